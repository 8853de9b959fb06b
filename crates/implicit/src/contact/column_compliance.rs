//! `A` at the columns that a contact touches: the static compliance, less what inertia holds back, or that of deformed tissue.

use ::contact::Vector;

use super::compliance::{Compliance, Tangent, WHAT};
use super::ties::RowNodes;
use crate::error::Result;
use crate::memory::{self, HeldBytes};
use crate::prior::CoarseSpace;

/// Columns that a contact reads of deformed tissue, each of which takes some solves; where it touches more, it takes those of tissue at rest.
const MOST_DEFORMED: usize = 40;

/// No place.
const NONE: u32 = u32::MAX;

/// `A` at some columns. From call to call only what is new is computed: each value is a function of its two columns alone, so what was kept has the bits of
/// what would be made anew.
#[derive(Debug, Default, HeldBytes)]
pub(super) struct ColumnCompliance {
    /// Columns of the compliance, ascending.
    columns: Vec<u32>,
    /// Those of the call being made, until it changes places with `columns`; afterwards those of the call before.
    wanted: Vec<u32>,
    /// By column: whether it was there in the call before, and its place then or [`NONE`].
    is_known: Vec<bool>,
    places_before: Vec<u32>,
    scratch: Scratch,
    /// `A [3m,3m]`, mm/mN.
    a: Vec<f32>,
    /// `A` of the call before, over the columns that `wanted` holds afterwards: what both have is copied from here.
    a_before: Vec<f32>,
    /// Which compliance `a` is of.
    kind: Kind,
}

/// Columns of one kind have nothing to do with those of another.
#[derive(Clone, Copy, Debug, Default, PartialEq, HeldBytes)]
struct Kind {
    /// The static compliance: nothing was taken off it for inertia.
    is_static: bool,
    /// Of which tissue: 0 as it is at rest ([`Tangent::generation`]).
    generation: u64,
}

/// What columns are made in.
#[derive(Debug, Default, HeldBytes)]
struct Scratch {
    /// What is read of deformed tissue, and of the bundle's tables.
    upper: Vec<f64>,
    widened: Vec<f32>,
    /// All natural modes at the columns, by mode `[n,3m]`.
    modes: Vec<f32>,
}

impl ColumnCompliance {
    /// Degrees of freedom of the columns.
    pub fn order(&self) -> usize {
        3 * self.columns.len()
    }

    /// Place of a column among them.
    pub fn place_of(&self, column: u32) -> usize {
        self.columns.partition_point(|known| *known < column)
    }

    /// `count` rows of `A` from one on, `[count,3m]`.
    pub fn rows(&self, first: usize, count: usize) -> &[f32] {
        let order = self.order();
        &self.a[first * order..][..count * order]
    }

    /// Reads the columns that `rows` samples need, unless they are there. Tells whether it has become that of another tissue or length of step.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`]; it knows no column then, or those that it had.
    pub fn gather(
        &mut self,
        compliance: Compliance<'_>,
        rows: usize,
        samples: impl Iterator<Item = RowNodes>,
    ) -> Result<bool> {
        self.wanted.clear();
        memory::fit(&mut self.wanted, 6 * rows, WHAT)?;
        for sample in samples {
            self.wanted
                .extend(compliance.entries(sample).map(|entry| entry.0));
        }
        self.wanted.sort_unstable();
        self.wanted.dedup();
        let known = |column: &u32| self.columns.binary_search(column).is_ok();
        // A contact with many columns is broad: there the tissue at rest is near enough, and each column costs solves.
        let few = |_: &&dyn Tangent| self.wanted.len() <= MOST_DEFORMED;
        let tangent = compliance.tangent.filter(few);
        let kind = Kind {
            is_static: compliance.inertia.is_none(),
            generation: tangent.map_or(0, |tangent| tangent.generation()),
        };
        let same_kind = self.kind == kind;
        if same_kind
            && !self.columns.is_empty()
            // Columns that nobody wants any more go once they are half of all.
            && self.columns.len() <= 2 * self.wanted.len()
            && self.wanted.iter().all(known)
        {
            return Ok(false);
        }
        if !same_kind {
            self.columns.clear();
        }
        self.kind = kind;
        std::mem::swap(&mut self.columns, &mut self.wanted);
        std::mem::swap(&mut self.a, &mut self.a_before);
        // `wanted` and `a_before` hold the call before while `a` is made.
        let made = self.make(compliance, tangent);
        if made.is_err() {
            self.columns.clear();
        }
        made.map(|()| !same_kind)
    }

    /// Makes `a` that of the columns.
    fn make(&mut self, compliance: Compliance<'_>, tangent: Option<&dyn Tangent>) -> Result<()> {
        let count = self.columns.len();
        let order = 3 * count;
        let modes = compliance.inertia.map_or(0, |(_, lost)| lost.len());
        memory::fit(&mut self.a, order * order, WHAT)?;
        memory::fit(&mut self.scratch.modes, modes * order, WHAT)?;
        memory::fit(&mut self.is_known, count, WHAT)?;
        memory::fit(&mut self.places_before, count, WHAT)?;
        memory::fit(
            &mut self.scratch.widened,
            6 * compliance.prior.widest_block(),
            WHAT,
        )?;
        // All that is there is written over.
        self.a.resize(order * order, 0.0);
        let (columns, before) = (&self.columns, &self.wanted);
        let place = |column: &u32| before.binary_search(column).map_or(NONE, |at| at as u32);
        self.places_before.clear();
        self.places_before.extend(columns.iter().map(place));
        self.is_known.clear();
        let places = self.places_before.iter();
        self.is_known.extend(places.map(|place| *place != NONE));
        if let Some(tangent) = tangent {
            // The response keeps its own columns; here all of them are read from it.
            self.is_known.fill(false);
            self.scratch.upper.clear();
            memory::fit(&mut self.scratch.upper, order * order, WHAT)?;
            self.scratch.upper.resize(order * order, 0.0);
            tangent.gather(&self.columns, &mut self.scratch.upper)?;
            let values = self.a.iter_mut().zip(&self.scratch.upper);
            values.for_each(|(a, value)| *a = *value as f32);
        } else {
            self.take_known(order);
            compliance.prior.gather_new_compliance(
                (&self.columns, &self.is_known),
                &mut self.a,
                &mut self.scratch.widened,
            );
            if let Some((space, inertial_compliance)) = compliance.inertia {
                self.hold_back(space, inertial_compliance, order);
            }
        }
        self.mirror(order);
        Ok(())
    }

    /// Copies the blocks of two columns that are both known from the call before.
    fn take_known(&mut self, order: usize) {
        let order_before = 3 * self.wanted.len();
        let places = &self.places_before;
        for (i, &was) in places.iter().enumerate() {
            if was == NONE {
                continue;
            }
            for axis in 0..3 {
                let to = &mut self.a[(3 * i + axis) * order..][..order];
                let from = &self.a_before[(3 * was as usize + axis) * order_before..];
                // Runs of columns that were neighbours, too.
                let mut start = 0;
                while start < places.len() {
                    let first = places[start];
                    let mut end = start + 1;
                    if first == NONE {
                        start = end;
                        continue;
                    }
                    while end < places.len() && places[end] == first + (end - start) as u32 {
                        end += 1;
                    }
                    let values = &from[3 * first as usize..][..3 * (end - start)];
                    to[3 * start..3 * end].copy_from_slice(values);
                    start = end;
                }
            }
        }
    }

    /// Takes the natural modes' part off the upper triangle, where it is not known from before.
    fn hold_back(&mut self, space: &CoarseSpace, inertial_compliance: &[f32], order: usize) {
        let dof = |at: usize| 3 * self.columns[at / 3] as usize + at % 3;
        self.scratch.modes.clear();
        self.scratch
            .modes
            .resize(inertial_compliance.len() * order, 0.0);
        for at in 0..order {
            let own = space.at_contact(dof(at));
            for (mode, value) in own.iter().take(inertial_compliance.len()).enumerate() {
                self.scratch.modes[mode * order + at] = *value;
            }
        }
        let is_known = &self.is_known;
        for at in 0..order {
            let row = &mut self.a[at * order..(at + 1) * order];
            // Runs of columns that are not known with this row.
            let mut start = at;
            while start < order {
                let known = |column: usize| is_known[at / 3] && is_known[column / 3];
                let is_known = known(start);
                let mut end = start + 1;
                while end < order && known(end) == is_known {
                    end += 1;
                }
                if !is_known {
                    for (mode, lost) in inertial_compliance.iter().enumerate() {
                        let values = &self.scratch.modes[mode * order..(mode + 1) * order];
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

    /// Copies the upper triangle to the lower, but where it is known.
    fn mirror(&mut self, order: usize) {
        for i in 0..order / 3 {
            for j in 0..=i {
                if self.is_known[i] && self.is_known[j] {
                    continue;
                }
                for (row, column) in (0..9).map(|at| (3 * i + at / 3, 3 * j + at % 3)) {
                    if column < row {
                        self.a[row * order + column] = self.a[column * order + row];
                    }
                }
            }
        }
    }

    /// What forces on degrees of freedom of the columns do to the node of one of them, mm.
    pub fn moved(&self, column: u32, dofs: &[u32], forces: &[f32]) -> Vector {
        let order = self.order();
        let mut moved = [0.0f32; 3];
        let to = 3 * self.place_of(column);
        for (&dof, force) in dofs.iter().zip(forces) {
            let from = 3 * self.place_of(dof / 3) + (dof % 3) as usize;
            for (axis, moved) in moved.iter_mut().enumerate() {
                *moved += force * self.a[(to + axis) * order + from];
            }
        }
        Vector::from(moved)
    }
}
