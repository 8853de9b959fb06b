//! The way of the frames over to a step that has arrived: from where they would have been without it to where they are with it, within two fifths
//! of a step, or at 25 mm/s where that takes longer; within two steps in any case: a way of 10 mm, after a tool was put into the tissue, may lead
//! through the tool, and begins anew at each step.

use super::between::AT_ONCE_S;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// A frame goes over from one step to the next within this many steps (longer carries the older step's error on), or at this
/// speed, mm/s, where the way is long (faster is seen as a jerk), ...
const BLEND_STEPS: f64 = 0.4;
const BLEND_MM_S: f64 = 25.0;
/// ... but for no more than this many steps.
const MOST_STEPS: f64 = 2.0;

/// How far the frames without the last step are from those with it.
#[derive(Default, HeldBytes)]
pub(super) struct StepBlend {
    /// At the region's nodes when the step was first seen, `[n,3]`, mm.
    offset: Vec<f32>,
    /// Longest of them, mm.
    longest: f32,
    /// Time of the last frame before the last step was seen, after that step: there the way begins.
    seen_s: f64,
}

impl StepBlend {
    /// Nodes of another region.
    pub(super) fn of(nodes: usize) -> Result<StepBlend> {
        Ok(StepBlend {
            offset: memory::zeros(3 * nodes, "the present state of a scene")?,
            ..StepBlend::default()
        })
    }

    /// A step is seen for the first time, by a host that has last seen a frame at `seen_s` after it: without the step it would have `shown` what with
    /// it is `out`.
    pub(super) fn begin(&mut self, seen_s: f64, shown: &[f32], out: &[f32]) {
        self.seen_s = seen_s;
        for ((offset, shown), out) in self.offset.iter_mut().zip(shown).zip(out) {
            *offset = shown - out;
        }
        let lengths = self.offset.as_chunks::<3>().0.iter();
        self.longest = lengths.map(length).fold(0.0, f32::max);
    }

    /// A step is shown as it is from `seen_s` after it.
    pub(super) fn forget(&mut self, seen_s: f64) {
        self.seen_s = seen_s;
        self.offset.fill(0.0);
        self.longest = 0.0;
    }

    /// A frame at `tau`: if it lies before the way began, the host took the step for the one before when it first saw it.
    pub(super) fn look(&mut self, tau: f64) {
        if tau < self.seen_s {
            self.forget(tau);
        }
    }

    /// Takes a frame to its place on the way; tells whether that is another.
    pub(super) fn blend(&self, tau: f64, step_s: f64, out: &mut [f32]) -> bool {
        // At its own time a step is shown as it is.
        if tau <= AT_ONCE_S {
            return false;
        }
        let since = (tau - self.seen_s).max(0.0);
        let left = |steps: f64| (1.0 - since / (steps * step_s)).max(0.0) as f32;
        let (part, most) = (left(BLEND_STEPS), left(MOST_STEPS));
        let gone = (BLEND_MM_S * since) as f32;
        if part == 0.0 && (most == 0.0 || self.longest <= gone) {
            return false;
        }
        let pairs = out.as_chunks_mut::<3>().0.iter_mut();
        for (out, offset) in pairs.zip(self.offset.as_chunks::<3>().0) {
            let slow = 1.0 - gone / length(offset).max(f32::MIN_POSITIVE);
            let part = part.max(slow.min(most));
            for (out, offset) in out.iter_mut().zip(offset) {
                *out += part * offset;
            }
        }
        self.longest > 0.0
    }
}

fn length(v: &[f32; 3]) -> f32 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f64 = 0.05;

    /// What is left of offsets of 0.1, 1 and 20 mm `tau` after a step that was seen at once.
    fn left(tau: f64) -> [f32; 3] {
        let shown = [0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 20.0, 0.0, 0.0];
        let mut step_blend = StepBlend::of(3).unwrap();
        step_blend.begin(0.0, &shown, &[0.0; 9]);
        let mut out = [0.0; 9];
        step_blend.blend(tau, STEP_S, &mut out);
        [out[0], out[3], out[6]]
    }

    #[test]
    fn short_ways_end_within_a_step_and_long_ones_within_two() {
        let near = |a: f32, b: f32| (a - b).abs() < 1e-3;
        let [short, middle, long] = left(0.2 * BLEND_STEPS * STEP_S);
        assert!(near(short, 0.08) && near(middle, 0.9) && near(long, 19.2));
        let [short, middle, long] = left(0.5 * STEP_S);
        assert!(short == 0.0 && near(middle, 0.375) && near(long, 15.0));
        let [_, middle, long] = left(STEP_S);
        assert!(middle == 0.0 && near(long, 10.0));
        assert!(left(MOST_STEPS * STEP_S) == [0.0; 3]);
    }
}
