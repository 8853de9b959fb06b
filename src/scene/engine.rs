//! What differs between the bundle kinds inside a step, behind one enum.

use std::sync::Arc;

use super::contact::ContactSet;
use super::plan::NodePlan;
use super::points::AttachedPoints;
use super::reduced::{ReducedEngine, ReducedRecord};
use super::upt::{Means, UptEngine, UptInput};
use crate::bundle::Base;
use crate::error::{Error, Result};
use crate::kernels::rows::decode_rows;
use crate::kernels::{Isa, Pool};
use crate::memory;
use crate::model::{KindModel, Model, UptTables};
use crate::options::{DecoderKernel, Precision, Provider, StepPath};
#[cfg(feature = "forces")]
use crate::prior::ContactResponse;
use crate::prior::PriorTable;
use crate::stats::SceneStats;

/// Which state to decode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// The step being made.
    Next,
    /// The last published.
    Last,
    /// The one before.
    Before,
}

/// What a step reads.
pub struct Inputs<'a> {
    /// The host's displacement `[K,3]`, where it is not the scene's own state.
    pub given: Option<&'a [f32]>,
    /// `u[t]` `[K,3]`.
    pub displacement: &'a [f32],
    /// `u[t-1]` `[K,3]`.
    pub previous: &'a [f32],
    /// `c[t+1]`.
    pub contact: &'a ContactSet,
    /// The contact nodes differ from those of the last step.
    pub contact_changed: bool,
    /// Held nodes `[K]`.
    pub held: &'a [bool],
    /// Decoded nodes.
    pub plan: &'a NodePlan,
    /// Whether the learned part runs; a step that is corrected needs the linear response alone.
    pub learned: bool,
}

/// The kind's own buffers, sessions and latent state.
pub enum Engine {
    /// Kind `upt`, with the tables of the scene's mesh.
    Upt(Box<UptEngine>, Arc<UptTables>),
    /// Kind `reduced`.
    Reduced(Box<ReducedEngine>),
}

fn mismatch() -> Error {
    Error::Panic("the scene's engine is of another kind than its model".into())
}

impl Engine {
    /// The prior whose rows a plan must hold.
    pub fn planned_prior<'m>(&self, model: &'m Model) -> Option<&'m PriorTable> {
        match (self, &model.kind) {
            (Engine::Reduced(_), _) => model.prior.as_ref(),
            (Engine::Upt(..), KindModel::Upt(kind)) if kind.entry.needs_prior() => {
                model.prior.as_ref()
            }
            _ => None,
        }
    }

    /// Whether the scene has a linear response.
    pub fn responds(&self) -> bool {
        match self {
            Engine::Reduced(_) => true,
            Engine::Upt(engine, _) => engine.response.is_some(),
        }
    }

    /// Its contact solve.
    #[cfg(feature = "forces")]
    pub fn contact_response(&mut self) -> Option<&mut ContactResponse> {
        match self {
            Engine::Reduced(engine) => Some(&mut engine.response),
            Engine::Upt(engine, _) => engine.response.as_mut(),
        }
    }

    /// Whether every node is decoded in each step, and kept: because the prediction is added to the displacement, or
    /// because `step.onnx` decodes, whose bits no other path gives again.
    pub fn keeps_all_nodes(&self, model: &Model) -> bool {
        self.path() == StepPath::Whole
            || matches!(&model.kind, KindModel::Upt(kind) if kind.entry.base == Base::Displacement)
    }

    /// Nodes whose displacement the next step reads.
    pub fn recurrence_nodes(&self) -> &[u32] {
        match self {
            Engine::Upt(_, tables) => &tables.encode_nodes,
            Engine::Reduced(_) => &[],
        }
    }

    /// Computes the next latent state.
    pub fn predict(
        &mut self,
        isa: Isa,
        pool: &Pool,
        model: &Model,
        inputs: &Inputs<'_>,
        stats: &mut SceneStats,
    ) -> Result<()> {
        match (self, &model.kind) {
            (Engine::Reduced(engine), KindModel::Reduced(kind)) => {
                let table = model.prior.as_ref().ok_or_else(mismatch)?;
                engine.predict(
                    isa,
                    pool,
                    kind,
                    table,
                    inputs.held,
                    inputs.given,
                    inputs.contact,
                    inputs.contact_changed,
                    inputs.learned,
                    stats,
                )
            }
            (Engine::Upt(engine, tables), KindModel::Upt(kind)) => {
                let input = UptInput {
                    displacement: inputs.displacement,
                    previous: inputs.previous,
                    contact: inputs.contact,
                    held: inputs.held,
                    plan: inputs.plan,
                    learned: inputs.learned,
                };
                let means = Means {
                    isa,
                    pool,
                    kind,
                    tables,
                };
                engine.predict(means, model, &input, stats)
            }
            _ => Err(mismatch()),
        }
    }

    /// Decodes the nodes of a plan into a field `[K,3]`, boundary conditions not yet enforced. `displacement` is the
    /// state before the decoded one. `detail [n,3]` is what the attached points have beside the interpolation of the field.
    #[allow(clippy::too_many_arguments)]
    pub fn decode(
        &mut self,
        isa: Isa,
        pool: &Pool,
        model: &Model,
        which: Which,
        plan: &NodePlan,
        displacement: &[f32],
        field: &mut [f32],
        points: &AttachedPoints,
        detail: &mut [f32],
    ) -> Result<()> {
        detail.fill(0.0);
        match (self, &model.kind) {
            (Engine::Reduced(engine), _) => {
                let table = model.prior.as_ref().ok_or_else(mismatch)?;
                let rows = plan.rows().ok_or_else(mismatch)?;
                let record = engine.record(which);
                decode_rows(isa, pool, &table.basis(), rows, &record.q, field)
                    .map_err(|error| Error::Panic(error.to_string()))
            }
            (Engine::Upt(engine, tables), KindModel::Upt(kind)) => {
                let means = Means {
                    isa,
                    pool,
                    kind,
                    tables,
                };
                engine.decode_mesh(means, which, plan.nodes(), field)?;
                let (queries, rows) = points.queries();
                if !rows.is_empty() {
                    engine.decode_queries(means, which, queries, rows, detail)?;
                    points.add_interpolated(-1.0, field, detail);
                }
                match kind.entry.base {
                    Base::None => {}
                    Base::Displacement => add(displacement, plan.nodes(), field),
                    Base::Prior if which == Which::Next => {
                        add(&engine.record(which).prior_field, plan.nodes(), field);
                    }
                    Base::Prior => {
                        // A published state may be decoded at nodes that were not planned in its step.
                        let table = model.prior.as_ref().ok_or_else(mismatch)?;
                        let rows = plan.rows().ok_or_else(mismatch)?;
                        let mut prior = memory::zeros(field.len(), "the linear response")?;
                        decode_rows(
                            isa,
                            pool,
                            &table.basis(),
                            rows,
                            &engine.record(which).q_prior,
                            &mut prior,
                        )
                        .map_err(|error| Error::Panic(error.to_string()))?;
                        add(&prior, plan.nodes(), field);
                    }
                }
                Ok(())
            }
            _ => Err(mismatch()),
        }
    }

    /// Replaces the next state by the linear response alone, or by rest where the bundle has none.
    pub fn fall_back(
        &mut self,
        isa: Isa,
        pool: &Pool,
        model: &Model,
        plan: &NodePlan,
        field: &mut [f32],
    ) -> Result<()> {
        if let Engine::Reduced(engine) = self {
            engine.drop_correction();
        }
        self.decode_fallback(isa, pool, model, Which::Next, plan, field)
    }

    /// Decodes the linear response of a state, or rest where the bundle has none.
    pub fn decode_fallback(
        &mut self,
        isa: Isa,
        pool: &Pool,
        model: &Model,
        which: Which,
        plan: &NodePlan,
        field: &mut [f32],
    ) -> Result<()> {
        let Some(table) = self.planned_prior(model) else {
            field.fill(0.0);
            return Ok(());
        };
        let q = match &*self {
            Engine::Reduced(engine) => &engine.record(which).q,
            Engine::Upt(engine, _) => &engine.record(which).q_prior,
        };
        let rows = plan.rows().ok_or_else(mismatch)?;
        decode_rows(isa, pool, &table.basis(), rows, q, field)
            .map_err(|error| Error::Panic(error.to_string()))
    }

    /// The next state is rest.
    pub fn rest_next(&mut self) {
        match self {
            Engine::Upt(engine, _) => engine.next.clear(),
            Engine::Reduced(engine) => engine.rest_next(),
        }
    }

    /// The next state becomes the last.
    pub fn commit(&mut self) {
        match self {
            Engine::Upt(engine, _) => engine.commit(),
            Engine::Reduced(engine) => engine.commit(),
        }
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        match self {
            Engine::Upt(engine, _) => engine.reset(),
            Engine::Reduced(engine) => engine.reset(),
        }
    }

    /// Whether the latent state agrees that the tissue is still: the planned nodes alone might miss a motion.
    pub fn is_quiet(&self, displacement: f32) -> bool {
        match self {
            // Orthonormal modes: no node is displaced by more than |b|, and one by at least |b| / sqrt(K).
            Engine::Reduced(engine) => engine.last_norm() <= 50.0 * displacement,
            Engine::Upt(..) => true,
        }
    }

    /// Whether the model's free motion is known to end at exactly zero.
    pub fn comes_to_rest(&self) -> bool {
        // The bound of a reduced model's correction decays geometrically, and so does a free vibration; a network alone
        // promises nothing.
        matches!(self, Engine::Reduced(_))
    }

    /// Recomputes what the published records hold per planned node.
    pub fn replan(&mut self, isa: Isa, pool: &Pool, model: &Model, plan: &NodePlan) -> Result<()> {
        match self {
            Engine::Upt(engine, _) => engine.replan(isa, pool, model.prior.as_ref(), plan),
            Engine::Reduced(_) => Ok(()),
        }
    }

    /// What decodes.
    pub fn kernel(&self) -> DecoderKernel {
        match self {
            Engine::Upt(engine, _) => engine.kernel(),
            Engine::Reduced(_) => DecoderKernel::Native,
        }
    }

    /// Who makes a step.
    pub fn path(&self) -> StepPath {
        match self {
            Engine::Upt(engine, _) => engine.path(),
            Engine::Reduced(_) => StepPath::Split,
        }
    }

    /// Wall time of the last step's copies to a device and back, ms.
    pub fn transfer_ms(&self) -> [f64; 2] {
        match self {
            Engine::Upt(engine, _) => engine.transfer_ms(),
            Engine::Reduced(engine) => engine.transfer_ms(),
        }
    }

    /// Where the latent stage runs.
    pub fn provider(&self) -> Provider {
        match self {
            Engine::Upt(engine, _) => engine.stage().choice().provider,
            Engine::Reduced(engine) => engine.provider(),
        }
    }

    /// Precision that runs.
    pub fn precision(&self) -> Precision {
        match self {
            Engine::Upt(engine, _) => engine.precision(),
            Engine::Reduced(engine) => engine.precision(),
        }
    }

    /// Bytes of the tables of the scene's mesh.
    pub fn table_bytes(&self) -> usize {
        match self {
            Engine::Upt(_, tables) => tables.memory_bytes(),
            Engine::Reduced(_) => 0,
        }
    }

    /// Bytes of the buffers.
    pub fn memory_bytes(&self) -> usize {
        match self {
            Engine::Upt(engine, _) => engine.memory_bytes(),
            Engine::Reduced(engine) => engine.memory_bytes(),
        }
    }
}

impl ReducedEngine {
    /// A record.
    pub fn record(&self, which: Which) -> &ReducedRecord {
        match which {
            Which::Next => &self.next,
            Which::Last => &self.last,
            Which::Before => &self.before,
        }
    }
}

fn add(base: &[f32], nodes: &[u32], field: &mut [f32]) {
    for &node in nodes {
        let at = 3 * node as usize;
        for (u, b) in field[at..at + 3].iter_mut().zip(&base[at..at + 3]) {
            *u += b;
        }
    }
}
