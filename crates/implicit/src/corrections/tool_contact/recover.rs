//! Where the first guess inverts elements, however short its parts: tools and ties push and pull their way by iterations alone, from a state that has none.
//!
//! The laws of the elements say nothing of what is inside out, so that no iteration leads out of it: a step that took such a state over would be the start of
//! others (`docs/decisions/039-sound-states.md`).

use super::{Iterate, ToolStep};
use crate::corrections::lift::lift;
use crate::corrections::solver::SMALLEST_DET;
use crate::error::Result;

/// How often the way from rest to a guess is halved until its end has no inverted element: the last
/// of them leaves 0.4 % of the way.
const HALVES: u32 = 8;
/// Smallest det F of a state from rest that iterations begin with: one at the limit leaves them no way.
const BEGUN_DET: f32 = 0.2;

impl ToolStep<'_> {
    /// Whether the step must not end inside out where another state is known. Tools alone may: they find tissue that is inside out, and lose it where it
    /// stays as it was; ties and loads act on it for as long as they last.
    pub(super) fn must_be_sound(&self) -> bool {
        let is_moved = self.input.load.is_some() || !self.context.corrections.groups.is_empty();
        is_moved || self.problem.tied.has_any()
    }

    /// Iterates from the last state, or where that has inverted elements, too, from a part of the way from rest to the guess; returns the length of what is left
    /// unbalanced near the tools. With tools alone a last state with inverted elements, or work that is spent, leaves the guess.
    pub(super) fn recover(&mut self, at: &mut Iterate<'_>) -> Result<f64> {
        let was_sound = self.solver.motion.min_det >= SMALLEST_DET && !self.input.still;
        self.problem.work.attempt(false);
        if self.must_be_sound() {
            self.problem.work.renew();
        } else if !was_sound || self.problem.work.is_spent() {
            return Ok(f64::INFINITY);
        }
        if was_sound {
            self.begin_again(at)?;
        } else {
            // What the last state and this one make of a velocity is none.
            self.report.fell_back = true;
            self.problem.kept.take_guess(&mut self.problem.next);
            at.u.copy_from_slice(&self.solver.fields.guess);
            self.solver.fields.d.fill(0.0);
            let rest = &mut self.solver.fields.d;
            lift(self.context, self.input, None, rest)?;
            for _ in 0..HALVES {
                // Half the way, half the forces: they belong to each other where the response is linear.
                self.problem.next.scale_forces(0.5);
                let pairs = at.u.iter_mut().zip(&self.solver.fields.d);
                pairs.for_each(|(u, rest)| *u = 0.5 * (*u + rest));
                self.evaluate(at)?;
                if at.det >= BEGUN_DET {
                    break;
                }
            }
        }
        self.improve_loaded(at)
    }

    /// The last state where the boundary has gone since, with the forces that it had.
    pub(super) fn begin_again(&mut self, at: &mut Iterate<'_>) -> Result<()> {
        self.stay(at)?;
        if self.context.corrections.groups.is_empty() {
            return Ok(());
        }
        lift(self.context, self.input, Some(self.input.last), at.u)?;
        self.evaluate(at)
    }

    /// Whether iterations may begin with the last state where those from the guess have lost a tool: its elements are sound, a tool pushed it, and none has
    /// been put elsewhere.
    pub(super) fn may_begin_again(&self) -> bool {
        let was_sound = self.solver.motion.min_det >= SMALLEST_DET && !self.input.still;
        let leapt = self.problem.ways.has_leapt;
        let has_work = !self.problem.work.is_spent() && !self.problem.work.is_short();
        was_sound && !leapt && self.problem.past.tools_push() && has_work
    }
}
