//! How what a relaxing body remembers of its stresses goes on by a step: numbers that all elements of a law share ([`crate::StressHistory`]).

use crate::relaxation::{MOST_BRANCHES, Relaxation};

/// Numbers of a stress.
pub(crate) const SIX: usize = 6;

/// A step of a body, whatever its elements' relaxation.
#[derive(Clone, Copy, Debug)]
pub struct HistoryStep {
    /// Seconds between the state that is remembered and the one at hand.
    pub since_s: f64,
    /// Two times after that at which forces are asked for, s.
    pub times_s: [f64; 2],
    /// The modulus of the elements over that of their law.
    pub g0: f64,
}

/// One update: how what is remembered goes on to the state at hand, and with what weights it then pushes.
#[derive(Clone, Copy, Debug, Default)]
pub struct StressStep {
    /// Branches that the body keeps room for.
    pub(crate) count: usize,
    pub(crate) decay: [f32; MOST_BRANCHES],
    pub(crate) gain: [f32; MOST_BRANCHES],
    /// The law's modulus over that of the elements.
    pub(crate) stiffer: f64,
    /// Of `S_iso` and of the `q_i`, for two rows of forces.
    pub(crate) weights: [[f32; MOST_BRANCHES + 1]; 2],
}

impl StressStep {
    /// For elements of a relaxation in a body that keeps room for `count` branches: those beyond its own stay zero.
    pub(crate) fn new(relaxation: &Relaxation, count: usize, step: &HistoryStep) -> Self {
        let mut own = Self {
            count,
            stiffer: 1.0 / step.g0,
            ..Self::default()
        };
        for (weights, time) in own.weights.iter_mut().zip(step.times_s) {
            weights[0] = (relaxation.lasting() - step.g0) as f32;
            for (weight, branch) in weights[1..].iter_mut().zip(relaxation.iter()) {
                *weight = branch.decay(time) as f32;
            }
        }
        for (at, branch) in relaxation.iter().enumerate() {
            own.decay[at] = branch.decay(step.since_s) as f32;
            own.gain[at] = branch.gain(step.since_s) as f32;
        }
        own
    }

    /// Whether elements remember nothing that pushes: elastic ones with the modulus of their law.
    pub fn is_idle(&self) -> bool {
        self.weights.iter().flatten().all(|weight| *weight == 0.0)
    }
}
