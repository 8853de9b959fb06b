//! Passes over fields `[K,3]` in pieces of whole nodes that threads share, each of them several operations at once: a field is read from
//! memory as seldom as can be. Sums over pieces are in f64 and in order, so the bits do not depend on the number of threads.

use std::ops::Range;

use super::precondition::Env;
use crate::error::Result;
use crate::kernels::Pool;
use crate::kernels::parts::Parts;
use crate::kernels::vectors::{PartialSums, piece_dots};

/// Weight of the smoothing far from the tools. It is added to the iterations' answer without a search along it, from a residual that is older than
/// they are: the error of the modes' own part shrinks only if `w lambda < 1`, where `lambda`, at most 4, is the largest eigenvalue of `D^-1 K`
/// (`docs/decisions/030-reach.md`).
const FAR_WEIGHT: f32 = 0.2;

/// Numbers a piece: 1360 nodes, 16 kB, so that the fields of a pass stay in the second cache. It is
/// not a number of threads: sums have the same bits for any of them.
const PIECE: usize = 3 * 1360;

/// Calls `task(range, piece)` for each piece of a field of `len` numbers, which the pass reads or writes `streams` times.
pub(super) fn each(
    pool: &Pool,
    len: usize,
    streams: usize,
    task: impl Fn(Range<usize>, usize) + Sync,
) -> Result<()> {
    Ok(
        pool.run_streaming(4 * len * streams, len.div_ceil(PIECE), &|piece, _| {
            let start = piece * PIECE;
            task(start..(start + PIECE).min(len), piece);
        })?,
    )
}

/// Sums of [`each`]: `count` a piece.
pub(super) struct Sums<'a> {
    /// `[pieces, count]`.
    partial: &'a mut PartialSums,
    /// Sums of each piece.
    count: usize,
}

impl<'a> Sums<'a> {
    /// Room for `count` sums of each piece of a field of `len`.
    pub(super) fn new(partial: &'a mut PartialSums, len: usize, count: usize) -> Sums<'a> {
        partial.resize(len.div_ceil(PIECE) * count);
        Sums { partial, count }
    }

    /// The pieces' sums, each written by the thread that has the piece.
    pub(super) fn parts(&mut self) -> Parts<f32> {
        Parts::new(self.partial.values())
    }

    /// One of the sums over all pieces, added in their order.
    pub(super) fn total(&mut self, at: usize) -> f64 {
        let own = self.partial.values().iter().skip(at).step_by(self.count);
        own.map(|&sum| f64::from(sum)).sum()
    }
}

/// Sum of the squares of `value(0..count)`, in lanes.
pub(super) fn sum_of_squares(count: usize, value: impl Fn(usize) -> f32) -> f32 {
    let mut lanes = [0.0f32; 16];
    let whole = count / 16 * 16;
    for start in (0..whole).step_by(16) {
        for (lane, sum) in lanes.iter_mut().enumerate() {
            let value = value(start + lane);
            *sum += value * value;
        }
    }
    let rest = (whole..count).map(|at| value(at).powi(2));
    lanes.into_iter().sum::<f32>() + rest.sum::<f32>()
}

/// `u += change` where nodes are free, and `- w D^-1 r` with it where they are not near; the change is lost at held ones. Gives the sum of the
/// squares of what the smoothing moves, mm².
pub(super) fn add_smoothed(
    env: Env<'_>,
    (r, change, u): (&[f32], &mut [f32], &mut [f32]),
    is_near: impl Fn(u32) -> bool + Sync,
    partial: &mut PartialSums,
) -> Result<f64> {
    let len = u.len();
    let mut sums = Sums::new(partial, len, 1);
    let (u, change, parts) = (Parts::new(u), Parts::new(change), sums.parts());
    let blocks = &env.time_step.inverse_blocks;
    each(env.pool, len, 4, |range, piece| {
        // SAFETY: these parts belong to this piece alone.
        let [u, change] =
            unsafe { [&u, &change].map(|field| field.part(range.start, range.len())) };
        // SAFETY: this sum belongs to this piece alone.
        let sum = unsafe { parts.part(piece, 1) };
        let rows = r[range.clone()].as_chunks::<3>().0.iter();
        let places = change.as_chunks_mut::<3>().0.iter_mut();
        for ((change, r), node) in places.zip(rows).zip(range.start / 3..) {
            if !is_near(node as u32) && !env.held.is[node] {
                let [xx, xy, xz, yy, yz, zz] = blocks[node];
                let own = [
                    xx * r[0] + xy * r[1] + xz * r[2],
                    xy * r[0] + yy * r[1] + yz * r[2],
                    xz * r[0] + yz * r[1] + zz * r[2],
                ];
                for (change, own) in change.iter_mut().zip(own) {
                    *change -= FAR_WEIGHT * own;
                    // How far the far field is out of balance: it says whether the next step has to reach farther.
                    sum[0] += (FAR_WEIGHT * own).powi(2);
                }
            }
        }
        hold(env, &range, change);
        u.iter_mut()
            .zip(&*change)
            .for_each(|(u, change)| *u += change);
    })?;
    Ok(sums.total(0))
}

/// `u += change` where nodes are free; the change is lost at held ones.
pub(super) fn add(env: Env<'_>, change: &mut [f32], u: &mut [f32]) -> Result<()> {
    let len = u.len();
    let (u, change) = (Parts::new(u), Parts::new(change));
    each(env.pool, len, 2, |range, _| {
        // SAFETY: these parts belong to this piece alone.
        let [u, change] =
            unsafe { [&u, &change].map(|field| field.part(range.start, range.len())) };
        hold(env, &range, change);
        u.iter_mut()
            .zip(&*change)
            .for_each(|(u, change)| *u += change);
    })
}

/// `moved = u + t d`.
pub(super) fn shorten(env: Env<'_>, u: &[f32], d: &[f32], t: f32, moved: &mut [f32]) -> Result<()> {
    let len = moved.len();
    let moved = Parts::new(moved);
    each(env.pool, len, 3, |range, _| {
        // SAFETY: this part belongs to this piece alone.
        let moved = unsafe { moved.part(range.start, range.len()) };
        for ((moved, u), d) in moved.iter_mut().zip(&u[range.clone()]).zip(&d[range]) {
            *moved = u + t * d;
        }
    })
}

/// `out += drift + kappa M (u - last)` where nodes are free and zero where they are held; gives `out . d`.
pub(super) fn inertia(
    env: Env<'_>,
    kappa: f32,
    [drift, u, last, d]: [&[f32]; 4],
    out: &mut [f32],
    partial: &mut PartialSums,
) -> Result<f64> {
    let len = out.len();
    let mut sums = Sums::new(partial, len, 1);
    let (out, parts) = (Parts::new(out), sums.parts());
    let masses = &env.body.mass_of_dof;
    each(env.pool, len, 6, |range, piece| {
        // SAFETY: these parts belong to this piece alone.
        let (out, sums) = unsafe { (out.part(range.start, range.len()), parts.part(piece, 1)) };
        let [drift, u, last, d, masses] =
            [drift, u, last, d, masses].map(|field| &field[range.clone()]);
        for i in 0..out.len() {
            out[i] += drift[i] + masses[i] * kappa * (u[i] - last[i]);
        }
        hold(env, &range, out);
        piece_dots(env.isa, &[&*out], d, 0, sums);
    })?;
    Ok(sums.total(0))
}

/// `to = a - b`.
pub(super) fn difference(env: Env<'_>, a: &[f32], b: &[f32], to: &mut [f32]) -> Result<()> {
    let len = to.len();
    let to = Parts::new(to);
    each(env.pool, len, 3, |range, _| {
        // SAFETY: this part belongs to this piece alone.
        let to = unsafe { to.part(range.start, range.len()) };
        for ((to, a), b) in to.iter_mut().zip(&a[range.clone()]).zip(&b[range]) {
            *to = a - b;
        }
    })
}

/// `a . a`.
pub(super) fn square(env: Env<'_>, a: &[f32], partial: &mut PartialSums) -> Result<f64> {
    let mut sums = Sums::new(partial, a.len(), 1);
    let parts = sums.parts();
    each(env.pool, a.len(), 1, |range, piece| {
        // SAFETY: this sum belongs to this piece alone.
        let sums = unsafe { parts.part(piece, 1) };
        let a = &a[range];
        piece_dots(env.isa, &[a], a, 0, sums);
    })?;
    Ok(sums.total(0))
}

/// Zero at the held nodes of a piece.
fn hold(env: Env<'_>, range: &Range<usize>, field: &mut [f32]) {
    // Pieces are whole nodes, and held ones ascend.
    let nodes = (range.start / 3) as u32..(range.end / 3) as u32;
    let held = &env.held.nodes;
    let first = held.partition_point(|node| *node < nodes.start);
    for node in held[first..].iter().take_while(|node| **node < nodes.end) {
        let at = 3 * (node - nodes.start) as usize;
        field[at..at + 3].fill(0.0);
    }
}
