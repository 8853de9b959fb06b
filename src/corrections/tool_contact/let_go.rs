//! The guess of a body of which a support group has been let go.

use super::Iterate;
use crate::contact::ContactProblem;
use crate::corrections::input::{Input, Report, SolverContext};
use crate::corrections::precondition::mask_held;
use crate::corrections::solver::{ImplicitSolver, SMALLEST_DET};
use crate::error::Result;

impl ImplicitSolver {
    /// Moves the group's modes by what is out of balance on them, if that leaves less of it: no mode of the bundle moves what the group held, and from where
    /// the group has gone iterations find the rest.
    pub(super) fn move_let_go(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        problem: &ContactProblem,
        at: &mut Iterate<'_>,
        report: &mut Report,
    ) -> Result<()> {
        let env = context.env();
        let unbalanced = |g: &[f32], to: &mut Vec<f32>| {
            to.copy_from_slice(g);
            problem.each_load(|node, force| {
                let rows = to[3 * node as usize..].iter_mut();
                rows.zip(force.to_array())
                    .for_each(|(g, force)| *g -= 1e3 * force);
            });
            mask_held(&env.held.is, to);
        };
        self.with_fields(|solver, [from, scratch, left]| {
            from.copy_from_slice(at.u);
            unbalanced(at.g, left);
            let before = solver.size(env, left)?;
            (solver.preconditioner).move_whole(env, left, scratch, at.u)?;
            solver.evaluate(context, input, at, report)?;
            unbalanced(at.g, left);
            let after = solver.size(env, left)?;
            if at.det > SMALLEST_DET && after < before {
                return Ok(());
            }
            at.u.copy_from_slice(from);
            solver.evaluate(context, input, at, report)
        })
    }
}
