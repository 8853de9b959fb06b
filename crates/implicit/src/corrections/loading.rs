//! Loads in a step: off the drift before it, off the inertia that it leaves.
//!
//! In `F(u) = f_int(u) + M (a + alpha v) - p` all that the iterations do not change is the drift;
//! the load `p` at the end of the step is subtracted from it once, before them. When the step is
//! made the load is subtracted from the inertia that its state leaves, so that the next step finds
//! the two in balance. What relaxing tissue remembers pushes in the same way.

use super::balance::Balance;
use super::input::Input;
use super::motion::Motion;
use super::relax::FieldStep;
use super::relaxing::Relaxing;
use crate::error::Result;
use crate::memory;

impl Balance {
    /// Takes the loads of the step: those at its end off the drift.
    /// Loads are in µN here, as the residual is. `F(u) = f_int(u) + M (a + alpha v) - p` has them
    /// on the side of the drift, so nothing else in an iteration knows of them
    /// (`docs/decisions/028-loads.md`).
    pub(super) fn take_load(
        &mut self,
        input: &Input<'_>,
        step_s: f32,
        velocity: &[f32],
        relaxing: Option<&Relaxing>,
    ) -> Result<()> {
        if input.load.is_none() && relaxing.is_none() {
            // Empty says that there is none: no pass over the nodes for zeros.
            self.load.clear();
            return Ok(());
        }
        memory::fit(&mut self.load, self.drift.len(), "the loads of a scene")?;
        self.load.resize(self.drift.len(), 0.0);
        // Pressure follows the surface: it is taken where the tissue will be if it goes on as it did.
        let ahead = if input.still { 0.0 } else { step_s };
        let last = input.last;
        let there = |at: usize| last[at] + ahead * velocity[at];
        match &input.load {
            Some(load) => load.evaluate(1, input.rest, there, &mut self.load),
            None => self.load.fill(0.0),
        }
        if let Some(relaxing) = relaxing {
            relaxing.add(input.way[1], &mut self.load);
        }
        for (drift, load) in self.drift.iter_mut().zip(&self.load) {
            *drift -= load;
        }
        Ok(())
    }
}

impl FieldStep<'_> {
    /// The mean load over the step into `q`; false where there is none.
    pub(super) fn mean_load(&mut self) -> bool {
        let input = self.input;
        match &input.load {
            Some(load) => load.evaluate(
                0,
                input.rest,
                |at| input.last[at],
                &mut self.solver.fields.q,
            ),
            None if self.solver.relaxing.is_none() => return false,
            None => self.solver.fields.q.fill(0.0),
        }
        if let Some(relaxing) = &self.solver.relaxing {
            relaxing.add(input.way[0], &mut self.solver.fields.q);
        }
        for (mean, end) in self
            .solver
            .fields
            .q
            .iter_mut()
            .zip(&self.solver.balance.load)
        {
            // The trapezium of both ends: the oscillators are solved over the step, not at its end.
            *mean = 0.5 * (*mean + end);
        }
        true
    }
}

impl Motion {
    /// Takes the loads off the inertia of this state, the one being made, which keeps them.
    pub(super) fn leave_load(&mut self, load: &[f32]) -> Result<()> {
        memory::replace(&mut self.load, load, "the loads of a scene")?;
        for (inertia, load) in self.inertia.iter_mut().zip(load) {
            *inertia -= load;
        }
        Ok(())
    }
}
