//! The end of a step: the state becomes the last, and the scene falls asleep where it is quiet.

use std::sync::RwLock;

use super::core::{Core, lock_read, lock_write};
use super::counters::Source;
use super::published::{Frame, Published};
use crate::stats::SceneStats;

/// A scene is asleep after this many steps of the bundle's length, or as much time in its own, without contact ...
pub const QUIET_STEPS: u32 = 4;
/// ... in which no decoded node is displaced by more than this, mm, ...
pub const QUIET_DISPLACEMENT: f32 = 0.02;
/// ... or, with a model that need not come to rest at zero, in which no decoded node is displaced by more than this, beside
/// where the model's own free motion ends, and moves by more than [`STILL_CHANGE`] a step, mm.
pub const STILL_DISPLACEMENT: f32 = 0.05;
/// See [`STILL_DISPLACEMENT`], mm a step.
pub const STILL_CHANGE: f32 = 0.002;

impl Core {
    pub(super) fn publish(
        &mut self,
        published: &RwLock<Published>,
        was_given: bool,
        replaced: bool,
        stats: &SceneStats,
    ) {
        let Frame { field, points } = &mut self.next;
        self.points.add_interpolated(1.0, field, points);
        self.engine.commit();
        if let Some(corrected) = &mut self.corrected {
            if replaced {
                corrected.solver.stop_next();
            }
            corrected.solver.commit();
        }
        self.counters.was_corrected = [
            self.next_corrected && !replaced,
            self.counters.was_corrected[0],
        ];
        if let Some(problem) = &mut self.problem {
            problem.commit();
        }
        self.commit_loads();
        self.counters.source_before = self.counters.source;
        self.counters.source = if replaced {
            Source::Fallback
        } else {
            Source::Model
        };
        std::mem::swap(&mut self.contact_before, &mut self.contact);
        std::mem::swap(&mut self.contact, &mut self.incoming);
        self.counters.max_displacement = if replaced {
            self.largest_of_next()
        } else {
            stats.max_displacement_mm
        };
        let quiet = self.contact.is_empty()
            && !self.counters.was_corrected[0]
            && !was_given
            && (self.counters.max_displacement <= QUIET_DISPLACEMENT || self.is_still(published))
            && self.engine.is_quiet(QUIET_DISPLACEMENT);
        self.counters.quiet = if quiet { self.counters.quiet + 1 } else { 0 };
        let steps = f64::from(QUIET_STEPS) * self.model.manifest.dt_s / self.step_s();
        self.counters.sleeping =
            self.options.sleep && f64::from(self.counters.quiet) >= steps - 1e-6;
        self.counters.rest_frames = 0;
        self.rotate(published);
    }

    /// Whether `next` is close to rest and to the last state, with a model whose own fixed point may lie beside rest:
    /// what is left is then that model's bias, not motion.
    fn is_still(&self, published: &RwLock<Published>) -> bool {
        let bias = self.model.manifest.rest_displacement_mm;
        // Tissue that relaxes creeps back slower than that.
        let relaxes = self.corrected.as_ref().is_some_and(|own| own.relaxes);
        if self.counters.max_displacement > bias + STILL_DISPLACEMENT
            || self.engine.comes_to_rest()
            || relaxes
        {
            return false;
        }
        let shared = lock_read(published);
        self.plan.nodes().iter().all(|&node| {
            let at = 3 * node as usize;
            let (now, last) = (&self.next.field[at..at + 3], &shared.last.field[at..at + 3]);
            let square: f32 = now.iter().zip(last).map(|(a, b)| (a - b) * (a - b)).sum();
            square <= STILL_CHANGE * STILL_CHANGE
        })
    }

    /// A step of a sleeping scene: exactly rest.
    pub(super) fn publish_rest(&mut self, published: &RwLock<Published>) {
        self.contact_before.clear();
        self.contact.clear();
        self.counters.max_displacement = 0.0;
        self.commit_untouched_tools(published);
        let frames = if self.options.cubic_sampling { 4 } else { 3 };
        if self.counters.rest_frames >= frames {
            if let Some(frame_state) = &mut lock_write(published).frame_state {
                frame_state.time_s = self.counters.time_s;
            }
            return;
        }
        self.counters.rest_frames += 1;
        self.engine.reset();
        if let Some(corrected) = &mut self.corrected {
            corrected.solver.reset();
        }
        self.counters.was_corrected = [false; 2];
        self.counters.source_before = Source::Rest;
        self.counters.source = Source::Rest;
        self.next.field.fill(0.0);
        self.next.points.fill(0.0);
        self.rotate(published);
    }

    /// `next` becomes the last frame, the last the one before.
    fn rotate(&mut self, published: &RwLock<Published>) {
        let mut shared = lock_write(published);
        let shared = &mut *shared;
        if let Some(earlier) = &mut shared.earlier {
            std::mem::swap(earlier, &mut shared.before);
        }
        std::mem::swap(&mut shared.before, &mut shared.last);
        std::mem::swap(&mut shared.last, &mut self.next);
        self.show_contacts(shared);
        self.publish_tools(shared);
        self.publish_frame_state(shared);
    }

    /// The last step's contacts in the host's order.
    pub(super) fn show_contacts(&self, shared: &mut Published) {
        shared.contact_nodes.clear();
        shared.contact_vectors.clear();
        shared.contact_nodes.resize(self.contact.len(), 0);
        shared.contact_vectors.resize(3 * self.contact.len(), 0.0);
        for (i, &at) in self.contact.order.iter().enumerate() {
            let at = at as usize;
            shared.contact_nodes[at] = self.contact.nodes[i];
            shared.contact_vectors[3 * at..3 * at + 3]
                .copy_from_slice(&self.contact.vectors[3 * i..3 * i + 3]);
        }
    }
}
