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
        let lag = self.lag + NEWEST * (far_mm / pushed_mm.max(1.0) - self.lag);
        Extent {
            level: match lag > FAR_PART {
                true => (self.level + 1).min(LEVELS as u32 - 1),
                false => self.level,
            },
            lag,
        }
    }
}
