//! `A = U^T U` of a dense block, in place, in its upper triangle, row-major f64; and `U^T U x = b`.
//!
//! Left rows first: a block of [`BLOCK`] rows is factored, then taken off everything below it.
//! Golub and Van Loan, *Matrix Computations*, 4.2, in its blocked outer-product form. Pivots are
//! not exchanged, for the matrix is positive definite but for rounding; a pivot that drowns in the
//! rounding of its own diagonal ends the attempt, and the caller adds a Tikhonov term.

use super::gram::subtract_scaled_tile;
use crate::math::fused;
use lanes::DenseLanes;
use lanes::by_isa;

/// Pivots below this part of their diagonal are rounding noise of the f32 compliance, whose unit
/// roundoff is 6e-8: seventeen times that is left for the sums that made its entries.
const PIVOT_FLOOR: f64 = 1e-6;
/// Rows factored before the rest is updated: 24 rows of a block of some hundred columns stay in the
/// first-level cache while all rows below read them.
const BLOCK: usize = 24;

/// Whether a pivot stands out of the rounding of its diagonal `pivot + removed`; a NaN does not.
fn is_sound(pivot: f64, removed: f64) -> bool {
    pivot > PIVOT_FLOOR * (pivot + removed)
}

/// `A = U^T U`, the readable way; `positive` is false where a pivot is too small.
pub(super) fn factor_upper_scalar(a: &mut [f64], n: usize, positive: &mut bool) {
    for k in 0..n {
        let pivot = a[k * n + k];
        let removed: f64 = (0..k).map(|i| a[i * n + k] * a[i * n + k]).sum();
        if !is_sound(pivot, removed) {
            *positive = false;
            return;
        }
        let root = pivot.sqrt();
        for j in k..n {
            a[k * n + j] /= root;
        }
        for i in k + 1..n {
            for j in i..n {
                a[i * n + j] -= a[k * n + i] * a[k * n + j];
            }
        }
    }
}

by_isa! { pub(super) fn factor_upper(a: &mut [f64], n: usize, positive: &mut bool) = factor_upper_body, factor_upper_scalar; }

/// The same, by blocks of rows. Of `V` only the rounding of a multiply-add and the compiler's vector instructions depend.
#[inline(always)]
unsafe fn factor_upper_body<V: DenseLanes>(a: &mut [f64], n: usize, positive: &mut bool) {
    let mut start = 0;
    while start < n {
        let end = (start + BLOCK).min(n);
        if !factor_rows::<V>(a, n, start, end) {
            *positive = false;
            return;
        }
        // The block's rows are final: they are read for all rows below, in tiles that stay in registers.
        let (done, rest) = a.split_at_mut(end * n);
        let block = &done[start * n..];
        let mut i = end;
        while i + 4 <= n {
            let rows = &mut rest[(i - end) * n..][..4 * n];
            // The first tile starts on the diagonal: what it writes below is never read.
            let mut j = i;
            while j + 16 <= n {
                subtract_tile::<V, 4, 16>(block, rows, n, i, j);
                j += 16;
            }
            while j + 4 <= n {
                subtract_tile::<V, 4, 4>(block, rows, n, i, j);
                j += 4;
            }
            while j < n {
                subtract_tile::<V, 4, 1>(block, rows, n, i, j);
                j += 1;
            }
            i += 4;
        }
        while i < n {
            let rows = &mut rest[(i - end) * n..][..n];
            for j in i..n {
                subtract_tile::<V, 1, 1>(block, rows, n, i, j);
            }
            i += 1;
        }
        start = end;
    }
}

/// Factors rows `start..end`, whose earlier rows have been subtracted already.
#[inline(always)]
fn factor_rows<V: DenseLanes>(a: &mut [f64], n: usize, start: usize, end: usize) -> bool {
    for k in start..end {
        let (above, below) = a.split_at_mut((k + 1) * n);
        let pivot = above[k * n + k];
        // `pivot + removed` is the diagonal as it was given: rounding is a part of that.
        let removed: f64 = (0..k).map(|i| above[i * n + k] * above[i * n + k]).sum();
        if !is_sound(pivot, removed) {
            return false;
        }
        let row = &mut above[k * n..];
        let inverse = 1.0 / pivot.sqrt();
        row[k..].iter_mut().for_each(|x| *x *= inverse);
        // Rows of the same block are updated at once; those below wait for the whole block.
        for i in k + 1..end {
            let factor = row[i];
            let to = &mut below[(i - k - 1) * n..][i..n];
            for (to, &x) in to.iter_mut().zip(&row[i..]) {
                *to = fused::<V>(-factor, x, *to);
            }
        }
    }
    true
}

/// `rows[r][j + c] -= sum_k block[k][i + r] * block[k][j + c]` for an `R x C` tile in registers.
#[inline(always)]
fn subtract_tile<V: DenseLanes, const R: usize, const C: usize>(
    block: &[f64],
    rows: &mut [f64],
    n: usize,
    i: usize,
    j: usize,
) {
    subtract_scaled_tile::<V, R, C>(block, rows, n, i, j, 1.0);
}

/// The same loops without the instructions of a set: the compiler makes what it can of them.
fn solve_upper_scalar(u: &[f64], x: &mut [f64]) {
    solve(u, x);
}

by_isa! { pub(super) fn solve_upper(u: &[f64], x: &mut [f64]) = solve_upper_body, solve_upper_scalar; }

/// [`solve`], compiled for the instruction set of `V`; nothing else of `V` is used, so the bits are those of the scalar
/// way.
///
/// # Safety
/// The instruction set of `V` is there.
#[inline(always)]
unsafe fn solve_upper_body<V: DenseLanes>(u: &[f64], x: &mut [f64]) {
    solve(u, x);
}

/// `U^T U x = b` in place.
#[inline(always)]
fn solve(u: &[f64], x: &mut [f64]) {
    let n = x.len();
    for k in 0..n {
        let row = &u[k * n..][..n];
        let y = x[k] / row[k];
        x[k] = y;
        for (x, &u) in x[k + 1..].iter_mut().zip(&row[k + 1..]) {
            *x -= y * u;
        }
    }
    for k in (0..n).rev() {
        let row = &u[k * n..][..n];
        // Eight sums, so that the compiler makes lanes of them; one after another they would wait for each other.
        let mut sums = [0.0; 8];
        let (us, xs) = (row[k + 1..].chunks_exact(8), x[k + 1..].chunks_exact(8));
        let tail: f64 = us
            .remainder()
            .iter()
            .zip(xs.remainder())
            .map(|(u, x)| u * x)
            .sum();
        for (u, x) in us.zip(xs) {
            for lane in 0..8 {
                sums[lane] += u[lane] * x[lane];
            }
        }
        x[k] = (x[k] - tail - sums.iter().sum::<f64>()) / row[k];
    }
}
