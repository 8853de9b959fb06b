//! What differs between the bundle kinds inside a step, behind one enum.
//!
//! Both kinds keep records: what a state is beside its field, such as latent tokens or block
//! coordinates. There are three, of the state being made (next), the last published one, and the
//! one before it; `commit` turns them round by swapping, without copies. A record and the frame of
//! the same step belong together: any node of a published state can still be decoded from its
//! record.

use super::inputs::{Decode, Inputs, Which};
use super::linear::Linear;
use super::plan::NodePlan;
use super::reduced::{ReducedEngine, ReducedRecord};
use super::upt::UptEngine;
use crate::bundle::Base;
use crate::error::Result;
use crate::features::{Learned, Proven};
use crate::kernels::Compute;
use crate::memory::{self, HeldBytes};
use crate::options::{DecoderKernel, Precision, Provider, StepPath};
use crate::prior::PriorTable;
use crate::stats::SceneStats;

/// The kind's own buffers, sessions and latent state, with the model that they belong to.
#[derive(HeldBytes)]
pub enum Engine {
    /// Kind `upt`.
    Upt(Proven<Learned, UptEngine>),
    /// Kind `reduced`.
    Reduced(Box<ReducedEngine>),
}

impl Engine {
    /// The linear response, where the scene has one.
    pub fn linear(&self) -> Option<&Linear> {
        match self {
            Engine::Reduced(engine) => Some(&engine.linear),
            Engine::Upt(engine) => engine.linear.as_ref(),
        }
    }

    /// As [`Engine::linear`].
    pub fn linear_mut(&mut self) -> Option<&mut Linear> {
        match self {
            Engine::Reduced(engine) => Some(&mut engine.linear),
            Engine::Upt(engine) => engine.linear.as_mut(),
        }
    }

    /// The tables whose rows a plan must hold.
    pub fn planned_prior(&self) -> Option<&PriorTable> {
        self.linear().map(|linear| &*linear.table)
    }

    /// Whether every node is decoded in each step, and kept: because the prediction is added to the displacement, or
    /// because `step.onnx` decodes, whose bits no other path gives again.
    pub fn keeps_all_nodes(&self) -> bool {
        match self {
            Engine::Upt(engine) => {
                engine.path() == StepPath::Whole || engine.kind.entry.base == Base::Displacement
            }
            Engine::Reduced(_) => false,
        }
    }

    /// Nodes whose displacement the next step reads.
    pub fn recurrence_nodes(&self) -> &[u32] {
        match self {
            Engine::Upt(engine) => &engine.tables.encode_nodes,
            Engine::Reduced(_) => &[],
        }
    }

    /// Computes the next latent state.
    pub fn predict(
        &mut self,
        compute: Compute<'_>,
        inputs: &Inputs<'_>,
        stats: &mut SceneStats,
    ) -> Result<()> {
        match self {
            Engine::Reduced(engine) => engine.predict(compute, inputs, stats),
            Engine::Upt(engine) => engine.predict(compute, inputs, stats),
        }
    }

    /// Decodes the nodes of a plan into a field `[K,3]`, boundary conditions not yet enforced. `detail [n,3]` is what the
    /// attached points have in addition to the interpolation of the field.
    pub fn decode(
        &mut self,
        compute: Compute<'_>,
        what: &Decode<'_>,
        field: &mut [f32],
        detail: &mut [f32],
    ) -> Result<()> {
        detail.fill(0.0);
        let (which, plan) = (what.which, what.plan);
        match self {
            Engine::Reduced(engine) => {
                let q = &engine.record(which).q;
                engine.linear.decode(compute, plan, q, field)
            }
            Engine::Upt(engine) => {
                engine.decode_mesh(compute, which, plan.nodes(), field)?;
                let (queries, rows) = what.points.queries();
                if !rows.is_empty() {
                    engine.decode_queries(compute, which, queries, rows, detail)?;
                    what.points.add_interpolated(-1.0, field, detail);
                }
                match (engine.kind.entry.base, &engine.linear) {
                    (Base::None, _) | (Base::Prior, None) => {}
                    (Base::Displacement, _) => add(what.displacement, plan.nodes(), field),
                    (Base::Prior, Some(_)) if which == Which::Next => {
                        add(&engine.record(which).prior_field, plan.nodes(), field);
                    }
                    (Base::Prior, Some(linear)) => {
                        // A published state may be decoded at nodes that were not planned in its step.
                        let mut prior = memory::zeros(field.len(), "the linear response")?;
                        let q = &engine.record(which).q_prior;
                        linear.decode(compute, plan, q, &mut prior)?;
                        add(&prior, plan.nodes(), field);
                    }
                }
                Ok(())
            }
        }
    }

    /// Replaces the next state by the linear response alone, or by rest where the bundle has none.
    pub fn fall_back(
        &mut self,
        compute: Compute<'_>,
        plan: &NodePlan,
        field: &mut [f32],
    ) -> Result<()> {
        match self {
            Engine::Reduced(engine) => engine.drop_correction(),
            // The prediction lies in the field alone, which is replaced.
            Engine::Upt(_) => {}
        }
        self.decode_fallback(compute, Which::Next, plan, field)
    }

    /// Decodes the linear response of a state, or rest where the bundle has none.
    pub fn decode_fallback(
        &self,
        compute: Compute<'_>,
        which: Which,
        plan: &NodePlan,
        field: &mut [f32],
    ) -> Result<()> {
        let Some(linear) = self.linear() else {
            field.fill(0.0);
            return Ok(());
        };
        let q = match self {
            Engine::Reduced(engine) => &engine.record(which).q,
            Engine::Upt(engine) => &engine.record(which).q_prior,
        };
        linear.decode(compute, plan, q, field)
    }

    /// The next state is rest.
    pub fn rest_next(&mut self) {
        match self {
            Engine::Upt(engine) => engine.next.clear(),
            Engine::Reduced(engine) => engine.rest_next(),
        }
    }

    /// The next state becomes the last.
    pub fn commit(&mut self) {
        match self {
            Engine::Upt(engine) => engine.commit(),
            Engine::Reduced(engine) => engine.commit(),
        }
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        match self {
            Engine::Upt(engine) => engine.reset(),
            Engine::Reduced(engine) => engine.reset(),
        }
    }

    /// Whether the latent state agrees that the tissue is still: the planned nodes alone might miss a motion.
    pub fn is_quiet(&self, displacement: f32) -> bool {
        match self {
            // Orthonormal modes: no node is displaced by more than |b|, and one by at least |b| / sqrt(K).
            Engine::Reduced(engine) => engine.last_norm() <= 50.0 * displacement,
            Engine::Upt(_) => true,
        }
    }

    /// Whether the model's free motion is known to end at exactly zero.
    pub fn comes_to_rest(&self) -> bool {
        match self {
            // The bound of its correction decays geometrically, and so does a free vibration.
            Engine::Reduced(_) => true,
            // A network alone promises nothing.
            Engine::Upt(_) => false,
        }
    }

    /// Recomputes what the published records hold per planned node.
    pub fn replan(&mut self, compute: Compute<'_>, plan: &NodePlan) -> Result<()> {
        match self {
            Engine::Upt(engine) => engine.replan(compute, plan),
            Engine::Reduced(_) => Ok(()),
        }
    }

    /// What decodes.
    pub fn kernel(&self) -> DecoderKernel {
        match self {
            Engine::Upt(engine) => engine.kernel(),
            Engine::Reduced(_) => DecoderKernel::Native,
        }
    }

    /// Who makes a step.
    pub fn path(&self) -> StepPath {
        match self {
            Engine::Upt(engine) => engine.path(),
            Engine::Reduced(_) => StepPath::Split,
        }
    }

    /// Wall time of the last step's copies to a device and back, ms.
    pub fn transfer_ms(&self) -> [f64; 2] {
        match self {
            Engine::Upt(engine) => engine.transfer_ms(),
            Engine::Reduced(engine) => engine.transfer_ms(),
        }
    }

    /// Where the latent stage runs.
    pub fn provider(&self) -> Provider {
        match self {
            Engine::Upt(engine) => engine.stage().choice().provider,
            Engine::Reduced(engine) => engine.provider(),
        }
    }

    /// Precision that runs.
    pub fn precision(&self) -> Precision {
        match self {
            Engine::Upt(engine) => engine.precision(),
            Engine::Reduced(engine) => engine.precision(),
        }
    }

    /// Bytes of the tables of the scene's mesh.
    pub fn table_bytes(&self) -> usize {
        match self {
            Engine::Upt(engine) => engine.tables.held_bytes(),
            Engine::Reduced(_) => 0,
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

/// Adds `base [K,3]` to the field at some nodes: the others have not been decoded and are not to be
/// read.
fn add(base: &[f32], nodes: &[u32], field: &mut [f32]) {
    for &node in nodes {
        let at = 3 * node as usize;
        for (u, b) in field[at..at + 3].iter_mut().zip(&base[at..at + 3]) {
            *u += b;
        }
    }
}
