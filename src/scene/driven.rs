//! A step that tools drive: where the bundle has corrections their contact is solved inside of them; with `corrections = 0` once, on
//! the linear response.

use crate::clock::Instant;
use std::sync::{Arc, RwLock};

use super::core::{Core, lock_read, lock_write};
use super::corrected::Corrector;
use super::published::Published;
use super::timing::Stopwatch;
use super::{Contact, StepInput};
use crate::contact::{Compliance, ContactProblem, State, Tool};
use crate::corrections::{Input, SolverContext};
use crate::error::{Error, Result};
use crate::features::Proven;
use crate::stats::{SceneStats, flag};

const WHAT: &str = "the contact of instruments";
/// Free tissue may come this deep into a tool before the step is made with contact, mm.
const INTRUSION_MM: f32 = 0.02;
/// Tissue this deep inside of a tool raises [`flag::DEEP`], mm.
const DEEP_MM: f32 = 1.0;
/// A contact solve that leaves more than this raises [`flag::UNSOLVED`], mm.
const UNSOLVED_MM: f32 = 0.01;

impl Core {
    /// Takes the tools and ties of a step; says whether one is near enough to touch the tissue, or there are ties.
    pub(super) fn update_tools(
        &mut self,
        published: &RwLock<Published>,
        input: &StepInput<'_>,
    ) -> Result<bool> {
        let _span = tracing::trace_span!("search").entered();
        self.driven = match input.contact {
            Contact::Tools(_) => true,
            Contact::None => self.counters.driven,
            Contact::Dense(_) | Contact::Sparse { .. } => false,
        };
        let ties = input.loads.ties;
        let tools: &[Tool] = match input.contact {
            Contact::Tools(tools) => tools,
            // The elements make each step of a cut body, and of one with ties, as if tools were there.
            Contact::None if self.cut.is_some() || !ties.is_empty() => &[],
            _ => {
                if let Some(problem) = &mut self.problem {
                    problem.forget_tools();
                }
                return Ok(false);
            }
        };
        self.check_ties(ties)?;
        if self.model.prior.is_none() {
            return Err(Error::Unsupported(
                "instruments: the bundle has no linear response to solve their contact with; pass the nodes that upt_scene_contacts_from_instruments finds".into(),
            ));
        }
        let mut problem = match self.problem.take() {
            Some(problem) => problem,
            None => {
                let make = || ContactProblem::new(self.model.samples()?, Arc::clone(&self.mesh));
                Proven::new(make, WHAT)?
            }
        };
        let placed = self.place_ties(input, tools.len());
        let shared = lock_read(published);
        let (rest, start) = (&self.mesh.positions, &shared.last.field);
        let begun = placed.and_then(|()| problem.begin(tools, &self.placed_ties, rest, start));
        let state = State {
            rest,
            u: start,
            start,
        };
        let near = begun.and_then(|()| problem.is_near(state));
        self.problem = Some(problem);
        near
    }

    /// Makes `next` where tools drive the step; false where it is free.
    pub(super) fn drive(
        &mut self,
        published: &RwLock<Published>,
        near: bool,
        start: Instant,
        stats: &mut SceneStats,
    ) -> Result<bool> {
        self.next_corrected = false;
        let Some(mut problem) = self.problem.take() else {
            return Ok(false);
        };
        let is_prescribed = !self.incoming.is_empty();
        let is_free = is_prescribed || (problem.tools().is_empty() && !near && self.cut.is_none());
        let result = match is_free {
            true => Ok(false),
            false if self.corrected.is_some() => {
                self.drive_corrected(published, &mut problem, near, start, stats)
            }
            false => self.drive_linear(published, &mut problem, near, stats),
        };
        self.problem = Some(problem);
        result
    }

    fn drive_corrected(
        &mut self,
        published: &RwLock<Published>,
        problem: &mut ContactProblem,
        near: bool,
        start: Instant,
        stats: &mut SceneStats,
    ) -> Result<bool> {
        if self.cut.is_some() || problem.has_ties() {
            self.load(published, problem, start, stats)?;
            return Ok(true);
        }
        if near && (problem.had_forces() || problem.has_grasp()) {
            let before = *stats;
            self.load(published, problem, start, stats)?;
            if problem.has_forces() {
                return Ok(true);
            }
            // No tool pushes in that state: drop it together with its statistics.
            *stats = before;
        }
        // Nothing pushes: the model's own free motion, unless that runs into a tool.
        self.predict_and_decode(published, None, self.learns(), stats)?;
        self.correct(published, None, start, stats)?;
        let is_penetrated = {
            let shared = lock_read(published);
            let state = State {
                rest: &self.mesh.positions,
                u: &self.next.field,
                start: &shared.last.field,
            };
            problem.is_penetrated(state, INTRUSION_MM)
        };
        if is_penetrated {
            self.load(published, problem, start, stats)?;
        } else {
            self.finish_tools(published, problem, stats);
        }
        Ok(true)
    }

    /// The corrected step under the tools' loads.
    fn load(
        &mut self,
        published: &RwLock<Published>,
        problem: &mut ContactProblem,
        start: Instant,
        stats: &mut SceneStats,
    ) -> Result<()> {
        let (Some(corrected), Some(prior)) = (&mut self.corrected, &self.model.prior) else {
            return Ok(());
        };
        let mut watch = Stopwatch::start();
        let span = tracing::trace_span!("corrections").entered();
        let time_step = Arc::clone(&corrected.time_step);
        let context = SolverContext {
            isa: self.machine.isa,
            pool: &self.machine.pool,
            prior,
            corrections: self.model.corrections()?,
            time_step: &time_step,
            held: Core::held_of(&self.loads, self.model.corrections()?),
        };
        corrected.be_ready(context, &self.model)?;
        let shared = lock_read(published);
        let rest = &self.mesh.positions;
        let input = Input {
            rest,
            contact: &self.incoming,
            last: &shared.last.field,
            before: &shared.before.field,
            still: false,
            load: self.loads.as_ref().and_then(|loads| loads.load()),
            way: [0.0, 1.0],
            enough: corrected.enough(start),
        };
        let next = &mut self.next.field;
        let Corrector {
            solver,
            substeps,
            substepper,
            ..
        } = corrected;
        // A support group ends where it is led in one step.
        let leads = self
            .loads
            .as_ref()
            .is_some_and(|loads| loads.held.is_some());
        let parts = (substeps.as_deref_mut().zip(substepper.as_deref_mut())).filter(|_| !leads);
        let report = solver.drive(context, &input, problem, parts, next)?;
        corrected.report_to(&report, stats);
        drop(shared);
        drop(span);
        self.next_corrected = true;
        Self::report_depth(problem, stats);
        // The same contact as a collision field would give it: the envelope check, the engine's record and the host's list of
        // contacts read it there.
        self.incoming
            .take_nodes(problem.touched(&self.held), &self.next.field);
        let made_of = report.substeps.max(1) as f32;
        self.used = self
            .covers_tools()
            .then(|| problem.used(self.step_s() as f32 / made_of));
        stats.corrections_ms = watch.lap();
        self.predict_and_decode(published, None, false, stats)
    }

    /// Whether the steps get as many corrections as the bundle's limits for tools were measured with.
    fn covers_tools(&self) -> bool {
        let needed = self
            .model
            .manifest
            .envelope
            .tools
            .map(|tools| tools.corrections);
        let corrected = self.corrected.as_ref();
        needed.is_some_and(|needed| corrected.is_some_and(|solver| solver.most() >= needed))
    }

    /// Contact once on the linear response, as a collision field for the model.
    ///
    /// Half of the last forces stay in the state and half are solved for again: prescribed in full, two tools diverge.
    fn drive_linear(
        &mut self,
        published: &RwLock<Published>,
        problem: &mut ContactProblem,
        near: bool,
        stats: &mut SceneStats,
    ) -> Result<bool> {
        let Some(prior) = &self.model.prior else {
            return Ok(false);
        };
        if near {
            let mut watch = Stopwatch::start();
            let compliance = Compliance::at_rest(prior, &self.held, None);
            let shared = lock_read(published);
            let state = State {
                rest: &self.mesh.positions,
                u: &shared.last.field,
                start: &shared.last.field,
            };
            let (nodes, vectors) = problem.prescribe(compliance, state)?;
            let count = self.mesh.node_count();
            self.incoming.take_sparse(nodes, vectors, count)?;
            stats.check_ms += watch.lap();
        }
        self.predict_and_decode(published, None, true, stats)?;
        self.finish_tools(published, problem, stats);
        Ok(true)
    }

    fn finish_tools(
        &mut self,
        published: &RwLock<Published>,
        problem: &mut ContactProblem,
        stats: &mut SceneStats,
    ) {
        let shared = lock_read(published);
        problem.finish(State {
            rest: &self.mesh.positions,
            u: &self.next.field,
            start: &shared.last.field,
        });
        Self::report_depth(problem, stats);
    }

    /// Clears the tools' forces after the guard replaced the state that they made. Nothing pushes the new state, and it may lie inside a
    /// tool: the depth is measured again.
    pub(super) fn release_tools(&mut self, published: &RwLock<Published>, stats: &mut SceneStats) {
        if let Some(mut problem) = self.problem.take() {
            problem.clear_forces();
            self.finish_tools(published, &mut problem, stats);
            self.problem = Some(problem);
        }
    }

    fn report_depth(problem: &ContactProblem, stats: &mut SceneStats) {
        stats.contact_ms = problem.spent_ms();
        let readings = problem.next.tools.iter().map(|held| held.reading);
        if readings
            .clone()
            .any(|reading| reading.residual_mm > UNSOLVED_MM)
        {
            stats.flags |= flag::UNSOLVED;
        }
        let deepest = readings.map(|r| r.penetration_mm).fold(0.0, f32::max);
        if deepest > DEEP_MM || problem.lay_in_tissue {
            stats.flags |= flag::DEEP;
        }
    }

    /// Publishes the tools of a step in which the scene sleeps: their poses are remembered, and none touches the tissue.
    pub(super) fn commit_untouched_tools(&mut self, published: &RwLock<Published>) {
        if let Some(problem) = &mut self.problem {
            problem.clear_forces();
            problem.commit();
        }
        self.publish_tools(&mut lock_write(published));
    }

    /// The tools' readings and forces become readable.
    pub(super) fn publish_tools(&self, shared: &mut Published) {
        match &self.problem {
            Some(problem) => {
                problem.report(&mut shared.tools, &self.mesh.positions, &shared.last.field)
            }
            None => shared.tools.clear(),
        }
    }

    /// The tools' loads at the contact nodes, in the host's order: what the tissue does to them, mN.
    pub(super) fn loads_at_contacts(&self, problem: &ContactProblem, out: &mut [f32]) -> bool {
        out.fill(0.0);
        problem.each_push(|node, force| {
            if let Ok(at) = self.contact.nodes.binary_search(&node) {
                let at = 3 * self.contact.order[at] as usize;
                for (sum, force) in out[at..at + 3].iter_mut().zip(force.to_array()) {
                    *sum -= force;
                }
            }
        });
        true
    }
}
