//! Products of long vectors: many inner products with one vector, and one sum of many.
//!
//! Vectors are cut in pieces of `PIECE` floats. Within a piece an inner product is summed in f32 lanes, over the pieces in f64
//! and in order, so the bits do not depend on the number of threads.

use super::parts::Parts;
use super::pool::{Pool, PoolError};
use field::memory::{self, HeldBytes};
use lanes::DenseLanes;
use lanes::{Isa, by_isa};

/// Floats a piece: 16 kB, so that a piece of one vector and of the rows that meet it stay in the
/// first and second cache; and short enough that its f32 sums keep their digits.
const PIECE: usize = 4096;

/// Partial sums of [`dots`], kept between calls.
#[derive(Debug, Default, HeldBytes)]
pub struct PartialSums(Vec<f32>);

impl PartialSums {
    /// Room for `count` products of vectors of `len`.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn with_room(len: usize, count: usize) -> field::error::Result<Self> {
        // Other passes cut the vectors a little shorter.
        let pieces = len.div_ceil(PIECE / 4 * 3) + 1;
        memory::room(pieces * count, "sums over long vectors").map(Self)
    }

    /// Makes room for `count` sums, all zero.
    pub fn resize(&mut self, count: usize) {
        self.0.clear();
        self.0.resize(count, 0.0);
    }

    /// The sums.
    pub fn values(&mut self) -> &mut [f32] {
        &mut self.0
    }
}

/// `out[i] = rows[i] . x`; all vectors have one length.
///
/// # Errors
/// [`PoolError`] where a worker failed.
pub fn dots(
    isa: Isa,
    pool: &Pool,
    rows: &[&[f32]],
    x: &[f32],
    partial: &mut PartialSums,
    out: &mut [f64],
) -> Result<(), PoolError> {
    assert_eq!(rows.len(), out.len(), "one result a row");
    assert!(rows.iter().all(|row| row.len() == x.len()), "one length");
    let (count, pieces) = (rows.len(), x.len().div_ceil(PIECE));
    partial.0.clear();
    partial.0.resize(count * pieces, 0.0);
    let parts = Parts::new(&mut partial.0);
    pool.run_streaming(4 * x.len() * (count + 1), pieces, &|piece, _| {
        // SAFETY: these sums belong to this piece alone.
        let sums = unsafe { parts.part(piece * count, count) };
        let start = piece * PIECE;
        piece_dots(
            isa,
            rows,
            &x[start..(start + PIECE).min(x.len())],
            start,
            sums,
        );
    })?;
    for (i, out) in out.iter_mut().enumerate() {
        *out = partial.0[i..]
            .iter()
            .step_by(count)
            .map(|&s| f64::from(s))
            .sum();
    }
    Ok(())
}

by_isa! {
    /// `sums[i] = rows[i][start..start + x.len()] . x`: one piece of [`dots`], on this thread.
    pub fn piece_dots(rows: &[&[f32]], x: &[f32], start: usize, sums: &mut [f32]) = dots_body, dots_scalar;
}

/// In plain Rust, row after row.
fn dots_scalar(rows: &[&[f32]], x: &[f32], start: usize, sums: &mut [f32]) {
    for (row, sum) in rows.iter().zip(sums) {
        let row = &row[start..start + x.len()];
        // Sixteen sums, as lanes have, so that the rounding does not grow with the length.
        let mut lanes = [0.0f32; 16];
        for (row, x) in row.chunks(16).zip(x.chunks(16)) {
            for ((lane, a), b) in lanes.iter_mut().zip(row).zip(x) {
                *lane += a * b;
            }
        }
        *sum = lanes.iter().sum();
    }
}

/// Four rows share each register of `x`; what is left at the end of a piece fills a register with zeros. A last group of
/// fewer rows takes its last one several times, and the sums that are too many are dropped.
///
/// # Safety
/// The instruction set of `V` is there; lengths are checked here.
#[inline(always)]
#[allow(clippy::extra_unused_type_parameters)]
unsafe fn dots_body<V: DenseLanes>(rows: &[&[f32]], x: &[f32], start: usize, sums: &mut [f32]) {
    let end = start + x.len();
    assert!(
        rows.iter().all(|row| end <= row.len()),
        "rows of that length"
    );
    for (rows, sums) in rows.chunks(4).zip(sums.chunks_mut(4)) {
        // SAFETY: every row reaches to the end of the piece, by the line above.
        unsafe {
            let row = |i: usize| rows[i.min(rows.len() - 1)].as_ptr().add(start);
            let rows = [row(0), row(1), row(2), row(3)];
            let mut total = [V::splat(0.0); 4];
            let mut at = 0;
            while at + V::COUNT <= x.len() {
                let x = V::load(x.as_ptr().add(at));
                for i in 0..4 {
                    total[i] = V::load(rows[i].add(at)).mul_add(x, total[i]);
                }
                at += V::COUNT;
            }
            if at < x.len() {
                let left = x.len() - at;
                let x = V::load_part(x.as_ptr().add(at), left);
                for i in 0..4 {
                    total[i] = V::load_part(rows[i].add(at), left).mul_add(x, total[i]);
                }
            }
            for (sum, value) in sums.iter_mut().zip(V::sums(total)) {
                *sum = value;
            }
        }
    }
}

/// `to += sum_i factors[i] rows[i]`; all vectors have one length.
///
/// # Errors
/// [`PoolError`] where a worker failed.
pub fn add_scaled(
    isa: Isa,
    pool: &Pool,
    rows: &[&[f32]],
    factors: &[f32],
    to: &mut [f32],
) -> Result<(), PoolError> {
    assert_eq!(rows.len(), factors.len(), "one factor a row");
    assert!(rows.iter().all(|row| row.len() == to.len()), "one length");
    let len = to.len();
    let parts = Parts::new(to);
    pool.run_streaming(
        4 * len * (rows.len() + 1),
        len.div_ceil(PIECE),
        &|piece, _| {
            let start = piece * PIECE;
            // SAFETY: this piece is this chunk's alone.
            let to = unsafe { parts.part(start, PIECE.min(len - start)) };
            piece_add(isa, rows, factors, start, to);
        },
    )
}

by_isa! {
    /// `to += factors[i] * rows[i][start..start + to.len()]` for each row: one piece of [`add_scaled`], on this thread.
    pub fn piece_add(rows: &[&[f32]], factors: &[f32], start: usize, to: &mut [f32]) = add_body, add_scalar;
}

/// In plain Rust: a row after another over the whole piece.
fn add_scalar(rows: &[&[f32]], factors: &[f32], start: usize, to: &mut [f32]) {
    for (row, factor) in rows.iter().zip(factors) {
        for (to, x) in to.iter_mut().zip(&row[start..]) {
            *to += factor * x;
        }
    }
}

/// All rows at one register of `to` before the next: `to` is read and written once. A number takes the rows in the same
/// order as in the scalar way.
///
/// # Safety
/// The instruction set of `V` is there; lengths are checked here.
#[inline(always)]
#[allow(clippy::extra_unused_type_parameters)]
unsafe fn add_body<V: DenseLanes>(rows: &[&[f32]], factors: &[f32], start: usize, to: &mut [f32]) {
    let end = start + to.len();
    assert!(
        rows.iter().all(|row| end <= row.len()),
        "rows of that length"
    );
    let mut at = 0;
    // SAFETY: every row reaches to the end of the piece, by the line above.
    unsafe {
        while at + V::COUNT <= to.len() {
            let mut sum = V::load(to.as_ptr().add(at));
            for (row, &factor) in rows.iter().zip(factors) {
                sum = V::load(row.as_ptr().add(start + at)).mul_add(V::splat(factor), sum);
            }
            sum.store(to.as_mut_ptr().add(at));
            at += V::COUNT;
        }
        if at < to.len() {
            let left = to.len() - at;
            let mut sum = V::load_part(to.as_ptr().add(at), left);
            for (row, &factor) in rows.iter().zip(factors) {
                let x = V::load_part(row.as_ptr().add(start + at), left);
                sum = x.mul_add(V::splat(factor), sum);
            }
            sum.store_part(to.as_mut_ptr().add(at), left);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    #[test]
    fn every_isa_gives_the_sums_and_threads_do_not_matter() {
        let mut random = Random::new(11);
        for len in [3, 40, 4096, 300_001] {
            let rows: Vec<Vec<f32>> = (0..7).map(|_| random.normal(len, 1.0)).collect();
            let x = random.normal(len, 1.0);
            let views: Vec<&[f32]> = rows.iter().map(Vec::as_slice).collect();
            let factors = random.normal(7, 1.0);
            for isa in Isa::available() {
                let run = |threads| {
                    let pool = Pool::new(threads).unwrap();
                    let (mut out, mut to) = ([0.0; 7], x.clone());
                    let mut partial = PartialSums::default();
                    dots(isa, &pool, &views, &x, &mut partial, &mut out).unwrap();
                    add_scaled(isa, &pool, &views, &factors, &mut to).unwrap();
                    (out, to)
                };
                let (out, to) = run(1);
                for (row, got) in rows.iter().zip(out) {
                    let pairs = row.iter().zip(&x);
                    let want: f64 = pairs.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum();
                    assert!(
                        (got - want).abs() < 1e-4 * (len as f64).sqrt(),
                        "{got} {want}"
                    );
                }
                for at in [0, len / 2, len - 1] {
                    let terms = rows.iter().zip(&factors).map(|(row, f)| row[at] * f);
                    assert!((to[at] - x[at] - terms.sum::<f32>()).abs() < 1e-4);
                }
                assert_eq!((out, to), run(3));
            }
        }
    }
}
