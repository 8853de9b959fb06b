//! Corrections inside a step: after the prediction, before the guard.

use crate::clock::Instant;
use std::sync::{Arc, RwLock};

use super::core::{Core, lock_read};
use super::engine::Engine;
use super::published::Published;
use super::timing::Stopwatch;
use crate::corrections::{Enough, History, Input, Integrator, SolverContext};
use crate::error::Result;
use crate::stats::SceneStats;

/// After tools let go, the elements make the steps while the last state is displaced by more than this, mm. The displacement at which the
/// model's own free motion ends is added, or a network that rests farther out would never take over. The elements know
/// what the tools did; the learned part would go on from a field that it did not predict.
const SWUNG_MM: f32 = 0.1;

impl Core {
    /// Corrects `next` while there is contact; otherwise lets the velocities follow it.
    pub(super) fn correct(
        &mut self,
        published: &RwLock<Published>,
        given: Option<&[f32]>,
        start: Instant,
        stats: &mut SceneStats,
    ) -> Result<()> {
        let learns = self.learns();
        let Some(corrected) = &mut self.corrected else {
            return Ok(());
        };
        let (Some(prior), corrections) = (&self.model.prior, self.model.corrections()?) else {
            return Ok(());
        };
        let mut watch = Stopwatch::start();
        let _span = tracing::trace_span!("corrections").entered();
        let time_step = Arc::clone(&corrected.time_step);
        let context = SolverContext {
            isa: self.machine.isa,
            pool: &self.machine.pool,
            prior,
            corrections,
            time_step: &time_step,
            held: Core::held_of(&self.loads, corrections),
        };
        let touched = !self.incoming.is_empty();
        // The learned part takes over some steps after a release; with a length of step of the scene's own it never does.
        self.next_corrected = touched || (!learns && !corrected.alone()) || self.loaded;
        let load = self.loads.as_ref().and_then(|loads| loads.load());
        // A length of step of the scene's own may be short enough to need no substeps. Under a load that acts everywhere iterations are worth more.
        let in_parts = (corrected.free_substeps > 1 || !corrected.own_pace) && load.is_none();
        if !touched && !learns && in_parts {
            corrected.be_shorter(context, &self.model)?;
        }
        let shared = lock_read(published);
        let input = Input {
            rest: &self.mesh.positions,
            contact: &self.incoming,
            last: given.unwrap_or(&shared.last.field),
            before: given.unwrap_or(&shared.before.field),
            still: given.is_some(),
            load,
            way: [0.0, 1.0],
            enough: match load {
                // What the whole body does settles later than an iteration's own step says.
                // Whole modes know what it does.
                Some(_) if !corrections.has_whole_modes() => Enough {
                    error_mm: 0.0,
                    ..corrected.enough(start)
                },
                _ => corrected.enough(start),
            },
        };
        if touched {
            let report = corrected
                .solver
                .correct(context, &input, &mut self.next.field)?;
            corrected.report_to(&report, stats);
        } else if !learns {
            let substepper = corrected.substepper.as_deref_mut().filter(|_| in_parts);
            let next = &mut self.next.field;
            let report = corrected.solver.swing(context, &input, substepper, next)?;
            corrected.report_to(&report, stats);
        } else {
            corrected.solver.follow(context, &input, &self.next.field)?;
        }
        drop(shared);
        stats.corrections_ms = watch.lap();
        Ok(())
    }

    /// Whether the learned part (or, in a bundle without one, its free vibration) makes a step without contact; decided by the last state.
    pub(super) fn learns(&self) -> bool {
        let Some(corrected) = &self.corrected else {
            return true;
        };
        let lifted = corrected.most_substeps > 1 && self.driven && self.is_swung();
        !(corrected.alone() || lifted || self.loaded)
    }

    /// Whether the last state is displaced by more than where the model's own free motion ends.
    pub(super) fn is_swung(&self) -> bool {
        self.counters.max_displacement > SWUNG_MM + self.model.manifest.rest_displacement_mm
    }

    /// The length of a step and the damping.
    pub(super) fn integrator(&self) -> Integrator {
        let manifest = &self.model.manifest;
        let of_bundle = Integrator {
            step_s: manifest.dt_s,
            damping_per_s: manifest.material.damping_per_s,
        };
        let corrected = self.corrected.as_ref();
        corrected.map_or(of_bundle, |own| own.time_step.integrator)
    }

    /// The length of a step, s.
    pub(super) fn step_s(&self) -> f64 {
        self.integrator().step_s
    }

    /// The reaction of the last published state; false where it was not corrected.
    pub(super) fn corrected_reaction(&self, out: &mut [f32]) -> bool {
        let Some(corrected) = &self.corrected else {
            return false;
        };
        if let Some(problem) = &self.problem
            && !problem.past.forces.is_empty()
        {
            return self.loads_at_contacts(problem, out);
        }
        // A state that fell back has inverted elements, and what they push with means nothing.
        let motion = &corrected.solver.motion;
        let sound = motion.min_det >= crate::corrections::SMALLEST_DET
            && motion.reaction.len() == out.len();
        if self.contact.is_empty() || !sound {
            return false;
        }
        corrected.solver.reaction(&self.contact, out);
        true
    }

    /// Before a step that the learned part makes: its records become those of the corrected states, which it did not predict.
    pub(super) fn start_from_corrected(&mut self, shared: &Published) -> Result<()> {
        let Some(corrected) = &self.corrected else {
            return Ok(());
        };
        let engine = match &mut self.engine {
            Engine::Reduced(engine) => engine,
            // A network reads the field itself.
            Engine::Upt(_) => return Ok(()),
        };
        let compute = self.machine.compute();
        if self.counters.was_corrected[0] {
            engine.swing_from(
                compute,
                &corrected.basis_starts,
                [&shared.last.field, &shared.before.field],
                &corrected.solver.motion.velocity,
                self.model.manifest.dt_s as f32,
            )?;
        }
        engine.adopt_fields(
            compute,
            &corrected.basis_starts,
            [
                self.counters.was_corrected[0].then_some(shared.last.field.as_slice()),
                self.counters.was_corrected[1].then_some(shared.before.field.as_slice()),
            ],
        )
    }

    /// Takes what corrections remembered in another state.
    pub(super) fn put_history(&mut self, history: Option<History>) -> Result<()> {
        let (Some(corrected), Some(history), Some(prior)) =
            (&mut self.corrected, history, &self.model.prior)
        else {
            return Ok(());
        };
        let context = SolverContext {
            isa: self.machine.isa,
            pool: &self.machine.pool,
            prior,
            corrections: self.model.corrections()?,
            time_step: &corrected.time_step,
            held: Core::held_of(&self.loads, self.model.corrections()?),
        };
        corrected.solver.restore(context, &history)
    }

    /// Whether every node is decoded in each step, and kept.
    pub(super) fn keeps_all_nodes(&self) -> bool {
        self.corrected.is_some() || self.engine.keeps_all_nodes()
    }
}
