//! Gather and accumulate rows of a table: `q = sum_i f_i table[rows_i] (+ q)`.
//!
//! The reduced model's linear response: `f` the contact forces (`3 m` numbers), `table` `[3D,Q]`
//! in f32 or f16, or the residual modes with their amplitudes. Columns are split in tiles that stay
//! in registers while the rows stream by; each column is summed in the order of `rows`, so the bits
//! do not depend on tiles or threads.

use super::parts::Parts;
use super::pool::{Pool, PoolError};
use super::rows::{Number, Stored};
use half::f16;
use lanes::DenseLanes;
use lanes::{Isa, by_isa};
use std::ops::Range;

/// Columns a chunk: 2 kB of each row in f32, so that the jump to the next row is made once for many
/// cache lines.
const COLUMNS: usize = 512;

/// `q += sum_i factors_i table[rows_i]`, or `q = ..` where `add` is false.
///
/// `table [n,Q]`, `rows` and `factors` of one length, `q [Q]`.
///
/// # Errors
/// [`PoolError`] where a worker failed.
///
/// # Panics
/// If the lengths do not match or a row lies outside the table.
pub fn accumulate_rows(
    isa: Isa,
    pool: &Pool,
    table: Stored<'_>,
    rows: &[u32],
    factors: &[f32],
    add: bool,
    q: &mut [f32],
) -> Result<(), PoolError> {
    assert_eq!(rows.len(), factors.len(), "one factor a row");
    let width = q.len();
    if let Some(&last) = rows.iter().max() {
        assert!(
            (last as usize + 1) * width <= table.len(),
            "row {last} lies outside the table"
        );
    }
    let parts = Parts::new(q);
    let bytes = rows.len() * width * table.number_bytes();
    pool.run_streaming(bytes, width.div_ceil(COLUMNS), &|chunk, _| {
        let start = chunk * COLUMNS;
        // SAFETY: these columns belong to this chunk alone.
        let q = unsafe { parts.part(start, COLUMNS.min(width - start)) };
        match table {
            Stored::F32(table) => columns_f32(isa, &table[start..], width, rows, factors, add, q),
            Stored::F16(table) => columns_f16(isa, &table[start..], width, rows, factors, add, q),
        }
    })
}

/// The same in some ranges of columns alone, on this thread; the others keep what they hold.
///
/// # Panics
/// As [`accumulate_rows`].
pub fn accumulate_in(
    isa: Isa,
    table: Stored<'_>,
    (rows, factors): (&[u32], &[f32]),
    ranges: &[Range<usize>],
    add: bool,
    q: &mut [f32],
) {
    assert_eq!(rows.len(), factors.len(), "one factor a row");
    let width = q.len();
    if let Some(&last) = rows.iter().max() {
        assert!(
            (last as usize + 1) * width <= table.len(),
            "row {last} lies outside the table"
        );
    }
    // The ranges are of whole registers of eight.
    let isa = if isa == Isa::Avx512 { Isa::Avx2 } else { isa };
    for range in ranges {
        let (start, q) = (range.start, &mut q[range.clone()]);
        match table {
            Stored::F32(table) => columns_f32(isa, &table[start..], width, rows, factors, add, q),
            Stored::F16(table) => columns_f16(isa, &table[start..], width, rows, factors, add, q),
        }
    }
}

/// Some columns in plain Rust: `table` begins at the first of them, and its rows are `width` apart; `q` are theirs.
fn columns_scalar<T: Number>(
    table: &[T],
    width: usize,
    rows: &[u32],
    factors: &[f32],
    add: bool,
    q: &mut [f32],
) {
    if !add {
        q.fill(0.0);
    }
    for (&row, &factor) in rows.iter().zip(factors) {
        let row = &table[row as usize * width..][..q.len()];
        for (q, x) in q.iter_mut().zip(row) {
            *q += factor * x.wide();
        }
    }
}

by_isa! {
    /// [`accumulate_rows`] of a table in f32 `[n,Q]`, on this thread; `width` is `Q`.
    pub fn columns_f32(table: &[f32], width: usize, rows: &[u32], factors: &[f32], add: bool, q: &mut [f32])
        = columns_body, columns_scalar;
}
by_isa! {
    fn columns_f16(table: &[f16], width: usize, rows: &[u32], factors: &[f32], add: bool, q: &mut [f32])
        = columns_body, columns_scalar;
}

/// The same a register at a time. Every column is one sum over the rows in their order, whichever
/// tile it falls into: tiles of eight registers, then the rest.
///
/// # Safety
/// The instruction set of `V` is there; the rows are checked here.
#[inline(always)]
unsafe fn columns_body<V: DenseLanes>(
    table: &[impl Number],
    width: usize,
    rows: &[u32],
    factors: &[f32],
    add: bool,
    q: &mut [f32],
) {
    let inside = |&row: &u32| row as usize * width + q.len() <= table.len();
    assert!(rows.iter().all(inside), "rows of the table");
    let mut column = 0;
    // SAFETY: every row has `q.len()` columns in the table, by the line above.
    unsafe {
        let table = table.as_ptr();
        while column + V::COUNT <= q.len() {
            // As many columns at once as registers allow: each pass jumps from row to row of the
            // table.
            let registers = ((q.len() - column) / V::COUNT).min(8);
            match registers {
                8 => register_tile::<V, 8>(table, width, column, rows, factors, add, q),
                7 => register_tile::<V, 7>(table, width, column, rows, factors, add, q),
                6 => register_tile::<V, 6>(table, width, column, rows, factors, add, q),
                5 => register_tile::<V, 5>(table, width, column, rows, factors, add, q),
                4 => register_tile::<V, 4>(table, width, column, rows, factors, add, q),
                3 => register_tile::<V, 3>(table, width, column, rows, factors, add, q),
                2 => register_tile::<V, 2>(table, width, column, rows, factors, add, q),
                _ => register_tile::<V, 1>(table, width, column, rows, factors, add, q),
            }
            column += registers * V::COUNT;
        }
        // Fewer columns than lanes are left: one at a time, with the lanes' single rounding.
        while column < q.len() {
            let mut sum = V::splat(if add { q[column] } else { 0.0 });
            for (&row, &factor) in rows.iter().zip(factors) {
                let x = (*table.add(row as usize * width + column)).wide();
                sum = V::splat(x).mul_add(V::splat(factor), sum);
            }
            sum.store_part(q.as_mut_ptr().add(column), 1);
            column += 1;
        }
    }
}

/// `M` registers of [`columns_body`], from column `column` on: their sums stay in registers while
/// all rows pass.
///
/// # Safety
/// The instruction set of `V` is there; every row has these columns.
#[inline(always)]
unsafe fn register_tile<V: DenseLanes, const M: usize>(
    table: *const impl Number,
    width: usize,
    column: usize,
    rows: &[u32],
    factors: &[f32],
    add: bool,
    q: &mut [f32],
) {
    // SAFETY: the caller's.
    unsafe {
        let to = q.as_mut_ptr().add(column);
        let mut sum = [V::splat(0.0); M];
        if add {
            for v in 0..M {
                sum[v] = V::load(to.add(v * V::COUNT));
            }
        }
        for (&row, &factor) in rows.iter().zip(factors) {
            let from = table.add(row as usize * width + column);
            let factor = V::splat(factor);
            for v in 0..M {
                sum[v] = Number::lanes::<V>(from.add(v * V::COUNT)).mul_add(factor, sum[v]);
            }
        }
        for v in 0..M {
            sum[v].store(to.add(v * V::COUNT));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::{Random, max_error};
    use super::*;

    #[test]
    fn every_isa_matches_scalar_and_threads_do_not_matter() {
        let mut random = Random::new(5);
        // The widest table is large enough to be split over threads.
        for width in [1, 13, 130, 600, 1800, 60_000] {
            let wide = random.normal(40 * width, 1.0);
            let half: Vec<f16> = wide.iter().map(|&x| f16::from_f32(x)).collect();
            let rows: Vec<u32> = (0..70).map(|_| random.below(40) as u32).collect();
            let factors = random.normal(70, 1.0);
            let before = random.normal(width, 1.0);
            for add in [false, true] {
                for table in [Stored::F32(&wide), Stored::F16(&half)] {
                    let run = |isa, threads| {
                        let mut q = before.clone();
                        let pool = Pool::new(threads).unwrap();
                        accumulate_rows(isa, &pool, table, &rows, &factors, add, &mut q).unwrap();
                        q
                    };
                    let want = run(Isa::Scalar, 1);
                    for isa in Isa::available() {
                        let got = run(isa, 1);
                        let error = max_error(&want, &got);
                        assert!(error < 2e-5, "{} width {width}: {error:e}", isa.name());
                        assert_eq!(got, run(isa, 2));
                        assert_eq!(got, run(isa, 4));
                    }
                }
            }
        }
    }

    #[test]
    fn no_rows_give_zero_or_leave_the_sum() {
        let pool = Pool::new(1).unwrap();
        for isa in Isa::available() {
            let mut q = [3.0; 20];
            accumulate_rows(isa, &pool, Stored::F32(&[]), &[], &[], true, &mut q).unwrap();
            assert_eq!(q, [3.0; 20]);
            accumulate_rows(isa, &pool, Stored::F32(&[]), &[], &[], false, &mut q).unwrap();
            assert_eq!(q, [0.0; 20]);
        }
    }
}
