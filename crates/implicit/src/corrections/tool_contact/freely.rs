//! The guess of a cut body that a tool grasps.

use super::Iterate;
use crate::contact::ContactProblem;
use crate::corrections::input::{Input, Report, SolverContext};
use crate::corrections::solver::ImplicitSolver;
use crate::error::Result;

impl ImplicitSolver {
    /// The free motion alone, under the forces that there were: the linear response is the intact body's, in which both lips of a cut are one, and what
    /// holds them both would pull them apart.
    pub(super) fn guess_freely(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        problem: &mut ContactProblem,
        at: &mut Iterate<'_>,
        report: &mut Report,
    ) -> Result<()> {
        let env = context.env();
        problem.restart();
        at.u.copy_from_slice(input.last);
        self.add_gravity(context, input, at.u)?;
        self.lift(context, input, Some(input.last), at.u)?;
        self.move_freely(env)?;
        self.settle(env, at.u)?;
        report.parts = 1;
        self.evaluate(context, input, at, report)
    }
}
