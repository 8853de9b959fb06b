//! The micro-kernel: `y [out][nodes] = W x [in][nodes]` with nodes in the lanes.
//!
//! `R` outputs by `C` registers of nodes stay in registers while the depth runs by: a step of the
//! depth is `C` loads, `R` broadcasts and `R C` fused multiply-adds. Each output is a sum of chains of
//! [`BLOCK`] multiply-adds in the order of the depth, whatever `R` and `C` are: rounding grows with the
//! length of a chain.

use super::pack::GROUP;
use crate::math::gelu_lanes;
use lanes::DenseLanes;

/// Multiply-adds of a chain: the error of a sum of `n` terms grows like `n / 32 + 32` roundings in
/// place of `n`, and the sums of different chains are added where registers are free anyway.
pub(super) const BLOCK: usize = 32;

/// What happens to a sum before it is stored.
#[derive(Clone, Copy)]
pub(super) enum Finish {
    /// `y = s`
    Plain,
    /// `y = s * scale`, a factor a node.
    Scale(*const f32),
    /// `y = GELU(s + b)`
    Gelu(*const f32),
    /// `y = y + (s + b)`
    Residual(*const f32),
}

/// `y = finish(W x)`; `panels [groups][depth][8]`, `x [depth][C N]`, `y [8 groups][C N]`.
///
/// # Safety
/// See [`lanes::Lanes`]; the pointers hold what the shapes say.
#[inline(always)]
pub(super) unsafe fn multiply<V: DenseLanes, const R: usize, const C: usize>(
    panels: &[f32],
    depth: usize,
    x: *const f32,
    y: *mut f32,
    finish: Finish,
) {
    let stride = C * V::COUNT;
    for (group, panel) in panels.chunks_exact(GROUP * depth).enumerate() {
        for part in (0..GROUP).step_by(R) {
            // SAFETY: the caller's.
            unsafe {
                let mut weight = panel.as_ptr().add(part);
                let mut from = x;
                let mut sum = chain::<V, R, C>(&mut weight, &mut from, depth.min(BLOCK));
                for start in (BLOCK..depth).step_by(BLOCK) {
                    let more = chain::<V, R, C>(&mut weight, &mut from, BLOCK.min(depth - start));
                    for r in 0..R {
                        for c in 0..C {
                            sum[r][c] = sum[r][c].add(more[r][c]);
                        }
                    }
                }
                let row = group * GROUP + part;
                store::<V, R, C>(sum, y.add(row * stride), row, finish);
            }
        }
    }
}

/// `length` multiply-adds on zeros; the pointers move on behind them.
///
/// # Safety
/// As [`multiply`].
#[inline(always)]
unsafe fn chain<V: DenseLanes, const R: usize, const C: usize>(
    weight: &mut *const f32,
    from: &mut *const f32,
    length: usize,
) -> [[V; C]; R] {
    // SAFETY: the caller's.
    unsafe {
        let mut sum = [[V::splat(0.0); C]; R];
        for _ in 0..length {
            let mut column = [V::splat(0.0); C];
            for c in 0..C {
                column[c] = V::load(from.add(c * V::COUNT));
            }
            for r in 0..R {
                let w = V::splat(*weight.add(r));
                for c in 0..C {
                    sum[r][c] = column[c].mul_add(w, sum[r][c]);
                }
            }
            *weight = weight.add(GROUP);
            *from = from.add(C * V::COUNT);
        }
        sum
    }
}

/// Stores `R` rows of sums; `row` is the first one's index in the layer's outputs.
///
/// # Safety
/// As [`multiply`].
#[inline(always)]
pub(super) unsafe fn store<V: DenseLanes, const R: usize, const C: usize>(
    sum: [[V; C]; R],
    y: *mut f32,
    row: usize,
    finish: Finish,
) {
    // SAFETY: the caller's.
    unsafe {
        match finish {
            Finish::Plain => {
                for r in 0..R {
                    for c in 0..C {
                        sum[r][c].store(y.add((r * C + c) * V::COUNT));
                    }
                }
            }
            Finish::Scale(scale) => {
                for r in 0..R {
                    for c in 0..C {
                        let scale = V::load(scale.add(c * V::COUNT));
                        sum[r][c].mul(scale).store(y.add((r * C + c) * V::COUNT));
                    }
                }
            }
            Finish::Gelu(bias) => {
                for r in 0..R {
                    let bias = V::splat(*bias.add(row + r));
                    for c in 0..C {
                        gelu_lanes(sum[r][c].add(bias)).store(y.add((r * C + c) * V::COUNT));
                    }
                }
            }
            Finish::Residual(bias) => {
                for r in 0..R {
                    let bias = V::splat(*bias.add(row + r));
                    for c in 0..C {
                        let to = y.add((r * C + c) * V::COUNT);
                        V::load(to).add(sum[r][c].add(bias)).store(to);
                    }
                }
            }
        }
    }
}
