//! A region's cubes with glued ends as equilibria see them, and the law that fits all of its curves.
//!
//! Unknown are the shear modulus and the exponent of one term of Ogden's; Poisson's ratio is given, since what it does to a fit is what is asked: ends that
//! hold nearly incompressible tissue make a cube much stiffer along its axis and not in shear. Laws are solved at a few strains on a coarse mesh; between them
//! the logarithm of the stress over the strain is a parabola. After each fit a finer mesh says by what part the stress in the limit differs, and curves that
//! are fitted worse than others weigh more in the next one.

use std::cell::RefCell;

use anyhow::{Context, Result};
use elements::{Law, Material, Ogden};
use tissue::cube::{Motion, stresses};

use crate::fit::curve::{Curve, Mode, nominal_stress};
use crate::fit::least_squares::{self, Cost, Test, Unknown};
use crate::fit::specimen::SHEAR_PA;

/// Strains that are solved.
const LEVELS: usize = 6;
/// Cells along half of a side, and how much smaller those of the second are.
const CELLS: [usize; 2] = [2, 3];
/// Fits after the first one.
const ROUNDS: usize = 3;
/// Exponents that are sought; beyond, a law's cap leaves little of its curve.
const EXPONENTS: [f64; 2] = [-60.0, -2.0];
const START: f64 = -25.0;
/// The logarithm of how much more the curve weighs that is fitted worst, where another is met wholly.
const WEIGHING: f64 = 0.5;

/// One term of Ogden's, and Poisson's ratio.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tissue {
    pub shear_pa: f64,
    pub alpha: f64,
    pub poisson: f64,
}

impl Tissue {
    /// The law with this shear modulus, Pa.
    pub fn law(self, shear_pa: f64) -> Option<Ogden> {
        Ogden::new(&[[2.0 * shear_pa / self.alpha, self.alpha]])
    }
}

/// Of each curve, by strain from the first that is solved on.
type Rows = Vec<[f64; LEVELS]>;

/// What is known of laws.
struct Solved {
    /// Stresses of laws with a shear modulus of [`SHEAR_PA`] on the coarse mesh, by exponent and Poisson's ratio; none where there is no equilibrium.
    rows: Vec<([f64; 2], Option<Rows>)>,
    /// The stress in the limit over that of the coarse mesh.
    finer: Rows,
    /// Of each curve.
    weights: Vec<f64>,
    /// That of all rounds whose worst curve is fitted best, and R² of that curve.
    best: Option<(f64, Tissue)>,
    rounds: usize,
}

/// The curves of a region.
pub struct Cubes<'a> {
    curves: &'a [Curve],
    solved: RefCell<Solved>,
}

fn strain(mode: Mode, x: f64) -> f64 {
    if mode.is_shear() { x } else { x - 1.0 }
}

/// The largest strain of a curve, with its sign.
fn most(curve: &Curve) -> f64 {
    let strains = curve.points.iter().map(|[x, _]| strain(curve.mode, *x));
    strains.fold(0.0f64, |m, e| if e.abs() > m.abs() { e } else { m })
}

/// The root of the sum of squares about the mean, Pa.
fn spread(curve: &Curve) -> f64 {
    let mean = curve.points.iter().map(|[_, y]| y).sum::<f64>() / curve.points.len() as f64;
    let squares = curve.points.iter().map(|[_, y]| (y - mean).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Of bricks whose error falls with the square of their size.
fn limit(coarse: f64, fine: f64) -> f64 {
    let ratio = CELLS[1] as f64 / CELLS[0] as f64;
    fine + (fine - coarse) / (ratio * ratio - 1.0)
}

/// Stresses of the law with a shear modulus of [`SHEAR_PA`], Pa.
fn rows(curves: &[Curve], tissue: Tissue, cells: usize) -> Result<Rows> {
    let law = tissue
        .law(SHEAR_PA)
        .context("a law without a shear modulus")?;
    let material = Material {
        poisson: tissue.poisson,
        ..Material::default()
    }
    .with_law(Law::Ogden(law));
    let row = |curve: &Curve| {
        let motion = if curve.mode.is_shear() {
            Motion::Slide
        } else {
            Motion::Pull
        };
        let level = most(curve) / LEVELS as f64;
        let strains: Vec<f64> = (1..=LEVELS).map(|k| level * k as f64).collect();
        let found = stresses(motion, &material, &strains, cells)
            .with_context(|| format!("{} of a cube of `{law:.3}`", curve.mode.as_str()))?;
        let mut row = [0.0; LEVELS];
        row.copy_from_slice(&found);
        anyhow::Ok(row)
    };
    curves.iter().map(row).collect()
}

/// The stress over the strain at a part of the largest one, from those that are solved.
fn between(row: &[f64; LEVELS], part: f64) -> f64 {
    let value = |level: usize| (row[level - 1] / level as f64).abs().ln();
    let x = part * LEVELS as f64;
    let middle = (x.round() as usize).clamp(2, LEVELS - 1);
    let [low, own, high] = [middle - 1, middle, middle + 1].map(value);
    let t = x - middle as f64;
    let log = own + 0.5 * t * (high - low) + 0.5 * t * t * (high - 2.0 * own + low);
    x * log.exp().copysign(row[LEVELS - 1])
}

impl<'a> Cubes<'a> {
    pub fn new(curves: &'a [Curve]) -> Self {
        let solved = Solved {
            rows: Vec::new(),
            finer: vec![[1.0; LEVELS]; curves.len()],
            weights: vec![1.0; curves.len()],
            best: None,
            rounds: 0,
        };
        Self {
            curves,
            solved: RefCell::new(solved),
        }
    }

    /// On the coarse mesh, if it was not solved before.
    fn coarse(&self, tissue: Tissue) -> Option<Rows> {
        let key = [tissue.alpha, tissue.poisson];
        let solved = self.solved.borrow();
        if let Some((_, rows)) = solved.rows.iter().find(|(own, _)| *own == key) {
            return rows.clone();
        }
        drop(solved);
        let rows = rows(self.curves, tissue, CELLS[0]).ok();
        self.solved.borrow_mut().rows.push((key, rows.clone()));
        rows
    }

    /// The limit of both meshes, Pa, for a shear modulus of [`SHEAR_PA`].
    fn limits(&self, tissue: Tissue) -> Result<Rows> {
        let [coarse, fine] = CELLS.map(|cells| rows(self.curves, tissue, cells));
        let mut out = coarse?;
        for (row, fine) in out.iter_mut().zip(fine?) {
            for (coarse, fine) in row.iter_mut().zip(fine) {
                *coarse = limit(*coarse, fine);
            }
        }
        Ok(out)
    }

    /// `1 - sum (y - f)² / sum (y - mean)²` of each curve.
    fn scores(&self, rows: &Rows, tissue: Tissue) -> Vec<f64> {
        let score = |(curve, row): (&Curve, &[f64; LEVELS])| {
            let most = most(curve);
            let left = curve.points.iter().map(|[x, y]| {
                let stress = between(row, strain(curve.mode, *x) / most);
                (y - tissue.shear_pa / SHEAR_PA * stress).powi(2)
            });
            1.0 - left.sum::<f64>() / spread(curve).powi(2)
        };
        self.curves.iter().zip(rows).map(score).collect()
    }
}

impl Test<Tissue> for Cubes<'_> {
    fn unit(&self) -> f64 {
        self.curves.iter().map(Curve::largest).fold(0.0, f64::max)
    }

    fn count(&self) -> usize {
        self.curves.iter().map(|curve| curve.points.len()).sum()
    }

    fn compare(&self, tissue: &Tissue, mut point: impl FnMut([f64; 2])) -> bool {
        let Some(rows) = self.coarse(*tissue) else {
            return false;
        };
        let solved = self.solved.borrow();
        for (at, (curve, mut row)) in self.curves.iter().zip(rows).enumerate() {
            for (stress, finer) in row.iter_mut().zip(solved.finer[at]) {
                *stress *= finer;
            }
            let scale = solved.weights[at] / spread(curve);
            let most = most(curve);
            for [x, y] in &curve.points {
                let stress = between(&row, strain(curve.mode, *x) / most);
                point([scale * tissue.shear_pa / SHEAR_PA * stress, scale * y]);
            }
        }
        true
    }

    fn cost(&self) -> Cost {
        Cost::Large
    }

    fn refine(&self, found: &Tissue) -> Result<bool> {
        let limits = self.limits(*found)?;
        let coarse = self.coarse(*found).context("no equilibrium")?;
        let scores = self.scores(&limits, *found);
        let (worst, best) =
            (scores.iter()).fold((1.0f64, -1e9f64), |(a, b), s| (a.min(*s), b.max(*s)));
        let mut solved = self.solved.borrow_mut();
        if solved.best.is_none_or(|(least, _)| worst > least) {
            solved.best = Some((worst, *found));
        }
        if solved.rounds == ROUNDS {
            return Ok(false);
        }
        solved.rounds += 1;
        for (finer, (limits, coarse)) in solved.finer.iter_mut().zip(limits.iter().zip(&coarse)) {
            for (finer, (limit, coarse)) in finer.iter_mut().zip(limits.iter().zip(coarse)) {
                *finer = limit / coarse;
            }
        }
        for (weight, score) in solved.weights.iter_mut().zip(scores) {
            *weight *= (WEIGHING * (best - score) / (1.0 - worst).max(1e-3)).exp();
        }
        Ok(true)
    }
}

/// A law, R² of each curve, and the largest stress of each over that of a homogeneous specimen of the law.
pub struct Fit {
    pub tissue: Tissue,
    pub r2: Vec<f64>,
    pub shapes: Vec<f64>,
}

/// The law of a Poisson's ratio whose worst curve is fitted best.
pub fn fit(curves: &[Curve], poisson: f64) -> Result<Fit> {
    let cubes = Cubes::new(curves);
    let unit = cubes.unit();
    let start = vec![Unknown::stiffness(), Unknown::between(START, EXPONENTS)];
    let tissue = |constants: &[f64]| Tissue {
        shear_pa: unit * constants[0],
        alpha: constants[1],
        poisson,
    };
    least_squares::best(&cubes, vec![start], |constants| Some(tissue(constants)))?;
    let (_, tissue) = cubes.solved.borrow().best.context("no law fits")?;
    let rows = cubes.limits(tissue)?;
    let law = tissue.law(SHEAR_PA).context("no law fits")?;
    let shapes = curves.iter().zip(&rows).map(|(curve, row)| {
        let x = most(curve) + if curve.mode.is_shear() { 0.0 } else { 1.0 };
        row[LEVELS - 1] / nominal_stress(&law, curve.mode, x)
    });
    Ok(Fit {
        tissue,
        r2: cubes.scores(&rows, tissue),
        shapes: shapes.collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::{LEVELS, SHEAR_PA, Tissue, between, fit, rows};
    use crate::fit::curve::{Curve, Mode};

    /// Curves of a law's own cubes give its constants back.
    #[test]
    fn a_law_is_found_again_from_its_cubes() {
        let tissue = Tissue {
            shear_pa: 500.0,
            alpha: -20.0,
            poisson: 0.42,
        };
        let ends = [
            (Mode::Tension, 1.08),
            (Mode::Compression, 0.93),
            (Mode::Shear, 0.15),
        ];
        let curves = ends.map(|(mode, end)| {
            let from = if mode.is_shear() { 0.0 } else { 1.0 };
            let points = (0..=9).map(|k| [from + (end - from) * f64::from(k) / 9.0, 0.0]);
            Curve {
                mode,
                points: points.collect(),
            }
        });
        let rows = rows(&curves, tissue, 2).unwrap();
        let curves: Vec<Curve> = (curves.into_iter().zip(rows))
            .map(|(mut curve, row)| {
                for (k, point) in curve.points.iter_mut().enumerate() {
                    point[1] = tissue.shear_pa / SHEAR_PA * between(&row, k as f64 / 9.0);
                }
                curve
            })
            .collect();
        let found = fit(&curves, tissue.poisson).unwrap();
        // The data are a coarse mesh's, so that the limit differs by what that is off.
        assert!(
            (found.tissue.alpha + 20.0).abs() < 1.0,
            "{:?}",
            found.tissue
        );
        assert!(
            (found.tissue.shear_pa / 500.0 - 1.0).abs() < 0.03,
            "{:?}",
            found.tissue
        );
        assert!(found.r2.iter().all(|r2| *r2 > 0.999), "{:?}", found.r2);
    }

    #[test]
    fn between_two_strains_that_are_solved_a_power_is_met() {
        let mut row = [0.0; LEVELS];
        for (k, stress) in row.iter_mut().enumerate() {
            *stress = -((k + 1) as f64).powi(2);
        }
        for part in [0.5, 0.75, 1.0] {
            let wanted = -(part * LEVELS as f64).powi(2);
            assert!((between(&row, part) / wanted - 1.0).abs() < 0.03);
        }
        assert_eq!(between(&row, 0.0), 0.0);
    }
}
