//! What a scene knows of its last two steps in single numbers.

use serde::{Deserialize, Serialize};

/// Where a published state came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Source {
    /// Rest: zero everywhere.
    Rest,
    /// The model.
    Model,
    /// The linear response alone, or the imposed contact alone (the guard's blend).
    Fallback,
}

/// The numbers of a scene's state ([`super::state::State`]).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Counters {
    /// Steps since rest.
    pub step_count: u64,
    /// Quiet steps in a row.
    pub quiet: u32,
    /// Whether the scene sleeps.
    pub sleeping: bool,
    /// Published frames that hold exactly rest since the scene fell asleep.
    pub rest_frames: u32,
    /// Where the last published state came from, and the one before it.
    pub sources: [Source; 2],
    /// Largest displacement of the last published state, in mm.
    pub max_displacement: f32,
    /// Whether the last published state was corrected, and the one before it.
    pub was_corrected: [bool; 2],
    /// Whether tools drove the last step that anything drove.
    pub driven: bool,
    /// Whether loads acted in the last step, or did before and the body has not come back.
    pub loaded: bool,
    /// The moment of the last step on the host's clock, s.
    pub time_s: f64,
}

impl Counters {
    /// A scene before its first step.
    pub const REST: Self = Self {
        step_count: 0,
        quiet: 0,
        sleeping: false,
        rest_frames: 0,
        sources: [Source::Rest; 2],
        max_displacement: 0.0,
        was_corrected: [false; 2],
        driven: false,
        loaded: false,
        time_s: 0.0,
    };
}
