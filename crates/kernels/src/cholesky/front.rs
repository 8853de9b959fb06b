//! Dense kernels of a front, upper triangle, row-major.

/// Rows of `U` that are made before the others are changed by them.
const PANEL: usize = 8;
/// Partial sums of an inner product.
const LANES: usize = 16;

lanes::by_isa! {
    /// The first `own` rows of `[width, width]` become rows of `U` with the inverse on the diagonal, the others what is left; whether all
    /// pivots are positive.
    pub fn eliminate(a: &mut [f32], width: usize, own: usize, is_positive: &mut bool) = eliminate_lanes, eliminate_plain;
}

/// Compiled with the instructions of `L`; the compiler makes the vectors.
#[inline(always)]
// `#[target_feature]` of `by_isa!` reaches what is inlined here: the same source, other vectors.
unsafe fn eliminate_lanes<L>(a: &mut [f32], width: usize, own: usize, is_positive: &mut bool) {
    eliminate_plain(a, width, own, is_positive);
}

/// Right-looking elimination by panels: within a panel each row is changed by those before it alone, then all rows below take the whole panel off in one
/// pass, so that each of them is read and written once for [`PANEL`] rows of `U`.
#[inline(always)]
fn eliminate_plain(a: &mut [f32], width: usize, own: usize, is_positive: &mut bool) {
    let mut first = 0;
    while first < own {
        let end = (first + PANEL).min(own);
        for k in first..end {
            let (above, rows) = a.split_at_mut(k * width);
            // Row `k` from its diagonal on: what is left of it is not read.
            let row = &mut rows[k..width];
            for earlier in first..k {
                let earlier = &above[earlier * width + k..(earlier + 1) * width];
                subtract(row, earlier, earlier[0]);
            }
            let pivot = row[0];
            // A pivot that is not positive: the matrix is not positive definite and has no factor.
            *is_positive &= pivot > 0.0 && pivot.is_finite();
            if !*is_positive {
                return;
            }
            // `U_kk = sqrt(pivot)`; its inverse stands on the diagonal, for the solves divide by it far more often than it is made.
            let inverse = 1.0 / pivot.sqrt();
            row[0] = inverse;
            for value in &mut row[1..] {
                *value *= inverse;
            }
        }
        let (panel, rest) = a.split_at_mut(end * width);
        let panel = &panel[first * width..];
        for (i, row) in rest.chunks_exact_mut(width).enumerate() {
            let i = end + i;
            let row = &mut row[i..];
            // The last panel may be narrower: it takes the loop of any length.
            if end - first == PANEL {
                let lines: [&[f32]; PANEL] =
                    std::array::from_fn(|k| &panel[k * width + i..(k + 1) * width]);
                subtract_panel(row, lines);
            } else {
                for line in panel.chunks_exact(width) {
                    subtract(row, &line[i..], line[i]);
                }
            }
        }
        first = end;
    }
}

/// `row -= factor line`, as far as the shorter one goes.
#[inline(always)]
fn subtract(row: &mut [f32], line: &[f32], factor: f32) {
    for (value, line) in row.iter_mut().zip(line) {
        *value -= factor * line;
    }
}

/// Takes off a row what a whole panel has of it: one load and one store for [`PANEL`] products. `lines` begin at the row's own column.
#[inline(always)]
fn subtract_panel(row: &mut [f32], lines: [&[f32]; PANEL]) {
    let len = row.len();
    let lines = lines.map(|line| &line[..len]);
    let factors = lines.map(|line| line[0]);
    for j in 0..len {
        let mut sum = row[j];
        for k in 0..PANEL {
            sum -= factors[k] * lines[k][j];
        }
        row[j] = sum;
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
