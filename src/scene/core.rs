//! The step itself: check, predict, decode, boundary conditions, guard, publish (design: the paper's Eq. 2).
//!
//! A step has two halves. Up to the guard it works on `states.next` and other scratch, and may fail
//! at any place; from `publish` on it cannot fail, because all room was asked for in
//! `fit_published`. So a host sees a step whole or not at all. Readers on other threads take the
//! lock of what is published for as long as a copy takes; the step writes only while frames change
//! places and its numbers are told.
//!
//! REQ-033: Steps allocate nothing in steady state.

use crate::clock::Instant;
use std::sync::RwLock;

use tracing::Span;
use tracing::field::Empty;

use super::StepInput;
use super::hands::Hands;
use super::maker::StepMaker;
use super::published::{Published, View, lock_read, lock_write};
use super::timing::Stopwatch;
use crate::error::Result;
use crate::field::check_displacement;
use crate::guard;
use crate::kernels::FlushToZero;
use crate::memory::HeldBytes;
use crate::output::Output;
use crate::stats::SceneStats;

/// Everything of a scene that only its stepping thread touches: what makes states, and the hands that are told of them.
pub struct Core {
    /// What makes the next state, with all scratch of a step.
    pub(super) maker: StepMaker,
    /// Haptic loops that get a model of the tissue near their tool after each step.
    pub(super) hands: Hands,
}

impl Core {
    /// Without hands.
    pub(super) fn new(maker: StepMaker) -> Core {
        Core {
            maker,
            hands: Hands::default(),
        }
    }

    /// A blank account of a step.
    pub(super) fn blank_stats(&self) -> SceneStats {
        SceneStats {
            memory_bytes: self.memory_bytes() as u64,
            ..self.maker.blank_stats()
        }
    }

    /// One step. On error nothing that a caller can see has changed but the statistics of a guard refusal.
    pub(super) fn step(
        &mut self,
        published: &RwLock<Published>,
        input: StepInput<'_>,
        out: Option<Output<'_, f32>>,
    ) -> Result<()> {
        // For as long as this call: the host's own code keeps its mode.
        let _mode = FlushToZero::of(self.maker.machine.isa);
        let start = Instant::now();
        let step_count = self.maker.states.counters.step_count;
        let span = new_span(step_count).entered();
        let mut stats = self.blank_stats();
        // Asked first: a step that could not be given back should not be made.
        if let Some(out) = &out {
            lock_read(published).check_len(View::Region, out.len())?;
        }
        let taken = self.maker.take(published, &input, &mut stats)?;
        let was_given = taken.given.is_some();
        let states = &self.maker.states;
        // A sleeping scene costs nothing until something of a step asks for tissue: contact, a tool near it, loads, a host's own state.
        let is_idle = states.incoming.is_empty() && !was_given && !taken.near && !taken.has_load;
        if states.counters.sleeping && is_idle {
            self.fit_published(published)?;
            self.maker.states.counters.time_s = input.time_s;
            self.publish_rest(published);
            self.maker.loads.commit();
        } else {
            // May fail: then `states.next` is left as scratch, and all that is published and remembered is that of the last step.
            let replaced = self.maker.make(published, &taken, start, &mut stats)?;
            self.fit_published(published)?;
            self.maker.states.counters.time_s = input.time_s;
            self.publish(published, was_given, replaced, &stats);
        }
        let (tools, loads) = (&self.maker.tools, &self.maker.loads);
        let counters = &mut self.maker.states.counters;
        counters.driven = tools.driven;
        counters.loaded = loads.loaded;
        // Also a step of a sleeping scene counts: the host's clock goes on.
        counters.step_count += 1;
        stats.step_count = counters.step_count;
        stats.sleeping = counters.sleeping;
        stats.max_displacement_mm = counters.max_displacement;
        stats.contact_count = self.maker.states.contact.len() as u64;
        // The poses that the contact was made for are as old as the step took: a hand reckons with it.
        self.hands.took_s = start.elapsed().as_secs_f64();
        self.hands.publish(&self.maker, published);
        if let Some(out) = out {
            lock_read(published).read(View::Region, out)?;
        }
        // The flags belong to the step that has just been counted.
        self.maker.watch.tell(stats.step_count, &stats);
        record(&span, &stats);
        stats.timing.step_ms = start.elapsed().as_secs_f64() * 1e3;
        lock_write(published).stats = stats;
        Ok(())
    }

    /// Bytes of the scene's buffers, those of the published states included.
    pub(super) fn memory_bytes(&self) -> usize {
        let maker = &self.maker;
        let published = if maker.options.cubic_sampling { 3 } else { 2 };
        // A node's number and three floats of its vector, for as many contacts as there are nodes.
        let contacts_in_the_hosts_order = 16 * maker.body.mesh.node_count();
        maker.memory_bytes()
            + published * maker.states.next.held_bytes()
            + contacts_in_the_hosts_order
            + self.hands.memory_bytes()
    }
}

/// The span of a step; what comes out of it is filled in by [`record`], and stays empty where the step fails.
fn new_span(step: u64) -> Span {
    tracing::debug_span!(
        "step",
        step,
        contacts = Empty,
        corrections = Empty,
        error_mm = Empty,
        flags = Empty
    )
}

/// What a profiler shows beside the time of a step.
fn record(span: &Span, stats: &SceneStats) {
    span.record("contacts", stats.contact_count);
    span.record("corrections", stats.corrections);
    span.record("error_mm", stats.error_mm);
    span.record("flags", stats.flags);
}

/// What a step has taken of its input.
pub(super) struct Taken<'a> {
    /// The host's displacement `[K,3]`, where it is not the scene's own last state.
    pub given: Option<&'a [f32]>,
    /// A tool is near enough to touch the tissue, or there are ties.
    pub near: bool,
    /// Loads act at the start of the step or at its end.
    pub has_load: bool,
}

impl StepMaker {
    /// Checks the input of a step and takes contact, loads, tools and ties.
    ///
    /// # Errors
    /// Of the input; nothing that is published has changed.
    fn take<'a>(
        &mut self,
        published: &RwLock<Published>,
        input: &StepInput<'a>,
        stats: &mut SceneStats,
    ) -> Result<Taken<'a>> {
        let mut watch = Stopwatch::start();
        let body = &self.body;
        let count = body.mesh.node_count();
        input.check()?;
        body.check_cut(input)?;
        // A dense field has the intact mesh's nodes; a list may name the copies that cuts have made, too.
        let nodes = [body.intact_mesh().node_count(), count];
        input.contact.gather(&mut self.states.incoming, nodes)?;
        let shared = lock_read(published);
        let last = &*shared.last.field;
        let given = match input.displacement {
            Some(field) => {
                check_displacement(field, count)?;
                (!self.shown.is_equal(&body.mesh, last, field)).then_some(field)
            }
            None => None,
        };
        let corrected = self.corrected.as_ref();
        let velocity = corrected.map(|own| &*own.solver.motion.velocity);
        let moves = (last, velocity);
        // Loads before tools: a scene that refuses them has not yet forgotten the tools of the last step.
        let acts = (self.loads).take(body, &self.machine, &input.loads, moves)?;
        stats.timing.check_ms = watch.lap();
        let was_driven = self.states.counters.driven;
        let driven = (was_driven, self.corrected.is_some());
        let near = self.tools.update(body, last, input, driven)?;
        drop(shared);
        let has_load = acts || !input.loads.ties.is_empty();
        self.loads.loaded = has_load || (self.states.counters.loaded && self.is_swung());
        Ok(Taken {
            given,
            near,
            has_load,
        })
    }

    /// Makes `next`; says whether the guard has put another state in its place.
    ///
    /// # Errors
    /// [`crate::Error::Guard`] where it refused the state and the policy keeps the last one, and what solving says.
    fn make(
        &mut self,
        published: &RwLock<Published>,
        taken: &Taken<'_>,
        start: Instant,
        stats: &mut SceneStats,
    ) -> Result<bool> {
        let given = taken.given;
        // Tools make the state by the elements; where none touches, the model makes it, and the elements correct what is prescribed.
        if !self.drive(published, taken.near, start, stats)? {
            let learned =
                self.learns() && (self.corrected.is_none() || self.states.incoming.is_empty());
            self.predict_and_decode(published, given, learned, stats)?;
            self.correct(published, given, start, stats)?;
        }
        [stats.timing.upload_ms, stats.timing.download_ms] = self.engine.transfer_ms();
        let verdict = self.judge(stats)?;
        let replaced = verdict & guard::REFUSED != 0
            && self.refuse(published, verdict, given.is_some(), stats)?;
        if replaced {
            self.release_tools(published, stats);
        }
        Ok(replaced)
    }
}
