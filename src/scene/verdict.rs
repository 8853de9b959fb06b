//! Between decode and publish: boundary conditions, the guard's verdict on the new state, and what its policy makes of a
//! state that it refuses.

use std::sync::RwLock;

use super::core::{Core, lock_read, lock_write};
use super::inversion::ContactElements;
use super::published::Published;
use super::timing::Stopwatch;
use crate::error::{Error, Result};
use crate::field::ContactSet;
use crate::guard;
use crate::kernels::largest::largest;
use crate::options::GuardPolicy;
use crate::stats::{SceneStats, flag};

impl Core {
    /// Held nodes to zero, contact nodes to what is imposed; a held node stays held in contact.
    pub(super) fn enforce_next(&mut self) {
        if self.options.boundary {
            enforce(
                &self.mesh.held_nodes,
                &self.held,
                &self.incoming,
                &mut self.next.field,
            );
        }
    }

    /// Largest displacement of the planned nodes in `next`, mm.
    pub(super) fn largest_of_next(&self) -> f32 {
        largest(self.machine.isa, &self.next.field, self.plan.nodes())
    }

    pub(super) fn judge(&mut self, stats: &mut SceneStats) -> Result<u32> {
        let mut watch = Stopwatch::start();
        let _span = tracing::trace_span!("guard").entered();
        let max = self.largest_of_next();
        let bound = self.model.manifest.envelope.displacement_bound_mm;
        // A load may move the body as far as its bound.
        let cause = match self.loaded {
            true => bound,
            false => self.incoming.max_push(),
        };
        let mut verdict = guard::judge(bound, max, self.counters.max_displacement, cause);
        if self.options.check_inversion
            && verdict & flag::NON_FINITE == 0
            && guard::inverted(
                &self.machine.pool,
                &self.mesh.positions,
                &self.next.field,
                &self.planned_tets,
            )?
        {
            verdict |= flag::INVERTED;
        }
        self.look_at_contact(stats)?;
        stats.flags |= verdict;
        stats.max_displacement_mm = max;
        stats.guard_ms += watch.lap();
        Ok(verdict)
    }

    /// Raises [`flag::INVERTED`] where an element at the contact is inside out; refuses nothing. A region leaves out nodes that this
    /// needs: then only corrected steps are looked at.
    fn look_at_contact(&mut self, stats: &mut SceneStats) -> Result<()> {
        if stats.min_det == 0.0
            && !self.incoming.is_empty()
            && self.plan.nodes().len() == self.mesh.node_count()
        {
            let elements = match self.contact_elements.take() {
                Some(elements) => elements,
                None => ContactElements::new(&self.mesh)?,
            };
            stats.min_det =
                elements.smallest_det(&self.mesh, &self.incoming.nodes, &self.next.field);
            self.contact_elements = Some(elements);
        }
        if stats.min_det < 0.0 || stats.min_det.is_nan() {
            stats.flags |= flag::INVERTED;
        }
        Ok(())
    }

    /// One line of the log for the flags that this step has and the last one had not; none while they stay.
    pub(super) fn log_flags(&mut self, stats: &SceneStats) {
        let risen = stats.flags & !self.logged_flags;
        self.logged_flags = stats.flags;
        if risen != 0 {
            tracing::warn!(
                step = self.counters.step_count,
                indicator = stats.indicator,
                largest_mm = stats.max_displacement_mm,
                "{}",
                flag::names(risen)
            );
        }
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
        let bound = self.model.manifest.envelope.displacement_bound_mm;
        let error = Error::Guard(guard::describe(verdict, stats.max_displacement_mm, bound));
        let policy = self.options.guard_policy;
        if policy == GuardPolicy::Report && verdict & flag::NON_FINITE == 0 {
            return Ok(false);
        }
        let would_repeat = self.incoming.is_empty() && !was_given;
        if policy == GuardPolicy::Blend || would_repeat {
            let leads = self
                .loads
                .as_ref()
                .is_some_and(|loads| loads.held.is_some());
            match self.cut.is_some() || leads {
                // The linear response is the intact body's at rest, and inverts loose lips: the last good state stays.
                true => (self.next.field).copy_from_slice(&lock_read(published).last.field),
                false => self.fall_back()?,
            }
            self.next.points.fill(0.0);
            let sound = self.largest_of_next() <= bound;
            if !sound {
                // Even the linear response is out of bounds or not finite: rest, without this contact.
                self.engine.rest_next();
                self.incoming.clear();
                self.next.field.fill(0.0);
            }
            return Ok(true);
        }
        self.log_flags(stats);
        let mut shared = lock_write(published);
        stats.max_displacement_mm = self.counters.max_displacement;
        shared.stats = *stats;
        Err(error)
    }

    /// Replaces `next` by the linear response, or by the imposed contact alone where the bundle has none.
    fn fall_back(&mut self) -> Result<()> {
        let compute = self.machine.compute();
        self.engine
            .fall_back(compute, &self.plan, &mut self.next.field)?;
        self.enforce_next();
        Ok(())
    }
}

/// Held nodes of `field` to zero, contact nodes to what is imposed.
pub(super) fn enforce(held_nodes: &[u32], held: &[bool], contact: &ContactSet, field: &mut [f32]) {
    for (&node, c) in contact.nodes.iter().zip(contact.vectors.chunks_exact(3)) {
        if !held[node as usize] {
            field[3 * node as usize..3 * node as usize + 3].copy_from_slice(c);
        }
    }
    for &node in held_nodes {
        field[3 * node as usize..3 * node as usize + 3].fill(0.0);
    }
}
