//! Products with a factor and with itself: `R^-T Z`, and `A -= scale Z^T Z` in tiles that stay in registers.
//!
//! With `A_CC = U^T U`, `Z^T A_CC^-1 Z = (U^-T Z)^T (U^-T Z)`: the first function makes the
//! bracket, the second the product of it with itself, of which the upper triangle is enough.

use lanes::DenseLanes;
use lanes::{Isa, by_isa};

use crate::math::fused;

/// `U^T Y = Z` in place, a column of `z [3m,n]` after another: the readable way, which the tests compare the other with.
/// Reads the upper triangle of `u` alone.
fn whiten_rows_scalar(u: &[f64], columns: usize, z: &mut [f64]) {
    let n = z.len() / columns.max(1);
    for k in 0..n {
        for at in 0..columns {
            let known: f64 = (0..k).map(|i| u[i * n + k] * z[i * columns + at]).sum();
            z[k * columns + at] = (z[k * columns + at] - known) / u[k * n + k];
        }
    }
}

by_isa! { pub(super) fn whiten_rows(u: &[f64], columns: usize, z: &mut [f64]) = whiten_rows_body, whiten_rows_scalar; }

/// The same, by rows of `u`. Of `V` only the rounding of a multiply-add and the compiler's vector instructions depend.
#[inline(always)]
unsafe fn whiten_rows_body<V: DenseLanes>(u: &[f64], columns: usize, z: &mut [f64]) {
    let n = z.len() / columns.max(1);
    for k in 0..n {
        let (above, below) = z.split_at_mut((k + 1) * columns);
        let row = &mut above[k * columns..];
        let inverse = 1.0 / u[k * n + k];
        row.iter_mut().for_each(|x| *x *= inverse);
        for (to, &factor) in below.chunks_exact_mut(columns).zip(&u[k * n + k + 1..]) {
            for (to, &x) in to.iter_mut().zip(&*row) {
                *to = fused::<V>(-factor, x, *to);
            }
        }
    }
}

/// `upper -= scale Z^T Z` for `z [m,n]` in the upper triangle of `upper [n,n]`; what it writes below is never read.
///
/// # Panics
/// If a length does not fit.
pub fn subtract_gram(isa: Isa, z: &[f64], columns: usize, scale: f64, upper: &mut [f64]) {
    assert_eq!(upper.len(), columns * columns, "upper must be [n,n]");
    assert!(z.len().is_multiple_of(columns.max(1)), "z must be [m,n]");
    gram(isa, z, columns, scale, upper);
}

fn gram_scalar(z: &[f64], columns: usize, scale: f64, upper: &mut [f64]) {
    for (i, row) in upper.chunks_exact_mut(columns).enumerate() {
        for (j, to) in row.iter_mut().enumerate().skip(i) {
            let rows = z.chunks_exact(columns);
            *to -= scale * rows.map(|z| z[i] * z[j]).sum::<f64>();
        }
    }
}

by_isa! { fn gram(z: &[f64], columns: usize, scale: f64, upper: &mut [f64]) = gram_body, gram_scalar; }

/// The same in tiles of four rows by sixteen, four or one columns from the diagonal on. A tile's sum over the rows of `z`
/// is made before `upper` is touched, so a number depends on its row and column alone and not on the tile that it fell
/// into.
///
/// # Safety
/// The instruction set of `V` is there; all places are checked.
#[inline(always)]
unsafe fn gram_body<V: DenseLanes>(z: &[f64], columns: usize, scale: f64, upper: &mut [f64]) {
    let n = columns;
    let mut i = 0;
    while i + 4 <= n {
        let rows = &mut upper[i * n..][..4 * n];
        // Wide tiles while they fit, narrow ones to the end of the row: which of them takes a
        // number decides nothing, see above.
        let mut j = i;
        while j + 16 <= n {
            subtract_scaled_tile::<V, 4, 16>(z, rows, n, i, j, scale);
            j += 16;
        }
        while j + 4 <= n {
            subtract_scaled_tile::<V, 4, 4>(z, rows, n, i, j, scale);
            j += 4;
        }
        while j < n {
            subtract_scaled_tile::<V, 4, 1>(z, rows, n, i, j, scale);
            j += 1;
        }
        i += 4;
    }
    while i < n {
        let rows = &mut upper[i * n..][..n];
        for j in i..n {
            subtract_scaled_tile::<V, 1, 1>(z, rows, n, i, j, scale);
        }
        i += 1;
    }
}

/// `rows[r][j + c] -= scale sum_k block[k][i + r] * block[k][j + c]` for an `R x C` tile in registers.
#[inline(always)]
/// Slices of constant length take the checks of bounds out of the inner loops.
pub(super) fn subtract_scaled_tile<V: DenseLanes, const R: usize, const C: usize>(
    block: &[f64],
    rows: &mut [f64],
    n: usize,
    i: usize,
    j: usize,
    scale: f64,
) {
    let mut sum = [[0.0f64; C]; R];
    for row in block.chunks_exact(n) {
        let left: &[f64; R] = row[i..i + R].try_into().expect("R numbers");
        let right: &[f64; C] = row[j..j + C].try_into().expect("C numbers");
        for r in 0..R {
            for c in 0..C {
                sum[r][c] = fused::<V>(left[r], right[c], sum[r][c]);
            }
        }
    }
    for (r, sum) in sum.iter().enumerate() {
        for (to, sum) in rows[r * n + j..][..C].iter_mut().zip(sum) {
            *to -= scale * sum;
        }
    }
}
