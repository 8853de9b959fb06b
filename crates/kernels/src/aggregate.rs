//! The message mean of the encoder: for supernode `i` with neighbours `N(i)` (a CSR row),
//! `out_i = 1/|N(i)| sum_{j in N(i)} GELU(source_j + target_i)`, exact GELU.
//!
//! `source [n,d]`, `target [n_S,d]`, `out [n_S,d]`, row-major. One thread computes a row, adding
//! neighbours in index order: the same bits for any thread count. [`encode_aggregate`] is the
//! same mean with `source` and `target` computed on the fly from their tables
//! (see [`super::encode`]), so that no `[n,d]` array is written at all.

use super::Compute;
use super::encode::LowRank;
use super::math::{gelu, gelu_lanes};
use super::parts::Parts;
use super::pool::{Pool, PoolError};
use lanes::{DenseLanes, load_some, store_some};
use lanes::{Isa, by_isa};

/// Rows of a neighbour list: row `i` is `neighbours[offsets[i]..offsets[i + 1]]`.
#[derive(Debug, Clone, Copy)]
pub struct Csr<'a> {
    /// `[n_S + 1]`, ascending.
    pub offsets: &'a [u32],
    /// Node indices.
    pub neighbours: &'a [u32],
}

impl Csr<'_> {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// Senders of supernode `i`, in the order of the list.
    fn row(&self, i: usize) -> &[u32] {
        &self.neighbours[self.offsets[i] as usize..self.offsets[i + 1] as usize]
    }
}

/// Rows a chunk: enough work to pay for taking it, few enough to share evenly.
const ROWS: usize = 8;

/// `out_i = mean_j GELU(source_j + target_i)`; a row without neighbours gives 0.
///
/// `source [n,width]`, `target [n_S,width]`, `out [n_S,width]`.
///
/// # Errors
/// [`PoolError::Panicked`] where a neighbour lies outside `source`.
///
/// # Panics
/// If `target` or `out` is not `[n_S,width]`.
pub fn aggregate(
    isa: Isa,
    pool: &Pool,
    csr: Csr<'_>,
    width: usize,
    source: &[f32],
    target: &[f32],
    out: &mut [f32],
) -> Result<(), PoolError> {
    let rows = csr.rows();
    assert_eq!(target.len(), rows * width, "target must be [n_S, width]");
    assert_eq!(out.len(), rows * width, "out must be [n_S, width]");
    let parts = Parts::new(out);
    pool.run(rows.div_ceil(ROWS), &|chunk, _| {
        for i in chunk * ROWS..((chunk + 1) * ROWS).min(rows) {
            // SAFETY: row i belongs to this chunk alone.
            let out = unsafe { parts.part(i * width, width) };
            row(isa, csr.row(i), source, &target[i * width..][..width], out);
        }
    })
}

/// Who sends messages to whom, and what is sent before features are added.
#[derive(Clone, Copy)]
pub struct Messages<'a> {
    /// Senders of each supernode.
    pub senders: Csr<'a>,
    /// `[n_S]`: rows of the supernodes' own features.
    pub supernodes: &'a [u32],
    /// Table `[n,d]` and weights of the senders.
    pub source: LowRank<'a>,
    /// Table `[n_S,d]` and weights of the supernodes.
    pub target: LowRank<'a>,
}

/// [`aggregate`] of `source_j = source_table_j + W_s f_j`, `target_i = target_table_i + W_t f_{s_i}`
/// for supernodes `s`, without storing either.
///
/// `features [n,f]`, `out [n_S,d]`. `scratch [threads * d]` holds a target row a thread. Only features of supernodes and
/// their neighbours are read.
///
/// # Errors
/// [`PoolError::Panicked`] where an index lies outside the tables.
///
/// # Panics
/// If the shapes do not match.
pub fn encode_aggregate(
    compute: Compute<'_>,
    messages: Messages<'_>,
    features: &[f32],
    scratch: &mut [f32],
    out: &mut [f32],
) -> Result<(), PoolError> {
    let Compute { isa, pool } = compute;
    let Messages {
        senders: csr,
        supernodes,
        source,
        target,
    } = messages;
    let (rows, width, rank) = (csr.rows(), source.width, source.rank);
    source.check(features);
    assert_eq!(
        (target.width, target.rank),
        (width, rank),
        "source and target differ in width or features"
    );
    assert_eq!(
        target.table.len(),
        rows * width,
        "target table must be [n_S, width]"
    );
    assert_eq!(supernodes.len(), rows, "one supernode a row");
    assert_eq!(out.len(), rows * width, "out must be [n_S, width]");
    assert!(scratch.len() >= pool.threads() * width, "scratch too small");
    let parts = Parts::new(out);
    let scratch = Parts::new(scratch);
    pool.run(rows.div_ceil(ROWS), &|chunk, worker| {
        // SAFETY: scratch of this worker alone.
        let target_row = unsafe { scratch.part(worker * width, width) };
        for i in chunk * ROWS..((chunk + 1) * ROWS).min(rows) {
            // SAFETY: row i belongs to this chunk alone.
            let out = unsafe { parts.part(i * width, width) };
            // The target table has a row a supernode, the features a row a node: a table of this
            // one row makes the two indices one.
            let own = LowRank {
                table: &target.table[i * width..][..width],
                ..target
            };
            let features_of_own = &features[supernodes[i] as usize * rank..][..rank];
            super::encode::row(isa, own, features_of_own, 0, target_row);
            fused_row(isa, csr.row(i), source, features, target_row, out);
        }
    })
}

/// One supernode, in plain Rust: the definition.
fn row_scalar(neighbours: &[u32], source: &[f32], target: &[f32], out: &mut [f32]) {
    let width = target.len();
    out.fill(0.0);
    for &j in neighbours {
        let source = &source[j as usize * width..][..width];
        for ((out, s), t) in out.iter_mut().zip(source).zip(target) {
            *out += gelu(s + t);
        }
    }
    let mean = 1.0 / neighbours.len().max(1) as f32;
    out.iter_mut().for_each(|o| *o *= mean);
}

by_isa! { fn row(neighbours: &[u32], source: &[f32], target: &[f32], out: &mut [f32]) = row_body, row_scalar; }

#[inline(always)]
unsafe fn row_body<V: DenseLanes>(
    neighbours: &[u32],
    source: &[f32],
    target: &[f32],
    out: &mut [f32],
) {
    let width = target.len();
    let last = neighbours.iter().copied().max().unwrap_or(0) as usize;
    assert!(
        neighbours.is_empty() || (last + 1) * width <= source.len(),
        "neighbour {last} lies outside the source rows"
    );
    let mut column = 0;
    // SAFETY: columns stay below `width`, rows are checked above.
    unsafe {
        let mean = V::splat(1.0 / neighbours.len().max(1) as f32);
        // Two registers of columns at once: the polynomials of GELU are chains of dependent
        // multiply-adds, and two chains fill each other's waits. A column adds its neighbours up in
        // the order of the list in any case.
        while column + 2 * V::COUNT <= width {
            let t = [0, 1].map(|v| V::load(target.as_ptr().add(column + v * V::COUNT)));
            let mut sum = [V::splat(0.0); 2];
            for &j in neighbours {
                let from = source.as_ptr().add(j as usize * width + column);
                for v in 0..2 {
                    sum[v] = sum[v].add(gelu_lanes(V::load(from.add(v * V::COUNT)).add(t[v])));
                }
            }
            for v in 0..2 {
                sum[v]
                    .mul(mean)
                    .store(out.as_mut_ptr().add(column + v * V::COUNT));
            }
            column += 2 * V::COUNT;
        }
        while column < width {
            let count = (width - column).min(V::COUNT);
            let t = load_some::<V>(target.as_ptr().add(column), count);
            let mut sum = V::splat(0.0);
            for &j in neighbours {
                let s = load_some::<V>(source.as_ptr().add(j as usize * width + column), count);
                sum = sum.add(gelu_lanes(s.add(t)));
            }
            store_some(sum.mul(mean), out.as_mut_ptr().add(column), count);
            column += count;
        }
    }
}

/// One supernode with its senders' rows made on the way, in plain Rust.
fn fused_row_scalar(
    neighbours: &[u32],
    source: LowRank<'_>,
    features: &[f32],
    target: &[f32],
    out: &mut [f32],
) {
    out.fill(0.0);
    for &j in neighbours {
        for (column, (out, t)) in out.iter_mut().zip(target).enumerate() {
            *out += gelu(source.at(features, j as usize, column) + t);
        }
    }
    let mean = 1.0 / neighbours.len().max(1) as f32;
    out.iter_mut().for_each(|o| *o *= mean);
}

by_isa! {
    fn fused_row(neighbours: &[u32], source: LowRank<'_>, features: &[f32], target: &[f32], out: &mut [f32])
        = fused_row_body, fused_row_scalar;
}

#[inline(always)]
unsafe fn fused_row_body<V: DenseLanes>(
    neighbours: &[u32],
    source: LowRank<'_>,
    features: &[f32],
    target: &[f32],
    out: &mut [f32],
) {
    let (width, rank) = (source.width, source.rank);
    let last = neighbours.iter().copied().max().unwrap_or(0) as usize;
    assert!(
        neighbours.is_empty()
            || ((last + 1) * width <= source.table.len() && (last + 1) * rank <= features.len()),
        "neighbour {last} lies outside the tables"
    );
    let mut column = 0;
    // SAFETY: columns stay below `width`, rows are checked above.
    unsafe {
        let mean = V::splat(1.0 / neighbours.len().max(1) as f32);
        while column + 2 * V::COUNT <= width {
            let t = [0, 1].map(|v| V::load(target.as_ptr().add(column + v * V::COUNT)));
            let mut sum = [V::splat(0.0); 2];
            for &j in neighbours {
                let from = source.table.as_ptr().add(j as usize * width + column);
                let feature = features.as_ptr().add(j as usize * rank);
                // The message of one sender is built up in the registers that it is used in.
                let mut message = [0, 1].map(|v| V::load(from.add(v * V::COUNT)));
                for k in 0..rank {
                    let f = V::splat(*feature.add(k));
                    let weight = source.weight_t.as_ptr().add(k * width + column);
                    for v in 0..2 {
                        message[v] = V::load(weight.add(v * V::COUNT)).mul_add(f, message[v]);
                    }
                }
                for v in 0..2 {
                    sum[v] = sum[v].add(gelu_lanes(message[v].add(t[v])));
                }
            }
            for v in 0..2 {
                sum[v]
                    .mul(mean)
                    .store(out.as_mut_ptr().add(column + v * V::COUNT));
            }
            column += 2 * V::COUNT;
        }
        while column < width {
            let count = (width - column).min(V::COUNT);
            let t = load_some::<V>(target.as_ptr().add(column), count);
            let mut sum = V::splat(0.0);
            for &j in neighbours {
                let s = source.lanes::<V>(features, j as usize, column, count);
                sum = sum.add(gelu_lanes(s.add(t)));
            }
            store_some(sum.mul(mean), out.as_mut_ptr().add(column), count);
            column += count;
        }
    }
}

#[cfg(test)]
mod tests;
