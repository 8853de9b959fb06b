//! `decoder.onnx` in ONNX Runtime: in tiles on the CPU's cores, or with the whole query table resident on a device.

use std::sync::Mutex;

use super::record::UptRecord;
use crate::error::{Error, Result};
use crate::kernels::Pool;
use crate::memory::HeldBytes;
use crate::model::{DECODER_TILE, Model, UptModel, UptTables};
use crate::onnx::Stage;
use crate::options::DecoderKernel;

/// What decodes nodes of the mesh.
#[derive(HeldBytes)]
pub enum Decoders {
    /// The fused native kernel.
    Native,
    /// Tiles of [`DECODER_TILE`] nodes, one session a thread.
    Tiles(Vec<Mutex<Stage>>),
    /// All nodes in one run; the queries are bound once.
    Resident(Box<Stage>),
}

impl Decoders {
    /// Makes the sessions of a kernel, which is not [`DecoderKernel::Auto`].
    pub fn new(
        model: &Model,
        kind: &UptModel,
        tables: &UptTables,
        kernel: DecoderKernel,
        threads: usize,
    ) -> Result<Decoders> {
        Ok(match kernel {
            DecoderKernel::Auto | DecoderKernel::Native => Decoders::Native,
            DecoderKernel::Onnx => Decoders::Tiles(
                (0..threads)
                    .map(|_| {
                        Ok(Mutex::new(
                            kind.decoder_stage(model.runtime()?, &model.execution.plan)?,
                        ))
                    })
                    .collect::<Result<_>>()?,
            ),
            DecoderKernel::Resident => Decoders::Resident(Box::new(kind.resident_decoder(
                model.runtime()?,
                &model.execution.plan,
                threads,
                &tables.query_table,
            )?)),
        })
    }

    /// Which kernel it is.
    pub fn kernel(&self) -> DecoderKernel {
        match self {
            Decoders::Native => DecoderKernel::Native,
            Decoders::Tiles(_) => DecoderKernel::Onnx,
            Decoders::Resident(_) => DecoderKernel::Resident,
        }
    }
}

/// Decodes all nodes and takes the rows of `nodes`.
pub fn decode_resident(
    stage: &mut Stage,
    record: &UptRecord,
    nodes: &[u32],
    out: &mut [f32],
) -> Result<()> {
    stage.input(0).copy_from_slice(&record.keys);
    stage.input(1).copy_from_slice(&record.values);
    stage.run()?;
    take_rows(stage.output(0), nodes, out);
    Ok(())
}

/// Rows `nodes` of a field `[K,3]`.
pub fn take_rows(field: &[f32], nodes: &[u32], out: &mut [f32]) {
    for &node in nodes {
        let at = 3 * node as usize;
        out[at..at + 3].copy_from_slice(&field[at..at + 3]);
    }
}

/// A lock whose holder panicked: the scene that it belongs to is given up, as after any panic.
fn internal(error: impl std::fmt::Display) -> Error {
    Error::Panic(error.to_string())
}

/// The portable path: `decoder.onnx` over tiles of fixed size, one session a thread.
///
/// `queries [n,query]`, the same rows of `out [n,3]`; no node twice. All tiles are tried; the first error is returned, and
/// what `out` holds then does not count.
pub fn decode_tiles(
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
    })?;
    match failed.into_inner().unwrap_or_else(|e| e.into_inner()) {
        Some(error) => Err(error),
        None => Ok(()),
    }
}
