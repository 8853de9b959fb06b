//! The parts in which tools take their way in a step.

use super::ContactProblem;

/// Parts of a step's way at most.
const MOST_PARTS: f32 = 80.0;
/// Parts of the tools' ways in a step that has taken its work, or its time.
const LEAST_PARTS: u32 = 4;
const LATE_PARTS: u32 = 2;

impl ContactProblem {
    /// In how many parts the tools' ways are taken: no tool may pass a sample between two looks, and none may push it over its own
    /// edge.
    pub fn parts(&self) -> u32 {
        if self.work.is_spent() {
            return self.least_parts();
        }
        let parts = self.tools.iter().zip(&self.before).map(|(tool, from)| {
            let most = (0.5 * tool.body.radius()).clamp(0.5, 2.0);
            (tool.body.motion(from, &tool.pose) / most).ceil()
        });
        parts.fold(1.0, f32::max).min(MOST_PARTS) as u32
    }

    /// The part of `parts` to take after part `part`: the next, or one of `LEAST_PARTS` once the solves have taken their time.
    pub fn next_part(&self, part: u32, parts: u32) -> u32 {
        let stride = match self.work.is_spent() {
            true => parts.div_ceil(self.least_parts()),
            false => 1,
        };
        (part + stride).min(parts)
    }

    fn least_parts(&self) -> u32 {
        if self.work.is_late() {
            LATE_PARTS
        } else {
            LEAST_PARTS
        }
    }
}
