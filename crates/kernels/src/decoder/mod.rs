//! The fused decoder of a `upt` bundle, node tiles through all layers while they are in cache:
//!
//! `y = x + W_o softmax(q K^T / sqrt(h/heads)) V + b_o`, `y = y + W_2 GELU(W_1 LN_2(y) + b_1) + b_2`,
//! `out = W_3 LN_3(y) + b_3`, LayerNorm eps 1e-6, exact GELU; `[x | q]` a row of the query table.
//!
//! Nodes lie in the lanes, so every sum over features or latent tokens runs within a lane in one
//! fixed order: what a node gets does not depend on its place in a tile, on the other nodes or on
//! threads, and a region has the bits of the full decode. `weights` packs once a model and once a
//! step, `gemm` is the micro-kernel, `tile` the layers, `scalar` the readable reference.

// On other processors nothing computes in bf16; only sizes are read.
#[cfg_attr(not(target_arch = "x86_64"), allow(dead_code))]
mod amx;
mod bf16;
mod gemm;
#[cfg_attr(not(target_arch = "x86_64"), allow(dead_code))]
mod pack;
mod precision;
pub mod probe;
mod scalar;
mod tile;
#[cfg_attr(not(target_arch = "x86_64"), allow(dead_code))]
mod weights;

pub use precision::DecoderPrecision;
pub use weights::{DecoderTokens, DecoderWeights, PackedDecoder};

use super::Compute;
use super::parts::Parts;
use super::pool::PoolError;
use field::memory::{self, HeldBytes};
use lanes::Isa;

/// Which nodes to decode, and where each goes.
#[derive(Debug, Clone, Copy)]
pub enum DecoderRows<'a> {
    /// All rows of the query table; `out [n,3]`.
    All,
    /// Row `rows[i]` to row `i` of `out [rows,3]`.
    Compact(&'a [u32]),
    /// Row `rows[i]` to the same row of `out [n,3]`; no row twice. Others keep their values.
    Scatter(&'a [u32]),
}

/// Working memory of the threads, made once; `len` grows with the model's widths only.
#[derive(Debug, Default, HeldBytes)]
pub struct DecoderScratch {
    /// One part after another, a part a worker: `[threads * a_worker]`. Cache lines, so that loads
    /// are aligned and no two workers write to one line.
    blocks: Vec<CacheLine>,
    /// Lines of a worker's part.
    a_worker: usize,
}

/// Sixteen f32 on a cache line of their own.
#[repr(align(64))]
#[derive(Debug, Clone, Copy, HeldBytes)]
pub(super) struct CacheLine(pub(super) [f32; 16]);

impl DecoderScratch {
    /// Room for `threads` workers on tiles of any instruction set.
    pub fn new(decoder: &PackedDecoder, tokens: usize, threads: usize) -> Self {
        Self::try_new(decoder, tokens, threads).expect("memory for the decoder's threads")
    }

    /// As [`DecoderScratch::new`].
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn try_new(
        decoder: &PackedDecoder,
        tokens: usize,
        threads: usize,
    ) -> field::error::Result<Self> {
        let a_worker = tile::scratch_floats(decoder, tokens).div_ceil(16);
        let line = CacheLine([0.0; 16]);
        Ok(Self {
            blocks: memory::filled(a_worker * threads, line, "the decoder's threads")?,
            a_worker,
        })
    }
}

/// What is decoded, and by what.
#[derive(Clone, Copy)]
pub struct Decoding<'a> {
    /// The weights.
    pub decoder: &'a PackedDecoder,
    /// Arithmetic of the matrix products.
    pub precision: DecoderPrecision,
    /// Keys and values of the latent state.
    pub tokens: &'a DecoderTokens,
    /// The query table `[n, 2h]`.
    pub queries: &'a [f32],
    /// Which of its rows.
    pub rows: DecoderRows<'a>,
}

/// Decodes rows of the query table: displacement, mm, before the bundle's `base` is added. `out` as [`DecoderRows`] says.
///
/// # Errors
/// [`PoolError::Panicked`] where a row lies outside the query table.
///
/// # Panics
/// If `queries` or `out` has another shape, or `scratch` is too small for the model or the pool.
pub fn decode(
    compute: Compute<'_>,
    what: Decoding<'_>,
    scratch: &mut DecoderScratch,
    out: &mut [f32],
) -> Result<(), PoolError> {
    let Compute { isa, pool } = compute;
    let Decoding {
        decoder,
        precision,
        tokens,
        queries,
        rows,
    } = what;
    let width = 2 * decoder.hidden;
    assert!(
        queries.len().is_multiple_of(width),
        "queries must be [n, 2h]"
    );
    let n = queries.len() / width;
    let (count, out_rows) = match rows {
        DecoderRows::All => (n, n),
        DecoderRows::Compact(rows) => (rows.len(), rows.len()),
        DecoderRows::Scatter(rows) => (rows.len(), n),
    };
    assert_eq!(out.len(), 3 * out_rows, "out must be [rows, 3]");
    assert_eq!(
        tokens.hidden(),
        decoder.hidden,
        "keys and values of another model"
    );
    let needed = tile::scratch_floats(decoder, tokens.len()).div_ceil(16);
    assert!(
        scratch.a_worker >= needed && scratch.blocks.len() >= scratch.a_worker * pool.threads(),
        "scratch made for a smaller model or fewer threads"
    );
    let tiles = precision == DecoderPrecision::Bf16Tiles && isa == Isa::Avx512;
    let vectors = precision == DecoderPrecision::Bf16Vectors && isa == Isa::Avx512;
    // What the machine or the system lacks falls back to f32 without an error: the option is a
    // wish.
    let bf16 = tiles && amx::is_available() || vectors && Isa::has_bf16();
    let nodes = if bf16 { amx::NODES } else { tile::nodes(isa) };
    let (parts, a_worker) = (Parts::new(out), scratch.a_worker);
    let scratch = Parts::new(&mut scratch.blocks);
    pool.run(count.div_ceil(nodes), &|chunk, worker| {
        let start = chunk * nodes;
        let end = (start + nodes).min(count);
        // SAFETY: this worker's part alone; a cache line is sixteen f32.
        let scratch = unsafe {
            let lines = scratch.part(worker * a_worker, a_worker);
            std::slice::from_raw_parts_mut(lines.as_mut_ptr().cast::<f32>(), 16 * a_worker)
        };
        let mut input = [0usize; tile::MAX_NODES];
        let mut output = [0usize; tile::MAX_NODES];
        for (lane, i) in (start..end).enumerate() {
            (input[lane], output[lane]) = match rows {
                DecoderRows::All => (i, i),
                DecoderRows::Compact(rows) => (rows[i] as usize, i),
                DecoderRows::Scatter(rows) => (rows[i] as usize, rows[i] as usize),
            };
            assert!(
                input[lane] < n,
                "row {} lies outside the query table",
                input[lane]
            );
        }
        let input = &mut input[..nodes];
        let last = input[end - start - 1];
        input[end - start..].fill(last);
        let mut result = [0.0f32; 3 * tile::MAX_NODES];
        let result = &mut result[..3 * nodes];
        if bf16 {
            bf16::tile(tiles, decoder, tokens, queries, input, scratch, result);
        } else {
            tile::tile(isa, decoder, tokens, queries, input, scratch, result);
        }
        for (lane, &row) in output[..end - start].iter().enumerate() {
            for axis in 0..3 {
                // SAFETY: each output row is in one chunk only.
                unsafe { parts.write(3 * row + axis, result[axis * nodes + lane]) };
            }
        }
    })
}

#[cfg(test)]
mod tests;
