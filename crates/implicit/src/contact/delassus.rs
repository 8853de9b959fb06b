//! How samples move under forces on samples: the Delassus matrix `W = B A B^T`.

use ::contact::Vector;

use super::column_compliance::ColumnCompliance;
use super::compliance::{Compliance, WHAT};
use super::ties::Points;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// A row's place among the columns, and its weight there, for up to six nodes.
#[derive(Clone, Copy, Debug, Default, HeldBytes)]
struct Entries {
    count: usize,
    places: [(u32, f32); 6],
}

/// `A` at some columns, and `W` of samples on them. From call to call only what is new is computed: each value is a function of its
/// two columns, or samples, alone, so what was kept has the bits of what would be made anew.
#[derive(Debug, Default, HeldBytes)]
pub struct Delassus {
    /// `A` at the columns that the samples touch.
    at: ColumnCompliance,
    /// Of the last call, and of the call before, from which what both have is copied.
    now: Matrix,
    before: Matrix,
    /// Samples of the call before, ascending, and their rows there; by sample, its row there or [`NONE`].
    known: Vec<(u32, u32)>,
    was: Vec<u32>,
    /// By sample: its places among the columns.
    entries: Vec<Entries>,
    /// Of one sample.
    line: Line,
    /// The rows by their samples' numbers.
    order: Vec<u32>,
    /// Of which ties.
    ties: u64,
}

/// `W = B A B^T [3n,3n]`, mm/mN, and the samples whose rows `B` it is made of.
#[derive(Debug, Default, HeldBytes)]
struct Matrix {
    values: Vec<f32>,
    samples: Vec<u32>,
}

impl Matrix {
    fn clear(&mut self) {
        self.values.clear();
        self.samples.clear();
    }
}

/// `B A` of one sample `[3,3m]`, and its block at each column `[m]`, row-major.
#[derive(Debug, Default, HeldBytes)]
struct Line {
    rows: Vec<f32>,
    blocks: Vec<Block>,
}

const NONE: u32 = u32::MAX;

/// Nine numbers, row-major, and three that are nothing: registers have four.
type Block = [f32; 12];

impl Delassus {
    /// `W` of samples, `[3n,3n]`, row-major; read again only where they are others than those of the last call.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn of<'p>(
        &mut self,
        compliance: Compliance<'_>,
        all: impl Into<Points<'p>>,
        rows: &[u32],
    ) -> Result<&[f32]> {
        self.read(compliance, all.into(), rows)?;
        Ok(&self.now.values)
    }

    /// The same, and whether it is other than that of the last call.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn fixed(
        &mut self,
        compliance: Compliance<'_>,
        all: Points<'_>,
        rows: &[u32],
    ) -> Result<(&[f32], bool)> {
        let is_new = self.read(compliance, all, rows)?;
        Ok((&self.now.values, is_new))
    }

    /// Samples of the last call.
    pub fn rows(&self) -> &[u32] {
        &self.now.samples
    }

    /// `f^T W f` under forces on them, mN mm.
    pub fn work(&self, force: impl Fn(u32) -> Vector) -> f32 {
        let blocks = self
            .now
            .values
            .chunks_exact(3 * self.now.samples.len().max(1));
        let on = self
            .now
            .samples
            .iter()
            .flat_map(|row| force(*row).to_array());
        let moved = |line: &[f32]| -> f32 {
            let all = self
                .now
                .samples
                .iter()
                .flat_map(|row| force(*row).to_array());
            line.iter().zip(all).map(|(w, f)| w * f).sum()
        };
        blocks.zip(on).map(|(line, f)| f * moved(line)).sum()
    }

    /// Makes `W` that of the samples; says whether it was another's.
    fn read(&mut self, compliance: Compliance<'_>, all: Points<'_>, rows: &[u32]) -> Result<bool> {
        if self.ties != all.generation {
            // Rows of the same numbers are others.
            self.now.clear();
            self.ties = all.generation;
        }
        let samples = rows.iter().map(|row| all.at(*row));
        let is_other = self.at.gather(compliance, rows.len(), samples.clone());
        // Blocks of another tissue or length of step are of no use, nor are those of a call that failed half way.
        if !matches!(is_other, Ok(false)) {
            self.now.clear();
        }
        is_other?;
        if self.now.samples == rows {
            return Ok(false);
        }
        let count = rows.len();
        // What both calls have is copied from the one before.
        std::mem::swap(&mut self.now, &mut self.before);
        self.now.clear();
        self.known.clear();
        self.entries.clear();
        memory::fit(&mut self.known, self.before.samples.len(), WHAT)?;
        memory::fit(&mut self.entries, count, WHAT)?;
        memory::fit(&mut self.now.samples, count, WHAT)?;
        memory::fit(&mut self.now.values, 9 * count * count, WHAT)?;
        memory::fit(&mut self.order, count, WHAT)?;
        memory::fit(&mut self.was, count, WHAT)?;
        memory::fit(&mut self.line.rows, 3 * self.at.order(), WHAT)?;
        memory::fit(&mut self.line.blocks, self.at.order() / 3, WHAT)?;
        let before = self.before.samples.iter().enumerate();
        self.known
            .extend(before.map(|(at, &sample)| (sample, at as u32)));
        self.known.sort_unstable();
        self.now.values.resize(9 * count * count, 0.0);
        self.now.samples.extend_from_slice(rows);
        for sample in samples {
            let mut entries = Entries::default();
            for (column, weight) in compliance.entries(sample) {
                let place = self.at.place_of(column) as u32;
                entries.places[entries.count] = (place, weight);
                entries.count += 1;
            }
            self.entries.push(entries);
        }
        self.order.clear();
        self.order.extend(0..count as u32);
        self.order.sort_unstable_by_key(|at| rows[*at as usize]);
        self.was.clear();
        let known = &self.known;
        self.was.extend(rows.iter().map(|sample| {
            let found = known.binary_search_by_key(sample, |known| known.0);
            found.map_or(NONE, |found| known[found].1)
        }));
        for first in 0..count {
            self.fill_rows(first);
        }
        Ok(true)
    }

    /// Blocks of `W` of the sample at `first` in the order of their numbers with itself and those after it: each is summed from the lower one of
    /// two samples, so that it does not depend on the order of the rows.
    fn fill_rows(&mut self, first: usize) {
        let count = self.now.samples.len();
        let (size, size_before) = (3 * count, 3 * self.before.samples.len());
        let i = self.order[first] as usize;
        let was_i = self.was[i] as usize;
        self.line.rows.clear();
        for at in first..count {
            let j = self.order[at] as usize;
            let was_j = self.was[j] as usize;
            let mut block = [0.0; 12];
            if self.was[i] != NONE && self.was[j] != NONE {
                for (axis, row) in block.chunks_exact_mut(3).take(3).enumerate() {
                    let from = (3 * was_i + axis) * size_before + 3 * was_j;
                    row.copy_from_slice(&self.before.values[from..from + 3]);
                }
            } else {
                self.add_block(i, j, &mut block);
            }
            let [a, b, c, d, e, f, g, h, k, ..] = block;
            let mut block = [[a, b, c], [d, e, f], [g, h, k]];
            // A diagonal block is symmetric but for rounding: its lower half decides, as in the mirrored blocks.
            if i == j {
                block[0] = [block[0][0], block[1][0], block[2][0]];
                block[1][2] = block[2][1];
            }
            for (axis, values) in block.iter().enumerate() {
                self.now.values[(3 * i + axis) * size + 3 * j..][..3].copy_from_slice(values);
                let turned = block.map(|row| row[axis]);
                self.now.values[(3 * j + axis) * size + 3 * i..][..3].copy_from_slice(&turned);
            }
        }
    }

    /// Adds the block of the sample at `i`, whose `line` is made where it is not, with that at `j`.
    fn add_block(&mut self, i: usize, j: usize, block: &mut Block) {
        let (row, other) = (&self.entries[i], &self.entries[j]);
        if self.line.rows.is_empty() {
            let order = self.at.order();
            self.line.rows.resize(3 * order, 0.0);
            for (from, x) in &row.places[..row.count] {
                let lines = self.at.rows(3 * *from as usize, 3);
                for (sum, value) in self.line.rows.iter_mut().zip(lines) {
                    *sum += x * value;
                }
            }
            let (x, others) = self.line.rows.split_at(order);
            let (y, z) = others.split_at(order);
            let [x, y, z] = [x, y, z].map(|line| line.as_chunks::<3>().0);
            self.line.blocks.clear();
            self.line.blocks.extend(x.iter().zip(y).zip(z).map(
                |((&[a, b, c], &[d, e, f]), &[g, h, k])| [a, b, c, d, e, f, g, h, k, 0.0, 0.0, 0.0],
            ));
        }
        for (to, y) in &other.places[..other.count] {
            let values = &self.line.blocks[*to as usize];
            for (sum, value) in block.iter_mut().zip(values) {
                *sum += y * value;
            }
        }
    }

    /// What forces on degrees of freedom of the columns do to the node of one of them, mm.
    pub fn moved(&self, column: u32, dofs: &[u32], forces: &[f32]) -> Vector {
        self.at.moved(column, dofs, forces)
    }
}
