//! Rows that leave out zeros: of each block of columns a row holds the leading ones, in eights, and what is left out is not read.
//!
//! Each column is summed in the order of the rows, and each row in the order of its columns, as [`super::respond`] and [`super::project`] do: sums
//! have the bits of the whole table's where a register has eight lanes or four, and columns have them on every machine.

use super::parts::Parts;
use super::pool::{Pool, PoolError};
use super::rows::{Number, Stored};
use half::f16;
use lanes::DenseLanes;
use lanes::{Isa, by_isa};
use std::ops::Range;

/// The table: three rows a node, which leave out the same.
#[derive(Debug, Clone, Copy)]
pub struct Ragged<'a> {
    /// The rows' numbers, row after row, block after block.
    pub values: Stored<'a>,
    /// Where the numbers of a node's rows start, `[D+1]`.
    pub starts: &'a [usize],
    /// Eights of columns that a node's rows hold of each block, `[D,B]`.
    pub kept: &'a [u8],
    /// `[B+1]`; no block keeps more than it has.
    pub rank_offsets: &'a [u32],
}

/// What the kernels need of [`Ragged`] beside the numbers.
#[derive(Clone, Copy)]
struct Layout<'a> {
    starts: &'a [usize],
    kept: &'a [u8],
    rank_offsets: &'a [u32],
}

impl Layout<'_> {
    /// Eights kept of each block, where the node's first row starts, and how long each of its rows is.
    fn node(&self, node: usize) -> (&[u8], usize, usize) {
        let blocks = self.rank_offsets.len() - 1;
        let (start, end) = (self.starts[node], self.starts[node + 1]);
        (
            &self.kept[node * blocks..][..blocks],
            start,
            (end - start) / 3,
        )
    }
}

/// Numbers of the blocks before the first of a range.
fn skipped(kept: &[u8], blocks: &Range<usize>) -> usize {
    let before = kept[..blocks.start].iter();
    8 * before.map(|&eights| usize::from(eights)).sum::<usize>()
}

impl<'a> Ragged<'a> {
    fn layout(&self) -> Layout<'a> {
        Layout {
            starts: self.starts,
            kept: self.kept,
            rank_offsets: self.rank_offsets,
        }
    }

    /// Bytes that these rows hold.
    pub fn bytes(&self, rows: &[u32]) -> usize {
        let of = |row: &u32| self.layout().node(*row as usize / 3).2;
        self.values.number_bytes() * rows.iter().map(of).sum::<usize>()
    }

    /// `q += sum_i factors_i table[rows_i]`, or `q = ..` where `add` is false. Blocks are split over the pool.
    ///
    /// # Errors
    /// [`PoolError`] where a worker failed.
    ///
    /// # Panics
    /// If the lengths do not match or a row lies outside the table.
    pub fn accumulate(
        &self,
        isa: Isa,
        pool: &Pool,
        (rows, factors): (&[u32], &[f32]),
        add: bool,
        q: &mut [f32],
    ) -> Result<(), PoolError> {
        /// Blocks of a chunk.
        const BLOCKS: usize = 16;
        let (isa, layout) = (eight_lanes(isa), self.layout());
        let blocks = layout.rank_offsets.len() - 1;
        assert_eq!(rows.len(), factors.len(), "one factor a row");
        assert_eq!(
            q.len(),
            layout.rank_offsets[blocks] as usize,
            "one sum a column"
        );
        let parts = Parts::new(q);
        pool.run_streaming(self.bytes(rows), blocks.div_ceil(BLOCKS), &|chunk, _| {
            let own = BLOCKS * chunk..blocks.min(BLOCKS * (chunk + 1));
            let (from, to) = (layout.rank_offsets[own.start], layout.rank_offsets[own.end]);
            // SAFETY: these columns belong to this chunk alone.
            let q = unsafe { parts.part(from as usize, (to - from) as usize) };
            if !add {
                q.fill(0.0);
            }
            match self.values {
                Stored::F32(values) => add_f32(isa, values, layout, own, rows, factors, q),
                Stored::F16(values) => add_f16(isa, values, layout, own, rows, factors, q),
            }
        })
    }

    /// `out[i] = table[rows[i]] . q`.
    ///
    /// # Errors
    /// [`PoolError`] where a worker failed.
    ///
    /// # Panics
    /// If the lengths do not match or a row lies outside the table.
    pub fn dots(
        &self,
        isa: Isa,
        pool: &Pool,
        rows: &[u32],
        q: &[f32],
        out: &mut [f32],
    ) -> Result<(), PoolError> {
        /// Rows of a chunk: whole nodes.
        const ROWS: usize = 24;
        let (isa, layout) = (eight_lanes(isa), self.layout());
        assert_eq!(rows.len(), out.len(), "one result a row");
        let parts = Parts::new(out);
        pool.run_streaming(self.bytes(rows), rows.len().div_ceil(ROWS), &|chunk, _| {
            let rows = &rows[ROWS * chunk..rows.len().min(ROWS * (chunk + 1))];
            // SAFETY: these results belong to this chunk alone.
            let out = unsafe { parts.part(ROWS * chunk, rows.len()) };
            match self.values {
                Stored::F32(values) => dots_f32(isa, values, layout, rows, q, out),
                Stored::F16(values) => dots_f16(isa, values, layout, rows, q, out),
            }
        })
    }
}

/// Blocks keep eights.
fn eight_lanes(isa: Isa) -> Isa {
    match isa {
        Isa::Avx512 => Isa::Avx2,
        isa => isa,
    }
}

/// How many rows at the start, three at most, are of one node.
fn of_one_node(rows: &[u32]) -> usize {
    let node = rows[0] / 3;
    rows.iter()
        .take(3)
        .take_while(|row| **row / 3 == node)
        .count()
}

by_isa! {
    fn add_f32(values: &[f32], layout: Layout<'_>, blocks: Range<usize>, rows: &[u32], factors: &[f32], q: &mut [f32]) = add_body, add_scalar;
}
by_isa! {
    fn add_f16(values: &[f16], layout: Layout<'_>, blocks: Range<usize>, rows: &[u32], factors: &[f32], q: &mut [f32]) = add_body, add_scalar;
}
by_isa! {
    fn dots_f32(values: &[f32], layout: Layout<'_>, rows: &[u32], q: &[f32], out: &mut [f32]) = dots_body, dots_scalar;
}
by_isa! {
    fn dots_f16(values: &[f16], layout: Layout<'_>, rows: &[u32], q: &[f32], out: &mut [f32]) = dots_body, dots_scalar;
}

/// In plain Rust: what a row leaves out is neither read nor added to.
fn add_scalar<T: Number>(
    values: &[T],
    layout: Layout<'_>,
    blocks: Range<usize>,
    rows: &[u32],
    factors: &[f32],
    q: &mut [f32],
) {
    let first = layout.rank_offsets[blocks.start];
    for (&row, &factor) in rows.iter().zip(factors) {
        let (kept, start, length) = layout.node(row as usize / 3);
        let mut at = start + row as usize % 3 * length + skipped(kept, &blocks);
        for block in blocks.clone() {
            let count = 8 * usize::from(kept[block]);
            let q = &mut q[(layout.rank_offsets[block] - first) as usize..][..count];
            for (q, x) in q.iter_mut().zip(&values[at..at + count]) {
                *q += factor * x.wide();
            }
            at += count;
        }
    }
}

/// The same, the rows of a node that follow each other in the list at once: they have the same layout, and each coordinate
/// is loaded and stored once for up to three of them. The order of the additions is that of the list.
#[inline(always)]
unsafe fn add_body<V: DenseLanes>(
    values: &[impl Number],
    layout: Layout<'_>,
    blocks: Range<usize>,
    rows: &[u32],
    factors: &[f32],
    q: &mut [f32],
) {
    let mut done = 0;
    while done < rows.len() {
        let count = of_one_node(&rows[done..]);
        let (rows, factors) = (&rows[done..done + count], &factors[done..done + count]);
        // SAFETY: the caller's.
        unsafe {
            match count {
                3 => add_node::<V, 3>(values, layout, blocks.clone(), rows, factors, q),
                2 => add_node::<V, 2>(values, layout, blocks.clone(), rows, factors, q),
                _ => add_node::<V, 1>(values, layout, blocks.clone(), rows, factors, q),
            }
        }
        done += count;
    }
}

/// Rows of one node.
#[inline(always)]
unsafe fn add_node<V: DenseLanes, const M: usize>(
    values: &[impl Number],
    layout: Layout<'_>,
    blocks: Range<usize>,
    rows: &[u32],
    factors: &[f32],
    q: &mut [f32],
) {
    let first = layout.rank_offsets[blocks.start];
    let (kept, start, length) = layout.node(rows[0] as usize / 3);
    let mut at = start + skipped(kept, &blocks);
    for block in blocks {
        let count = 8 * usize::from(kept[block]);
        let to = &mut q[(layout.rank_offsets[block] - first) as usize..][..count];
        let from: [_; M] =
            std::array::from_fn(|i| &values[at + rows[i] as usize % 3 * length..][..count]);
        let mut column = 0;
        while column < count {
            // SAFETY: a multiple of the lanes is left of `count` numbers.
            unsafe {
                let to = to.as_mut_ptr().add(column);
                let mut sum = V::load(to);
                for i in 0..M {
                    let x = Number::lanes::<V>(from[i].as_ptr().add(column));
                    sum = x.mul_add(V::splat(factors[i]), sum);
                }
                sum.store(to);
            }
            column += V::COUNT;
        }
        at += count;
    }
}

/// In plain Rust: eight sums, by the column modulo eight, which leaving out whole eights does not change.
fn dots_scalar<T: Number>(
    values: &[T],
    layout: Layout<'_>,
    rows: &[u32],
    q: &[f32],
    out: &mut [f32],
) {
    for (&row, out) in rows.iter().zip(out) {
        let (kept, start, length) = layout.node(row as usize / 3);
        let mut at = start + row as usize % 3 * length;
        let mut lanes = [0.0f32; 8];
        for (&eights, &offset) in kept.iter().zip(layout.rank_offsets) {
            let count = 8 * usize::from(eights);
            let own = values[at..at + count].chunks_exact(8);
            for (own, q) in own.zip(q[offset as usize..][..count].chunks_exact(8)) {
                for ((lane, x), q) in lanes.iter_mut().zip(own).zip(q) {
                    *lane += x.wide() * q;
                }
            }
            at += count;
        }
        *out = lanes.iter().sum();
    }
}

/// The same, up to three rows of one node at once; a fourth sum stays zero, since registers are added up in fours.
#[inline(always)]
unsafe fn dots_body<V: DenseLanes>(
    values: &[impl Number],
    layout: Layout<'_>,
    rows: &[u32],
    q: &[f32],
    out: &mut [f32],
) {
    let mut done = 0;
    while done < rows.len() {
        let count = of_one_node(&rows[done..]);
        let (kept, start, length) = layout.node(rows[done] as usize / 3);
        // Rows that are not there are the last one again.
        let axis: [usize; 3] =
            std::array::from_fn(|i| start + rows[done + i.min(count - 1)] as usize % 3 * length);
        let mut at = 0;
        // SAFETY: a multiple of the lanes is left of `count` numbers.
        unsafe {
            let mut total = [V::splat(0.0); 4];
            for (&eights, &offset) in kept.iter().zip(layout.rank_offsets) {
                let count = 8 * usize::from(eights);
                let q = &q[offset as usize..][..count];
                let from = axis.map(|axis| &values[axis + at..][..count]);
                let mut column = 0;
                while column < count {
                    let x = V::load(q.as_ptr().add(column));
                    for i in 0..3 {
                        let own = Number::lanes::<V>(from[i].as_ptr().add(column));
                        total[i] = own.mul_add(x, total[i]);
                    }
                    column += V::COUNT;
                }
                at += count;
            }
            let sums = V::sums(total);
            out[done..done + count].copy_from_slice(&sums[..count]);
        }
        done += count;
    }
}

#[cfg(test)]
mod tests {
    use super::super::project::row_dots;
    use super::super::random::{Random, max_error};
    use super::super::respond::accumulate_rows;
    use super::*;

    #[test]
    fn what_is_left_out_counts_as_zero_on_every_isa_and_thread() {
        let mut random = Random::new(11);
        let (nodes, ranks) = (30, [8u32, 40, 8, 0, 64, 16]);
        let mut rank_offsets = vec![0];
        for block in 0..60 {
            rank_offsets.push(rank_offsets[block] + ranks[block % 6]);
        }
        let width = rank_offsets[60] as usize;
        let (mut kept, mut starts) = (Vec::new(), vec![0usize]);
        let (mut values, mut whole) = (Vec::new(), vec![0.0; 3 * nodes * width]);
        for node in 0..nodes {
            let own: Vec<u8> = (0..60)
                .map(|block| random.below(ranks[block % 6] as usize / 8 + 1) as u8)
                .collect();
            for row in 3 * node..3 * node + 3 {
                for (block, &eights) in own.iter().enumerate() {
                    let part: Vec<f16> = random
                        .normal(8 * usize::from(eights), 1.0)
                        .iter()
                        .map(|&x| f16::from_f32(x))
                        .collect();
                    let start = row * width + rank_offsets[block] as usize;
                    for (to, x) in whole[start..].iter_mut().zip(&part) {
                        *to = x.to_f32();
                    }
                    values.extend(part);
                }
            }
            kept.extend(own);
            starts.push(values.len());
        }
        let wide: Vec<f32> = values.iter().map(|x| x.to_f32()).collect();
        let rows: Vec<u32> = (0..40).chain([89, 1, 0, 2, 7, 7, 60, 62]).collect();
        let factors = random.normal(rows.len(), 1.0);
        let before = random.normal(width, 1.0);
        for stored in [Stored::F16(&values), Stored::F32(&wide)] {
            let table = Ragged {
                values: stored,
                starts: &starts,
                kept: &kept,
                rank_offsets: &rank_offsets,
            };
            for (isa, threads) in Isa::available()
                .into_iter()
                .flat_map(|isa| [(isa, 1), (isa, 3)])
            {
                let pool = Pool::new(threads).unwrap();
                for add in [false, true] {
                    let (mut want, mut got) = (before.clone(), before.clone());
                    let dense = Stored::F32(&whole);
                    accumulate_rows(isa, &pool, dense, &rows, &factors, add, &mut want).unwrap();
                    table
                        .accumulate(isa, &pool, (&rows, &factors), add, &mut got)
                        .unwrap();
                    assert_eq!(want, got, "{} {threads}", isa.name());
                }
                let (mut want, mut got) = (vec![0.0; rows.len()], vec![0.0; rows.len()]);
                row_dots(isa, &pool, Stored::F32(&whole), &rows, &before, &mut want).unwrap();
                table.dots(isa, &pool, &rows, &before, &mut got).unwrap();
                assert!(max_error(&want, &got) < 2e-4, "{} {threads}", isa.name());
            }
        }
    }
}
