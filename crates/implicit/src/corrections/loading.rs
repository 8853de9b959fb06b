//! Loads in a step: off the drift before it, off the inertia that it leaves.

use super::input::Input;
use super::solver::ImplicitSolver;
use crate::error::Result;
use crate::memory;

impl ImplicitSolver {
    /// Takes the loads of the step: those at its end off the drift.
    pub(super) fn take_load(&mut self, input: &Input<'_>, step_s: f32) -> Result<()> {
        if input.load.is_none() && self.relaxing.is_none() {
            self.balance.load.clear();
            return Ok(());
        }
        memory::fit(
            &mut self.balance.load,
            self.balance.drift.len(),
            "the loads of a scene",
        )?;
        self.balance.load.resize(self.balance.drift.len(), 0.0);
        let ahead = if input.still { 0.0 } else { step_s };
        let (last, velocity) = (input.last, &self.motion.velocity);
        let there = |at: usize| last[at] + ahead * velocity[at];
        match &input.load {
            Some(load) => load.evaluate(1, input.rest, there, &mut self.balance.load),
            None => self.balance.load.fill(0.0),
        }
        if let Some(relaxing) = &self.relaxing {
            relaxing.add(input.way[1], &mut self.balance.load);
        }
        for (drift, load) in self.balance.drift.iter_mut().zip(&self.balance.load) {
            *drift -= load;
        }
        Ok(())
    }

    /// The mean load over the step into `q`; false where there is none.
    pub(super) fn mean_load(&mut self, input: &Input<'_>) -> bool {
        match &input.load {
            Some(load) => load.evaluate(0, input.rest, |at| input.last[at], &mut self.fields.q),
            None if self.relaxing.is_none() => return false,
            None => self.fields.q.fill(0.0),
        }
        if let Some(relaxing) = &self.relaxing {
            relaxing.add(input.way[0], &mut self.fields.q);
        }
        for (mean, end) in self.fields.q.iter_mut().zip(&self.balance.load) {
            *mean = 0.5 * (*mean + end);
        }
        true
    }

    /// Takes the loads off the inertia of the state being made, which keeps them.
    pub(super) fn leave_load(&mut self) -> Result<()> {
        memory::replace(
            &mut self.next.load,
            &self.balance.load,
            "the loads of a scene",
        )?;
        for (inertia, load) in self.next.inertia.iter_mut().zip(&self.balance.load) {
            *inertia -= load;
        }
        Ok(())
    }
}
