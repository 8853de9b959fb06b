//! The guess of a cut body that a tool grasps.

use super::{Iterate, ToolStep};
use crate::corrections::gravity_columns::add_gravity;
use crate::corrections::lift::lift;
use crate::error::Result;

impl ToolStep<'_> {
    /// The free motion alone, under the forces that there were: the linear response is the intact body's, in which both lips of a cut are one, and what
    /// holds them both would pull them apart.
    pub(super) fn guess_freely(&mut self, at: &mut Iterate<'_>) -> Result<()> {
        let env = self.context.env();
        self.problem.restart();
        at.u.copy_from_slice(self.input.last);
        add_gravity(self.context, self.input, at.u)?;
        lift(self.context, self.input, Some(self.input.last), at.u)?;
        self.solver.move_freely(env)?;
        self.solver.settle(env, at.u)?;
        self.report.parts = 1;
        self.evaluate(at)
    }
}
