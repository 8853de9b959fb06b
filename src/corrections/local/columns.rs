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
#[derive(Default, HeldBytes)]
pub(super) struct NearColumns {
    generation: u64,
    columns: Vec<u32>,
    /// By column and axis: `B e` of a force of 1 mN `[3 C]`, `C` the core, mm; what of the force is left to the modes `[r]`, µN; what they make of it `[r]`, mm.
    moved: Vec<f32>,
    on_modes: Vec<f32>,
    modes: Vec<f32>,
}

/// What columns are made with.
pub(super) struct Response<'a> {
    pub env: Env<'a>,
    pub near: &'a NearSet,
    pub preconditioner: &'a Preconditioner,
    pub own: RefCell<(&'a mut NearFactor, &'a mut NearColumns, &'a mut Room)>,
}

impl Tangent for Response<'_> {
    fn generation(&self) -> u64 {
        self.own.borrow().0.generation
    }

    fn gather(&self, columns: &[u32], upper: &mut [f64]) -> Result<()> {
        let mut own = self.own.borrow_mut();
        let (factor, known, room) = &mut *own;
        if known.generation != factor.generation {
            known.clear();
            known.generation = factor.generation;
        }
        for &column in columns {
            if !known.columns.contains(&column) {
                known.push(self, factor, room, column)?;
            }
        }
        let (size, modes) = (3 * self.near.core, self.env.space.count());
        let order = 3 * columns.len();
        let at = |column: u32| known.columns.iter().position(|c| *c == column).unwrap_or(0);
        for (j, &column) in columns.iter().enumerate() {
            let column = at(column);
            for b in 0..3 {
                let index = 3 * column + b;
                let moved = &known.moved[index * size..][..size];
                let response = &known.modes[index * modes..][..modes];
                for (i, &row) in columns[..=j].iter().enumerate() {
                    let node = self.env.prior.contact_nodes[row as usize];
                    let place = self.near.place(node);
                    let is_diagonal = i == j;
                    let row = at(row);
                    for a in 0..3 {
                        let work = &known.on_modes[(3 * row + a) * modes..][..modes];
                        let mut sum = 1e-3 * dot(work, response);
                        match place {
                            Some(place) if place < self.near.core => {
                                sum += f64::from(moved[3 * place + a]);
                            }
                            // Outside of the core there is the diagonal.
                            Some(place) if place < self.near.inside && is_diagonal => {
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
    fn clear(&mut self) {
        self.columns.clear();
        self.moved.clear();
        self.on_modes.clear();
        self.modes.clear();
    }

    fn push(
        &mut self,
        by: &Response<'_>,
        factor: &mut NearFactor,
        room: &mut Room,
        column: u32,
    ) -> Result<()> {
        let (env, near) = (by.env, by.near);
        let (size, modes) = (3 * near.core, env.space.count());
        memory::reserve(&mut self.columns, 1, WHAT)?;
        memory::reserve(&mut self.moved, 3 * size, WHAT)?;
        memory::reserve(&mut self.on_modes, 3 * modes, WHAT)?;
        memory::reserve(&mut self.modes, 3 * modes, WHAT)?;
        let node = env.prior.contact_nodes[column as usize];
        // What an error has left half made is made anew.
        let known = 3 * self.columns.len();
        let (moved, on_modes) = (known * size, known * modes);
        self.moved.truncate(moved);
        self.on_modes.truncate(on_modes);
        self.modes.truncate(on_modes);
        self.moved.resize(moved + 3 * size, 0.0);
        self.on_modes.resize(on_modes + 3 * modes, 0.0);
        self.modes.resize(on_modes + 3 * modes, 0.0);
        for axis in 0..3 {
            let work = &mut self.on_modes[on_modes + axis * modes..][..modes];
            if let Some(place) = near.place(node).filter(|place| *place < near.core) {
                let t = &mut self.moved[moved + axis * size..][..size];
                t[3 * place + axis] = 1e3;
                factor.solve(env.isa, t);
                // In the core the factor balances the force: nothing of it is left there.
                resize(&mut room.field, 3 * near.free)?;
                factor.take_off(env, near, by.preconditioner, room, (t, work))?;
            } else {
                let own = env.space.at_contact(3 * column as usize + axis);
                for (work, own) in work.iter_mut().zip(own) {
                    *work = 1e3 * own;
                }
            }
            let response = &mut self.modes[on_modes + axis * modes..][..modes];
            by.preconditioner.respond_on_modes(env, work, response)?;
        }
        self.columns.push(column);
        Ok(())
    }
}

impl NearFactor {
    /// `p` becomes `p - Phi^T K t` of a move `t [3 core]`, with what `K t` has in the core at the start of `room.field [3 free]`.
    pub fn take_off(
        &self,
        env: Env<'_>,
        near: &NearSet,
        preconditioner: &Preconditioner,
        room: &mut Room,
        (t, p): (&[f32], &mut [f32]),
    ) -> Result<()> {
        resize(&mut room.linear, p.len())?;
        self.around(t, &mut room.field[t.len()..]);
        near.project(env, &room.field, &mut room.q);
        room.find_used(near)?;
        preconditioner.on_modes_in(env, &room.used, &room.q, &mut room.linear);
        add(-1.0, &room.linear, p);
        Ok(())
    }
}
