//! Corrections inside a step: after the prediction, before the guard.
//!
//! A prediction is corrected where there is something that the model has not learned: contact,
//! loads, or a body that swings after them. The solver then solves the equation of motion of the
//! elements for the new state, from the prediction or from the modes' own motion. In the other
//! steps the learned part stands, and the solver only follows it: velocity and inertia have to be
//! those of the field, or the next correction would start with a jolt.

use crate::clock::Instant;
use std::sync::RwLock;

use super::corrected::Corrector;
use super::engine::Engine;
use super::maker::StepMaker;
use super::published::Published;
use super::published::lock_read;
use super::timing::Stopwatch;
use crate::corrections::Input;
use crate::error::Result;
use crate::stats::SceneStats;

impl StepMaker {
    /// Corrects `next` while there is contact; otherwise lets the velocities follow it.
    pub(super) fn correct(
        &mut self,
        published: &RwLock<Published>,
        given: Option<&[f32]>,
        start: Instant,
        stats: &mut SceneStats,
    ) -> Result<()> {
        // Without a learned part the step is the modes' own motion, and corrections make all of it.
        let learns = self.learns();
        let Some(corrected) = &mut self.corrected else {
            return Ok(());
        };
        let (enough, alone) = (corrected.enough(start), corrected.alone());
        let Corrector {
            solver,
            parts,
            time_step,
            own_pace,
            ..
        } = &mut **corrected;
        let context = self.loads.context(&self.body, &self.machine, time_step)?;
        let Some(context) = context else {
            return Ok(());
        };
        let mut watch = Stopwatch::start();
        let _span = tracing::trace_span!("corrections").entered();
        let states = &mut self.states;
        // Here contact is that of nodes that the host prescribes; what tools touch is made by
        // `drive`.
        let touched = !states.incoming.is_empty();
        // The learned part takes over some steps after a release; with a length of step of the scene's own it never does.
        states.next_corrected = touched || (!learns && !alone) || self.loads.loaded;
        let load = self.loads.load();
        // A length of step of the scene's own may be short enough to need no substeps. Under a load that acts everywhere iterations are worth more.
        let in_parts = (parts.free_substeps > 1 || !*own_pace) && load.is_none();
        let shared = lock_read(published);
        let input = Input {
            rest: &self.body.mesh.positions,
            contact: &states.incoming,
            // A host's displacement is a new start, at rest: the state before is the same field,
            // which makes the velocity zero.
            last: given.unwrap_or(&shared.last.field),
            before: given.unwrap_or(&shared.before.field),
            still: given.is_some(),
            load,
            way: [0.0, 1.0],
            enough: match load {
                // What the whole body does settles later than an iteration's own step says.
                // Whole modes know what it does.
                Some(_) if !context.corrections.has_whole_modes() => enough.all(),
                // Nor do they say what is out of balance about a group that is led or let go.
                _ if self.loads.leads() => enough.all(),
                _ => enough,
            },
        };
        // What has been let go springs back within less than a step of 50 ms.
        let springs = context.held.let_go != 0 && context.held.stands(input.last);
        let in_parts = in_parts || (springs && parts.most_substeps > 1);
        let next = &mut states.next.field;
        let report = if touched {
            Some(solver.correct(context, &input, next)?)
        } else if learns {
            // The learned part has made the field: velocities and inertia are all that is left to
            // do.
            solver.follow(context, &input, next)?;
            None
        } else {
            if in_parts {
                parts.be_shorter(context, &self.body.model)?;
            }
            let limit_mm = parts.limit_mm;
            let substepper = parts.substepper.as_deref_mut().filter(|_| in_parts);
            Some(match (springs, substepper) {
                (true, Some(own)) => {
                    own.swing_where_it_helps(solver, context, &input, limit_mm, next)?
                }
                (_, own) => solver.swing(context, &input, own, next)?,
            })
        };
        if let Some(report) = report {
            corrected.report_to(&report, stats);
        }
        drop(shared);
        stats.timing.corrections_ms = watch.lap();
        Ok(())
    }

    /// The reaction of the last published state; false where it was not corrected.
    ///
    /// In `out [m,3]`, mN, one row for each contact node of the last step in the host's order.
    pub(super) fn corrected_reaction(&self, out: &mut [f32]) -> bool {
        let Some(corrected) = &self.corrected else {
            return false;
        };
        // Under tools the forces are known from the contact itself.
        if self.tools.pushes() {
            self.tools.loads_at_contacts(&self.states, out);
            return true;
        }
        // A state that fell back has inverted elements, and what they push with means nothing.
        let motion = &corrected.solver.motion;
        let sound = motion.min_det >= crate::corrections::SMALLEST_DET
            && motion.reaction.len() == out.len();
        if self.states.contact.is_empty() || !sound {
            return false;
        }
        corrected.solver.reaction(&self.states.contact, out);
        true
    }

    /// Before a step that the learned part makes: its records become those of the corrected states, which it did not predict.
    /// `was_corrected` is of the last state and of the one before it.
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
        let [last_corrected, before_corrected] = self.states.counters.was_corrected;
        if last_corrected {
            engine.swing_from(
                compute,
                &corrected.basis_starts,
                [&shared.last.field, &shared.before.field],
                &corrected.solver.motion.velocity,
                self.body.model.manifest.dt_s as f32,
            )?;
        }
        engine.adopt_fields(
            compute,
            &corrected.basis_starts,
            [
                last_corrected.then_some(shared.last.field.as_slice()),
                before_corrected.then_some(shared.before.field.as_slice()),
            ],
        )
    }
}
