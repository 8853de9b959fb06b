//! The step of kind `upt`: features -> low-rank encoder and message mean (native) -> `latent.onnx` -> decoder, or
//! `step.onnx` for all of it.

use super::anchors::AnchorField;
use super::contact::ContactSet;
use super::decoders::{Decoders, decode_resident, decode_tiles, take_rows};
use super::engine::Which;
use super::features::fill_features;
use super::plan::NodePlan;
use super::reduced::solve_flags;
use super::timing::Stopwatch;
use super::upt_prior::{decode_prior, respond};
use super::upt_record::UptRecord;
use crate::error::{Error, Result};
use crate::kernels::aggregate::{Csr, encode_aggregate};
use crate::kernels::decoder::{
    DecoderPrecision, DecoderRows, DecoderScratch, DecoderTokens, decode,
};
use crate::kernels::encode::LowRank;
use crate::kernels::{Isa, Pool};
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
        let record = UptRecord {
            keys: vec![0.0; kv],
            values: vec![0.0; kv],
            q_prior: vec![0.0; table.map_or(0, PriorTable::width)],
            prior_field: vec![0.0; table.map_or(0, |_| 3 * node_count)],
            vibration: vec![
                0.0;
                table
                    .and_then(|table| table.vibration.as_ref())
                    .map_or(0, |vibration| 2 * vibration.count())
            ],
        };
        let (runtime, plan, threads) = (model.runtime, &model.plan, pool.threads());
        let path = if choice.whole {
            Path::Whole(Box::new(kind.step_stage(runtime, plan, threads, tables)?))
        } else {
            let supernodes = tables.graph.supernodes.len();
            Path::Split {
                latent: Box::new(kind.latent_stage(runtime, plan, threads, supernodes)?),
                features: vec![0.0; tables.encode_nodes.len() * kind.entry.feature_width()],
                scratch: vec![0.0; threads * dims.encoder],
            }
        };
        Ok(UptEngine {
            response: table.map(ContactResponse::new),
            path,
            tokens: DecoderTokens::new(&kind.decoder, dims.latent_tokens),
            decoder_scratch: DecoderScratch::new(&kind.decoder, dims.latent_tokens, pool.threads()),
            decoders: Decoders::new(model, kind, tables, choice.kernel, threads)?,
            anchors: tables
                .anchors
                .as_ref()
                .map(|anchors| AnchorField::new(anchors, node_count))
                .unwrap_or_default(),
            precision: if choice.precision == Precision::Bf16 && Isa::has_bf16() {
                DecoderPrecision::Bf16
            } else {
                DecoderPrecision::F32
            },
            graphs: kind.precision,
            next: record.clone(),
            last: record.clone(),
            before: record,
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
    #[allow(clippy::too_many_arguments)]
    pub fn predict(
        &mut self,
        isa: Isa,
        pool: &Pool,
        model: &Model,
        kind: &UptModel,
        tables: &UptTables,
        input: &UptInput<'_>,
        stats: &mut SceneStats,
    ) -> Result<()> {
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
        let span = tracing::trace_span!("encode").entered();
        let features = match &mut self.path {
            Path::Split { features, .. } => features.as_mut_slice(),
            Path::Whole(stage) => stage.input(0),
        };
        fill_features(features, kind, tables, input, &self.next, &self.last);
        drop(span);
        stats.encode_ms = watch.lap();
        [stats.aggregate_ms, stats.latent_ms] = self.network(isa, pool, kind, tables)?;
        Ok(())
    }

    /// Keys and values of `next` from the features, and on the whole path its displacements; wall time of the message
    /// mean and of the graph, ms.
    pub fn network(
        &mut self,
        isa: Isa,
        pool: &Pool,
        kind: &UptModel,
        tables: &UptTables,
    ) -> Result<[f64; 2]> {
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

    /// Decodes nodes of the scene's mesh into a field `[K,3]`, before the base is added; where the bundle has anchors, at
    /// those that the nodes need, and interpolates.
    #[allow(clippy::too_many_arguments)]
    pub fn decode_mesh(
        &mut self,
        isa: Isa,
        pool: &Pool,
        kind: &UptModel,
        tables: &UptTables,
        which: Which,
        nodes: &[u32],
        out: &mut [f32],
    ) -> Result<()> {
        let Some(table) = &tables.anchors else {
            return self.decode_nodes(isa, pool, kind, tables, which, nodes, out);
        };
        let mut anchors = std::mem::take(&mut self.anchors);
        let (needed, field) = anchors.needed(table, nodes);
        let done = self.decode_nodes(isa, pool, kind, tables, which, needed, field);
        let done = done.and_then(|()| anchors.interpolate(pool, table, nodes, out));
        self.anchors = anchors;
        done
    }

    #[allow(clippy::too_many_arguments)]
    fn decode_nodes(
        &mut self,
        isa: Isa,
        pool: &Pool,
        kind: &UptModel,
        tables: &UptTables,
        which: Which,
        nodes: &[u32],
        out: &mut [f32],
    ) -> Result<()> {
        if let (Path::Whole(stage), Which::Next) = (&self.path, which) {
            take_rows(stage.output(0), nodes, out);
            return Ok(());
        }
        if let Decoders::Resident(stage) = &mut self.decoders {
            let record = match which {
                Which::Next => &self.next,
                Which::Last => &self.last,
                Which::Before => &self.before,
            };
            return decode_resident(stage, record, nodes, out);
        }
        self.decode_network(isa, pool, kind, which, &tables.query_table, nodes, out)
    }

    /// Decodes rows `nodes` of a query table into the same rows of `out`, before the base is added.
    #[allow(clippy::too_many_arguments)]
    pub fn decode_network(
        &mut self,
        isa: Isa,
        pool: &Pool,
        kind: &UptModel,
        which: Which,
        queries: &[f32],
        nodes: &[u32],
        out: &mut [f32],
    ) -> Result<()> {
        let record = match which {
            Which::Next => &self.next,
            Which::Last => &self.last,
            Which::Before => &self.before,
        };
        if let Decoders::Tiles(stages) = &self.decoders {
            let width = kind.entry.dims.query;
            return decode_tiles(stages, pool, width, record, queries, nodes, out);
        }
        self.tokens
            .set(self.precision, &record.keys, &record.values);
        decode(
            isa,
            pool,
            self.precision,
            &kind.decoder,
            &self.tokens,
            queries,
            DecoderRows::Scatter(nodes),
            &mut self.decoder_scratch,
            out,
        )
        .map_err(internal)
    }

    /// `next` becomes `last`.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.before, &mut self.last);
        std::mem::swap(&mut self.last, &mut self.next);
    }

    /// Recomputes the prior fields of the published records at a new plan's nodes.
    pub fn replan(
        &mut self,
        isa: Isa,
        pool: &Pool,
        table: Option<&PriorTable>,
        plan: &NodePlan,
    ) -> Result<()> {
        let Some(table) = table.filter(|_| self.response.is_some()) else {
            return Ok(());
        };
        for record in [&mut self.last, &mut self.before] {
            decode_prior(
                isa,
                pool,
                table,
                plan,
                &record.q_prior,
                &mut record.prior_field,
            )?;
        }
        Ok(())
    }

    /// Bytes of the buffers.
    pub fn memory_bytes(&self) -> usize {
        let record = &self.next;
        let floats = record.keys.len()
            + record.values.len()
            + record.q_prior.len()
            + record.prior_field.len()
            + record.vibration.len();
        let own = match &self.path {
            Path::Split {
                features, scratch, ..
            } => features.len() + scratch.len(),
            Path::Whole(_) => 0,
        };
        4 * (3 * floats + own) + self.anchors.memory_bytes()
    }
}
