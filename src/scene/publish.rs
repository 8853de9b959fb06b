//! The end of a step: the state becomes the last, and the scene falls asleep where it is quiet.

use std::sync::RwLock;

use super::core::Core;
use super::maker::StepMaker;
use super::published::{Frame, Published};
use super::published::{lock_read, lock_write};
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
    /// Publishes `next`: all that was made beside it (records, motion, contact, loads) becomes that of the last step, the scene falls asleep where it is
    /// quiet, and the frames change places. `was_given`: the step began at a displacement of the host's; `replaced`: the guard has put another state in the
    /// place of the one that was made. Nothing of it can fail.
    pub(super) fn publish(
        &mut self,
        published: &RwLock<Published>,
        was_given: bool,
        replaced: bool,
        stats: &SceneStats,
    ) {
        let maker = &mut self.maker;
        let Frame { field, points } = &mut maker.states.next;
        maker.shown.points.add_interpolated(1.0, field, points);
        // Nothing fails from here on: all room was asked for in `fit_published`.
        maker.engine.commit();
        if let Some(corrected) = &mut maker.corrected {
            if replaced {
                corrected.solver.stop_next();
            }
            corrected.solver.commit();
        }
        maker.tools.commit();
        maker.loads.commit();
        maker.states.commit(replaced);
        // The statistics still have the refused state's displacement; the next verdict starts from the one that stands.
        let largest = match replaced {
            true => maker.largest_of_next(),
            false => stats.max_displacement_mm,
        };
        maker.states.counters.max_displacement = largest;
        let quiet = !was_given && maker.is_quiet(published);
        let counters = &mut maker.states.counters;
        counters.quiet = if quiet { counters.quiet + 1 } else { 0 };
        let body = &maker.body;
        let steps = f64::from(QUIET_STEPS) * body.model.manifest.dt_s / body.step_s();
        counters.sleeping = maker.options.sleep && f64::from(counters.quiet) >= steps - 1e-6;
        counters.rest_frames = 0;
        self.rotate(published);
    }

    /// A step of a sleeping scene: exactly rest. The tools' poses are remembered, and none touches the tissue.
    pub(super) fn publish_rest(&mut self, published: &RwLock<Published>) {
        let maker = &mut self.maker;
        maker.states.contact_before.clear();
        maker.states.contact.clear();
        maker.states.counters.max_displacement = 0.0;
        maker.tools.clear_forces();
        maker.tools.commit();
        maker.tools.publish(&maker.body, &mut lock_write(published));
        // After so many steps every frame that exists, the spare one among them, is exactly rest,
        // and there is nothing left to write. Only the time goes on.
        let frames = if maker.options.cubic_sampling { 4 } else { 3 };
        let counters = &mut maker.states.counters;
        if counters.rest_frames >= frames {
            if let Some(frame_state) = &mut lock_write(published).frame_state {
                frame_state.time_s = counters.time_s;
            }
            return;
        }
        counters.rest_frames += 1;
        maker.engine.reset();
        if let Some(corrected) = &mut maker.corrected {
            corrected.solver.reset();
        }
        maker.states.rest_next();
        self.rotate(published);
    }

    /// `next` becomes the last frame, the last the one before.
    ///
    /// All under one lock: a reader that interpolates between two frames never sees one of this
    /// step and one of the step before the last.
    fn rotate(&mut self, published: &RwLock<Published>) {
        let maker = &mut self.maker;
        let mut shared = lock_write(published);
        maker.states.rotate(&mut shared);
        maker.states.show_contacts(&mut shared);
        maker.tools.publish(&maker.body, &mut shared);
        shared.publish_frame_state(maker.corrected.as_deref(), &maker.states);
    }
}

impl StepMaker {
    /// Whether nothing touches the state that is about to be published, and it lies still at rest or close to it.
    fn is_quiet(&self, published: &RwLock<Published>) -> bool {
        let counters = &self.states.counters;
        self.states.contact.is_empty()
            && !counters.was_corrected[0]
            && (counters.max_displacement <= QUIET_DISPLACEMENT || self.is_still(published))
            && self.engine.is_quiet(QUIET_DISPLACEMENT)
    }

    /// Whether `next` is close to rest and to the last state, with a model whose own fixed point may lie beside rest:
    /// what is left is then that model's bias, not motion.
    fn is_still(&self, published: &RwLock<Published>) -> bool {
        let bias = self.body.model.manifest.rest_displacement_mm;
        // Tissue that relaxes creeps back slower than that.
        let relaxes = self.corrected.as_ref().is_some_and(|own| own.relaxes);
        if self.states.counters.max_displacement > bias + STILL_DISPLACEMENT
            || self.engine.comes_to_rest()
            || relaxes
        {
            return false;
        }
        let shared = lock_read(published);
        self.shown.plan.nodes().iter().all(|&node| {
            let at = 3 * node as usize;
            let (now, last) = (
                &self.states.next.field[at..at + 3],
                &shared.last.field[at..at + 3],
            );
            let square: f32 = now.iter().zip(last).map(|(a, b)| (a - b) * (a - b)).sum();
            square <= STILL_CHANGE * STILL_CHANGE
        })
    }
}
