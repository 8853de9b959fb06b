//! The step of kind `upt`: features -> low-rank encoder and message mean (native) -> `latent.onnx` -> decoder tiles.

use std::sync::Mutex;

use super::contact::ContactSet;
use super::engine::Which;
use super::plan::NodePlan;
use super::reduced::solve_flags;
use super::timing::Stopwatch;
use super::upt_prior::{decode_prior, respond};
use crate::bundle::Feature;
use crate::error::{Error, Result};
use crate::kernels::aggregate::{Csr, encode_aggregate};
use crate::kernels::decoder::{
    DecoderPrecision, DecoderRows, DecoderScratch, DecoderTokens, decode,
};
use crate::kernels::encode::LowRank;
use crate::kernels::{Isa, Pool};
use crate::model::{DECODER_TILE, Model, UptModel, UptTables};
use crate::onnx::Stage;
use crate::options::{DecoderKernel, Precision};
use crate::prior::{ContactResponse, PriorTable};
use crate::stats::SceneStats;

/// The latent state after one step.
#[derive(Debug, Clone)]
pub struct UptRecord {
    /// Decoder keys `[L,h]`.
    pub keys: Vec<f32>,
    /// Decoder values `[L,h]`.
    pub values: Vec<f32>,
    /// Linear response, or its free vibration without contact, in block coordinates; empty where the bundle does not use it.
    pub q_prior: Vec<f32>,
    /// The same at the plan's nodes `[K,3]`; empty where the bundle does not use it.
    pub prior_field: Vec<f32>,
    /// Amplitudes `[m]` of the free modes, mm, and their velocities times the step `[m]`; empty where there are none.
    pub vibration: Vec<f32>,
}

/// Buffers and sessions of a scene of kind `upt`.
pub struct UptEngine {
    response: Option<ContactResponse>,
    latent: Stage,
    features: Vec<f32>,
    scratch: Vec<f32>,
    tokens: DecoderTokens,
    decoder_scratch: DecoderScratch,
    decoder_stages: Vec<Mutex<Stage>>,
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

impl UptRecord {
    /// Rest.
    pub fn clear(&mut self) {
        for values in [
            &mut self.keys,
            &mut self.values,
            &mut self.q_prior,
            &mut self.prior_field,
            &mut self.vibration,
        ] {
            values.fill(0.0);
        }
    }
}

impl UptEngine {
    /// Makes sessions and buffers.
    pub fn new(
        model: &Model,
        kind: &UptModel,
        tables: &UptTables,
        pool: &Pool,
        node_count: usize,
        kernel: DecoderKernel,
        precision: Precision,
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
        let decoder_stages = if kernel == DecoderKernel::Onnx {
            (0..pool.threads())
                .map(|_| Ok(Mutex::new(kind.decoder_stage(model.runtime, &model.plan)?)))
                .collect::<Result<_>>()?
        } else {
            Vec::new()
        };
        Ok(UptEngine {
            response: table.map(ContactResponse::new),
            latent: kind.latent_stage(
                model.runtime,
                &model.plan,
                pool.threads(),
                tables.graph.supernodes.len(),
            )?,
            features: vec![0.0; tables.encode_nodes.len() * kind.entry.feature_width()],
            scratch: vec![0.0; pool.threads() * dims.encoder],
            tokens: DecoderTokens::new(&kind.decoder, dims.latent_tokens),
            decoder_scratch: DecoderScratch::new(&kind.decoder, dims.latent_tokens, pool.threads()),
            decoder_stages,
            precision: if precision == Precision::Bf16 && Isa::has_bf16() {
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
            _ if !self.decoder_stages.is_empty() => self.graphs,
            DecoderPrecision::Bf16 => Precision::Bf16,
            DecoderPrecision::F32 => Precision::F32,
        }
    }

    /// What decodes.
    pub fn kernel(&self) -> DecoderKernel {
        if self.decoder_stages.is_empty() {
            DecoderKernel::Native
        } else {
            DecoderKernel::Onnx
        }
    }

    /// What runs the latent stage.
    pub fn stage(&self) -> &Stage {
        &self.latent
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
        self.fill_features(kind, tables, input);
        drop(span);
        stats.encode_ms = watch.lap();
        let span = tracing::trace_span!("aggregate").entered();
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
            &self.features,
            &mut self.scratch,
            self.latent.input(0),
        )
        .map_err(internal)?;
        drop(span);
        stats.aggregate_ms = watch.lap();
        let _span = tracing::trace_span!("latent").entered();
        self.latent.run()?;
        self.next.keys.copy_from_slice(self.latent.output(0));
        self.next.values.copy_from_slice(self.latent.output(1));
        stats.latent_ms = watch.lap();
        Ok(())
    }

    fn fill_features(&mut self, kind: &UptModel, tables: &UptTables, input: &UptInput<'_>) {
        let width = kind.entry.feature_width();
        let normalisation = &kind.entry.normalisation;
        let (mean, std) = (normalisation.mean, normalisation.std);
        let mut column = 0;
        for &feature in &kind.entry.features {
            let field = match feature {
                Feature::Displacement => Some(input.displacement),
                Feature::PreviousDisplacement => Some(input.previous),
                Feature::Prior => Some(self.next.prior_field.as_slice()),
                Feature::PreviousPrior => Some(self.last.prior_field.as_slice()),
                Feature::Collision | Feature::Contact => None,
            };
            let rows = self.features.chunks_exact_mut(width);
            match field {
                Some(field) => {
                    for (row, &node) in rows.zip(&tables.encode_nodes) {
                        for axis in 0..3 {
                            let x = field[3 * node as usize + axis];
                            row[column + axis] = (x - mean[axis]) / std[axis];
                        }
                    }
                }
                None if feature == Feature::Collision => {
                    let zero = [0, 1, 2].map(|axis| (0.0 - mean[axis]) / std[axis]);
                    rows.for_each(|row| row[column..column + 3].copy_from_slice(&zero));
                }
                None => rows.for_each(|row| row[column] = 0.0),
            }
            if field.is_none() {
                for (&node, c) in input
                    .contact
                    .nodes
                    .iter()
                    .zip(input.contact.vectors.chunks_exact(3))
                {
                    let row = tables.row_of_node[node as usize];
                    if row == u32::MAX {
                        continue;
                    }
                    let row = &mut self.features[row as usize * width..(row as usize + 1) * width];
                    if feature == Feature::Contact {
                        row[column] = 1.0;
                    } else {
                        for axis in 0..3 {
                            row[column + axis] = (c[axis] - mean[axis]) / std[axis];
                        }
                    }
                }
            }
            column += feature.width();
        }
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
        if self.decoder_stages.is_empty() {
            self.tokens
                .set(self.precision, &record.keys, &record.values);
            return decode(
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
            .map_err(internal);
        }
        decode_tiles(
            &self.decoder_stages,
            pool,
            kind.entry.dims.query,
            record,
            queries,
            nodes,
            out,
        )
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
        4 * (3 * floats + self.features.len() + self.scratch.len())
    }
}

/// The portable path: `decoder.onnx` over tiles of fixed size, one session a thread.
fn decode_tiles(
    stages: &[Mutex<Stage>],
    pool: &Pool,
    query: usize,
    record: &UptRecord,
    queries: &[f32],
    nodes: &[u32],
    out: &mut [f32],
) -> Result<()> {
    let failed: Mutex<Option<Error>> = Mutex::new(None);
    let parts = crate::kernels::parts::Parts::new(out);
    for stage in stages {
        let mut stage = stage.lock().map_err(internal)?;
        stage.input(1).copy_from_slice(&record.keys);
        stage.input(2).copy_from_slice(&record.values);
    }
    pool.run(nodes.len().div_ceil(DECODER_TILE), &|chunk, worker| {
        let tile = &nodes[chunk * DECODER_TILE..((chunk + 1) * DECODER_TILE).min(nodes.len())];
        let run = || -> Result<()> {
            let mut stage = stages[worker].lock().map_err(internal)?;
            let input = stage.input(0);
            for (row, &node) in input.chunks_exact_mut(query).zip(tile) {
                row.copy_from_slice(&queries[node as usize * query..(node as usize + 1) * query]);
            }
            input[tile.len() * query..].fill(0.0);
            stage.run()?;
            for (u, &node) in stage.output(0).chunks_exact(3).zip(tile) {
                // SAFETY: no node is in the list twice, so its row belongs to this chunk alone.
                unsafe { parts.part(3 * node as usize, 3) }.copy_from_slice(u);
            }
            Ok(())
        };
        if let Err(error) = run() {
            failed
                .lock()
                .unwrap_or_else(|e| e.into_inner())
                .get_or_insert(error);
        }
    })
    .map_err(internal)?;
    match failed.into_inner().unwrap_or_else(|e| e.into_inner()) {
        Some(error) => Err(error),
        None => Ok(()),
    }
}
