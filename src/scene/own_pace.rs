//! What a scene has of its own in place of the bundle's: the length of its steps, and the damping of its tissue. Only corrections by the elements
//! can have another: learned maps know one of each.

use crate::corrections::Integrator;
use crate::error::{Error, Result};
use crate::model::Model;
use crate::options::{
    LARGEST_DAMPING_PER_S, LONGEST_STEP_S, SHORTEST_STEP_S, SMALLEST_DAMPING_PER_S, SceneOptions,
};

/// Free steps longer than this are made of two: over a longer one BDF2 loses what the natural modes do not hold, s.
const LONGEST_SWING_S: f64 = 0.025;

/// None where it is the bundle's.
#[derive(Debug, Clone, Copy, Default)]
pub struct OwnPace {
    step_s: Option<f64>,
    damping_per_s: Option<f64>,
}

impl OwnPace {
    /// What the options ask for.
    ///
    /// # Errors
    /// [`Error::NonFinite`], [`Error::Argument`] outside of the ranges.
    pub fn new(model: &Model, options: &SceneOptions) -> Result<OwnPace> {
        // A host's numbers may have been float32.
        Ok(OwnPace {
            step_s: own(
                "step_s",
                options.step_s,
                model.manifest.dt_s,
                [SHORTEST_STEP_S, LONGEST_STEP_S],
            )?,
            damping_per_s: own(
                "damping_per_s",
                options.damping_per_s,
                model.manifest.material.damping_per_s,
                [SMALLEST_DAMPING_PER_S, LARGEST_DAMPING_PER_S],
            )?,
        })
    }

    /// Whether anything is the scene's own.
    pub fn is_some(self) -> bool {
        self.step_s.is_some() || self.damping_per_s.is_some()
    }

    /// Whether the length of the steps is.
    pub fn has_step(self) -> bool {
        self.step_s.is_some()
    }

    /// The scene's, where the bundle has `of`.
    pub fn integrator(self, of: Integrator) -> Integrator {
        Integrator {
            step_s: self.step_s.unwrap_or(of.step_s),
            damping_per_s: self.damping_per_s.unwrap_or(of.damping_per_s),
        }
    }

    /// Of how many shorter ones a free step is made.
    pub fn free_substeps(self, step_s: f64, relaxes: bool) -> u32 {
        match (self.is_some() || relaxes) && step_s > LONGEST_SWING_S + 1e-9 {
            true => 2,
            false => 1,
        }
    }

    /// A scene that does not correct has the bundle's.
    ///
    /// # Errors
    /// [`Error::Unsupported`].
    pub fn refuse(self) -> Result<()> {
        let (option, value) = match (self.step_s, self.damping_per_s) {
            (Some(step_s), _) => ("step_s", step_s),
            (None, Some(damping)) => ("damping_per_s", damping),
            (None, None) => return Ok(()),
        };
        Err(Error::Unsupported(format!(
            "{option} is {value}: only corrections by the elements can use another value than the bundle's, and this scene makes none; leave {option} at 0, set `corrections`, or run `upt corrections BUNDLE`"
        )))
    }
}

/// The value of an option, where it is not 0 and not what the bundle has.
fn own(option: &str, value: f64, of_bundle: f64, [least, most]: [f64; 2]) -> Result<Option<f64>> {
    if !value.is_finite() {
        return Err(Error::NonFinite(format!("{option} is {value}")));
    }
    let rounding = |bound: f64| 1e-6 * bound.max(1.0);
    let allowed = least - rounding(least)..=most + rounding(most);
    if value != 0.0 && !allowed.contains(&value) {
        return Err(Error::Argument(format!(
            "{option} is {value}, must be {least} to {most}, or 0 for the bundle's {of_bundle}"
        )));
    }
    Ok((value != 0.0 && (value - of_bundle).abs() > rounding(of_bundle)).then_some(value))
}
