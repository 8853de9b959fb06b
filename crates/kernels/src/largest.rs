//! The largest displacement of a decoded field: the guard's pass over it, once a step.
//!
//! One thread: it reads what the decoder has just written, some hundred kilobytes in cache.

use lanes::DenseLanes;
use lanes::{Isa, by_isa};

/// Nodes a block of the contiguous pass.
const BLOCK: usize = 16;

/// Largest `|u|` over `nodes` (no node twice) of a field `[K,3]`, mm; not finite when any of them is not.
///
/// # Panics
/// If a node is not below `K`.
/// Squares are compared, and as bits: one integer maximum a node, and a NaN cannot hide behind a
/// comparison that is false.
pub fn largest(isa: Isa, field: &[f32], nodes: &[u32]) -> f32 {
    let mut bits = 0;
    if 3 * nodes.len() == field.len() {
        all_nodes(isa, field, &mut bits);
    } else {
        for &node in nodes {
            let at = 3 * node as usize;
            bits = bits.max(square_bits(&field[at..at + 3]));
        }
    }
    f32::from_bits(bits).sqrt()
}

/// Squares are not negative, so their bits order as they do, infinities and NaN last.
#[inline(always)]
fn square_bits(u: &[f32]) -> u32 {
    (u[0] * u[0] + u[1] * u[1] + u[2] * u[2]).to_bits() & 0x7fff_ffff
}

/// The largest square over a contiguous field `[n,3]`, into `bits`, which may hold that of others.
fn all_nodes_scalar(field: &[f32], bits: &mut u32) {
    for u in field.chunks_exact(3) {
        *bits = (*bits).max(square_bits(u));
    }
}

by_isa! { fn all_nodes(field: &[f32], bits: &mut u32) = all_nodes_body, all_nodes_scalar; }

/// The same in blocks. Only the compiler's vector instructions depend on `V`.
#[inline(always)]
unsafe fn all_nodes_body<V: DenseLanes>(field: &[f32], bits: &mut u32) {
    let mut worst = [0u32; BLOCK];
    let blocks = field.chunks_exact(3 * BLOCK);
    all_nodes_scalar(blocks.remainder(), bits);
    for block in blocks {
        for (worst, u) in worst.iter_mut().zip(block.chunks_exact(3)) {
            *worst = (*worst).max(square_bits(u));
        }
    }
    *bits = worst.iter().fold(*bits, |a, &b| a.max(b));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_of_the_nodes_is_found_on_every_isa() {
        let mut field = vec![0.0f32; 3 * 10_007];
        field[3 * 9_000 + 1] = -4.0;
        let nodes: Vec<u32> = (0..10_007).collect();
        for isa in Isa::available() {
            assert_eq!(largest(isa, &field, &nodes), 4.0);
            assert_eq!(largest(isa, &field, &nodes[..9_001]), 4.0);
            assert_eq!(largest(isa, &field, &nodes[..9_000]), 0.0);
            assert_eq!(largest(isa, &field, &[]), 0.0);
        }
    }

    #[test]
    fn what_is_not_finite_is_never_lost() {
        let nodes: Vec<u32> = (0..10_007).collect();
        for isa in Isa::available() {
            for bad in [f32::NAN, -f32::NAN, f32::INFINITY, 1e30] {
                for at in [0, 7, 15_000, 3 * 10_007 - 1] {
                    let mut field = vec![1.0f32; 3 * 10_007];
                    field[at] = bad;
                    let name = isa.name();
                    assert!(
                        !largest(isa, &field, &nodes).is_finite(),
                        "{name} {bad} {at}"
                    );
                    let part = [at as u32 / 3];
                    assert!(
                        !largest(isa, &field, &part).is_finite(),
                        "{name} {bad} {at}"
                    );
                }
            }
        }
    }
}
