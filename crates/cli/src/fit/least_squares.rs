//! The constants of a law that fit some curves best: Levenberg and Marquardt's method with bounds (MPFIT, by the crate `rmpfit`), from several starts.
//!
//! The residual of a point is its error over the largest stress of its curve, so that each curve counts alike.

use anyhow::{Result, bail};
use rmpfit::{MPError, MPFitter, MPPar, MPResult, MPSide};

use super::curve::{Curve, Response, nominal_stress};

/// Where to begin with a constant, and how far it may go.
pub struct Unknown {
    pub start: f64,
    bounds: MPPar,
}

impl Unknown {
    /// Between two bounds; the upper one may be infinite.
    pub fn between(start: f64, [low, up]: [f64; 2]) -> Unknown {
        let bounds = MPPar {
            limited_low: true,
            limit_low: low,
            limited_up: up.is_finite(),
            limit_up: if up.is_finite() { up } else { 0.0 },
            side: MPSide::Both,
            ..MPPar::new()
        };
        Unknown { start, bounds }
    }

    /// Given.
    pub fn fixed(start: f64) -> Unknown {
        let bounds = MPPar {
            fixed: true,
            side: MPSide::Both,
            ..MPPar::new()
        };
        Unknown { start, bounds }
    }
}

struct Problem<'a, F> {
    curves: &'a [Curve],
    /// The law of some constants; none where these make none.
    law: &'a F,
    bounds: Vec<MPPar>,
}

impl<L: Response, F: Fn(&[f64]) -> Option<L>> MPFitter for Problem<'_, F> {
    fn eval(&mut self, constants: &[f64], errors: &mut [f64]) -> MPResult<()> {
        let law = (self.law)(constants).ok_or(MPError::Eval)?;
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

/// Largest stress over all curves, Pa: the unit in which stiffnesses are sought.
pub fn unit(curves: &[Curve]) -> f64 {
    curves.iter().map(Curve::largest).fold(0.0, f64::max)
}

/// The best constants of all starts.
///
/// # Errors
/// No start leads to a law: fewer points than constants, or residuals that are not finite.
pub fn best<L: Response>(
    curves: &[Curve],
    starts: impl IntoIterator<Item = Vec<Unknown>>,
    law: impl Fn(&[f64]) -> Option<L>,
) -> Result<Vec<f64>> {
    let mut best: Option<(f64, Vec<f64>)> = None;
    for start in starts {
        let mut constants: Vec<f64> = start.iter().map(|unknown| unknown.start).collect();
        let mut problem = Problem {
            curves,
            law: &law,
            bounds: start.into_iter().map(|unknown| unknown.bounds).collect(),
        };
        // A start that leads nowhere is left to the others.
        let Ok(status) = problem.mpfit(&mut constants) else {
            continue;
        };
        let cost = status.best_norm;
        if cost.is_finite() && best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, constants));
        }
    }
    match best {
        Some((_, constants)) => Ok(constants),
        None => bail!("no law fits: fewer points than constants, or residuals that are not finite"),
    }
}
