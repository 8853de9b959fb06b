//! Inner products of table rows with vectors that are zero outside of some ranges.
//!
//! A force at a few nodes excites the coordinates of their blocks alone, and a vector that is zero
//! elsewhere needs no other columns of the table: what is skipped would only have added zeros.

use std::ops::Range;

use half::f16;
use lanes::{DenseLanes, Isa, by_isa};

use crate::rows::{Number, Stored};

/// `out[i] = table[rows[i]] . q` over some ranges of columns alone, each of a multiple of eight, on this thread, for `n` vectors `q [n,Q]` to `out [n,rows]`: the table
/// is read once for three of them.
///
/// # Panics
/// If the lengths do not match, a row lies outside the table or a range is not of whole eights.
pub fn row_dots_in(
    isa: Isa,
    table: Stored<'_>,
    rows: &[u32],
    ranges: &[Range<usize>],
    q: &[f32],
    out: &mut [f32],
) {
    if out.is_empty() {
        return;
    }
    assert!(out.len().is_multiple_of(rows.len()), "one result a row");
    let count = out.len() / rows.len();
    assert!(q.len().is_multiple_of(count), "vectors of one length");
    let width = q.len() / count;
    if let Some(&last) = rows.iter().max() {
        assert!((last as usize + 1) * width <= table.len(), "row {last}");
    }
    let fits = |range: &Range<usize>| range.end <= width && range.len().is_multiple_of(8);
    assert!(ranges.iter().all(fits), "ranges of eight columns");
    // The ranges are of whole registers of eight.
    let isa = if isa == Isa::Avx512 { Isa::Avx2 } else { isa };
    match table {
        Stored::F32(table) => range_f32(isa, table, rows, ranges, q, out),
        Stored::F16(table) => range_f16(isa, table, rows, ranges, q, out),
    }
}

by_isa! {
    fn range_f32(table: &[f32], rows: &[u32], ranges: &[Range<usize>], q: &[f32], out: &mut [f32]) = range_body, range_scalar;
}
by_isa! {
    fn range_f16(table: &[f16], rows: &[u32], ranges: &[Range<usize>], q: &[f32], out: &mut [f32]) = range_body, range_scalar;
}

/// Row after row in plain Rust: eight sums, by the column's place in its eight, through all ranges, added up at the end.
fn range_scalar<T: Number>(
    table: &[T],
    rows: &[u32],
    ranges: &[Range<usize>],
    q: &[f32],
    out: &mut [f32],
) {
    let width = q.len() / (out.len() / rows.len());
    for (q, out) in q.chunks(width).zip(out.chunks_mut(rows.len())) {
        for (&row, out) in rows.iter().zip(out) {
            let row = &table[row as usize * width..][..width];
            let mut lanes = [0.0f32; 8];
            for range in ranges {
                let (row, q) = (&row[range.clone()], &q[range.clone()]);
                for (row, q) in row.chunks(8).zip(q.chunks(8)) {
                    for ((lane, a), b) in lanes.iter_mut().zip(row).zip(q) {
                        *lane += a.wide() * b;
                    }
                }
            }
            *out = lanes.iter().sum();
        }
    }
}

/// Vectors in threes, then one at a time: three share each number of the table that is read.
///
/// # Safety
/// The instruction set of `V` is there; rows and ranges were checked by [`row_dots_in`].
#[inline(always)]
#[allow(clippy::extra_unused_type_parameters)]
unsafe fn range_body<V: DenseLanes>(
    table: &[impl Number],
    rows: &[u32],
    ranges: &[Range<usize>],
    q: &[f32],
    out: &mut [f32],
) {
    let width = q.len() / (out.len() / rows.len());
    let (threes, rest) = out.split_at_mut(out.len() / rows.len() / 3 * 3 * rows.len());
    let (q_threes, q_rest) = q.split_at(threes.len() / rows.len() * width);
    // SAFETY: `row_dots_in` has checked every row and range.
    unsafe {
        for (q, out) in q_threes
            .chunks(3 * width)
            .zip(threes.chunks_mut(3 * rows.len()))
        {
            range_rows::<V, 3>(table, rows, ranges, q, out);
        }
        for (q, out) in q_rest.chunks(width).zip(rest.chunks_mut(rows.len())) {
            range_rows::<V, 1>(table, rows, ranges, q, out);
        }
    }
}

/// `N` vectors of [`range_body`].
///
/// Four rows at a time: with three vectors these are twelve sums, which stay in registers together
/// with the row and the vectors. Where fewer than four rows are left the last is computed again,
/// and its copies are dropped: there is one way of summing for every row, whatever its place in the
/// list.
#[inline(always)]
unsafe fn range_rows<V: DenseLanes, const N: usize>(
    table: &[impl Number],
    all: &[u32],
    ranges: &[Range<usize>],
    q: &[f32],
    out: &mut [f32],
) {
    let width = q.len() / N;
    for start in (0..all.len()).step_by(4) {
        let count = 4.min(all.len() - start);
        // SAFETY: the caller's.
        unsafe {
            let row = |i: usize| {
                let row = all[start + i.min(count - 1)] as usize;
                table.as_ptr().add(row * width)
            };
            let rows = [row(0), row(1), row(2), row(3)];
            let mut total = [[V::splat(0.0); 4]; N];
            for range in ranges {
                let mut at = range.start;
                while at < range.end {
                    let mut x = [V::splat(0.0); N];
                    for n in 0..N {
                        x[n] = V::load(q.as_ptr().add(n * width + at));
                    }
                    for i in 0..4 {
                        let row = Number::lanes::<V>(rows[i].add(at));
                        for n in 0..N {
                            total[n][i] = row.mul_add(x[n], total[n][i]);
                        }
                    }
                    at += V::COUNT;
                }
            }
            for n in 0..N {
                let sums = V::sums(total[n]);
                out[n * all.len() + start..][..count].copy_from_slice(&sums[..count]);
            }
        }
    }
}
