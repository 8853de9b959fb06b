//! How what a relaxing body remembers of its stresses goes on by a step: numbers that all its elements share ([`crate::StressHistory`]).

use crate::relaxation::{MOST_BRANCHES, Relaxation};

/// Numbers of a stress.
pub(crate) const SIX: usize = 6;

/// One update: how what is remembered goes on to the state at hand, and with what weights it then pushes.
#[derive(Clone, Copy, Debug, Default)]
pub struct StressStep {
    pub(crate) count: usize,
    pub(crate) decay: [f32; MOST_BRANCHES],
    pub(crate) gain: [f32; MOST_BRANCHES],
    /// The law's modulus over that of the elements.
    pub(crate) stiffer: f64,
    /// Of `S_iso` and of the `q_i`, for two rows of forces.
    pub(crate) weights: [[f32; MOST_BRANCHES + 1]; 2],
}

impl StressStep {
    /// The state at hand is `since` seconds after the one that is remembered; forces are asked for at two times after it, with elements of the modulus `g0`.
    pub fn new(relaxation: &Relaxation, since: f64, [first, second]: [f64; 2], g0: f64) -> Self {
        let mut own = Self {
            count: relaxation.len(),
            stiffer: 1.0 / g0,
            ..Self::default()
        };
        for (side, time) in [first, second].into_iter().enumerate() {
            own.weights[side][0] = (relaxation.lasting() - g0) as f32;
            for (at, branch) in relaxation.iter().enumerate() {
                own.weights[side][at + 1] = branch.decay(time) as f32;
            }
        }
        for (at, branch) in relaxation.iter().enumerate() {
            own.decay[at] = branch.decay(since) as f32;
            own.gain[at] = branch.gain(since) as f32;
        }
        own
    }
}
