//! A step that tools drive: where the bundle has corrections their contact is solved inside of them; with `corrections = 0` once, on
//! the linear response.

use crate::clock::Instant;
use std::sync::RwLock;

use super::corrected::Corrector;
use super::maker::StepMaker;
use super::published::Published;
use super::published::lock_read;
use super::timing::Stopwatch;
use crate::contact::{Compliance, State};
use crate::corrections::Input;
use crate::error::Result;
use crate::stats::SceneStats;

/// Free tissue may come this deep into a tool before the step is made with contact, mm.
const INTRUSION_MM: f32 = 0.02;

impl StepMaker {
    /// Makes `next` where tools drive the step; false where it is free.
    pub(super) fn drive(
        &mut self,
        published: &RwLock<Published>,
        near: bool,
        start: Instant,
        stats: &mut SceneStats,
    ) -> Result<bool> {
        self.states.next_corrected = false;
        let Some(problem) = &self.tools.problem else {
            return Ok(false);
        };
        // A host that gives nodes in contact drives by them, whatever tools it had before.
        let is_prescribed = !self.states.incoming.is_empty();
        let is_cut = self.body.cut.is_some();
        if is_prescribed || (problem.ways.tools.is_empty() && !near && !is_cut) {
            return Ok(false);
        }
        // Without corrections there is one solve on the linear response at rest, and the model answers to it as to a collision field.
        if self.corrected.is_none() {
            return self.drive_linear(published, near, stats);
        }
        // A cut body has no learned motion, and ties pull without touching: each of their steps is
        // made by the elements.
        if is_cut || problem.tied.has_any() {
            self.load(published, start, stats)?;
            return Ok(true);
        }
        if near && (problem.past.has_forces() || problem.next.has_grasp()) {
            // What a step reports must be of the state that it publishes.
            let before = *stats;
            self.load(published, start, stats)?;
            let tools = &self.tools.problem;
            if tools
                .as_ref()
                .is_some_and(|problem| problem.next.has_forces())
            {
                return Ok(true);
            }
            // No tool pushes in that state: drop it together with its statistics.
            *stats = before;
        }
        // Nothing pushes: the model's own free motion, unless that runs into a tool.
        self.predict_and_decode(published, None, self.learns(), stats)?;
        self.correct(published, None, start, stats)?;
        // The free motion is the cheaper step and right in most cases; only where it ends inside of
        // a tool is it thrown away and made again with contact.
        let is_penetrated = {
            let shared = lock_read(published);
            let state = State {
                rest: &self.body.mesh.positions,
                u: &self.states.next.field,
                start: &shared.last.field,
            };
            let tools = &mut self.tools.problem;
            tools
                .as_mut()
                .is_some_and(|problem| problem.is_penetrated(state, INTRUSION_MM))
        };
        match is_penetrated {
            true => self.load(published, start, stats)?,
            false => self.finish_tools(published, stats),
        }
        Ok(true)
    }

    /// The corrected step under the tools' loads.
    fn load(
        &mut self,
        published: &RwLock<Published>,
        start: Instant,
        stats: &mut SceneStats,
    ) -> Result<()> {
        let (Some(corrected), Some(problem)) = (&mut self.corrected, &mut self.tools.problem)
        else {
            return Ok(());
        };
        let enough = corrected.enough(start);
        let Corrector {
            solver,
            parts,
            time_step,
            ..
        } = &mut **corrected;
        let context = self.loads.context(&self.body, &self.machine, time_step)?;
        let Some(context) = context else {
            return Ok(());
        };
        let mut watch = Stopwatch::start();
        let span = tracing::trace_span!("corrections").entered();
        // Room for shorter steps is asked for before the step, so that one that needs them cannot
        // fail half way for want of it.
        parts.be_ready(context, &self.body.model)?;
        let shared = lock_read(published);
        let states = &mut self.states;
        let input = Input {
            rest: &self.body.mesh.positions,
            contact: &states.incoming,
            last: &shared.last.field,
            before: &shared.before.field,
            still: false,
            load: self.loads.load(),
            way: [0.0, 1.0],
            // What an iteration near the tools moves does not say what is out of balance about a group that is led or let go.
            enough: match self.loads.leads() {
                true => enough.all(),
                false => enough,
            },
        };
        // A support group ends where it is led in one step; what has been let go springs back, and more so than a step of 50 ms can follow.
        let parts = (parts.substeps.as_deref_mut()).zip(parts.substepper.as_deref_mut());
        let parts = parts.filter(|_| !self.loads.leads() || context.held.stands(input.last));
        let report = solver.drive(context, &input, problem, parts, &mut states.next.field)?;
        corrected.report_to(&report, stats);
        drop(shared);
        drop(span);
        states.next_corrected = true;
        // The same contact as a collision field would give it: the envelope check, the engine's record and the host's list of
        // contacts read it there.
        let touched = problem.touched(&self.body.held);
        states.incoming.take_nodes(touched, &states.next.field);
        // A substep is a step to the contact: speeds are those of its length.
        let made_of = report.substeps.max(1) as f32;
        let step_s = self.body.step_s() as f32 / made_of;
        // The bundle's limits for tools hold for steps with as many corrections as they were
        // measured with; with fewer they say nothing.
        let covered = corrected.covers_tools(&self.body.model);
        self.tools.used = covered.then(|| problem.ways.used(&problem.next, step_s));
        self.tools.report_depth(stats);
        stats.timing.corrections_ms = watch.lap();
        self.predict_and_decode(published, None, false, stats)
    }

    /// Contact once on the linear response, as a collision field for the model.
    ///
    /// Half of the last forces stay in the state and half are solved for again: prescribed in full, two tools diverge.
    fn drive_linear(
        &mut self,
        published: &RwLock<Published>,
        near: bool,
        stats: &mut SceneStats,
    ) -> Result<bool> {
        let (Some(prior), Some(problem)) = (&self.body.model.prior, &mut self.tools.problem) else {
            return Ok(false);
        };
        if near {
            let mut watch = Stopwatch::start();
            // The tissue's answer to a force at a sample, from the linear response: exact for small
            // motions, and the same in each step.
            let compliance = Compliance::at_rest(prior, &self.body.held, None);
            let shared = lock_read(published);
            let state = State {
                rest: &self.body.mesh.positions,
                u: &shared.last.field,
                start: &shared.last.field,
            };
            let (nodes, vectors) = problem.prescribe(compliance, state)?;
            let count = self.body.mesh.node_count();
            self.states.incoming.take_sparse(nodes, vectors, count)?;
            stats.timing.check_ms += watch.lap();
        }
        self.predict_and_decode(published, None, true, stats)?;
        self.finish_tools(published, stats);
        Ok(true)
    }

    /// What the tools feel in `next`, a state that their forces have not made.
    fn finish_tools(&mut self, published: &RwLock<Published>, stats: &mut SceneStats) {
        let shared = lock_read(published);
        let fields = (&*self.states.next.field, &*shared.last.field);
        self.tools.finish(&self.body, fields, stats);
    }

    /// Clears the tools' forces after the guard replaced the state that they made. Nothing pushes the new state, and it may lie inside a
    /// tool: the depth is measured again.
    pub(super) fn release_tools(&mut self, published: &RwLock<Published>, stats: &mut SceneStats) {
        self.tools.clear_forces();
        self.finish_tools(published, stats);
    }
}
