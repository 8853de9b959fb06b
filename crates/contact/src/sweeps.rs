//! Contact forces by projected Gauss-Seidel on a small dense compliance (Delassus) matrix `W = B A B^T`.
//!
//! Gaps and slips are given at the forces that come in, so that a solve goes on from the last one (a *warm start*): a
//! change of force `df` moves the samples by `W df`. Contacts are visited in their order, each with its own 3x3 block
//! ([`crate::friction`]); the first to be asked is the first to be solved, so the same input gives the same bits. A contact
//! that is open and has no force costs a distance a sweep, and its rows of `W` are never asked for.

use crate::friction::{coulomb, frame};
use crate::tie::Pull;
use parry3d::math::{Matrix, Vector};
use std::collections::TryReserveError;

/// How a contact may push.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// Pushes along the normal only, with Coulomb friction across it.
    Touch { friction: f32 },
    /// Holds the sample in all directions, as a grasper does.
    Bound,
    /// Pulls as a tie does.
    Tie(Pull),
}

/// A contact at the forces that come in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    pub law: Law,
    /// Out of the tool, unit length: the direction of the force on the tissue.
    pub normal: Vector,
    /// Distance from the tool's surface, negative inside, mm.
    pub gap: f32,
    /// The sample's way relative to the tool since the start of the step, mm; only what lies across the normal counts.
    /// Of a bound sample the way from its place on the tool, of a tie from its far end.
    pub slip: Vector,
}

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest change of a sample's place by its own force in the last sweep, mm. Default 1e-4.
    pub tolerance_mm: f32,
    /// Default 15.
    pub least_sweeps: u32,
    /// Default 200.
    pub most_sweeps: u32,
    /// Multiplications at most, from the second sweep on. Default: as many as it takes.
    pub most_work: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            tolerance_mm: 1e-4,
            least_sweeps: 15,
            most_sweeps: 200,
            most_work: u64::MAX,
        }
    }
}

/// How a solve ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    pub sweeps: u32,
    /// Of the last sweep, see [`Limits::tolerance_mm`].
    pub change_mm: f32,
    /// Within the tolerance.
    pub converged: bool,
    /// Multiplications of the solve.
    pub work: u64,
}

/// A Delassus matrix `[3n,3n]`, symmetric, in millimetres a unit of force, of which a solve reads the rows of those contacts alone whose
/// force changes.
pub trait Rows {
    /// `n`.
    fn contacts(&self) -> usize;

    /// Three rows of a contact, `[3,3n]`.
    fn rows(&mut self, contact: usize) -> &[f32];

    /// Adds to `shift [3n]` what a change of the force at a contact does, by its three rows.
    fn add_shift(&mut self, contact: usize, change: Vector, shift: &mut [f32]) {
        add_rows(self.rows(contact), change, shift);
    }
}

/// `shift += rows^T change` with `rows [3,3n]`: compiled for the instructions of whoever calls it, with the same bits.
#[inline(always)]
pub fn add_rows(rows: &[f32], change: Vector, shift: &mut [f32]) {
    let (x, others) = rows.split_at(shift.len());
    let (y, z) = others.split_at(shift.len());
    let rows = x.iter().zip(y).zip(z);
    for (shift, ((x, y), z)) in shift.iter_mut().zip(rows) {
        *shift = *shift + x * change.x + y * change.y + z * change.z;
    }
}

/// All of it, row-major.
#[derive(Clone, Copy, Debug)]
pub struct Whole<'a> {
    w: &'a [f32],
    contacts: usize,
}

impl<'a> Whole<'a> {
    /// Of `[3n,3n]` numbers.
    ///
    /// Panics when there are others.
    pub fn new(w: &'a [f32], contacts: usize) -> Self {
        assert_eq!(w.len(), 9 * contacts * contacts, "`delassus` is [3n,3n]");
        Self { w, contacts }
    }
}

impl Rows for Whole<'_> {
    fn contacts(&self) -> usize {
        self.contacts
    }

    fn rows(&mut self, contact: usize) -> &[f32] {
        let size = 9 * self.contacts;
        &self.w[contact * size..][..size]
    }
}

/// A contact's own block in its own frame.
#[derive(Clone, Copy, Debug)]
struct Block {
    frame: Matrix,
    w: Matrix,
    inverse: Matrix,
    /// A sample that no force moves takes none.
    rigid: bool,
}

/// The solver's buffers. One thread at a time.
#[derive(Clone, Debug, Default)]
pub struct Sweeps {
    /// Those that have been asked for.
    blocks: Vec<Option<Block>>,
    /// `W df`, three numbers a contact, mm.
    shift: Vec<f32>,
    work: u64,
}

impl Sweeps {
    /// Room for `contacts` contacts, which then allocate nothing.
    ///
    /// # Errors
    /// No memory.
    pub fn reserve(&mut self, contacts: usize) -> Result<(), TryReserveError> {
        let more = |have: usize, wanted: usize| wanted.saturating_sub(have);
        self.blocks
            .try_reserve_exact(more(self.blocks.len(), contacts))?;
        self.shift
            .try_reserve_exact(more(self.shift.len(), 3 * contacts))
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        size_of::<Option<Block>>() * self.blocks.capacity() + 4 * self.shift.capacity()
    }

    /// Solves for `forces`, one a contact, on the tissue; they come in as the guess that gaps and slips belong to.
    ///
    /// Panics when the lengths do not agree.
    pub fn solve(
        &mut self,
        delassus: &mut (impl Rows + ?Sized),
        contacts: &[Contact],
        forces: &mut [Vector],
        limits: Limits,
    ) -> Outcome {
        let n = contacts.len();
        assert_eq!(forces.len(), n, "one force a contact");
        assert_eq!(delassus.contacts(), n, "`delassus` is [3n,3n]");
        self.shift.clear();
        self.shift.resize(3 * n, 0.0);
        self.blocks.clear();
        self.blocks.resize(n, None);
        // A guess that the law forbids is put right first: a contact that became another's may pull.
        let mut outcome = Outcome {
            sweeps: 0,
            change_mm: 0.0,
            converged: true,
            work: 0,
        };
        self.work = 0;
        while outcome.sweeps < limits.most_sweeps.max(1) {
            outcome.change_mm = self.sweep(delassus, contacts, forces);
            outcome.sweeps += 1;
            outcome.converged = outcome.change_mm <= limits.tolerance_mm;
            outcome.work = self.work;
            if outcome.converged && outcome.sweeps >= limits.least_sweeps {
                break;
            }
            if outcome.sweeps > 1 && outcome.work >= limits.most_work {
                break;
            }
        }
        outcome
    }

    /// How the last solve's change of force moves each contact's sample, mm: `W (f' - f)`.
    #[inline]
    pub fn shift(&self, contact: usize) -> Vector {
        let at = 3 * contact;
        Vector::new(self.shift[at], self.shift[at + 1], self.shift[at + 2])
    }

    fn sweep(
        &mut self,
        delassus: &mut (impl Rows + ?Sized),
        contacts: &[Contact],
        forces: &mut [Vector],
    ) -> f32 {
        let mut largest = 0.0f32;
        for (i, contact) in contacts.iter().enumerate() {
            let shift = self.shift(i);
            let gap = contact.gap + contact.normal.dot(shift);
            let touch = matches!(contact.law, Law::Touch { .. });
            if touch && gap >= 0.0 && forces[i] == Vector::ZERO {
                continue;
            }
            let made = &mut self.blocks[i];
            let block = made.get_or_insert_with(|| Block::new(delassus.rows(i), i, contact));
            let now = contact.slip + shift;
            let local = block.frame.transpose() * forces[i];
            let wanted = match contact.law {
                Law::Tie(pull) => {
                    let way = block.frame.transpose() * now;
                    pull.solve(&block.w, way - block.w * local)
                }
                _ if block.rigid => Vector::ZERO,
                Law::Touch { friction } => {
                    let mut r = block.frame.transpose() * now;
                    r.x = gap;
                    let b = r - block.w * local;
                    coulomb(&block.w, &block.inverse, b, friction, local)
                }
                Law::Bound => local - block.inverse * (block.frame.transpose() * now),
            };
            let change = wanted - local;
            if change == Vector::ZERO {
                continue;
            }
            largest = largest.max((block.w * change).abs().max_element());
            let change = block.frame * change;
            forces[i] = block.frame * wanted;
            self.work += 3 * self.shift.len() as u64;
            delassus.add_shift(i, change, &mut self.shift);
        }
        largest
    }
}

impl Block {
    /// From the rows `[3,3n]` of contact `i`.
    fn new(rows: &[f32], i: usize, contact: &Contact) -> Self {
        let row = |k: usize| Vector::from_slice(&rows[k * (rows.len() / 3) + 3 * i..]);
        // Symmetric: rows serve as columns.
        let w = Matrix::from_cols(row(0), row(1), row(2));
        let frame = frame(contact.normal);
        let local = frame.transpose() * w * frame;
        let inverse = local.inverse();
        Self {
            frame,
            w: local,
            inverse,
            rigid: local.x_axis.x <= 0.0 || !inverse.is_finite(),
        }
    }
}
