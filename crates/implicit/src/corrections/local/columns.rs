//! The compliance of a contact by the near factor: `E^T P E` at columns of the prior, of the preconditioner that the iterations have.

use std::cell::RefCell;

use super::factor::NearFactor;
use super::linear::WHAT;
use super::near::NearSet;
use super::pairs::Room;
use super::step::{add, dot, resize};
use crate::contact::Tangent;
use crate::corrections::precondition::{DIAGONAL_WEIGHT, Env, Preconditioner};
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// Where an entry of a symmetric block is among its six.
const SYMMETRIC: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// What is known of columns, with the factor that it was made by.
/// A column is the answer to a unit force at one touched node, for the three axes. Contact asks for
/// the same ones in iteration after iteration, so each is made once a factor.
#[derive(Default, HeldBytes)]
pub(super) struct NearColumns {
    /// Number of the factor: another one makes all columns anew.
    /// It is compared with the factor's on every look, so no caller has to say that the factor is a
    /// new one.
    generation: u64,
    /// Columns of the prior that are known, in the order of the lists that follow.
    columns: Vec<u32>,
    /// By column and axis: `B e` of a force of 1 mN `[3 C]`, `C` the core, mm; what of the force is left to the modes `[r]`, µN; what they make of it `[r]`, mm.
    moved: Vec<f32>,
    on_modes: Vec<f32>,
    modes: Vec<f32>,
    /// Columns that are being made.
    made: Vec<u32>,
}

/// What columns are made with.
pub(super) struct Response<'a> {
    /// Tables and threads.
    pub env: Env<'a>,
    /// Whose core the factor is of.
    pub near: &'a NearSet,
    /// For `G^-1`.
    pub preconditioner: &'a Preconditioner,
    /// Factor, known columns and room: all are written to while the contact only asks.
    pub own: RefCell<(&'a mut NearFactor, &'a mut NearColumns, &'a mut Room)>,
}

impl Tangent for Response<'_> {
    fn generation(&self) -> u64 {
        self.own.borrow().0.generation
    }

    fn gather(&self, columns: &[u32], upper: &mut [f64]) -> Result<()> {
        let mut own = self.own.borrow_mut();
        let (factor, known, room) = &mut *own;
        // Columns of a factor that is gone would make the contact's matrix unsymmetric.
        if known.generation != factor.generation {
            known.clear();
            known.generation = factor.generation;
        }
        known.make(self, factor, room, columns)?;
        // Entry (i, j) is `e_i . P e_j` by the two levels of the preconditioner: the factor's move in the core, and the work of the force on the modes times their answer.
        let (size, modes) = (3 * self.near.places.core, self.env.space.count());
        let order = 3 * columns.len();
        // All columns are known after `make`: the 0 is never taken.
        let at = |column: u32| known.columns.iter().position(|c| *c == column).unwrap_or(0);
        for (j, &column) in columns.iter().enumerate() {
            let column = at(column);
            for b in 0..3 {
                let index = 3 * column + b;
                let moved = &known.moved[index * size..][..size];
                let response = &known.modes[index * modes..][..modes];
                // The upper triangle alone; the matrix is symmetric because `P` is.
                for (i, &row) in columns[..=j].iter().enumerate() {
                    let node = self.env.prior.contact_nodes[row as usize];
                    let place = self.near.places.of(node);
                    let is_diagonal = i == j;
                    let row = at(row);
                    for a in 0..3 {
                        let work = &known.on_modes[(3 * row + a) * modes..][..modes];
                        // `work` is in µN, and a compliance is mm for each mN.
                        let mut sum = 1e-3 * dot(work, response);
                        match place {
                            Some(place) if place < self.near.places.core => {
                                sum += f64::from(moved[3 * place + a]);
                            }
                            // Outside of the core there is the diagonal.
                            Some(place) if place < self.near.places.inside && is_diagonal => {
                                let block = &self.env.time_step.inverse_blocks[node as usize];
                                sum += f64::from(1e3 * DIAGONAL_WEIGHT * block[SYMMETRIC[a][b]]);
                            }
                            _ => {}
                        }
                        upper[(3 * i + a) * order + 3 * j + b] = sum;
                    }
                }
            }
        }
        Ok(())
    }
}

impl NearColumns {
    /// Forgets all columns: another factor has others.
    fn clear(&mut self) {
        self.columns.clear();
        self.moved.clear();
        self.on_modes.clear();
        self.modes.clear();
    }

    /// Makes those columns that are not known.
    fn make(
        &mut self,
        by: &Response<'_>,
        factor: &mut NearFactor,
        room: &mut Room,
        columns: &[u32],
    ) -> Result<()> {
        let (env, near) = (by.env, by.near);
        let (size, modes) = (3 * near.places.core, env.space.count());
        // What an error has left half made is made anew.
        let known = self.columns.len();
        self.moved.truncate(3 * known * size);
        self.on_modes.truncate(3 * known * modes);
        self.modes.truncate(3 * known * modes);
        self.made.clear();
        memory::fit(&mut self.made, columns.len(), WHAT)?;
        let is_new = |column: &&u32| !self.columns.contains(column);
        self.made.extend(columns.iter().filter(is_new));
        let count = self.made.len();
        memory::reserve(&mut self.columns, count, WHAT)?;
        memory::reserve(&mut self.moved, 3 * count * size, WHAT)?;
        memory::reserve(&mut self.on_modes, 3 * count * modes, WHAT)?;
        memory::reserve(&mut self.modes, 3 * count * modes, WHAT)?;
        self.moved.resize(3 * (known + count) * size, 0.0);
        self.on_modes.resize(3 * (known + count) * modes, 0.0);
        self.modes.resize(3 * (known + count) * modes, 0.0);
        // Those of nodes in the core first: they need the factor.
        let core = |column: u32| {
            let place = near.places.of(env.prior.contact_nodes[column as usize]);
            place.filter(|place| *place < near.places.core)
        };
        self.made
            .sort_unstable_by_key(|column| (core(*column).is_none(), *column));
        let in_core = self.made.iter().filter(|c| core(**c).is_some()).count();
        let moved = &mut self.moved[3 * known * size..][..3 * in_core * size];
        for (at, &column) in self.made[..in_core].iter().enumerate() {
            let place = core(column).unwrap_or(0);
            for axis in 0..3 {
                // 1 mN in the µN of the residual.
                moved[(3 * at + axis) * size + 3 * place + axis] = 1e3;
            }
        }
        // Sixteen right sides go through the factor together: one by one they would read it sixteen times.
        factor.solve_many(env.isa, moved);
        let on_modes = self.on_modes[3 * known * modes..].chunks_exact_mut(3 * modes);
        let responses = self.modes[3 * known * modes..].chunks_exact_mut(3 * modes);
        for (at, (work, responses)) in on_modes.zip(responses).enumerate() {
            let column = self.made[at];
            match at < in_core {
                true => {
                    // In the core the factor balances the force: nothing of it is left there.
                    resize(&mut room.field, 9 * near.places.free)?;
                    let moved = &moved[3 * at * size..][..3 * size];
                    factor.take_off(env, near, room, (moved, work))?;
                }
                false => {
                    for (axis, work) in work.chunks_exact_mut(modes).enumerate() {
                        let own = env.space.at_contact(3 * column as usize + axis);
                        for (work, own) in work.iter_mut().zip(own) {
                            *work = 1e3 * own;
                        }
                    }
                }
            }
            let axes = work.chunks_exact(modes);
            for (work, response) in axes.zip(responses.chunks_exact_mut(modes)) {
                by.preconditioner.respond_on_modes(env, work, response)?;
            }
        }
        // Last: only whole columns are known.
        self.columns.extend_from_slice(&self.made);
        Ok(())
    }
}

impl NearFactor {
    /// `p [n,r]` becomes `p - Phi^T K t` of up to three moves `t [n, 3 core]`, with what `K t` has in the core in `room.field [n, 3 free]`.
    pub fn take_off(
        &self,
        env: Env<'_>,
        near: &NearSet,
        room: &mut Room,
        (t, p): (&[f32], &mut [f32]),
    ) -> Result<()> {
        let (free, modes) = (3 * near.places.free, env.space.count());
        let count = p.len() / modes;
        let core = t.len() / count.max(1);
        for n in 0..count {
            let field = &mut room.field[n * free..][..free];
            self.around(&t[n * core..][..core], &mut field[core..]);
        }
        resize(&mut room.linear, p.len())?;
        room.on_modes(env, near, count)?;
        add(-1.0, &room.linear, p);
        Ok(())
    }
}
