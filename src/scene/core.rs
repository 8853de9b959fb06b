//! The step itself: check, predict, decode, boundary conditions, guard, publish (design: the paper's Eq. 2).
//!
//! REQ-033: Steps allocate nothing in steady state.

use crate::clock::Instant;
use std::sync::{Arc, PoisonError, RwLock};

use super::StepInput;
use super::corrected::Corrector;
use super::counters::Counters;
use super::cut_state::CutState;
use super::engine::Engine;
use super::inputs::{Decode, Inputs, Which};
use super::inversion::ContactElements;
use super::load_state::LoadState;
use super::plan::NodePlan;
use super::points::AttachedPoints;
use super::published::{Frame, Published, View};
use super::timing::Stopwatch;
use crate::bundle::Mesh;
use crate::contact::ToolUse;
use crate::contact::{ContactProblem, Placed};
use crate::envelope::EnvelopeCheck;
use crate::error::Result;
use crate::features::{Instruments, Proven};
use crate::field::{ContactSet, check_displacement};
use crate::guard;
use crate::kernels::{FlushToZero, Isa, Machine, Pool};
use crate::memory::{self, HeldBytes};
use crate::model::Model;
use crate::options::SceneOptions;
use crate::output::Output;
use crate::stats::{SceneStats, flag};

pub(super) const SCENE: &str = "a scene's states";

/// Everything of a scene that only its stepping thread touches.
#[derive(HeldBytes)]
pub struct Core {
    #[held(skip)]
    pub(super) model: Arc<Model>,
    #[held(skip)]
    pub(super) mesh: Arc<Mesh>,
    #[held(skip)]
    pub(super) options: SceneOptions,
    #[held(skip)]
    pub(super) machine: Machine,
    pub(super) engine: Engine,
    #[held(skip)]
    pub(super) corrected: Option<Corrector>,
    /// What cuts have made of the body; none while it is intact.
    pub(super) cut: Option<Box<CutState>>,
    /// Contact of tools, from the first step that has one.
    pub(super) problem: Option<Proven<Instruments, ContactProblem>>,
    /// From the first step that has loads.
    pub(super) loads: Option<Box<LoadState>>,
    /// Of the step being made.
    pub(super) placed_ties: Vec<Placed>,
    /// Whether loads act in the step being made, or did and the body has not come back from where they took it.
    pub(super) loaded: bool,
    /// The tools of the step being made, where the bundle's limits for tools say something about it.
    #[held(skip)]
    pub(super) used: Option<ToolUse>,
    /// One for each haptics object of the scene. Each gets the contact of every published step.
    #[held(skip)]
    pub(super) hands: Vec<crate::haptics::publish::Link>,
    /// Wall time of the last step, s: a hand takes it as the age of what it gets.
    pub(super) took_s: f64,
    /// Whether the state being made comes from the corrections, and not from the learned part alone.
    pub(super) next_corrected: bool,
    /// Whether tools drive the step being made, or drove the last one before it that anything drove. Their contact is then in
    /// `problem`, and `incoming` is filled from it.
    pub(super) driven: bool,
    /// By node: the boundary condition holds it, so its displacement is zero whatever the contact says.
    pub(super) held: Vec<bool>,
    /// The nodes that a step decodes: all, or those of the region and of the attached points' tetrahedra.
    pub(super) plan: NodePlan,
    #[held(own)]
    pub(super) points: Arc<AttachedPoints>,
    /// Tetrahedra whose four nodes are decoded, which the guard checks for inversion; empty without `check_inversion`.
    pub(super) planned_tets: Vec<u32>,
    pub(super) contact_elements: Option<ContactElements>,
    /// Contact of the step being made; it becomes `contact` when that step is published, and is scratch between steps.
    pub(super) incoming: ContactSet,
    /// Contact of the last published step, and of the one before it.
    pub(super) contact: ContactSet,
    pub(super) contact_before: ContactSet,
    #[held(skip)]
    pub(super) counters: Counters,
    /// Flags of the last step, which the log has.
    pub(super) logged_flags: u32,
    pub(super) envelope: EnvelopeCheck,
    /// The state being made. It is valid from the end of the prediction or the contact solve until it is published, when it
    /// changes places with the oldest published frame; a refused step leaves it behind, and the next one overwrites it.
    pub(super) next: Frame,
}

/// Parts made by [`super::build`].
pub struct CoreParts {
    pub model: Arc<Model>,
    pub mesh: Arc<Mesh>,
    pub options: SceneOptions,
    pub isa: Isa,
    pub pool: Pool,
    pub engine: Engine,
    pub corrected: Option<Corrector>,
    /// None: it is made here.
    pub envelope: Option<EnvelopeCheck>,
}

pub(super) fn lock_read(
    published: &RwLock<Published>,
) -> std::sync::RwLockReadGuard<'_, Published> {
    published.read().unwrap_or_else(PoisonError::into_inner)
}

pub(super) fn lock_write(
    published: &RwLock<Published>,
) -> std::sync::RwLockWriteGuard<'_, Published> {
    published.write().unwrap_or_else(PoisonError::into_inner)
}

impl Core {
    pub(super) fn new(parts: CoreParts) -> Result<Core> {
        let count = parts.mesh.node_count();
        let mut held = memory::filled(count, false, SCENE)?;
        for &node in &parts.mesh.held_nodes {
            held[node as usize] = true;
        }
        let plan = NodePlan::all(count, parts.engine.planned_prior())?;
        let contact = ContactSet::with_capacity(count)?;
        Ok(Core {
            envelope: match parts.envelope {
                Some(envelope) => envelope,
                None => EnvelopeCheck::new(&parts.mesh)?,
            },
            planned_tets: if parts.options.check_inversion {
                memory::copied(&parts.mesh.tets, SCENE)?
            } else {
                Vec::new()
            },
            contact_elements: None,
            held,
            plan,
            points: Arc::default(),
            incoming: ContactSet::with_capacity(count)?,
            contact_before: ContactSet::with_capacity(count)?,
            contact,
            counters: Counters::REST,
            logged_flags: 0,
            next: Frame::rest(count)?,
            model: parts.model,
            mesh: parts.mesh,
            options: parts.options,
            machine: Machine {
                isa: parts.isa,
                pool: parts.pool,
            },
            engine: parts.engine,
            corrected: parts.corrected,
            cut: None,
            problem: None,
            loads: None,
            placed_ties: Vec::new(),
            loaded: false,
            used: None,
            hands: Vec::new(),
            took_s: 0.0,
            next_corrected: false,
            driven: false,
        })
    }

    /// A blank account of a step.
    pub(super) fn blank_stats(&self) -> SceneStats {
        SceneStats {
            flags: match self.corrected.is_none() && self.model.manifest.relaxes() {
                true => flag::ELASTIC,
                false => 0,
            },
            step_count: self.counters.step_count,
            step_ms: 0.0,
            check_ms: 0.0,
            prior_ms: 0.0,
            encode_ms: 0.0,
            aggregate_ms: 0.0,
            latent_ms: 0.0,
            decode_ms: 0.0,
            guard_ms: 0.0,
            corrections_ms: 0.0,
            contact_ms: 0.0,
            corrections: 0,
            evaluations: 0,
            substeps: 0,
            residual: 0.0,
            error_mm: 0.0,
            min_det: 0.0,
            decoded_node_count: 0,
            contact_count: 0,
            memory_bytes: self.memory_bytes() as u64,
            threads: self.machine.pool.threads() as u32,
            kernel: self.engine.kernel(),
            provider: self.engine.provider(),
            precision: self.engine.precision(),
            step_path: self.engine.path(),
            upload_ms: 0.0,
            download_ms: 0.0,
            max_displacement_mm: self.counters.max_displacement,
            indicator: 0.0,
            prior_forces: self.engine.linear().is_some() && self.corrected.is_none(),
            sleeping: self.counters.sleeping,
            poisoned: false,
        }
    }

    /// One step. On error nothing that a caller can see has changed but the statistics of a guard refusal.
    pub(super) fn step(
        &mut self,
        published: &RwLock<Published>,
        input: StepInput<'_>,
        out: Option<Output<'_, f32>>,
    ) -> Result<()> {
        let _mode = FlushToZero::of(self.machine.isa);
        let start = Instant::now();
        let _span = tracing::debug_span!("step", step = self.counters.step_count).entered();
        let mut stats = self.blank_stats();
        let mut watch = Stopwatch::start();
        let count = self.mesh.node_count();
        if let Some(out) = &out {
            lock_read(published).check_len(View::Region, out.len())?;
        }
        input.check()?;
        self.check_cut(&input)?;
        let nodes = [self.intact_mesh().node_count(), count];
        input.contact.gather(&mut self.incoming, nodes)?;
        let given = match input.displacement {
            Some(field) => {
                check_displacement(field, count)?;
                (!self.is_own_state(published, field)).then_some(field)
            }
            None => None,
        };
        let has_load = self.take_loads(published, &input.loads)?;
        stats.check_ms = watch.lap();
        let near = self.update_tools(published, &input)?;
        let has_load = has_load || !input.loads.ties.is_empty();
        self.loaded = has_load || (self.counters.loaded && self.is_swung());

        if self.counters.sleeping
            && given.is_none()
            && self.incoming.is_empty()
            && !near
            && !has_load
        {
            self.fit_published(published)?;
            self.counters.time_s = input.time_s;
            self.publish_rest(published);
            self.commit_loads();
        } else {
            if !self.drive(published, near, start, &mut stats)? {
                let learned =
                    self.learns() && (self.corrected.is_none() || self.incoming.is_empty());
                self.predict_and_decode(published, given, learned, &mut stats)?;
                self.correct(published, given, start, &mut stats)?;
            }
            [stats.upload_ms, stats.download_ms] = self.engine.transfer_ms();
            let verdict = self.judge(&mut stats)?;
            let replaced = verdict & guard::REFUSED != 0
                && self.refuse(published, verdict, given.is_some(), &mut stats)?;
            if replaced {
                self.release_tools(published, &mut stats);
            }
            self.fit_published(published)?;
            self.counters.time_s = input.time_s;
            self.publish(published, given.is_some(), replaced, &stats);
        }
        self.counters.driven = self.driven;
        self.counters.loaded = self.loaded;
        self.took_s = start.elapsed().as_secs_f64();
        self.publish_to_hands(published);
        self.counters.step_count += 1;
        stats.step_count = self.counters.step_count;
        stats.sleeping = self.counters.sleeping;
        stats.max_displacement_mm = self.counters.max_displacement;
        stats.contact_count = self.contact.len() as u64;
        if let Some(out) = out {
            lock_read(published).read(View::Region, out)?;
        }
        self.log_flags(&stats);
        stats.step_ms = start.elapsed().as_secs_f64() * 1e3;
        lock_write(published).stats = stats;
        Ok(())
    }

    /// Whether a host's displacement is the scene's own last state, at the nodes that the scene knows.
    fn is_own_state(&self, published: &RwLock<Published>, field: &[f32]) -> bool {
        let shared = lock_read(published);
        let own = &shared.last.field;
        if self.plan.nodes().len() == self.mesh.node_count() {
            return own == field;
        }
        self.plan.nodes().iter().all(|&node| {
            let at = 3 * node as usize;
            own[at..at + 3] == field[at..at + 3]
        })
    }

    /// Checks the contact against what the bundle was measured with, lets the engine record the step, and decodes its field.
    ///
    /// With `learned` false the elements have made `next` already, or will: then the engine follows with the linear response
    /// alone, and `next` keeps its field.
    pub(super) fn predict_and_decode(
        &mut self,
        published: &RwLock<Published>,
        given: Option<&[f32]>,
        learned: bool,
        stats: &mut SceneStats,
    ) -> Result<()> {
        let limits = &self.model.manifest.envelope;
        let envelope = match (self.used.take(), &limits.tools) {
            (Some(used), Some(tools)) => self.envelope.check_tools(tools, &used, &self.incoming),
            _ => self.envelope.check(
                &self.mesh,
                limits,
                &self.incoming,
                &self.contact,
                (self.step_s() / self.model.manifest.dt_s) as f32,
            ),
        };
        stats.flags |= envelope.flags;
        stats.indicator = envelope.ratio;
        let shared = lock_read(published);
        if learned {
            self.start_from_corrected(&shared)?;
        }
        let compute = self.machine.compute();
        self.engine.predict(
            compute,
            &Inputs {
                given,
                displacement: given.unwrap_or(&shared.last.field),
                previous: &shared.before.field,
                contact: &self.incoming,
                contact_changed: self.incoming.nodes != self.contact.nodes,
                held: &self.held,
                plan: &self.plan,
                learned,
            },
            stats,
        )?;
        if !learned {
            self.next.points.fill(0.0);
            return Ok(());
        }
        let mut watch = Stopwatch::start();
        let _span = tracing::trace_span!("decode").entered();
        let displacement = given.unwrap_or(&shared.last.field);
        let what = Decode {
            which: Which::Next,
            plan: &self.plan,
            displacement,
            points: &self.points,
        };
        let Frame { field, points } = &mut self.next;
        self.engine.decode(compute, &what, field, points)?;
        drop(shared);
        stats.decoded_node_count = self.plan.nodes().len() as u64;
        self.enforce_next();
        stats.decode_ms = watch.lap();
        Ok(())
    }

    /// Bytes of the scene's buffers, those of the published states included.
    pub(super) fn memory_bytes(&self) -> usize {
        let published = if self.options.cubic_sampling { 3 } else { 2 };
        let hands: usize = self.hands.iter().map(|hand| hand.memory_bytes()).sum();
        // A mesh of the scene's own is the scene's.
        let own_mesh = match Arc::ptr_eq(&self.mesh, &self.model.mesh) {
            true => 0,
            false => self.mesh.held_bytes() + self.engine.table_bytes(),
        };
        let contacts_in_the_hosts_order = 16 * self.mesh.node_count();
        self.held_bytes()
            + published * self.next.held_bytes()
            + contacts_in_the_hosts_order
            + self.corrected.as_ref().map_or(0, Corrector::memory_bytes)
            + hands
            + own_mesh
    }
}
