//! The terms that fit some curves best: Levenberg and Marquardt's method with bounds (MPFIT, by the crate `rmpfit`), from several starts.
//!
//! The residual of a point is its error over the largest stress of its curve, so that each curve counts alike. Unknown are `mu alpha / 2` of each
//! term, at least 0, so that every term adds to the shear modulus and the law is elliptic, and the exponents up to [`BOUND`]: without a
//! bound, terms degenerate to opposite ones that cancel.

use anyhow::{Result, bail};
use elements::Ogden;
use rmpfit::{MPError, MPFitter, MPPar, MPResult, MPSide};

use super::curve::{Curve, nominal_stress};

/// Exponents stay below this size.
pub const BOUND: f64 = 30.0;
/// And above this one: a law has no term of exponent 0.
const LEAST: f64 = 0.05;
/// Exponents of the starts; one keeps its sign.
const STARTS: [f64; 6] = [-25.0, -12.0, -4.0, 4.0, 12.0, 25.0];
/// Terms whose part of the shear modulus is smaller are left out.
const NOTHING: f64 = 1e-6;

/// What of a law is asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum Exponents {
    /// Given, a term each.
    Fixed(Vec<f64>),
    /// So many terms, exponents to be found.
    Free(usize),
}

struct Problem<'a> {
    curves: &'a [Curve],
    /// Largest stress over all curves, Pa: the unit of the terms' parts.
    unit: f64,
    /// Of `[part, exponent]` of each term in turn.
    bounds: Vec<MPPar>,
}

impl Problem<'_> {
    fn terms(&self, unknown: &[f64]) -> Vec<[f64; 2]> {
        let pairs = unknown.as_chunks::<2>().0.iter();
        pairs
            .map(|[part, alpha]| [2.0 * self.unit * part / alpha, *alpha])
            .collect()
    }
}

impl MPFitter for Problem<'_> {
    fn eval(&mut self, unknown: &[f64], errors: &mut [f64]) -> MPResult<()> {
        let law = Ogden::new(&self.terms(unknown)).ok_or(MPError::Eval)?;
        let points = self.curves.iter().flat_map(|curve| {
            let scale = 1.0 / curve.largest();
            (curve.points.iter()).map(move |point| (curve.mode, scale, point))
        });
        for (error, (mode, scale, [x, y])) in errors.iter_mut().zip(points) {
            *error = scale * (nominal_stress(&law, mode, *x) - y);
        }
        Ok(())
    }

    fn number_of_points(&self) -> usize {
        self.curves.iter().map(|curve| curve.points.len()).sum()
    }

    fn parameters(&self) -> &[MPPar] {
        &self.bounds
    }
}

/// Bounds of a term's part, and of its exponent around a start.
fn bounds(alpha: f64, fixed: bool) -> [MPPar; 2] {
    let part = MPPar {
        limited_low: true,
        side: MPSide::Both,
        ..MPPar::new()
    };
    let [low, up] = if alpha < 0.0 {
        [-BOUND, -LEAST]
    } else {
        [LEAST, BOUND]
    };
    let exponent = MPPar {
        fixed,
        limited_low: !fixed,
        limited_up: !fixed,
        limit_low: low,
        limit_up: up,
        side: MPSide::Both,
        ..MPPar::new()
    };
    [part, exponent]
}

/// All choices of `count` of the starts' exponents.
fn choices(count: usize) -> Vec<Vec<f64>> {
    let all = 1u32 << STARTS.len();
    let chosen = |bits: u32| (0..STARTS.len()).filter(move |at| bits >> at & 1 == 1);
    (0..all)
        .filter(|bits| bits.count_ones() as usize == count)
        .map(|bits| chosen(bits).map(|at| STARTS[at]).collect())
        .collect()
}

/// The best law of all starts.
pub fn best(curves: &[Curve], exponents: &Exponents) -> Result<Ogden> {
    let unit = curves.iter().map(Curve::largest).fold(0.0, f64::max);
    let (starts, fixed) = match exponents {
        Exponents::Fixed(list) => (vec![list.clone()], true),
        Exponents::Free(count) => (choices(*count), false),
    };
    let mut best: Option<(f64, Vec<[f64; 2]>)> = None;
    for start in starts {
        let mut problem = Problem {
            curves,
            unit,
            bounds: start
                .iter()
                .flat_map(|alpha| bounds(*alpha, fixed))
                .collect(),
        };
        let mut unknown: Vec<f64> = start.iter().flat_map(|alpha| [1.0, *alpha]).collect();
        // A start that leads nowhere is left to the others.
        let Ok(status) = problem.mpfit(&mut unknown) else {
            continue;
        };
        let cost = status.best_norm;
        if cost.is_finite() && best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, problem.terms(&unknown)));
        }
    }
    let Some((_, mut terms)) = best else {
        bail!("no law fits: fewer points than constants, or residuals that are not finite");
    };
    let whole: f64 = terms.iter().map(|[mu, alpha]| mu * alpha).sum();
    terms.retain(|[mu, alpha]| mu * alpha > NOTHING * whole);
    terms.sort_by(|a, b| (b[0] * b[1]).total_cmp(&(a[0] * a[1])));
    match Ogden::new(&terms) {
        Some(law) if !terms.is_empty() => Ok(law),
        _ => bail!("no law fits: the shear modulus comes out as zero"),
    }
}

#[cfg(test)]
mod tests {
    use super::{Exponents, best};
    use crate::fit::curve::{Curve, Mode, nominal_stress};
    use elements::Ogden;

    fn curves(law: &Ogden) -> Vec<Curve> {
        let points = |mode, from: f64, to: f64| Curve {
            mode,
            points: (0..=20)
                .map(|k| from + (to - from) * f64::from(k) / 20.0)
                .map(|x| [x, nominal_stress(law, mode, x)])
                .collect(),
        };
        vec![
            points(Mode::Tension, 1.0, 1.1),
            points(Mode::Compression, 1.0, 0.9),
            points(Mode::Shear, 0.0, 0.2),
        ]
    }

    #[test]
    fn a_law_is_found_again_from_its_own_curves() {
        let law = Ogden::new(&[[-157.0, -18.7]]).unwrap();
        let found = best(&curves(&law), &Exponents::Free(1)).unwrap();
        let term = found.terms.iter().next().unwrap();
        assert!((term.alpha + 18.7).abs() < 1e-4, "{found}");
        assert!((term.mu_pa + 157.0).abs() < 1e-2, "{found}");
        let law = Ogden::new(&[[400.0, 2.0], [-100.0, -2.0]]).unwrap();
        let found = best(&curves(&law), &Exponents::Fixed(vec![2.0, -2.0])).unwrap();
        for (term, want) in found.terms.iter().zip([400.0, -100.0]) {
            assert!((term.mu_pa - want).abs() < 1e-3 * want.abs(), "{found}");
        }
    }
}
