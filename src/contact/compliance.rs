//! How samples move under forces on samples: `W = B A B^T`, from the prior's columns at the samples' nodes.
//!
//! With a coarse space, `A` is the compliance of `K + kappa M`: the static one less what inertia holds back,
//! `A_k = A - N diag(kappa / (w² (w² + kappa))) N^T` with natural modes `N` of frequency `w`.

use ::contact::Vector;

use super::ties::{Points, RowNodes};
use crate::error::Result;
use crate::memory::{self, HeldBytes};
use crate::prior::{CoarseSpace, PriorTable};

pub(super) const WHAT: &str = "the compliance of a contact";
/// Columns that a contact reads of deformed tissue, each of which takes some solves; where it touches more, it takes those of tissue at rest.
const MOST_DEFORMED: usize = 40;

/// The tables of a solve.
#[derive(Clone, Copy)]
pub struct Compliance<'a> {
    /// Columns.
    pub prior: &'a PriorTable,
    /// Held nodes `[K]`.
    pub held: &'a [bool],
    /// The natural modes, and for each what inertia takes off its part, mm/mN ([`CoarseSpace::inertial_compliance`]); none: static.
    pub inertia: Option<(&'a CoarseSpace, &'a [f32])>,
    /// In place of all that: the compliance of the tissue as it is deformed.
    pub tangent: Option<&'a dyn Tangent>,
}

/// The compliance of deformed tissue at columns of the prior.
pub trait Tangent {
    /// Another number for another tissue, from 1.
    fn generation(&self) -> u64;

    /// The upper triangle of `A [3m,3m]` at `m` columns, ascending, mm/mN.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    fn gather(&self, columns: &[u32], upper: &mut [f64]) -> Result<()>;
}

impl<'a> Compliance<'a> {
    /// That of tissue at rest.
    pub fn at_rest(
        prior: &'a PriorTable,
        held: &'a [bool],
        inertia: Option<(&'a CoarseSpace, &'a [f32])>,
    ) -> Compliance<'a> {
        Compliance {
            prior,
            held,
            inertia,
            tangent: None,
        }
    }

    /// Columns of the nodes of a row with their weights; nodes that do not move are left out.
    pub fn entries(&self, row: impl Into<RowNodes>) -> impl Iterator<Item = (u32, f32)> {
        row.into().into_entries().filter_map(|(node, weight)| {
            let found = self.prior.column_for(self.held, node)?;
            Some((found.0 as u32, weight))
        })
    }
}

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
    /// Columns of the compliance that the samples touch, ascending.
    columns: Vec<u32>,
    /// Those of the call being made, until it changes places with `columns`; afterwards those of the call before.
    wanted: Vec<u32>,
    /// Scratch of the block that is read: packed upper triangle, then widened to f32.
    upper: Vec<f64>,
    widened: Vec<f32>,
    /// All natural modes at the columns, by mode `[n,3m]`.
    modes: Vec<f32>,
    /// `A [3m,3m]`, mm/mN.
    a: Vec<f32>,
    /// `A` of the call before, over the columns that `wanted` holds afterwards: what both have is copied from here.
    a_before: Vec<f32>,
    /// `a` is the static compliance: nothing was taken off it for inertia.
    is_static: bool,
    /// Of which tissue: 0 as it is at rest ([`Tangent::generation`]).
    generation: u64,
    /// `W = B A B^T [3n,3n]`, mm/mN, and the samples whose rows `B` it is made of.
    w: Vec<f32>,
    of: Vec<u32>,
    /// `W` and its samples in the call before.
    w_before: Vec<f32>,
    of_before: Vec<u32>,
    /// Samples of the call before, ascending, and their rows there; by sample, its row there or [`NONE`].
    known: Vec<(u32, u32)>,
    was: Vec<u32>,
    /// By sample: its places among the columns.
    entries: Vec<Entries>,
    /// `B A` of one sample `[3,3m]`.
    line: Vec<f32>,
    /// The rows by their samples' numbers.
    order: Vec<u32>,
    /// Of which ties.
    ties: u64,
}

const NONE: u32 = u32::MAX;

impl Delassus {
    /// Forgets the columns: the next call reads them anew.
    fn forget(&mut self) {
        self.columns.clear();
        self.of.clear();
        self.w.clear();
    }

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
        Ok(&self.w)
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
        Ok((&self.w, is_new))
    }

    /// Makes `w` that of the samples; says whether it was another's.
    fn read(&mut self, compliance: Compliance<'_>, all: Points<'_>, rows: &[u32]) -> Result<bool> {
        if self.ties != all.generation {
            // Rows of the same numbers are others.
            self.of.clear();
            self.w.clear();
            self.ties = all.generation;
        }
        self.wanted.clear();
        memory::fit(&mut self.wanted, 6 * rows.len(), WHAT)?;
        let samples = rows.iter().map(|row| all.at(*row));
        self.gather(compliance, samples.clone())?;
        if self.of == rows {
            return Ok(false);
        }
        let count = rows.len();
        std::mem::swap(&mut self.w, &mut self.w_before);
        std::mem::swap(&mut self.of, &mut self.of_before);
        self.of.clear();
        self.w.clear();
        self.known.clear();
        self.entries.clear();
        memory::fit(&mut self.known, self.of_before.len(), WHAT)?;
        memory::fit(&mut self.entries, count, WHAT)?;
        memory::fit(&mut self.of, count, WHAT)?;
        memory::fit(&mut self.w, 9 * count * count, WHAT)?;
        memory::fit(&mut self.order, count, WHAT)?;
        memory::fit(&mut self.was, count, WHAT)?;
        memory::fit(&mut self.line, 9 * self.columns.len(), WHAT)?;
        let before = self.of_before.iter().enumerate();
        self.known
            .extend(before.map(|(at, &sample)| (sample, at as u32)));
        self.known.sort_unstable();
        self.w.resize(9 * count * count, 0.0);
        self.of.extend_from_slice(rows);
        for sample in samples {
            let mut entries = Entries::default();
            for (column, weight) in compliance.entries(sample) {
                let place = 3 * self.columns.partition_point(|c| *c < column) as u32;
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
        let count = self.of.len();
        let (size, size_before) = (3 * count, 3 * self.of_before.len());
        let i = self.order[first] as usize;
        let was_i = self.was[i] as usize;
        self.line.clear();
        for at in first..count {
            let j = self.order[at] as usize;
            let was_j = self.was[j] as usize;
            let mut block = [[0.0f32; 3]; 3];
            if self.was[i] != NONE && self.was[j] != NONE {
                for (axis, row) in block.iter_mut().enumerate() {
                    let from = (3 * was_i + axis) * size_before + 3 * was_j;
                    row.copy_from_slice(&self.w_before[from..from + 3]);
                }
            } else {
                self.add_block(i, j, &mut block);
            }
            if i == j {
                block[0] = [block[0][0], block[1][0], block[2][0]];
                block[1][2] = block[2][1];
            }
            for (axis, values) in block.iter().enumerate() {
                self.w[(3 * i + axis) * size + 3 * j..][..3].copy_from_slice(values);
                let turned = block.map(|row| row[axis]);
                self.w[(3 * j + axis) * size + 3 * i..][..3].copy_from_slice(&turned);
            }
        }
    }

    /// Adds the block of the sample at `i`, whose `line` is made where it is not, with that at `j`.
    fn add_block(&mut self, i: usize, j: usize, block: &mut [[f32; 3]; 3]) {
        let order = 3 * self.columns.len();
        let (row, other) = (self.entries[i], self.entries[j]);
        if self.line.is_empty() {
            self.line.resize(3 * order, 0.0);
            for (from, x) in &row.places[..row.count] {
                let lines = &self.a[*from as usize * order..][..3 * order];
                for (sum, value) in self.line.iter_mut().zip(lines) {
                    *sum += x * value;
                }
            }
        }
        for (to, y) in &other.places[..other.count] {
            for (axis, row) in block.iter_mut().enumerate() {
                let values = &self.line[axis * order + *to as usize..][..3];
                for (sum, value) in row.iter_mut().zip(values) {
                    *sum += y * value;
                }
            }
        }
    }

    /// Reads the columns that samples need, unless they are there; `wanted` has room for six a row.
    fn gather(
        &mut self,
        compliance: Compliance<'_>,
        samples: impl Iterator<Item = RowNodes>,
    ) -> Result<()> {
        for sample in samples {
            self.wanted
                .extend(compliance.entries(sample).map(|entry| entry.0));
        }
        self.wanted.sort_unstable();
        self.wanted.dedup();
        let known = |column: &u32| self.columns.binary_search(column).is_ok();
        let few = |_: &&dyn Tangent| self.wanted.len() <= MOST_DEFORMED;
        let tangent = compliance.tangent.filter(few);
        let generation = tangent.map_or(0, |tangent| tangent.generation());
        let same_kind =
            self.is_static == compliance.inertia.is_none() && self.generation == generation;
        if same_kind
            && !self.columns.is_empty()
            && self.columns.len() <= 2 * self.wanted.len()
            && self.wanted.iter().all(known)
        {
            return Ok(());
        }
        if !same_kind {
            self.forget();
        }
        self.is_static = compliance.inertia.is_none();
        self.generation = generation;
        std::mem::swap(&mut self.columns, &mut self.wanted);
        std::mem::swap(&mut self.a, &mut self.a_before);
        let order = 3 * self.columns.len();
        self.upper.clear();
        self.a.clear();
        let modes = compliance
            .inertia
            .map_or(0, |(_, inertial_compliance)| inertial_compliance.len());
        let made = memory::fit(&mut self.upper, order * order, WHAT)
            .and_then(|()| memory::fit(&mut self.a, order * order, WHAT))
            .and_then(|()| memory::fit(&mut self.modes, modes * order, WHAT))
            .and_then(|()| {
                let widened = 6 * compliance.prior.widest_block();
                memory::fit(&mut self.widened, widened, WHAT)
            });
        if let Err(error) = made {
            self.forget();
            return Err(error);
        }
        self.upper.resize(order * order, 0.0);
        if let Some(tangent) = tangent {
            if let Err(error) = tangent.gather(&self.columns, &mut self.upper) {
                self.forget();
                return Err(error);
            }
            self.a.extend(self.upper.iter().map(|value| *value as f32));
        } else {
            compliance
                .prior
                .gather_compliance(&self.columns, &mut self.upper, &mut self.widened);
            self.a.extend(self.upper.iter().map(|value| *value as f32));
            if let Some((space, inertial_compliance)) = compliance.inertia {
                self.hold_back(space, inertial_compliance, order);
            }
        }
        for i in 0..order {
            for j in 0..i {
                self.a[i * order + j] = self.a[j * order + i];
            }
        }
        Ok(())
    }

    /// Takes the natural modes' part off the upper triangle, where it is not known from before.
    fn hold_back(&mut self, space: &CoarseSpace, inertial_compliance: &[f32], order: usize) {
        let dof = |at: usize| 3 * self.columns[at / 3] as usize + at % 3;
        self.modes.clear();
        self.modes.resize(inertial_compliance.len() * order, 0.0);
        for at in 0..order {
            let own = space.at_contact(dof(at));
            for (mode, value) in own.iter().take(inertial_compliance.len()).enumerate() {
                self.modes[mode * order + at] = *value;
            }
        }
        let order_before = 3 * self.wanted.len();
        let before = |at: usize| match self.wanted.binary_search(&self.columns[at / 3]) {
            Ok(place) => (3 * place + at % 3) as u32,
            Err(_) => NONE,
        };
        for at in 0..order {
            let row = &mut self.a[at * order..(at + 1) * order];
            let was = before(at);
            // Runs of columns that were known with this row, and of those that were not.
            let mut start = at;
            while start < order {
                let known = |column: usize| was != NONE && before(column) != NONE;
                let is_known = known(start);
                let mut end = start + 1;
                while end < order && known(end) == is_known {
                    end += 1;
                }
                if is_known {
                    let line = &self.a_before[was as usize * order_before..][..order_before];
                    for (value, column) in row[start..end].iter_mut().zip(start..) {
                        *value = line[before(column) as usize];
                    }
                } else {
                    for (mode, lost) in inertial_compliance.iter().enumerate() {
                        let values = &self.modes[mode * order..(mode + 1) * order];
                        let factor = lost * values[at];
                        for (a, value) in row[start..end].iter_mut().zip(&values[start..end]) {
                            *a -= factor * value;
                        }
                    }
                }
                start = end;
            }
        }
    }

    /// What forces on degrees of freedom of the columns do to the node of one of them, mm.
    pub fn moved(&self, column: u32, dofs: &[u32], forces: &[f32]) -> Vector {
        let order = 3 * self.columns.len();
        let place = |column: u32| 3 * self.columns.partition_point(|c| *c < column);
        let mut moved = [0.0f32; 3];
        for (&dof, force) in dofs.iter().zip(forces) {
            let from = place(dof / 3) + (dof % 3) as usize;
            for (axis, moved) in moved.iter_mut().enumerate() {
                *moved += force * self.a[(place(column) + axis) * order + from];
            }
        }
        Vector::from(moved)
    }
}
