//! The constants of a law that fit a test best: Levenberg and Marquardt's method with bounds (MPFIT, by the crate `rmpfit`), from several starts.
//!
//! The residual of a point is its error over the largest stress of its curve, so that each curve counts alike.

use anyhow::{Result, bail};
use rmpfit::{MPConfig, MPError, MPFitter, MPPar, MPResult, MPSide};

use super::curve::{Curve, Response, nominal_stress};

/// Where to begin with a constant, and how far it may go.
#[derive(Clone, Copy)]
pub struct Unknown {
    pub start: f64,
    /// None where it is given.
    range: Option<[f64; 2]>,
    is_stiffness: bool,
}

impl Unknown {
    /// Between two bounds; the upper one may be infinite.
    pub fn between(start: f64, range: [f64; 2]) -> Unknown {
        Unknown {
            start,
            range: Some(range),
            is_stiffness: false,
        }
    }

    /// One of those in which stresses are linear together, at least 0.
    pub fn stiffness() -> Unknown {
        Unknown {
            is_stiffness: true,
            ..Self::between(1.0, [0.0, f64::INFINITY])
        }
    }

    /// Given.
    pub fn fixed(start: f64) -> Unknown {
        Unknown {
            start,
            range: None,
            is_stiffness: false,
        }
    }

    fn bounds(self, cost: Cost) -> MPPar {
        let (rel_step, side) = match cost {
            Cost::Small => (0.0, MPSide::Both),
            Cost::Large => (STEP, MPSide::Auto),
        };
        let own = MPPar {
            rel_step,
            side,
            ..MPPar::new()
        };
        let Some([low, up]) = self.range else {
            return MPPar { fixed: true, ..own };
        };
        MPPar {
            limited_low: true,
            limit_low: low,
            limited_up: up.is_finite(),
            limit_up: if up.is_finite() { up } else { 0.0 },
            ..own
        }
    }
}

/// What was measured, and what a law gives for it.
pub trait Test<L> {
    /// The stiffness in units of which stiffnesses are sought, Pa.
    fn unit(&self) -> f64;

    /// How many points it has.
    fn count(&self) -> usize;

    /// Calls `point` with what a law gives for each point and what was measured, both over the largest of its curve; false where the law gives nothing.
    fn compare(&self, law: &L, point: impl FnMut([f64; 2])) -> bool;

    /// Which starts are followed, how derivatives are taken, and where the search ends.
    fn cost(&self) -> Cost {
        Cost::Small
    }

    /// Compares more exactly from now on, near a law that has been found; false where it cannot, or need not.
    ///
    /// # Errors
    /// The law gives nothing when it is looked at closely.
    fn refine(&self, _found: &L) -> Result<bool> {
        Ok(false)
    }
}

/// What it costs to compare a law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// A closed form: every start is followed, derivatives come from small steps on both sides.
    Small,
    /// An equilibrium: the starts that are nearest are followed, derivatives come from one step that is large beside what an equilibrium leaves.
    Large,
}

/// Starts that are followed, the relative step of derivatives, and where the search ends, where a law costs much.
const FOLLOWED: usize = 2;
const STEP: f64 = 1e-3;
const NEAR: MPConfig = MPConfig {
    ftol: 1e-5,
    xtol: 1e-4,
    max_iter: 15,
    ..MPConfig::new()
};
const EXACT: MPConfig = MPConfig::new();
/// Errors, over the largest stress, of a law that gives nothing.
const NOTHING: f64 = 10.0;

impl<L: Response> Test<L> for [Curve] {
    fn unit(&self) -> f64 {
        self.iter().map(Curve::largest).fold(0.0, f64::max)
    }

    fn count(&self) -> usize {
        self.iter().map(|curve| curve.points.len()).sum()
    }

    fn compare(&self, law: &L, mut point: impl FnMut([f64; 2])) -> bool {
        for curve in self {
            let scale = 1.0 / curve.largest();
            for [x, y] in &curve.points {
                point([scale * nominal_stress(law, curve.mode, *x), scale * y]);
            }
        }
        true
    }
}

struct Problem<'a, T: ?Sized, F> {
    test: &'a T,
    count: usize,
    /// The law of some constants; none where these make none.
    law: &'a F,
    bounds: Vec<MPPar>,
    config: &'static MPConfig,
}

impl<L, T: Test<L> + ?Sized, F: Fn(&[f64]) -> Option<L>> MPFitter for Problem<'_, T, F> {
    fn eval(&mut self, constants: &[f64], errors: &mut [f64]) -> MPResult<()> {
        let law = (self.law)(constants).ok_or(MPError::Eval)?;
        let mut at = 0;
        let is_sound = self.test.compare(&law, |[got, wanted]| {
            errors[at] = got - wanted;
            at += 1;
        });
        if !is_sound {
            errors.fill(NOTHING);
        }
        Ok(())
    }

    fn number_of_points(&self) -> usize {
        self.count
    }

    fn config(&self) -> &MPConfig {
        self.config
    }

    fn parameters(&self) -> &[MPPar] {
        &self.bounds
    }
}

/// The starts that are nearest to a test, with the stiffness that brings each nearest.
fn nearest<L>(
    test: &(impl Test<L> + ?Sized),
    starts: Vec<Vec<Unknown>>,
    law: &impl Fn(&[f64]) -> Option<L>,
) -> Vec<Vec<Unknown>> {
    let mut sorted: Vec<(f64, Vec<Unknown>)> = Vec::new();
    for mut start in starts {
        let constants: Vec<f64> = start.iter().map(|unknown| unknown.start).collect();
        let Some(law) = law(&constants) else {
            continue;
        };
        let [mut both, mut square, mut whole] = [0.0; 3];
        let is_sound = test.compare(&law, |[got, wanted]| {
            both += got * wanted;
            square += got * got;
            whole += wanted * wanted;
        });
        let scale = both / square;
        if !(is_sound && scale > 0.0 && scale.is_finite()) {
            continue;
        }
        for unknown in start.iter_mut().filter(|unknown| unknown.is_stiffness) {
            unknown.start *= scale;
        }
        sorted.push((whole - scale * both, start));
    }
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let near = sorted.into_iter().take(FOLLOWED);
    near.map(|(_, start)| start).collect()
}

/// The constants that the best of some starts leads to, each with its bounds.
fn follow<L>(
    test: &(impl Test<L> + ?Sized),
    starts: Vec<Vec<Unknown>>,
    law: &impl Fn(&[f64]) -> Option<L>,
) -> Option<Vec<Unknown>> {
    let mut best: Option<(f64, Vec<Unknown>)> = None;
    for mut start in starts {
        let mut constants: Vec<f64> = start.iter().map(|unknown| unknown.start).collect();
        let bounds = start.iter().map(|unknown| unknown.bounds(test.cost()));
        let mut problem = Problem {
            test,
            count: test.count(),
            law,
            bounds: bounds.collect(),
            config: match test.cost() {
                Cost::Small => &EXACT,
                Cost::Large => &NEAR,
            },
        };
        // A start that leads nowhere is left to the others.
        let Ok(status) = problem.mpfit(&mut constants) else {
            continue;
        };
        let cost = status.best_norm;
        if cost.is_finite() && best.as_ref().is_none_or(|(least, _)| cost < *least) {
            for (unknown, constant) in start.iter_mut().zip(constants) {
                unknown.start = constant;
            }
            best = Some((cost, start));
        }
    }
    best.map(|(_, found)| found)
}

/// The best constants of all starts.
///
/// # Errors
/// No start leads to a law: fewer points than constants, or residuals that are not finite; or the law that is found cannot be looked at closely.
pub fn best<L>(
    test: &(impl Test<L> + ?Sized),
    mut starts: Vec<Vec<Unknown>>,
    law: impl Fn(&[f64]) -> Option<L>,
) -> Result<Vec<f64>> {
    if test.cost() == Cost::Large {
        starts = nearest(test, starts, &law);
    }
    loop {
        let Some(found) = follow(test, starts, &law) else {
            bail!(
                "no law fits: fewer points than constants, residuals that are not finite, or no equilibrium"
            );
        };
        let constants: Vec<f64> = found.iter().map(|unknown| unknown.start).collect();
        match law(&constants) {
            Some(own) if test.refine(&own)? => starts = vec![found],
            _ => return Ok(constants),
        }
    }
}
