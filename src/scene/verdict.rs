//! Between decode and publish: the guard's verdict on the new state, and what its policy makes of a state that it refuses.
//!
//! The guard is the last thing between a solver or a network and a host's renderer: a state that is
//! not finite, lies beyond the bundle's bound, moves farther than its cause explains, or turns
//! elements inside out does not pass it unseen. What becomes of it is the host's policy: keep the
//! last state and fail, blend (the linear response in its place), or only report.

use std::sync::RwLock;

use super::maker::StepMaker;
use super::published::Published;
use super::published::{lock_read, lock_write};
use super::timing::Stopwatch;
use crate::error::{Error, Result};
use crate::guard;
use crate::options::GuardPolicy;
use crate::stats::{SceneStats, flag};

impl StepMaker {
    /// The guard's verdict on `next`, and what the step says of it in its statistics.
    pub(super) fn judge(&mut self, stats: &mut SceneStats) -> Result<u32> {
        let mut watch = Stopwatch::start();
        let _span = tracing::trace_span!("guard").entered();
        // Of the nodes that are decoded: a region leaves the others unknown.
        let max = self.largest_of_next();
        let bound = self.body.model.manifest.envelope.displacement_bound_mm;
        // A load may move the body as far as its bound.
        let cause = match self.loads.loaded {
            true => bound,
            false => self.states.incoming.max_push(),
        };
        // Finite, within the bundle's bound, and no farther beyond the last state than its cause explains.
        let mut verdict = guard::judge(bound, max, self.states.counters.max_displacement, cause);
        if self.options.check_inversion
            && verdict & flag::NON_FINITE == 0
            && guard::inverted(
                &self.machine.pool,
                &self.body.mesh.positions,
                &self.states.next.field,
                &self.shown.tets,
            )?
        {
            verdict |= flag::INVERTED;
        }
        let of_step = (&self.states, &self.shown);
        self.watch.look_at_contact(&self.body, of_step, stats)?;
        stats.flags |= verdict;
        stats.max_displacement_mm = max;
        stats.timing.guard_ms += watch.lap();
        Ok(verdict)
    }

    /// The policy for a refused state. `Ok` means that `next` may be published, and says whether it was replaced.
    ///
    /// A step without contact from the scene's own state asks nothing of the host: held, it would be made and refused
    /// again for ever. Such a step is replaced under every policy, so that the tissue comes back.
    pub(super) fn refuse(
        &mut self,
        published: &RwLock<Published>,
        verdict: u32,
        was_given: bool,
        stats: &mut SceneStats,
    ) -> Result<bool> {
        let bound = self.body.model.manifest.envelope.displacement_bound_mm;
        let error = Error::Guard(guard::describe(verdict, stats.max_displacement_mm, bound));
        let policy = self.options.guard_policy;
        if policy == GuardPolicy::Report && verdict & flag::NON_FINITE == 0 {
            return Ok(false);
        }
        let would_repeat = self.states.incoming.is_empty() && !was_given;
        if policy == GuardPolicy::Blend || would_repeat {
            match self.body.cut.is_some() || self.loads.leads() {
                // The linear response is the intact body's at rest, and inverts loose lips: the last good state stays.
                true => (self.states.next.field).copy_from_slice(&lock_read(published).last.field),
                // The linear response, or the imposed contact alone where the bundle has none.
                false => {
                    let compute = self.machine.compute();
                    let field = &mut self.states.next.field;
                    self.engine.fall_back(compute, &self.shown.plan, field)?;
                    self.enforce_next();
                }
            }
            self.states.next.points.fill(0.0);
            let sound = self.largest_of_next() <= bound;
            if !sound {
                // Even the linear response is out of bounds or not finite: rest, without this contact.
                self.engine.rest_next();
                self.states.incoming.clear();
                self.states.next.field.fill(0.0);
            }
            return Ok(true);
        }
        let counters = &self.states.counters;
        self.watch.tell(counters.step_count, stats);
        let mut shared = lock_write(published);
        stats.max_displacement_mm = counters.max_displacement;
        shared.stats = *stats;
        Err(error)
    }
}
