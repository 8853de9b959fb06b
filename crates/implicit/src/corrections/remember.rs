//! When relaxing tissue takes a state into what it remembers ([`super::relaxing`]).

use elements::{HistoryStep, Scratch};

use super::Corrections;
use super::history::History;
use super::input::{Input, SolverContext};
use super::relaxing::Relaxing;
use super::solver::ImplicitSolver;
use crate::error::{Error, Result};
use crate::memory;

const WHAT: &str = "the stresses of a cut body";

impl Relaxing {
    /// Before a step of the scene: what is remembered goes on to the last published state, and what it pushes with at the end of the step is known; with
    /// `start` at its start too, for what happens within it. `scratch` is room for the elements.
    ///
    /// # Errors
    /// A panic on another thread of the pool.
    pub(super) fn remember(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        start: bool,
        scratch: &mut Scratch,
    ) -> Result<()> {
        let step_s = context.time_step.integrator.step_s;
        self.next_since_s = step_s;
        self.next_is_new = input.still;
        if input.still {
            (self.is_ready, self.has_start) = (false, true);
            self.pushes.iter_mut().for_each(|push| push.fill(0.0));
            return Ok(());
        }
        // A step that is made a second time, with other contact or none.
        if self.is_ready && (self.has_start || !start) {
            return Ok(());
        }
        (self.is_ready, self.has_start) = (true, start);
        let forces = &context.corrections.body.forces;
        let body_step_s = context.corrections.time_step.integrator.step_s;
        let step = HistoryStep {
            since_s: self.since_s,
            times_s: [step_s, 0.0],
            g0: forces.relaxation().over(body_step_s),
        };
        let [from, to] = &mut self.pushes;
        let failed = std::sync::Mutex::new(None);
        forces.relax(
            input.last,
            &mut self.history,
            &step,
            scratch,
            (to, start.then_some(from)),
            &|count, task| {
                if let Err(error) = context.pool.run(count, task) {
                    *failed
                        .lock()
                        .unwrap_or_else(std::sync::PoisonError::into_inner) = Some(error);
                }
            },
        );
        // What is remembered is of the last published state from here on.
        self.since_s = 0.0;
        let failed = failed.into_inner();
        match failed.unwrap_or_else(std::sync::PoisonError::into_inner) {
            Some(error) => {
                self.is_ready = false;
                Err(error.into())
            }
            None => Ok(()),
        }
    }
}

impl ImplicitSolver {
    /// Checks what a snapshot remembers of stresses.
    ///
    /// # Errors
    /// [`Error::Snapshot`].
    pub fn admit(&self, history: &History) -> Result<()> {
        match (&self.relaxing, &history.relaxing) {
            (Some(own), Some(remembered)) => remembered.check(own),
            (None, None) => Ok(()),
            (Some(_), None) | (None, Some(_)) => Err(Error::Snapshot(
                "was saved of tissue that relaxes where this one does not, or the reverse".into(),
            )),
        }
    }

    /// Takes what the same tissue remembered before it was cut; `sources` are the numbers there of what each element stems from.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn remember_as(
        &mut self,
        corrections: &Corrections,
        (before, other): (&ImplicitSolver, &Corrections),
        sources: &[u32],
    ) -> Result<()> {
        let (Some(own), Some(from)) = (&mut self.relaxing, &before.relaxing) else {
            return Ok(());
        };
        let [forces, source] = [corrections, other].map(|own| &own.body.forces);
        let taken = forces.follow_history(&mut own.history, (source, &from.history), sources);
        memory::tried(taken, WHAT)?;
        own.since_s = from.since_s;
        own.is_ready = false;
        Ok(())
    }

    /// Bytes that what it remembers has in a snapshot, at most.
    pub fn remembered_bytes(&self) -> usize {
        let own = self.relaxing.as_ref();
        own.map_or(0, |own| own.history.bytes() + 64)
    }

    /// Whether the tissue relaxes.
    pub fn relaxes(&self) -> bool {
        self.relaxing.is_some()
    }
}
