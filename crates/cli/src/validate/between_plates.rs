//! The silicone cylinders between plates that hold their ends, as the solver's laws see them: they barrel, and are stiffer than a bar with free ends.
//!
//! How the plates hold them is not published; friction without slip is one end of what may be, none, a homogeneous bar, the other. Equilibria of half of a
//! cylinder ([`tissue::axisymmetric`]) whose side may roll onto the plate, the limit of two meshes, at Poisson's ratio 0.49. A force is the modulus times
//! that of the law with a shear modulus of 1 kPa, so that a row of the law's other constant is solved once for all phantoms: the stress over a homogeneous
//! bar's is linear in the strain and in that constant between two that are solved.

use std::path::Path;

use anyhow::{Context, Result};
use elements::{Law, Material, MooneyRivlin, Ogden};
use gauge::median;

use super::section::{Section, verdict};
use super::silicone::{BAR, PREDICTED, Phantom, RADIUS_MM, beyond, read};
use crate::fit::curve::{Mode, nominal_stress};
use crate::fit::specimen::{SHEAR_PA, held, limit};

/// Half the height of the cylinders, mm.
const HALF_MM: f64 = 15.0;
/// Cells across and along of half a cylinder, the second twice the first, smaller towards the edge of the plate.
const CELLS: [[usize; 2]; 2] = [[10, 6], [20, 12]];
/// Strains that are solved, to 40 %.
const STEPS: usize = 16;
const MOST: f64 = 0.4;
/// Constants that are tried in a fit, between each two that are solved.
const TRIED: usize = 10;

/// One constant beside the stiffness.
#[derive(Clone, Copy)]
enum Family {
    NeoHookean,
    MooneyRivlin,
    Ogden,
}

impl Family {
    const ALL: [(&str, Self); 3] = [
        ("neo-Hookean", Self::NeoHookean),
        ("Mooney-Rivlin", Self::MooneyRivlin),
        ("Ogden, 1 term", Self::Ogden),
    ];

    /// Constants that are solved: shares of `C01`, exponents.
    fn solved(self) -> &'static [f64] {
        match self {
            Self::NeoHookean => &[0.0],
            Self::MooneyRivlin => &[0.0, 0.25, 0.5, 0.75, 1.0],
            Self::Ogden => &[-8.0, -6.0, -4.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0],
        }
    }

    /// The terms of the law of a constant.
    fn terms(self, constant: f64) -> Result<Ogden> {
        let terms = match self {
            Self::NeoHookean => vec![[SHEAR_PA, 2.0]],
            Self::Ogden => vec![[2.0 * SHEAR_PA / constant, constant]],
            Self::MooneyRivlin => {
                let parts = [[1.0 - constant, 2.0], [-constant, -2.0]];
                let parts = parts.into_iter().filter(|[part, _]| *part != 0.0);
                parts
                    .map(|[part, alpha]| [SHEAR_PA * part, alpha])
                    .collect()
            }
        };
        Ogden::new(&terms).context("a law without a shear modulus")
    }

    fn law(self, constant: f64) -> Result<Law> {
        Ok(match self {
            Self::NeoHookean => Law::default(),
            Self::MooneyRivlin => Law::MooneyRivlin(MooneyRivlin {
                c01_share: constant,
            }),
            Self::Ogden => Law::Ogden(self.terms(constant)?),
        })
    }
}

/// Stress over a homogeneous bar's at the strains that are solved, from rest on.
type Row = [f64; STEPS + 1];

fn row(family: Family, constant: f64) -> Result<Row> {
    let material = Material {
        young_pa: 2.0 * (1.0 + Material::default().poisson) * SHEAR_PA,
        ..Material::default()
    }
    .with_law(family.law(constant)?);
    let terms = family.terms(constant)?;
    let solved = |cells| {
        held([RADIUS_MM, HALF_MM], &material, MOST, STEPS, cells)
            .with_context(|| format!("a cylinder pressed by {MOST} of its height"))
    };
    let [coarse, fine] = CELLS.map(solved);
    let area = std::f64::consts::PI * RADIUS_MM * RADIUS_MM;
    let mut out = [0.0; STEPS + 1];
    for (k, (coarse, fine)) in coarse?.into_iter().zip(fine?).enumerate() {
        let x = 1.0 - MOST * (k + 1) as f64 / STEPS as f64;
        // mN/mm² is kPa; the middle bears what presses.
        let stress = -1e3 * limit(coarse, fine) / area;
        out[k + 1] = stress / nominal_stress(&terms, Mode::Compression, x);
    }
    out[0] = 2.0 * out[1] - out[2];
    Ok(out)
}

/// Rows of the constants that are solved.
struct Solved {
    family: Family,
    rows: Vec<(f64, Row)>,
}

impl Solved {
    fn new(family: Family) -> Result<Self> {
        let rows = family.solved().iter();
        let rows = rows.map(|constant| Ok((*constant, row(family, *constant)?)));
        Ok(Self {
            family,
            rows: rows.collect::<Result<_>>()?,
        })
    }

    /// Stress over a homogeneous bar's.
    fn factor(&self, constant: f64, strain: f64) -> f64 {
        let x = (strain / MOST * STEPS as f64).min(STEPS as f64);
        let first = (x as usize).min(STEPS - 1);
        let of = |row: &Row| row[first] + (x - first as f64) * (row[first + 1] - row[first]);
        let after = self.rows.iter().position(|(own, _)| *own >= constant);
        match after {
            Some(0) | None => of(&self.rows[0].1),
            Some(at) => {
                let [(low, before), (high, after)] = [&self.rows[at - 1], &self.rows[at]];
                let part = (constant - low) / (high - low);
                of(before) + part * (of(after) - of(before))
            }
        }
    }

    /// Constants that a fit tries.
    fn tried(&self) -> Vec<f64> {
        let solved = self.family.solved();
        let between = solved.windows(2).flat_map(|pair| {
            let part = |k: usize| pair[0] + (pair[1] - pair[0]) * k as f64 / TRIED as f64;
            (0..TRIED).map(part)
        });
        // No law has the exponent 0.
        let all = between.chain(solved.last().copied());
        all.filter(|c| !matches!(self.family, Family::Ogden) || c.abs() > 0.05)
            .collect()
    }
}

/// What fits a phantom up to the largest strain of the fit.
struct Fit {
    terms: Ogden,
    constant: f64,
    /// Over [`SHEAR_PA`].
    stiffness: f64,
}

impl Fit {
    fn new(solved: &Solved, phantom: &Phantom) -> Result<Self> {
        let mut best: Option<(f64, Self)> = None;
        for constant in solved.tried() {
            let mut own = Self {
                terms: solved.family.terms(constant)?,
                constant,
                stiffness: 1.0,
            };
            let points = phantom.fitted.points.iter();
            let pairs: Vec<[f64; 2]> = points.map(|[x, y]| [own.stress(solved, *x), *y]).collect();
            let (both, square) = pairs.iter().fold((0.0, 0.0), |(both, square), [f, y]| {
                (both + f * y, square + f * f)
            });
            own.stiffness = both / square;
            let left = pairs.iter().map(|[f, y]| (own.stiffness * f - y).powi(2));
            let left = left.sum::<f64>();
            if best.as_ref().is_none_or(|(least, _)| left < *least) {
                best = Some((left, own));
            }
        }
        Ok(best.context("no constant to try")?.1)
    }

    /// Nominal stress of the cylinder at a stretch, Pa.
    fn stress(&self, solved: &Solved, x: f64) -> f64 {
        let bar = nominal_stress(&self.terms, Mode::Compression, x);
        self.stiffness * solved.factor(self.constant, 1.0 - x) * bar
    }
}

fn worst(list: &[f64]) -> f64 {
    list.iter().copied().fold(0.0, f64::max)
}

pub fn section(path: &Path) -> Result<Section> {
    let phantoms = read(path)?;
    let mut text = String::from(
        "| law, fitted to 20 % between plates that hold the ends | predicted to | error of the force, rms a phantom: median | worst | largest error at any strain: median | worst | bar 5 / 10 % (rms) |\n|---|---:|---:|---:|---:|---:|---|\n",
    );
    let mut own = String::new();
    for (name, family) in Family::ALL {
        let solved = Solved::new(family)?;
        let fits = phantoms.iter().map(|phantom| Fit::new(&solved, phantom));
        let fits = fits.collect::<Result<Vec<Fit>>>()?;
        for up_to in PREDICTED {
            let both = phantoms.iter().zip(&fits);
            let found = both
                .map(|(phantom, fit)| beyond(&phantom.whole, |x| fit.stress(&solved, x), up_to));
            let (rms, most): (Vec<f64>, Vec<f64>) = found.map(|[a, b]| (a, b)).unzip();
            let reached = median(&rms) <= BAR[0] && worst(&rms) <= BAR[1];
            text += &format!(
                "| {name} | {:.0} % | {:.1} % | {:.1} % | {:.1} % | {:.1} % | {} |\n",
                100.0 * up_to,
                100.0 * median(&rms),
                100.0 * worst(&rms),
                100.0 * median(&most),
                100.0 * worst(&most),
                verdict(reached)
            );
        }
        if matches!(family, Family::NeoHookean) {
            own = phantom_rows(&phantoms, &fits, &solved);
        }
    }
    Ok(Section {
        name: "between plates",
        text: text + &own,
        plots: Vec::new(),
    })
}

/// How much stiffer the plates make a neo-Hookean cylinder, and each phantom as one.
fn phantom_rows(phantoms: &[Phantom], fits: &[Fit], solved: &Solved) -> String {
    let mut text = String::from(
        "\n| strain | force of a neo-Hookean cylinder whose ends are held over that of a bar |\n|---:|---:|\n",
    );
    for strain in [0.05, 0.1, 0.2, 0.3, 0.4] {
        let factor = solved.factor(0.0, strain);
        text += &format!("| {:.0} % | {factor:.3} |\n", 100.0 * strain);
    }
    text += "\nEach phantom, neo-Hookean, ends held:\n\n| phantom | shear modulus, kPa | error to 30 %, rms | to 40 % |\n|---|---:|---:|---:|\n";
    for (phantom, fit) in phantoms.iter().zip(fits) {
        let of = |up_to| beyond(&phantom.whole, |x| fit.stress(solved, x), up_to)[0];
        let [near, far] = PREDICTED.map(of);
        text += &format!(
            "| {} | {:.1} | {:.1} % | {:.1} % |\n",
            phantom.name,
            1e-3 * SHEAR_PA * fit.stiffness,
            100.0 * near,
            100.0 * far
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::{CELLS, Family, Fit, Solved};
    use crate::fit::curve::{Curve, Mode};
    use crate::fit::specimen::{held, limit};
    use crate::validate::silicone::{FITTED, Phantom};
    use elements::Material;

    /// Gent and Lindley (1959): held discs have about `1 + 2 S²` = 1.35 of Young's modulus, `S` = R / 2H.
    #[test]
    fn plates_that_hold_the_ends_stiffen_a_cylinder() {
        let material = Material::default();
        let force = CELLS.map(|cells| held([25.0, 15.0], &material, 0.01, 1, cells).unwrap()[0]);
        let bar = 1e-3 * material.young_pa * 0.01 * std::f64::consts::PI * 625.0;
        let factor = limit(force[0], force[1]) / bar;
        assert!((1.28..1.45).contains(&factor), "{factor}");
    }

    #[test]
    fn a_modulus_and_a_constant_are_found_again() {
        let row = |bend: f64| std::array::from_fn(|k| 1.3 + bend * k as f64);
        let solved = Solved {
            family: Family::MooneyRivlin,
            rows: vec![(0.0, row(0.01)), (0.5, row(0.02)), (1.0, row(0.04))],
        };
        let made = Fit {
            terms: Family::MooneyRivlin.terms(0.3).unwrap(),
            constant: 0.3,
            stiffness: 7.0,
        };
        let points = |most: f64| Curve {
            mode: Mode::Compression,
            points: (1..=40)
                .map(|k| f64::from(k) / 100.0)
                .filter(|e| *e <= most)
                .map(|e| [1.0 - e, made.stress(&solved, 1.0 - e)])
                .collect(),
        };
        let phantom = Phantom {
            name: "made".to_owned(),
            whole: points(0.4),
            fitted: points(FITTED),
            spread: 0.0,
        };
        let found = Fit::new(&solved, &phantom).unwrap();
        assert!(
            (found.stiffness / 7.0 - 1.0).abs() < 1e-9,
            "{}",
            found.stiffness
        );
        assert!((found.constant - 0.3).abs() < 1e-9, "{}", found.constant);
    }
}
