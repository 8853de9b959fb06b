//! A guess that throws the tissue off balance under tools that lie still: the step begins with the last state instead. And iterations that throw it: their
//! end is no state of the step.
//!
//! Deep under a thin tool the linear response of the body at rest says little: forces that change from one sample to the next throw the tissue, and
//! iterations do not bring it back. Where tools have come nearer the last state is in balance too, but not in contact.

use super::{Iterate, LEAST_WAY_MM, ToolStep};
use crate::contact::ContactProblem;
use crate::corrections::precondition::mask_held;
use crate::corrections::solver::SMALLEST_DET;
use crate::error::Result;

/// A guess leaves so many times the loads out of balance at most, or what the last state does times `WORSE`: ordinary ones leave half of the loads.
const THROWN: f64 = 2.0;
const WORSE: f64 = 3.0;

/// Iterations leave so many times more out of balance near the tools than they began with, at most, or no more than [`THROWN`] times the loads: ordinary ones
/// leave less than they began with.
const GROWN: f64 = 10.0;

/// Whether iterations have thrown the tissue: they have left `[.., to]` out of balance near the tools, µN, and began with `[from, ..]`.
pub(super) fn has_thrown(problem: &ContactProblem, [from, to]: [f64; 2]) -> bool {
    to > GROWN * from && to > THROWN * libm::sqrt(squared_loads(problem))
}

/// `|B^T f|²` by rows, µN².
fn squared_loads(problem: &ContactProblem) -> f64 {
    let mut sum = 0.0;
    problem.each_load(|_, force| sum += f64::from((force * 1e3).length_squared()));
    sum
}

impl ToolStep<'_> {
    /// Begins with the last state, with the forces that it had, where the guess is much farther from balance; tells whether it does.
    pub(super) fn leave_thrown_guess(&mut self, at: &mut Iterate<'_>) -> Result<bool> {
        let lies_still = self.problem.ways.longest() <= LEAST_WAY_MM;
        if !lies_still || at.det < SMALLEST_DET || !self.may_begin_again() {
            return Ok(false);
        }
        let (guess, loads) = left_out(self, at);
        if guess <= THROWN * loads {
            return Ok(false);
        }
        self.begin_again(at)?;
        let (last, _) = left_out(self, at);
        if at.det >= SMALLEST_DET && guess > WORSE * last {
            return Ok(true);
        }
        self.problem.kept.take_guess(&mut self.problem.next);
        at.u.copy_from_slice(&self.solver.fields.guess);
        self.evaluate(at)?;
        Ok(false)
    }
}

/// `|F(u) - B^T f|` and `|B^T f|` on the free nodes, µN.
fn left_out(step: &mut ToolStep<'_>, at: &Iterate<'_>) -> (f64, f64) {
    let left = &mut step.solver.fields.q;
    take_loads(step.problem, &step.context.held.is, at.g, left);
    let loads = squared_loads(step.problem);
    let sum: f64 = left.iter().map(|x| f64::from(*x) * f64::from(*x)).sum();
    (libm::sqrt(sum), libm::sqrt(loads))
}

/// `to` becomes `F(u) - B^T f` on the free nodes, µN: what the tools push with is balanced near them.
pub(super) fn take_loads(problem: &ContactProblem, held: &[bool], g: &[f32], to: &mut [f32]) {
    to.copy_from_slice(g);
    problem.each_load(|node, force| {
        let rows = to[3 * node as usize..].iter_mut();
        let loads = rows.zip(force.to_array());
        loads.for_each(|(g, force)| *g -= 1e3 * force);
    });
    mask_held(held, to);
}
