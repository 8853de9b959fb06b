//! Dense kernels of a front, upper triangle, row-major.
//!
//! A front of width `w` with `p` own rows costs up to `p w^2 / 2` multiply-adds, most of the work
//! of a factor. [`eliminate`] works in panels of [`PANEL`] rows so that each entry below is loaded
//! and stored once for eight rows of `U`. The solves read `U` once each and are bound by memory. An
//! entry below the diagonal is never read, so products may write there what they like.

use lanes::{DenseLanes, load_some, store_some};

/// Rows of `U` that are made before the others are changed by them.
const PANEL: usize = 8;
/// Rows that take a panel off together, and registers of each: their sums stay in registers while the panel passes.
const ROWS: usize = 4;
const REGISTERS: usize = 2;
/// Partial sums of an inner product.
const LANES: usize = 16;

lanes::by_isa! {
    /// The first `own` rows of `[width, width]` become rows of `U` with the inverse on the diagonal, the others what is left; whether all
    /// pivots are positive. What stands below the diagonal is not read, and has no meaning afterwards.
    pub fn eliminate(a: &mut [f32], width: usize, own: usize, is_positive: &mut bool) = eliminate_lanes, eliminate_scalar;
}

fn eliminate_scalar(a: &mut [f32], width: usize, own: usize, is_positive: &mut bool) {
    // SAFETY: lanes of plain numbers need no instruction set.
    unsafe { eliminate_lanes::<lanes::Scalar<8>>(a, width, own, is_positive) }
}

/// Right-looking elimination by panels: within a panel each row is changed by those before it alone, then all rows below take the whole panel off in one
/// pass, [`ROWS`] at a time. Each entry takes the rows of `U` off one after another, so that its bits depend on nothing but whether products are fused.
#[inline(always)]
unsafe fn eliminate_lanes<V: DenseLanes>(
    a: &mut [f32],
    width: usize,
    own: usize,
    is_positive: &mut bool,
) {
    assert!(own <= width && a.len() == width * width, "a front");
    let a = a.as_mut_ptr();
    let mut first = 0;
    while first < own {
        let end = (first + PANEL).min(own);
        // SAFETY: rows and columns lie below `width`.
        unsafe {
            for k in first..end {
                let row = a.add(k * width);
                for earlier in first..k {
                    take_off::<V, 1, 1>(a, width, earlier..earlier + 1, k, k);
                }
                let pivot = *row.add(k);
                // A pivot that is not positive: the matrix is not positive definite and has no factor.
                *is_positive &= pivot > 0.0 && pivot.is_finite();
                if !*is_positive {
                    return;
                }
                // `U_kk = sqrt(pivot)`; its inverse stands on the diagonal, for the solves divide by it far more often than it is made.
                let inverse = 1.0 / pivot.sqrt();
                *row.add(k) = inverse;
                for column in k + 1..width {
                    *row.add(column) *= inverse;
                }
            }
            let mut row = end;
            // A tile of four rows begins at the diagonal of the first: of the later rows it also
            // writes a few entries below theirs, which nobody reads.
            while row + ROWS <= width {
                take_off::<V, ROWS, REGISTERS>(a, width, first..end, row, row);
                row += ROWS;
            }
            while row < width {
                take_off::<V, 1, REGISTERS>(a, width, first..end, row, row);
                row += 1;
            }
        }
        first = end;
    }
}

/// `a_ij -= sum_k u_ki u_kj` over the rows `panel` of `U`, for the rows `i` from `row` on and the columns `j` from `column` on; `R` rows at once.
///
/// # Safety
/// That of the lanes; the rows and columns lie in `a [width, width]`, and the panel above the rows.
#[inline(always)]
unsafe fn take_off<V: DenseLanes, const R: usize, const N: usize>(
    a: *mut f32,
    width: usize,
    panel: std::ops::Range<usize>,
    row: usize,
    column: usize,
) {
    // SAFETY: the caller's.
    unsafe {
        let mut at = column;
        while at + N * V::COUNT <= width {
            let own = |i: usize, n: usize| a.add((row + i) * width + at + n * V::COUNT);
            let mut sums: [[V; N]; R] =
                std::array::from_fn(|i| std::array::from_fn(|n| V::load(own(i, n))));
            for k in panel.clone() {
                let line = a.add(k * width);
                let values: [V; N] = std::array::from_fn(|n| V::load(line.add(at + n * V::COUNT)));
                for (i, sums) in sums.iter_mut().enumerate() {
                    let factor = V::splat(*line.add(row + i));
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum = value.neg_mul_add(factor, *sum);
                    }
                }
            }
            for (i, sums) in sums.into_iter().enumerate() {
                for (n, sum) in sums.into_iter().enumerate() {
                    sum.store(own(i, n));
                }
            }
            at += N * V::COUNT;
        }
        while at < width {
            let count = V::COUNT.min(width - at);
            let own = |i: usize| a.add((row + i) * width + at);
            let mut sums: [V; R] = std::array::from_fn(|i| load_some::<V>(own(i), count));
            for k in panel.clone() {
                let line = a.add(k * width);
                let value = load_some::<V>(line.add(at), count);
                for (i, sum) in sums.iter_mut().enumerate() {
                    *sum = value.neg_mul_add(V::splat(*line.add(row + i)), *sum);
                }
            }
            for (i, sum) in sums.into_iter().enumerate() {
                store_some(sum, own(i), count);
            }
            at += count;
        }
    }
}

/// `row -= factor line`, as far as the shorter one goes.
#[inline(always)]
fn subtract(row: &mut [f32], line: &[f32], factor: f32) {
    for (value, line) in row.iter_mut().zip(line) {
        *value -= factor * line;
    }
}

lanes::by_isa! {
    /// `U11^T y1 = b1`, `b2 -= U12^T y1` with the rows `[own, width]` of `U`, of a right side `[width]`.
    pub fn solve_forward(upper: &[f32], width: usize, x: &mut [f32]) = forward_lanes, forward_plain;
}
lanes::by_isa! {
    /// `U11 x1 = y1 - U12 x2` of a right side `[width]`.
    pub fn solve_back(upper: &[f32], width: usize, x: &mut [f32]) = back_lanes, back_plain;
}

#[inline(always)]
unsafe fn forward_lanes<L>(upper: &[f32], width: usize, x: &mut [f32]) {
    forward_plain(upper, width, x);
}

#[inline(always)]
unsafe fn back_lanes<L>(upper: &[f32], width: usize, x: &mut [f32]) {
    back_plain(upper, width, x);
}

/// By rows of `U`, which are the columns of `U^T`: each unknown is taken off all that follow as soon as it is known.
#[inline(always)]
fn forward_plain(upper: &[f32], width: usize, x: &mut [f32]) {
    for (k, row) in upper.chunks_exact(width).enumerate() {
        let y = x[k] * row[k];
        x[k] = y;
        subtract(&mut x[k + 1..], &row[k + 1..], y);
    }
}

/// By rows of `U`, from the last: each needs those behind it alone.
#[inline(always)]
fn back_plain(upper: &[f32], width: usize, x: &mut [f32]) {
    for (k, row) in upper.chunks_exact(width).enumerate().rev() {
        let (line, known) = (&row[k + 1..], &x[k + 1..width]);
        // Added in the same order on every machine: the bits do not depend on how wide its vectors are.
        let mut sums = [0.0f32; LANES];
        let (wide, rest) = line.as_chunks::<LANES>();
        let (wide_x, rest_x) = known.as_chunks::<LANES>();
        for (a, b) in wide.iter().zip(wide_x) {
            for lane in 0..LANES {
                sums[lane] += a[lane] * b[lane];
            }
        }
        let mut sum: f32 = rest.iter().zip(rest_x).map(|(a, b)| a * b).sum();
        // Halves are folded onto each other: a fixed tree, whatever the compiler makes of it.
        let mut half = LANES / 2;
        while half > 0 {
            for lane in 0..half {
                sums[lane] += sums[lane + half];
            }
            half /= 2;
        }
        sum += sums[0];
        x[k] = (x[k] - sum) * row[k];
    }
}
