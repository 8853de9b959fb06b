//! Matrices in the order in which the micro-kernels read them: groups of eight outputs, in float32 and in pairs of bf16, and blocks of the
//! matrix tiles.

use super::amx;
use half::bf16;

/// Outputs a group.
pub(super) const GROUP: usize = 8;

pub(super) fn panel_floats(outputs: usize, depth: usize) -> usize {
    outputs.next_multiple_of(GROUP) * depth
}

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
