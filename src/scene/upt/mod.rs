//! The step of kind `upt`: features -> low-rank encoder and message mean (native) -> `latent.onnx` -> decoder, or
//! `step.onnx` for all of it.

mod anchors;
mod decode;
mod decoders;
mod features;
mod prior;
mod record;
pub mod step_path;

pub use record::UptRecord;

use super::contact::ContactSet;
use super::plan::NodePlan;
use super::reduced::solve_flags;
use super::timing::Stopwatch;
use anchors::AnchorField;
use decoders::Decoders;
use features::fill_features;
use prior::{decode_prior, respond};

use crate::error::{Error, Result};
use crate::kernels::aggregate::{Csr, encode_aggregate};
use crate::kernels::decoder::{DecoderPrecision, DecoderScratch, DecoderTokens};
use crate::kernels::encode::LowRank;
use crate::kernels::{Isa, Pool};
use crate::memory;
use crate::model::{Model, UptModel, UptTables};
use crate::onnx::Stage;
use crate::options::{DecoderKernel, Precision, StepPath};
use crate::prior::{ContactResponse, PriorTable};
use crate::stats::SceneStats;

/// Who makes a step.
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
pub struct UptEngine {
    /// The contact solve; none where the bundle does not use its prior.
    pub response: Option<ContactResponse>,
    path: Path,
    tokens: DecoderTokens,
    decoder_scratch: DecoderScratch,
    decoders: Decoders,
    anchors: AnchorField,
    precision: DecoderPrecision,
    graphs: Precision,
    /// The step being made.
    pub next: UptRecord,
    /// Last published.
    pub last: UptRecord,
    /// The one before.
    pub before: UptRecord,
}

/// What the network runs on and with.
#[derive(Clone, Copy)]
pub struct Means<'a> {
    /// Instruction set of the kernels.
    pub isa: Isa,
    /// Threads.
    pub pool: &'a Pool,
    /// Weights.
    pub kind: &'a UptModel,
    /// Tables of the scene's mesh.
    pub tables: &'a UptTables,
}

/// What a step of this kind reads.
pub struct UptInput<'a> {
    /// `u[t]` `[K,3]`, valid at the encoder's nodes.
    pub displacement: &'a [f32],
    /// `u[t-1]` `[K,3]`.
    pub previous: &'a [f32],
    /// `c[t+1]`.
    pub contact: &'a ContactSet,
    /// Held nodes `[K]`.
    pub held: &'a [bool],
    /// Decoded nodes.
    pub plan: &'a NodePlan,
    /// Whether the network runs.
    pub learned: bool,
}

fn internal(error: impl std::fmt::Display) -> Error {
    Error::Panic(error.to_string())
}

impl UptEngine {
    /// Makes sessions and buffers.
    pub fn new(
        model: &Model,
        kind: &UptModel,
        tables: &UptTables,
        pool: &Pool,
        node_count: usize,
        choice: Choice,
    ) -> Result<UptEngine> {
        let dims = &kind.entry.dims;
        let uses_prior = kind.entry.needs_prior();
        let table = model.prior.as_ref().filter(|_| uses_prior);
        let kv = dims.latent_tokens * dims.decoder;
        let vibration = table.and_then(|table| table.vibration.as_ref());
        let zeros = |count| memory::zeros(count, "a scene's latent states");
        let record = || {
            Ok::<_, Error>(UptRecord {
                keys: zeros(kv)?,
                values: zeros(kv)?,
                q_prior: zeros(table.map_or(0, PriorTable::width))?,
                prior_field: zeros(table.map_or(0, |_| 3 * node_count))?,
                vibration: zeros(vibration.map_or(0, |vibration| 2 * vibration.count()))?,
            })
        };
        let (runtime, plan, threads) = (model.runtime()?, &model.plan, pool.threads());
        let path = if choice.whole {
            Path::Whole(Box::new(kind.step_stage(runtime, plan, threads, tables)?))
        } else {
            let supernodes = tables.graph.supernodes.len();
            Path::Split {
                latent: Box::new(kind.latent_stage(runtime, plan, threads, supernodes)?),
                features: zeros(tables.encode_nodes.len() * kind.entry.feature_width())?,
                scratch: zeros(threads * dims.encoder)?,
            }
        };
        Ok(UptEngine {
            response: table.map(ContactResponse::new).transpose()?,
            path,
            tokens: DecoderTokens::try_new(&kind.decoder, dims.latent_tokens)?,
            decoder_scratch: DecoderScratch::try_new(
                &kind.decoder,
                dims.latent_tokens,
                pool.threads(),
            )?,
            decoders: Decoders::new(model, kind, tables, choice.kernel, threads)?,
            anchors: tables
                .anchors
                .as_ref()
                .map(|anchors| AnchorField::new(anchors, node_count))
                .transpose()?
                .unwrap_or_default(),
            precision: if choice.precision == Precision::Bf16 && Isa::has_bf16() {
                DecoderPrecision::Bf16
            } else {
                DecoderPrecision::F32
            },
            graphs: kind.precision,
            next: record()?,
            last: record()?,
            before: record()?,
        })
    }

    /// Precision that the decoder runs in.
    pub fn precision(&self) -> Precision {
        match self.precision {
            _ if self.path() == StepPath::Whole || self.kernel() != DecoderKernel::Native => {
                self.graphs
            }
            DecoderPrecision::Bf16 => Precision::Bf16,
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
    pub fn predict(
        &mut self,
        means: Means<'_>,
        model: &Model,
        input: &UptInput<'_>,
        stats: &mut SceneStats,
    ) -> Result<()> {
        let Means { isa, pool, .. } = means;
        let mut watch = Stopwatch::start();
        let span = tracing::trace_span!("prior").entered();
        if let (Some(response), Some(table)) = (&mut self.response, &model.prior) {
            let report = respond(
                isa,
                pool,
                table,
                response,
                input.held,
                input.contact,
                &self.last,
                &mut self.next,
            )?;
            stats.flags |= solve_flags(report);
            let next = &mut self.next;
            decode_prior(
                isa,
                pool,
                table,
                input.plan,
                &next.q_prior,
                &mut next.prior_field,
            )?;
        }
        drop(span);
        stats.prior_ms = watch.lap();
        if !input.learned {
            return Ok(());
        }
        let span = tracing::trace_span!("encode").entered();
        let features = match &mut self.path {
            Path::Split { features, .. } => features.as_mut_slice(),
            Path::Whole(stage) => stage.input(0),
        };
        fill_features(
            features,
            means.kind,
            means.tables,
            input,
            &self.next,
            &self.last,
        );
        drop(span);
        stats.encode_ms = watch.lap();
        [stats.aggregate_ms, stats.latent_ms] = self.network(means)?;
        Ok(())
    }

    /// Keys and values of `next` from the features, and on the whole path its displacements; wall time of the message
    /// mean and of the graph, ms.
    pub fn network(&mut self, means: Means<'_>) -> Result<[f64; 2]> {
        let Means {
            isa,
            pool,
            kind,
            tables,
        } = means;
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
                encode_aggregate(
                    isa,
                    pool,
                    Csr {
                        offsets: &tables.graph.offsets,
                        neighbours: &tables.neighbour_rows,
                    },
                    &tables.supernode_rows,
                    LowRank::new(&tables.source_table, &kind.source_weight, d, f),
                    LowRank::new(&tables.target_table, &kind.target_weight, d, f),
                    features,
                    scratch,
                    latent.input(0),
                )
                .map_err(internal)?;
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

    /// `next` becomes `last`.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.before, &mut self.last);
        std::mem::swap(&mut self.last, &mut self.next);
    }

    /// Bytes of the buffers.
    pub fn memory_bytes(&self) -> usize {
        let own = match &self.path {
            Path::Split {
                features, scratch, ..
            } => 4 * (features.len() + scratch.len()),
            Path::Whole(_) => 0,
        };
        let response = self.response.as_ref();
        3 * self.next.memory_bytes()
            + own
            + self.stage().memory_bytes()
            + self.decoders.memory_bytes()
            + self.tokens.memory_bytes()
            + self.decoder_scratch.memory_bytes()
            + response.map_or(0, ContactResponse::memory_bytes)
            + self.anchors.memory_bytes()
    }
}
