//! What makes the state of a step: the prediction and its decoding here, the contact of tools in `driven`, corrections in `correct`,
//! the guard in `verdict`. [`super::core::Core`] calls them in order and publishes what comes out.

use std::sync::{Arc, RwLock};

use super::body::SceneBody;
use super::corrected::Corrector;
use super::counters::Source;
use super::engine::Engine;
use super::inputs::{Decode, Inputs, Which};
use super::loading::SceneLoads;
use super::plan::NodePlan;
use super::points::AttachedPoints;
use super::published::lock_read;
use super::published::{Frame, Published};
use super::shown::Shown;
use super::step_states::{StepStates, enforce};
use super::timing::Stopwatch;
use super::tool_contact::ToolContact;
use super::watch::Watch;
use crate::envelope::EnvelopeCheck;
use crate::error::Result;
use crate::kernels::largest::largest;
use crate::kernels::{Isa, Machine, Pool};
use crate::memory::HeldBytes;
use crate::options::SceneOptions;
use crate::stats::{SceneStats, SceneTiming, flag};

/// See the module. A step fills `states.next`; until it is published nothing else of the scene's state changes.
#[derive(HeldBytes)]
pub struct StepMaker {
    /// Mesh, model, what is held, and cuts.
    pub(super) body: SceneBody,
    /// As the host gave them, checked.
    #[held(skip)]
    pub(super) options: SceneOptions,
    /// Instruction set and threads; the pool is the scene's own.
    #[held(skip)]
    pub(super) machine: Machine,
    /// What predicts without elements: a network, a reduced map, or the linear response alone.
    pub(super) engine: Engine,
    /// The implicit solver and when it has done enough; none where no step is corrected. [`StepMaker::memory_bytes`] counts its bytes.
    #[held(skip)]
    pub(super) corrected: Option<Box<Corrector>>,
    /// The contact problem of instruments, and what it knows of the last step.
    pub(super) tools: ToolContact,
    /// Gravity, forces, pressure, ties and supports of the step being made.
    pub(super) loads: SceneLoads,
    /// Which nodes and points are decoded.
    pub(super) shown: Shown,
    /// What a step is compared with, and the flags that it raises.
    pub(super) watch: Watch,
    pub(super) states: StepStates,
}

/// Parts that `super::build` has made, of which a maker is put together.
pub struct Parts {
    /// Mesh, model and what is held.
    pub body: SceneBody,
    /// As the host gave them.
    pub options: SceneOptions,
    /// With the pool they make the machine of the scene.
    pub isa: Isa,
    pub pool: Pool,
    /// The predictor of the bundle's kind.
    pub engine: Engine,
    /// None where the options or the bundle ask for no corrections.
    pub corrected: Option<Box<Corrector>>,
    /// None: it is made here.
    pub envelope: Option<EnvelopeCheck>,
}

impl StepMaker {
    /// At rest, every node shown.
    pub(super) fn new(parts: Parts) -> Result<StepMaker> {
        let mesh = &parts.body.mesh;
        let table = parts.engine.planned_prior();
        Ok(StepMaker {
            shown: Shown::all(mesh, table, parts.options.check_inversion)?,
            watch: Watch::new(match parts.envelope {
                Some(envelope) => envelope,
                None => EnvelopeCheck::new(mesh)?,
            }),
            states: StepStates::rest(mesh.node_count())?,
            body: parts.body,
            options: parts.options,
            machine: Machine {
                isa: parts.isa,
                pool: parts.pool,
            },
            engine: parts.engine,
            corrected: parts.corrected,
            tools: ToolContact::default(),
            loads: SceneLoads::default(),
        })
    }

    /// A blank account of a step.
    pub(super) fn blank_stats(&self) -> SceneStats {
        let counters = &self.states.counters;
        SceneStats {
            flags: match self.corrected.is_none() && self.body.model.manifest.relaxes() {
                true => flag::ELASTIC,
                false => 0,
            },
            step_count: counters.step_count,
            corrections: 0,
            evaluations: 0,
            substeps: 0,
            residual: 0.0,
            error_mm: 0.0,
            min_det: 0.0,
            decoded_node_count: 0,
            contact_count: 0,
            // Set by who knows all of the scene.
            memory_bytes: 0,
            threads: self.machine.pool.threads() as u32,
            kernel: self.engine.kernel(),
            provider: self.engine.provider(),
            precision: self.engine.precision(),
            step_path: self.engine.path(),
            max_displacement_mm: counters.max_displacement,
            indicator: 0.0,
            prior_forces: self.engine.linear().is_some() && self.corrected.is_none(),
            sleeping: counters.sleeping,
            poisoned: false,
            timing: SceneTiming::default(),
        }
    }

    /// Whether every node is decoded in each step, and kept.
    pub(super) fn keeps_all_nodes(&self) -> bool {
        self.corrected.is_some() || self.engine.keeps_all_nodes()
    }

    /// Whether the learned part (or, in a bundle without one, its free vibration) makes a step without contact; decided by the last state.
    pub(super) fn learns(&self) -> bool {
        let Some(corrected) = &self.corrected else {
            return true;
        };
        let lifted = corrected.parts.most_substeps > 1 && self.tools.driven && self.is_swung();
        !(corrected.alone() || lifted || self.loads.loaded)
    }

    /// Whether the last state is displaced by more than where the model's own free motion ends.
    pub(super) fn is_swung(&self) -> bool {
        let at_rest = self.body.model.manifest.rest_displacement_mm;
        self.states.is_swung(at_rest)
    }

    /// Largest displacement of the planned nodes in `next`, mm.
    pub(super) fn largest_of_next(&self) -> f32 {
        let nodes = self.shown.plan.nodes();
        largest(self.machine.isa, &self.states.next.field, nodes)
    }

    /// Held nodes of `next` to zero, contact nodes to what is imposed, where the scene has a boundary.
    pub(super) fn enforce_next(&mut self) {
        if self.options.boundary {
            self.states.enforce(&self.body.mesh, &self.body.held);
        }
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
        // A corrected step under tools has said it just before; a free one has none.
        // Taken, so that a step that makes no contact cannot be judged by an older one's.
        let used = self.tools.used.take();
        self.watch.compare(&self.body, &self.states, used, stats);
        let shared = lock_read(published);
        if learned {
            // A reduced map's records are of its own predictions: they become those of the corrected states.
            self.start_from_corrected(&shared)?;
        }
        let compute = self.machine.compute();
        let states = &mut self.states;
        self.engine.predict(
            compute,
            &Inputs {
                given,
                displacement: given.unwrap_or(&shared.last.field),
                previous: &shared.before.field,
                contact: &states.incoming,
                contact_changed: states.incoming.nodes != states.contact.nodes,
                held: &self.body.held,
                plan: &self.shown.plan,
                learned,
            },
            stats,
        )?;
        if !learned {
            // Points beyond the nodes' interpolation are the network's alone.
            states.next.points.fill(0.0);
            return Ok(());
        }
        let mut watch = Stopwatch::start();
        let _span = tracing::trace_span!("decode").entered();
        let displacement = given.unwrap_or(&shared.last.field);
        let what = Decode {
            which: Which::Next,
            plan: &self.shown.plan,
            displacement,
            points: &self.shown.points,
        };
        let Frame { field, points } = &mut states.next;
        self.engine.decode(compute, &what, field, points)?;
        drop(shared);
        stats.decoded_node_count = self.shown.plan.nodes().len() as u64;
        self.enforce_next();
        stats.timing.decode_ms = watch.lap();
        Ok(())
    }

    /// Decodes the nodes of a plan in a published state into the spare frame `next.field`, and into `detail` what a network says at attached
    /// points beyond the interpolation of their nodes.
    ///
    /// A state is decoded by what made it: rest is zero, a model's state comes from its record, and a replaced one from the linear
    /// response. Where every node is kept, the published field is copied instead.
    pub(super) fn decode_published(
        &mut self,
        published: &RwLock<Published>,
        which: Which,
        plan: &NodePlan,
        points: &AttachedPoints,
        detail: &mut [f32],
    ) -> Result<()> {
        let kept = self.keeps_all_nodes();
        let states = &mut self.states;
        let (source, contact) = match which {
            Which::Last => (states.counters.sources[0], &states.contact),
            Which::Next | Which::Before => (states.counters.sources[1], &states.contact_before),
        };
        let shared = lock_read(published);
        let frame = if which == Which::Last {
            &shared.last
        } else {
            &shared.before
        };
        let field = &mut states.next.field;
        if kept && points.queries().1.is_empty() {
            detail.fill(0.0);
            field.copy_from_slice(&frame.field);
            return Ok(());
        }
        let compute = self.machine.compute();
        match source {
            Source::Rest => {
                detail.fill(0.0);
                field.fill(0.0);
                return Ok(());
            }
            Source::Model => {
                let what = Decode {
                    which,
                    plan,
                    displacement: &shared.before.field,
                    points,
                };
                self.engine.decode(compute, &what, field, detail)?;
            }
            Source::Fallback => {
                detail.fill(0.0);
                self.engine.decode_fallback(compute, which, plan, field)?;
            }
        }
        if kept {
            field.copy_from_slice(&frame.field);
        } else if self.options.boundary {
            enforce(&self.body.mesh.held_nodes, &self.body.held, contact, field);
        }
        Ok(())
    }

    /// Bytes of its buffers, and of a mesh and a corrector of its own.
    pub(super) fn memory_bytes(&self) -> usize {
        let body = &self.body;
        // A mesh of the scene's own is the scene's.
        let own_mesh = match Arc::ptr_eq(&body.mesh, &body.model.mesh) {
            true => 0,
            false => body.mesh.held_bytes() + self.engine.table_bytes(),
        };
        self.held_bytes() + self.corrected.as_ref().map_or(0, |own| own.memory_bytes()) + own_mesh
    }
}
