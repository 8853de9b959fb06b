//! The first half of the encoder as a low-rank update of a table:
//! `out_i = table_{rows_i} + W f_{rows_i}`, for the rows asked for only.
//!
//! `table [n,d]`, `features [n,f]` (6 to 16 numbers a node), `W [d,f]` stored transposed `[f,d]`.

use super::parts::Parts;
use super::pool::{Pool, PoolError};
use field::memory;
use lanes::{DenseLanes, load_some, store_some};
use lanes::{Isa, by_isa};

/// A table `[n,width]` and its update's weight, transposed: `[rank,width]`.
#[derive(Debug, Clone, Copy)]
pub struct LowRank<'a> {
    /// `[n,width]`, row-major.
    pub(super) table: &'a [f32],
    /// `[rank,width]`: a feature's weights for all columns lie beside each other, as lanes want
    /// them.
    pub(super) weight_t: &'a [f32],
    /// `d`, columns of the table.
    pub(super) width: usize,
    /// `f`, features of a node.
    pub(super) rank: usize,
}

impl<'a> LowRank<'a> {
    /// `table [n,width]`, `weight_t [rank,width]` from [`transpose_weight`].
    ///
    /// # Panics
    /// If the lengths are not multiples of the shapes.
    pub fn new(table: &'a [f32], weight_t: &'a [f32], width: usize, rank: usize) -> Self {
        assert!(
            width > 0 && table.len().is_multiple_of(width),
            "table must be [n, width]"
        );
        assert_eq!(weight_t.len(), rank * width, "weight must be [rank, width]");
        Self {
            table,
            weight_t,
            width,
            rank,
        }
    }

    pub(super) fn check(&self, features: &[f32]) {
        let rows = self.table.len() / self.width;
        assert_eq!(
            features.len(),
            rows * self.rank,
            "features must be [n, rank]"
        );
    }

    /// One entry: the readable definition.
    pub(super) fn at(&self, features: &[f32], row: usize, column: usize) -> f32 {
        let features = &features[row * self.rank..][..self.rank];
        let mut sum = self.table[row * self.width + column];
        for (k, f) in features.iter().enumerate() {
            sum += self.weight_t[k * self.width + column] * f;
        }
        sum
    }

    /// `count <= N` entries of a row from `column` on.
    #[inline(always)]
    pub(super) unsafe fn lanes<V: DenseLanes>(
        &self,
        features: &[f32],
        row: usize,
        column: usize,
        count: usize,
    ) -> V {
        // SAFETY: the caller has checked row and column.
        unsafe {
            let mut sum = load_some::<V>(self.table.as_ptr().add(row * self.width + column), count);
            for k in 0..self.rank {
                let f = V::splat(*features.as_ptr().add(row * self.rank + k));
                let w = load_some::<V>(self.weight_t.as_ptr().add(k * self.width + column), count);
                sum = w.mul_add(f, sum);
            }
            sum
        }
    }
}

/// `[width,rank]` as stored in a bundle to `[rank,width]` as the kernels read it.
///
/// # Errors
/// [`field::Error::OutOfMemory`].
pub fn transpose_weight(
    weight: &[f32],
    width: usize,
    rank: usize,
) -> field::error::Result<Vec<f32>> {
    assert_eq!(weight.len(), width * rank, "weight must be [width, rank]");
    let mut out = memory::zeros(weight.len(), "the encoder's weights")?;
    for i in 0..width {
        for k in 0..rank {
            out[k * width + i] = weight[i * rank + k];
        }
    }
    Ok(out)
}

/// Rows a chunk: enough work to pay for taking it.
const ROWS: usize = 64;

/// `out_i = table_{rows_i} + W features_{rows_i}`, `out [rows, width]`, in the order of `rows`.
///
/// # Errors
/// [`PoolError::Panicked`] where a row lies outside the table.
///
/// # Panics
/// If the shapes do not match.
pub fn encode(
    isa: Isa,
    pool: &Pool,
    update: LowRank<'_>,
    features: &[f32],
    rows: &[u32],
    out: &mut [f32],
) -> Result<(), PoolError> {
    let width = update.width;
    update.check(features);
    assert_eq!(out.len(), rows.len() * width, "out must be [rows, width]");
    let parts = Parts::new(out);
    pool.run(rows.len().div_ceil(ROWS), &|chunk, _| {
        let start = chunk * ROWS;
        let rows = &rows[start..(start + ROWS).min(rows.len())];
        for (i, &r) in rows.iter().enumerate() {
            // SAFETY: row start + i belongs to this chunk alone.
            let out = unsafe { parts.part((start + i) * width, width) };
            row(isa, update, features, r as usize, out);
        }
    })
}

fn row_scalar(update: LowRank<'_>, features: &[f32], index: usize, out: &mut [f32]) {
    for (column, out) in out.iter_mut().enumerate() {
        *out = update.at(features, index, column);
    }
}

by_isa! {
    /// One row of [`encode`]: `out [width]`.
    pub(super) fn row(update: LowRank<'_>, features: &[f32], index: usize, out: &mut [f32]) = row_body, row_scalar;
}

#[inline(always)]
unsafe fn row_body<V: DenseLanes>(
    update: LowRank<'_>,
    features: &[f32],
    index: usize,
    out: &mut [f32],
) {
    let width = update.width;
    assert!(
        (index + 1) * width <= update.table.len() && (index + 1) * update.rank <= features.len(),
        "row {index} lies outside the table"
    );
    let mut column = 0;
    while column < width {
        let count = (width - column).min(V::COUNT);
        // SAFETY: the row is checked above, the column stays below the width.
        unsafe {
            let sum = update.lanes::<V>(features, index, column, count);
            store_some(sum, out.as_mut_ptr().add(column), count);
        }
        column += count;
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::{Random, max_error};
    use super::*;

    #[test]
    fn every_isa_matches_scalar() {
        let mut random = Random::new(1);
        for (width, rank) in [(3, 2), (16, 6), (96, 6), (100, 16)] {
            let table = random.normal(90 * width, 1.0);
            let features = random.normal(90 * rank, 1.0);
            let weight = transpose_weight(&random.normal(width * rank, 1.0), width, rank).unwrap();
            let rows: Vec<u32> = (0..130).map(|_| random.below(90) as u32).collect();
            let run = |isa, threads| {
                let mut out = vec![f32::NAN; rows.len() * width];
                let update = LowRank::new(&table, &weight, width, rank);
                let pool = Pool::new(threads).unwrap();
                encode(isa, &pool, update, &features, &rows, &mut out).unwrap();
                out
            };
            let want = run(Isa::Scalar, 1);
            for isa in Isa::available() {
                let got = run(isa, 1);
                assert!(max_error(&want, &got) < 2e-6, "{}", isa.name());
                assert_eq!(got, run(isa, 3));
            }
        }
    }
}
