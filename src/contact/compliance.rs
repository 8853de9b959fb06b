//! How samples move under forces on samples: `W = B A B^T`, from the prior's columns at the samples' nodes.
//!
//! With a coarse space, `A` is the compliance of `K + kappa M`: the static one less what inertia holds back,
//! `A_k = A - N diag(kappa / (w² (w² + kappa))) N^T` with natural modes `N` of frequency `w`.

use ::contact::{Sample, Vector};

use crate::corrections::CoarseSpace;
use crate::error::Result;
use crate::memory;
use crate::prior::PriorTable;

const WHAT: &str = "the compliance of a contact";

/// The tables of a solve.
#[derive(Clone, Copy)]
pub struct Compliance<'a> {
    /// Columns.
    pub prior: &'a PriorTable,
    /// Held nodes `[K]`.
    pub held: &'a [bool],
    /// The natural modes, and for each what inertia takes off its part, mm/mN ([`CoarseSpace::held_back`]); none: static.
    pub inertia: Option<(&'a CoarseSpace, &'a [f32])>,
}

impl Compliance<'_> {
    /// Columns of the nodes of a sample with their weights; nodes that do not move are left out.
    pub fn entries(&self, sample: Sample) -> impl Iterator<Item = (u32, f32)> {
        let columns = sample.nodes.into_iter().zip(sample.weights);
        columns.filter_map(|(node, weight)| {
            let found = self.prior.column_for(self.held, node)?;
            (weight != 0.0).then_some((found.0 as u32, weight))
        })
    }
}

/// `A` at some columns, and `W` of samples on them.
#[derive(Debug, Default)]
pub struct Delassus {
    /// Ascending.
    columns: Vec<u32>,
    wanted: Vec<u32>,
    upper: Vec<f64>,
    widened: Vec<f32>,
    /// Scaled modes of a row, and all modes by mode `[n,3m]`.
    modes: Vec<f32>,
    /// `A [3m,3m]`, mm/mN.
    a: Vec<f32>,
    /// The natural modes' part was left out of it.
    is_static: bool,
    /// `W [3n,3n]`, mm/mN, and the samples that it is of.
    w: Vec<f32>,
    of: Vec<u32>,
    /// Places in `a` and weights of all samples' columns, and where each sample's end.
    entries: Vec<(usize, f32)>,
    ends: Vec<usize>,
    /// `W` less what inertia holds back in [`Delassus::between`].
    varied: Vec<f32>,
}

impl Delassus {
    /// `W` of samples, `[3n,3n]`, row-major; read again only where they are others than those of the last call.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn of(
        &mut self,
        compliance: Compliance<'_>,
        all: &[Sample],
        rows: &[u32],
    ) -> Result<&[f32]> {
        self.read(compliance, all, rows)?;
        Ok(&self.w)
    }

    /// As [`Delassus::of`] where the inertia changes from call to call: the static part and the modes at the samples are kept.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn between(
        &mut self,
        compliance: Compliance<'_>,
        all: &[Sample],
        rows: &[u32],
    ) -> Result<&[f32]> {
        let Some((space, held_back)) = compliance.inertia else {
            return self.of(compliance, all, rows);
        };
        let alone = Compliance {
            inertia: None,
            ..compliance
        };
        let order = 3 * rows.len();
        if self.read(alone, all, rows)? || self.modes.len() != held_back.len() * order {
            memory::reserve(&mut self.varied, order * order, WHAT)?;
            self.modes.clear();
            memory::reserve(&mut self.modes, held_back.len() * order, WHAT)?;
            self.modes.resize(held_back.len() * order, 0.0);
            for (at, &row) in rows.iter().enumerate() {
                for (column, weight) in compliance.entries(all[row as usize]) {
                    for axis in 0..3 {
                        let own = space.at_contact(3 * column as usize + axis);
                        let to = self.modes.chunks_exact_mut(order.max(1));
                        for (to, own) in to.zip(own) {
                            to[3 * at + axis] += weight * own;
                        }
                    }
                }
            }
        }
        self.varied.clear();
        self.varied.extend_from_slice(&self.w);
        // A row of blocks at a time stays in the cache; the upper triangle is enough to compute.
        for at in 0..order {
            let row = &mut self.varied[at * order + at..(at + 1) * order];
            for (mode, lost) in self.modes.chunks_exact(order).zip(held_back) {
                let factor = lost * mode[at];
                for (w, value) in row.iter_mut().zip(&mode[at..]) {
                    *w -= factor * value;
                }
            }
        }
        for at in 0..order {
            for other in 0..at {
                self.varied[at * order + other] = self.varied[other * order + at];
            }
        }
        Ok(&self.varied)
    }

    /// Makes `w` that of the samples; tells whether it was another's.
    fn read(&mut self, compliance: Compliance<'_>, all: &[Sample], rows: &[u32]) -> Result<bool> {
        let samples = rows.iter().map(|row| all[*row as usize]);
        let read = self.gather(compliance, samples.clone())?;
        if !read && self.of == rows {
            return Ok(false);
        }
        self.of.clear();
        let (order, count) = (3 * self.columns.len(), rows.len());
        // Where the columns of each sample lie in `a`.
        self.ends.clear();
        self.entries.clear();
        memory::reserve(&mut self.ends, count, WHAT)?;
        for sample in samples {
            let columns = &self.columns;
            let place = |column: u32| 3 * columns.partition_point(|c| *c < column);
            let own = compliance.entries(sample);
            self.entries
                .extend(own.map(|(column, weight)| (place(column), weight)));
            self.ends.push(self.entries.len());
        }
        self.w.clear();
        memory::reserve(&mut self.w, 9 * count * count, WHAT)?;
        self.of.extend_from_slice(rows);
        self.w.resize(9 * count * count, 0.0);
        let (ends, entries) = (&self.ends, &self.entries);
        let of = |at: usize| &entries[if at == 0 { 0 } else { ends[at - 1] }..ends[at]];
        for i in 0..count {
            for j in i..count {
                let mut block = [0.0f32; 9];
                for &(from, x) in of(i) {
                    for &(to, y) in of(j) {
                        for axis in 0..3 {
                            let line = &self.a[(from + axis) * order + to..][..3];
                            for (sum, value) in block[3 * axis..].iter_mut().zip(line) {
                                *sum += x * y * value;
                            }
                        }
                    }
                }
                for (at, &value) in block.iter().enumerate() {
                    let (r, c) = (3 * i + at / 3, 3 * j + at % 3);
                    self.w[r * 3 * count + c] = value;
                    self.w[c * 3 * count + r] = value;
                }
            }
        }
        Ok(true)
    }

    /// Reads the columns that samples need, unless they are there; tells whether it has.
    fn gather(
        &mut self,
        compliance: Compliance<'_>,
        samples: impl Iterator<Item = Sample>,
    ) -> Result<bool> {
        self.wanted.clear();
        for sample in samples {
            self.wanted
                .extend(compliance.entries(sample).map(|entry| entry.0));
        }
        self.wanted.sort_unstable();
        self.wanted.dedup();
        let known = |column: &u32| self.columns.binary_search(column).is_ok();
        if self.is_static == compliance.inertia.is_none()
            && !self.columns.is_empty()
            && self.columns.len() <= 2 * self.wanted.len()
            && self.wanted.iter().all(known)
        {
            return Ok(false);
        }
        self.of.clear();
        self.is_static = compliance.inertia.is_none();
        std::mem::swap(&mut self.columns, &mut self.wanted);
        let order = 3 * self.columns.len();
        self.upper.clear();
        self.a.clear();
        let made = memory::reserve(&mut self.upper, order * order, WHAT)
            .and_then(|()| memory::reserve(&mut self.a, order * order, WHAT));
        if let Err(error) = made {
            self.columns.clear();
            return Err(error);
        }
        self.upper.resize(order * order, 0.0);
        compliance
            .prior
            .gather_compliance(&self.columns, &mut self.upper, &mut self.widened);
        self.a.extend(self.upper.iter().map(|value| *value as f32));
        if let Some((space, held_back)) = compliance.inertia {
            self.hold_back(space, held_back, order);
        }
        for i in 0..order {
            for j in 0..i {
                self.a[i * order + j] = self.a[j * order + i];
            }
        }
        Ok(true)
    }

    /// Takes the natural modes' part off the upper triangle.
    fn hold_back(&mut self, space: &CoarseSpace, held_back: &[f32], order: usize) {
        let dof = |at: usize| 3 * self.columns[at / 3] as usize + at % 3;
        self.modes.clear();
        self.modes.resize(held_back.len() * order, 0.0);
        for at in 0..order {
            let own = space.at_contact(dof(at));
            for (mode, value) in own.iter().take(held_back.len()).enumerate() {
                self.modes[mode * order + at] = *value;
            }
        }
        for at in 0..order {
            let row = &mut self.a[at * order + at..(at + 1) * order];
            for (mode, lost) in held_back.iter().enumerate() {
                let values = &self.modes[mode * order + at..(mode + 1) * order];
                let factor = lost * values[0];
                for (a, value) in row.iter_mut().zip(values) {
                    *a -= factor * value;
                }
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

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.columns.capacity()
            + self.wanted.capacity()
            + self.widened.capacity()
            + self.modes.capacity()
            + self.a.capacity()
            + self.w.capacity()
            + self.varied.capacity()
            + self.of.capacity())
            + 8 * (self.upper.capacity() + self.ends.capacity() + 2 * self.entries.capacity())
    }
}
