//! The layers of the decoder for one tile of nodes: features in rows, nodes in lanes.

use super::gemm::{BLOCK, Finish, multiply};
use super::pack::GROUP;
use super::scalar;
use super::weights::{DecoderTokens, PackedDecoder};
use crate::math::exp2_lanes;
use lanes::DenseLanes;
use lanes::{Isa, by_isa};

/// Nodes of the largest tile: the stack arrays of a tile are as long on every machine.
pub(super) const MAX_NODES: usize = 64;

/// Nodes of a tile: as many as the register tile of the set has lanes ([`body`]). The arrays of a
/// tile are meant to stay in the second-level cache through all layers.
pub(super) fn nodes(isa: Isa) -> usize {
    match isa {
        Isa::Avx512 => 48,
        Isa::Avx2 | Isa::Portable | Isa::PortableScalar => 16,
        Isa::Neon | Isa::Simd128 => 8,
        Isa::Scalar => 16,
    }
}

/// f32 numbers that a worker needs.
pub(super) fn scratch_floats(decoder: &PackedDecoder, tokens: usize) -> usize {
    Layout::new(decoder, tokens, MAX_NODES).total
}

/// Where a tile's arrays lie in the scratch space; all `[rows][nodes]`.
#[derive(Clone, Copy)]
pub(super) struct Layout {
    /// `x`, then `y` of the residual stream.
    pub stream: usize,
    /// `q`, then the normalised stream.
    pub input: usize,
    /// Attention's output.
    pub attention: usize,
    /// Scores of one head, or the MLP's hidden layer.
    pub hidden: usize,
    /// Room behind for bf16 pairs of the widest input.
    #[cfg_attr(
        not(target_arch = "x86_64"),
        expect(dead_code, reason = "only x86-64 multiplies bf16")
    )]
    pub pairs: usize,
    /// Numbers in all: what [`scratch_floats`] gives for the largest tile.
    pub total: usize,
}

impl Layout {
    /// For a tile of `nodes` nodes and `tokens` latent tokens. Every array begins at a whole number of rows, so that each
    /// row is as aligned as the first.
    pub(super) fn new(decoder: &PackedDecoder, tokens: usize, nodes: usize) -> Self {
        // A head's last group may write up to 7 rows beyond its own.
        let h = (decoder.hidden + GROUP).next_multiple_of(GROUP);
        let wide = tokens.max(decoder.mlp).next_multiple_of(GROUP);
        let widest = wide.max(h);
        Self {
            stream: 0,
            input: h * nodes,
            attention: 2 * h * nodes,
            hidden: 3 * h * nodes,
            pairs: (3 * h + wide) * nodes,
            total: (3 * h + wide + widest.next_multiple_of(super::amx::DEPTH) / 2) * nodes,
        }
    }
}

by_isa! {
    /// Decodes the nodes `rows` (as many as [`nodes`] says) to `out [3][rows]`.
    pub(super) fn tile(decoder: &PackedDecoder, tokens: &DecoderTokens, queries: &[f32], rows: &[usize],
        scratch: &mut [f32], out: &mut [f32]) = body, scalar_tile;
}

/// The readable reference behind the same door, for `UPT_ISA=scalar`; it needs no scratch space.
fn scalar_tile(
    decoder: &PackedDecoder,
    tokens: &DecoderTokens,
    queries: &[f32],
    rows: &[usize],
    scratch: &mut [f32],
    out: &mut [f32],
) {
    scalar::tile(decoder, tokens, queries, rows, scratch, out);
}

/// Chooses the register tile, `R` outputs by `C` registers of nodes: 8 x 3 of the 32 registers of AVX-512, 4 x 2 of the 16
/// of AVX2, 8 x 2 of NEON's 32. `C V::COUNT` is what [`nodes`] says for the instruction set.
///
/// # Safety
/// The instruction set of `V` is there, and every row lies in the query table.
#[inline(always)]
unsafe fn body<V: DenseLanes>(
    decoder: &PackedDecoder,
    tokens: &DecoderTokens,
    queries: &[f32],
    rows: &[usize],
    scratch: &mut [f32],
    out: &mut [f32],
) {
    // SAFETY: the caller's; the shape of the register tile fits the number of registers.
    unsafe {
        match V::COUNT {
            16 => layers::<V, 8, 3>(decoder, tokens, queries, rows, scratch, out),
            8 => layers::<V, 4, 2>(decoder, tokens, queries, rows, scratch, out),
            _ => layers::<V, 8, 2>(decoder, tokens, queries, rows, scratch, out),
        }
    }
}

/// All layers for one tile. Arrays are `[rows][nodes]`: a node is a lane, and no lane reads another, so a node's bits do
/// not depend on its neighbours in the tile. The order of the layers is that of the module's equation.
///
/// # Safety
/// As [`body`].
#[inline(always)]
unsafe fn layers<V: DenseLanes, const R: usize, const C: usize>(
    decoder: &PackedDecoder,
    tokens: &DecoderTokens,
    queries: &[f32],
    rows: &[usize],
    scratch: &mut [f32],
    out: &mut [f32],
) {
    let (h, nodes) = (decoder.hidden, C * V::COUNT);
    let at = Layout::new(decoder, tokens.len(), nodes);
    assert!(rows.len() == nodes && out.len() == 3 * nodes && scratch.len() >= at.total);
    // SAFETY: every array lies inside `scratch` by its layout; rows were checked by `decode`.
    unsafe {
        let scratch = scratch.as_mut_ptr();
        let (stream, input) = (scratch.add(at.stream), scratch.add(at.input));
        let (attended, hidden) = (scratch.add(at.attention), scratch.add(at.hidden));
        gather::<V>(queries, rows, 2 * h, 0, h, stream);
        gather::<V>(queries, rows, 2 * h, h, h, input);
        let width = h / decoder.heads;
        for head in 0..decoder.heads {
            let first = head * width * nodes;
            let keys = tokens.key_panels(head);
            multiply::<V, R, C>(keys, width, input.add(first), hidden, Finish::Plain);
            let mut scale = [0.0f32; MAX_NODES];
            exponentials::<V, C>(hidden, tokens.len(), scale.as_mut_ptr());
            let values = tokens.value_panels(head);
            let finish = Finish::Scale(scale.as_ptr());
            multiply::<V, R, C>(values, tokens.len(), hidden, attended.add(first), finish);
        }
        let layer = &decoder.attention_out;
        let finish = Finish::Residual(layer.bias.as_ptr());
        multiply::<V, R, C>(&layer.panels, h, attended, stream, finish);
        normalise::<V, C>(stream, h, input);
        let layer = &decoder.mlp1;
        let finish = Finish::Gelu(layer.bias.as_ptr());
        multiply::<V, R, C>(&layer.panels, h, input, hidden, finish);
        let layer = &decoder.mlp2;
        let finish = Finish::Residual(layer.bias.as_ptr());
        multiply::<V, R, C>(&layer.panels, decoder.mlp, hidden, stream, finish);
        normalise::<V, C>(stream, h, input);
        head::<V, C>(decoder, input, out.as_mut_ptr());
    }
}

/// `to[k][i] = table[rows[i]][column + k]` for `k < count`.
#[inline(always)]
/// Rows of the table are nodes and become lanes: blocks of `V::COUNT` by `V::COUNT` are turned in
/// registers, what is left of a row number by number.
pub(super) unsafe fn gather<V: DenseLanes>(
    table: &[f32],
    rows: &[usize],
    width: usize,
    column: usize,
    count: usize,
    to: *mut f32,
) {
    let stride = rows.len();
    for (part, rows) in rows.chunks_exact(V::COUNT).enumerate() {
        let mut offsets = [0usize; 16];
        for (offset, row) in offsets.iter_mut().zip(rows) {
            *offset = row * width + column;
        }
        let whole = count - count % V::COUNT;
        // SAFETY: the caller's.
        unsafe {
            let to = to.add(part * V::COUNT);
            for k in (0..whole).step_by(V::COUNT) {
                V::transpose(table.as_ptr().add(k), &offsets, to.add(k * stride), stride);
            }
            for k in whole..count {
                for (i, offset) in offsets[..V::COUNT].iter().enumerate() {
                    *to.add(k * stride + i) = *table.as_ptr().add(offset + k);
                }
            }
        }
    }
}

/// `s = 2^(s - max s)` over the tokens of each node, and one over the sum to `scale`.
#[inline(always)]
/// Nodes keep unscaled weights in `scores`; the scale is applied to the product with the values,
/// which has fewer rows than there are tokens. Sums are in chains as in [`super::gemm`].
pub(super) unsafe fn exponentials<V: DenseLanes, const C: usize>(
    scores: *mut f32,
    tokens: usize,
    scale: *mut f32,
) {
    let stride = C * V::COUNT;
    // SAFETY: the caller's.
    unsafe {
        let mut largest = [V::splat(f32::NEG_INFINITY); C];
        for l in 0..tokens {
            for c in 0..C {
                // A NaN score stays a NaN in the exponential below.
                largest[c] = largest[c].max(V::load(scores.add(l * stride + c * V::COUNT)));
            }
        }
        let mut sum = [V::splat(0.0); C];
        for start in (0..tokens).step_by(BLOCK) {
            let mut part = [V::splat(0.0); C];
            for l in start..(start + BLOCK).min(tokens) {
                for c in 0..C {
                    let at = scores.add(l * stride + c * V::COUNT);
                    let weight = exp2_lanes(V::load(at).sub(largest[c]));
                    weight.store(at);
                    part[c] = part[c].add(weight);
                }
            }
            for c in 0..C {
                sum[c] = sum[c].add(part[c]);
            }
        }
        for c in 0..C {
            V::splat(1.0).div(sum[c]).store(scale.add(c * V::COUNT));
        }
    }
}

/// `y = (x - mean x) / sqrt(var x + eps)` over the features of each node.
#[inline(always)]
/// Two passes: the variance of what is left after the mean does not cancel, as the difference of
/// the mean square and the squared mean would.
pub(super) unsafe fn normalise<V: DenseLanes, const C: usize>(
    x: *const f32,
    h: usize,
    y: *mut f32,
) {
    let stride = C * V::COUNT;
    let share = 1.0 / h as f32;
    // SAFETY: the caller's.
    unsafe {
        let mut mean = [V::splat(0.0); C];
        for start in (0..h).step_by(BLOCK) {
            let mut part = [V::splat(0.0); C];
            for k in start..(start + BLOCK).min(h) {
                for c in 0..C {
                    part[c] = part[c].add(V::load(x.add(k * stride + c * V::COUNT)));
                }
            }
            for c in 0..C {
                mean[c] = mean[c].add(part[c]);
            }
        }
        for c in 0..C {
            mean[c] = mean[c].mul(V::splat(share));
        }
        let mut variance = [V::splat(0.0); C];
        for start in (0..h).step_by(BLOCK) {
            let mut part = [V::splat(0.0); C];
            for k in start..(start + BLOCK).min(h) {
                for c in 0..C {
                    let d = V::load(x.add(k * stride + c * V::COUNT)).sub(mean[c]);
                    part[c] = d.mul_add(d, part[c]);
                }
            }
            for c in 0..C {
                variance[c] = variance[c].add(part[c]);
            }
        }
        let mut scale = variance;
        for c in 0..C {
            let root = variance[c].mul_add(V::splat(share), V::splat(scalar::EPS));
            scale[c] = V::splat(1.0).div(root.sqrt());
        }
        for k in 0..h {
            for c in 0..C {
                let at = k * stride + c * V::COUNT;
                V::load(x.add(at))
                    .sub(mean[c])
                    .mul(scale[c])
                    .store(y.add(at));
            }
        }
    }
}

/// `out [3][nodes] = W_3 x + b_3`.
#[inline(always)]
/// Only three of the group's eight outputs exist; [`multiply`] would compute all.
pub(super) unsafe fn head<V: DenseLanes, const C: usize>(
    decoder: &PackedDecoder,
    x: *const f32,
    out: *mut f32,
) {
    let (h, stride) = (decoder.hidden, C * V::COUNT);
    let layer = &decoder.head;
    // SAFETY: the caller's.
    unsafe {
        let mut sum = [[V::splat(0.0); C]; 3];
        for k in 0..h {
            for c in 0..C {
                let x = V::load(x.add(k * stride + c * V::COUNT));
                for axis in 0..3 {
                    let w = V::splat(*layer.panels.as_ptr().add(k * GROUP + axis));
                    sum[axis][c] = x.mul_add(w, sum[axis][c]);
                }
            }
        }
        for axis in 0..3 {
            let bias = V::splat(layer.bias[axis]);
            for c in 0..C {
                sum[axis][c]
                    .add(bias)
                    .store(out.add(axis * stride + c * V::COUNT));
            }
        }
    }
}
