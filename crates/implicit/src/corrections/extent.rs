//! How far from the tools iterations reach, and when they reach farther (`docs/decisions/030-reach.md`).

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::stored;

/// Levels of the reach.
pub(super) const LEVELS: usize = 4;
/// A set is too narrow where the far nodes lag by more than this part of how far the touched ones have been pushed, or of a millimetre.
const FAR_PART: f32 = 8e-5;
/// What a step has of the lag that is compared: where modes follow a push, they do after two or three steps of it.
const NEWEST: f32 = 0.25;
/// The lag of a step counts as this at the most: one step that goes wrong is forgotten after a few.
const MOST_LAG: f32 = 8.0 * FAR_PART;

/// What is known of the reach at the end of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Extent {
    /// That of the next step, below [`LEVELS`].
    pub level: u32,
    /// How far the smoothing moved the far nodes, over how far the touched ones have been pushed: a running mean over the steps.
    pub lag: f32,
}

impl Extent {
    /// All of the body.
    pub(super) fn whole(self) -> Extent {
        Extent {
            level: LEVELS as u32 - 1,
            ..self
        }
    }

    /// Checks what was read.
    pub(super) fn check(self) -> Result<()> {
        let Extent { level, lag } = self;
        if level as usize >= LEVELS {
            return Err(Error::Snapshot(format!(
                "holds a reach of level {level}, there are {LEVELS}"
            )));
        }
        stored::check(&[lag], 1)
    }

    /// That of the next step, which reaches farther where the far nodes lag: they were smoothed by `far_mm`, the touched ones have been pushed by
    /// `pushed_mm`. It does not reach less far until the tools have left: under a tool that is held still the far nodes come to balance also in a set that
    /// is too narrow for the next motion.
    pub(super) fn after(self, far_mm: f32, pushed_mm: f32) -> Extent {
        let newest = far_mm / pushed_mm.max(1.0);
        if !newest.is_finite() {
            // Nothing is known of a state that is no state; something else takes its place.
            return self;
        }
        let lag = self.lag + NEWEST * (newest.min(MOST_LAG) - self.lag);
        Extent {
            level: match lag > FAR_PART {
                true => (self.level + 1).min(LEVELS as u32 - 1),
                false => self.level,
            },
            lag,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Extent, FAR_PART};

    #[test]
    fn it_grows_where_the_far_nodes_lag_for_several_steps() {
        let after = |lags: &[f32]| {
            let start = Extent::default();
            lags.iter()
                .fold(start, |extent, lag| extent.after(2.0 * lag * FAR_PART, 2.0))
        };
        // The first steps of a push, after which the modes follow.
        assert_eq!(after(&[1.9, 1.4, 1.0, 0.7, 0.6]).level, 0);
        assert!(after(&[1.9, 1.9, 1.9, 1.9]).level > 0);
        // What is lost at once is seen at once, and one such step does not count for long.
        let lost = after(&[1e6]);
        assert_eq!(lost.level, 1);
        assert!(after(&[1e6, 0.1, 0.1, 0.1, 0.1]).lag < FAR_PART);
        assert_eq!(lost.after(f32::NAN, 2.0), lost);
    }
}
