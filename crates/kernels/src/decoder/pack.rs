//! Matrices in the order in which the micro-kernels read them: groups of eight outputs, in float32 and in pairs of bf16, and blocks of the
//!
//! The kernel walks a packed matrix from its first number to its last, once a tile of nodes, so the
//! processor's prefetcher always knows what comes next. Weights are packed once a model, keys and
//! values once a step. Padding is zeros: an output that does not exist is computed and dropped.
//! matrix tiles.

use super::amx;
use half::bf16;

/// Outputs a group: eight by three registers of nodes are 24 sums, which leaves eight of AVX-512's
/// 32 registers for operands. Smaller sets take a group in two parts of four.
pub(super) const GROUP: usize = 8;

/// Numbers of a matrix `[outputs,depth]` in panels, `[outputs/8][depth][8]`: the last group is whole, with zeros for
/// outputs that there are not.
pub(super) fn panel_floats(outputs: usize, depth: usize) -> usize {
    outputs.next_multiple_of(GROUP) * depth
}

/// Numbers of a matrix in pairs, `[outputs/8][depth/2][8][2]`: an odd depth gets a column of zeros, since an instruction
/// takes two features at once.
pub(super) fn pair_count(outputs: usize, depth: usize) -> usize {
    outputs.next_multiple_of(GROUP) * depth.next_multiple_of(2)
}

/// Numbers of a matrix as blocks; none where the machine has no matrix tiles.
pub(super) fn block_count(outputs: usize, depth: usize) -> usize {
    if !amx::is_built_in() {
        return 0;
    }
    outputs.next_multiple_of(amx::OUTPUTS) * depth.next_multiple_of(amx::DEPTH)
}

/// Fills `[outputs/16][depth/32][16][32]`. What lies behind the last output or feature is left as it is: the room is made
/// of zeros, and each call for the same matrix writes the same places.
pub(super) fn pack_blocks(
    blocks: &mut [bf16],
    outputs: usize,
    depth: usize,
    weight: impl Fn(usize, usize) -> f32,
) {
    let (rows, columns, steps) = (amx::OUTPUTS, amx::DEPTH, depth.div_ceil(amx::DEPTH));
    for (index, block) in blocks.chunks_exact_mut(rows * columns).enumerate() {
        let (first, start) = (index / steps * rows, index % steps * columns);
        for (i, x) in block.iter_mut().enumerate() {
            let (o, k) = (first + i / columns, start + i % columns);
            if o < outputs && k < depth {
                *x = bf16::from_f32(weight(o, k));
            }
        }
    }
}

/// Fills panels, `[outputs/8][depth][8]`: the eight weights that meet one feature lie beside each other. `weight(o, k)` is
/// asked once for each number, and may read another layout or a matrix that is turned.
pub(super) fn pack(
    panels: &mut [f32],
    outputs: usize,
    depth: usize,
    weight: impl Fn(usize, usize) -> f32,
) {
    for (group, panel) in panels.chunks_exact_mut(GROUP * depth).enumerate() {
        for (k, eight) in panel.chunks_exact_mut(GROUP).enumerate() {
            for (r, x) in eight.iter_mut().enumerate() {
                let o = group * GROUP + r;
                *x = if o < outputs { weight(o, k) } else { 0.0 };
            }
        }
    }
}

/// Fills pairs, `[outputs/8][depth/2][8][2]`, rounded to the nearest bf16; every number of the room is written, zeros too.
pub(super) fn pack_pairs(
    pairs: &mut [bf16],
    outputs: usize,
    depth: usize,
    weight: impl Fn(usize, usize) -> f32,
) {
    let even = depth.next_multiple_of(2);
    for (group, panel) in pairs.chunks_exact_mut(GROUP * even).enumerate() {
        for (k2, sixteen) in panel.chunks_exact_mut(2 * GROUP).enumerate() {
            for (i, x) in sixteen.iter_mut().enumerate() {
                let (o, k) = (group * GROUP + i / 2, 2 * k2 + i % 2);
                *x = if o < outputs && k < depth {
                    bf16::from_f32(weight(o, k))
                } else {
                    bf16::ZERO
                };
            }
        }
    }
}
