//! The step of kind `upt`: features -> low-rank encoder and message mean (native) -> `latent.onnx` -> decoder, or
//! `step.onnx` for all of it.

mod anchors;
mod decode;
mod decoders;
mod features;
mod record;
pub mod step_path;

pub use record::UptRecord;

use std::sync::Arc;

use super::inputs::Inputs;
use super::linear::{Linear, solve_flags};
use super::plan::NodePlan;
use super::timing::Stopwatch;
use anchors::AnchorField;
use decoders::Decoders;
use features::fill_features;

use crate::error::{Error, Result};
use crate::kernels::aggregate::{Csr, Messages, encode_aggregate};
use crate::kernels::decoder::{DecoderPrecision, DecoderScratch, DecoderTokens};
use crate::kernels::encode::LowRank;
use crate::kernels::{Compute, Pool};
use crate::memory::{self, HeldBytes};
use crate::model::{Model, UptModel, UptTables};
use crate::onnx::Stage;
use crate::options::{DecoderKernel, Precision, StepPath};
use crate::stats::SceneStats;

/// Who makes a step.
#[derive(HeldBytes)]
enum Path {
    /// Native encoder and message mean of `features`, then `latent.onnx`.
    Split {
        latent: Box<Stage>,
        features: Vec<f32>,
        scratch: Vec<f32>,
    },
    /// `step.onnx`, which decodes every node as well.
    Whole(Box<Stage>),
}

/// How a scene runs the network.
#[derive(Debug, Clone, Copy)]
pub struct Choice {
    /// `step.onnx` makes the step.
    pub whole: bool,
    /// What decodes; not [`DecoderKernel::Auto`].
    pub kernel: DecoderKernel,
    /// Precision of the native decoder.
    pub precision: Precision,
}

/// Buffers and sessions of a scene of kind `upt`.
#[derive(HeldBytes)]
pub struct UptEngine {
    /// The weights.
    #[held(skip)]
    pub kind: Arc<UptModel>,
    /// Tables of the scene's mesh.
    #[held(skip)]
    pub tables: Arc<UptTables>,
    /// The linear response; none where the network does not use it.
    pub linear: Option<Linear>,
    path: Path,
    native: NativeDecoder,
    decoders: Decoders,
    /// The nodes that the network decodes for the others to be interpolated from, where the bundle has anchors.
    anchors: AnchorField,
    /// The step being made.
    pub next: UptRecord,
    /// Last published.
    pub last: UptRecord,
    /// The one before.
    pub before: UptRecord,
}

/// What the native decoder works in.
#[derive(HeldBytes)]
struct NativeDecoder {
    #[held(skip)]
    precision: DecoderPrecision,
    /// Keys and values of the latent state that is decoded, packed for it.
    tokens: DecoderTokens,
    scratch: DecoderScratch,
}

const STATES: &str = "a scene's latent states";

impl UptEngine {
    /// Makes sessions and buffers.
    pub fn new(
        model: &Model,
        kind: &Arc<UptModel>,
        tables: &Arc<UptTables>,
        pool: &Pool,
        node_count: usize,
        choice: Choice,
    ) -> Result<UptEngine> {
        let dims = &kind.entry.dims;
        let uses_prior = kind.entry.needs_prior();
        let table = model.prior.as_ref().filter(|_| uses_prior);
        let kv = dims.latent_tokens * dims.decoder;
        let vibration = table.and_then(|table| table.vibration.as_ref());
        let zeros = |count| memory::zeros(count, STATES);
        let record = || {
            Ok::<_, Error>(UptRecord {
                keys: zeros(kv)?,
                values: zeros(kv)?,
                q_prior: zeros(table.map_or(0, |table| table.width()))?,
                prior_field: zeros(table.map_or(0, |_| 3 * node_count))?,
                vibration: zeros(vibration.map_or(0, |vibration| vibration.state_len()))?,
            })
        };
        let (runtime, plan, threads) = (model.runtime()?, &model.execution.plan, pool.threads());
        let path = if choice.whole {
            let stage = kind.step_stage(runtime, plan, threads, tables)?;
            Path::Whole(memory::boxed(stage, STATES)?)
        } else {
            let supernodes = tables.graph.supernodes.len();
            Path::Split {
                latent: {
                    let stage = kind.latent_stage(runtime, plan, threads, supernodes)?;
                    memory::boxed(stage, STATES)?
                },
                features: zeros(tables.encode_nodes.len() * kind.entry.feature_width())?,
                scratch: zeros(threads * dims.encoder)?,
            }
        };
        Ok(UptEngine {
            kind: Arc::clone(kind),
            tables: Arc::clone(tables),
            linear: table.map(Linear::new).transpose()?,
            path,
            native: NativeDecoder {
                precision: match choice.precision {
                    Precision::Bf16 => DecoderPrecision::fastest_bf16(),
                    _ => DecoderPrecision::F32,
                },
                tokens: DecoderTokens::try_new(&kind.decoder, dims.latent_tokens)?,
                scratch: DecoderScratch::try_new(
                    &kind.decoder,
                    dims.latent_tokens,
                    pool.threads(),
                )?,
            },
            decoders: Decoders::new(model, kind, tables, choice.kernel, threads)?,
            anchors: tables
                .anchors
                .as_ref()
                .map(|anchors| AnchorField::new(anchors, node_count))
                .transpose()?
                .unwrap_or_default(),
            next: record()?,
            last: record()?,
            before: record()?,
        })
    }

    /// Precision that the decoder runs in.
    pub fn precision(&self) -> Precision {
        match self.native.precision {
            _ if self.path() == StepPath::Whole || self.kernel() != DecoderKernel::Native => {
                self.kind.precision
            }
            DecoderPrecision::Bf16Vectors | DecoderPrecision::Bf16Tiles => Precision::Bf16,
            DecoderPrecision::F32 => Precision::F32,
        }
    }

    /// What decodes.
    pub fn kernel(&self) -> DecoderKernel {
        self.decoders.kernel()
    }

    /// Who makes a step.
    pub fn path(&self) -> StepPath {
        match self.path {
            Path::Split { .. } => StepPath::Split,
            Path::Whole(_) => StepPath::Whole,
        }
    }

    /// What runs the latent stage, or the whole step.
    pub fn stage(&self) -> &Stage {
        match &self.path {
            Path::Split { latent, .. } => latent,
            Path::Whole(stage) => stage,
        }
    }

    /// Wall time of the last step's copies to a device and back, ms.
    pub fn transfer_ms(&self) -> [f64; 2] {
        let step = self.stage().times();
        let decoder = match (&self.decoders, &self.path) {
            (Decoders::Resident(stage), Path::Split { .. }) => stage.times(),
            _ => Default::default(),
        };
        [
            step.upload + decoder.upload,
            step.download + decoder.download,
        ]
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.last.clear();
        self.before.clear();
    }

    /// Computes the latent state `next`.
    /// Stages in order: the linear response, the features of all encoder nodes, the network
    /// ([`UptEngine::network`]). Decoding is asked for later, for the nodes of the plan alone.
    pub fn predict(
        &mut self,
        compute: Compute<'_>,
        inputs: &Inputs<'_>,
        stats: &mut SceneStats,
    ) -> Result<()> {
        let mut watch = Stopwatch::start();
        let span = tracing::trace_span!("prior").entered();
        if let Some(linear) = &mut self.linear {
            let report = linear.solve_contact(compute.isa, inputs.held, inputs.contact)?;
            stats.flags |= solve_flags(report);
            let (touched, next) = (!inputs.contact.is_empty(), &mut self.next);
            let (last, swung, q) = (&self.last.vibration, &mut next.vibration, &mut next.q_prior);
            linear.respond(compute, touched, last, swung, q)?;
            linear.decode(compute, inputs.plan, &next.q_prior, &mut next.prior_field)?;
        }
        drop(span);
        stats.timing.prior_ms = watch.lap();
        if !inputs.learned {
            return Ok(());
        }
        let span = tracing::trace_span!("encode").entered();
        let features = match &mut self.path {
            Path::Split { features, .. } => features.as_mut_slice(),
            Path::Whole(stage) => stage.input(0),
        };
        fill_features(
            features,
            &self.kind,
            &self.tables,
            inputs,
            &self.next,
            &self.last,
        );
        drop(span);
        stats.timing.encode_ms = watch.lap();
        [stats.timing.aggregate_ms, stats.timing.latent_ms] = self.network(compute)?;
        Ok(())
    }

    /// Keys and values of `next` from the features, and on the whole path its displacements; wall time of the message
    /// mean and of the graph, ms.
    pub fn network(&mut self, compute: Compute<'_>) -> Result<[f64; 2]> {
        let (kind, tables) = (&self.kind, &self.tables);
        let mut watch = Stopwatch::start();
        let mut aggregate_ms = 0.0;
        let (stage, first) = match &mut self.path {
            Path::Split {
                latent,
                features,
                scratch,
            } => {
                let _span = tracing::trace_span!("aggregate").entered();
                let (d, f) = (kind.entry.dims.encoder, kind.entry.feature_width());
                let messages = Messages {
                    senders: Csr {
                        offsets: &tables.graph.offsets,
                        neighbours: &tables.neighbour_rows,
                    },
                    supernodes: &tables.supernode_rows,
                    source: LowRank::new(&tables.source_table, &kind.source_weight, d, f),
                    target: LowRank::new(&tables.target_table, &kind.target_weight, d, f),
                };
                encode_aggregate(compute, messages, features, scratch, latent.input(0))?;
                aggregate_ms = watch.lap();
                (latent, 0)
            }
            Path::Whole(stage) => (stage, 1),
        };
        let _span = tracing::trace_span!("latent").entered();
        stage.run()?;
        self.next.keys.copy_from_slice(stage.output(first));
        self.next.values.copy_from_slice(stage.output(first + 1));
        Ok([aggregate_ms, watch.lap()])
    }

    /// Recomputes the response's fields of the published records at a new plan's nodes.
    pub fn replan(&mut self, compute: Compute<'_>, plan: &NodePlan) -> Result<()> {
        let Some(linear) = &self.linear else {
            return Ok(());
        };
        for record in [&mut self.last, &mut self.before] {
            linear.decode(compute, plan, &record.q_prior, &mut record.prior_field)?;
        }
        Ok(())
    }

    /// `next` becomes `last`.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.before, &mut self.last);
        std::mem::swap(&mut self.last, &mut self.next);
    }
}
