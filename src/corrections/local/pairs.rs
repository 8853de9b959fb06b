//! The L-BFGS pairs of local iterations: steps and changes of the residual where the tools are, and on the modes elsewhere.
//!
//! A step is `s = t + Phi c`: any field `t` at the inside nodes, and modes. A change of the residual is known by what it does over such steps,
//!
//! ```text
//! y . s = y_S . t + eta . v + m . c        v = Phi c at the near nodes,  m = (K + kappa M of the modes) c_y + what the far clusters add
//! ```
//!
//! with the change `y_S` at the inside nodes, and `eta` what of it at the near nodes is not linear in `c_y`.
//!
//! A pair is kept as a [`Record`] that does not depend on what else is near, and laid out for the near set of the moment: where nodes
//! have come to it the change is that of linear elasticity, as it was while they were far.

use super::near::{NearSet, WHAT};
use super::record::Record;
use super::step::{Change, Step, add, resize};
use crate::corrections::history::PAIRS;
use crate::corrections::memory::{SLOTS, alpha, weight};
use crate::corrections::precondition::{Env, Preconditioner};
use crate::error::Result;
use crate::kernels::Isa;
use crate::kernels::vectors::{piece_add, piece_dots};
use crate::memory::{self, HeldBytes};

/// The pairs of a scene, oldest first by `order`.
#[derive(HeldBytes)]
pub(in crate::corrections) struct Pairs {
    records: Vec<Record>,
    steps: Vec<Step>,
    changes: Vec<Change>,
    laid_out: [bool; SLOTS],
    order: Vec<usize>,
    published: Vec<usize>,
    /// `s_i . y_j`.
    products: Vec<[f64; SLOTS]>,
}

/// What the second recursion needs of the first.
#[derive(Clone, Copy, Debug)]
pub(in crate::corrections) struct Recursion {
    used: ([usize; PAIRS], usize),
    alpha: [f64; PAIRS],
}

impl Pairs {
    pub fn new(modes: usize) -> Result<Pairs> {
        let mut own = Pairs {
            records: memory::room(SLOTS, WHAT)?,
            steps: memory::room(SLOTS, WHAT)?,
            changes: memory::room(SLOTS, WHAT)?,
            laid_out: [false; SLOTS],
            order: memory::room(SLOTS, WHAT)?,
            published: memory::room(SLOTS, WHAT)?,
            products: memory::filled(SLOTS, [0.0; SLOTS], WHAT)?,
        };
        for _ in 0..SLOTS {
            own.records.push(Record::default());
            own.steps.push(Step::with_modes(modes)?);
            own.changes.push(Change::with_modes(modes)?);
        }
        Ok(own)
    }

    /// Forgets all pairs, in the step being made.
    pub fn clear(&mut self) {
        self.order.clear();
    }

    /// Back to the pairs of the last published state.
    pub fn begin(&mut self) {
        self.order.clone_from(&self.published);
    }

    /// The state being made is published.
    pub fn commit(&mut self) {
        self.published.clone_from(&self.order);
    }

    /// Others are near now, or steps are of another length.
    pub fn forget_layout(&mut self) {
        self.laid_out = [false; SLOTS];
    }

    /// A copy of the published pairs, oldest first.
    pub fn copy(&self) -> Result<Vec<Record>> {
        let slots = self.published.iter();
        slots
            .map(|&slot| {
                let mut copy = Record::default();
                copy.take(&self.records[slot])?;
                Ok(copy)
            })
            .collect()
    }

    /// Takes what was copied.
    pub fn restore(&mut self, records: &[Record]) -> Result<()> {
        self.forget_layout();
        self.order.clear();
        for (slot, record) in records.iter().enumerate() {
            self.records[slot].take(record)?;
            self.order.push(slot);
        }
        self.commit();
        Ok(())
    }

    /// The pairs in use, oldest first.
    pub fn records(&self) -> impl Iterator<Item = &Record> + '_ {
        self.order.iter().map(|&slot| &self.records[slot])
    }

    /// Lays out all pairs for a near set.
    pub fn lay_out(
        &mut self,
        env: Env<'_>,
        near: &NearSet,
        preconditioner: &mut Preconditioner,
        room: &mut Room,
    ) -> Result<()> {
        let mut is_new = false;
        for at in 0..self.order.len() {
            let slot = self.order[at];
            if !self.laid_out[slot] {
                self.lay_out_one(env, near, preconditioner, room, (slot, None))?;
                is_new = true;
            }
        }
        if is_new {
            for at in 0..self.order.len() {
                self.multiply(at);
            }
            let products = &self.products;
            self.order.retain(|&slot| products[slot][slot] > 0.0);
        }
        Ok(())
    }

    fn lay_out_one(
        &mut self,
        env: Env<'_>,
        near: &NearSet,
        preconditioner: &mut Preconditioner,
        room: &mut Room,
        (slot, known_v): (usize, Option<&[f32]>),
    ) -> Result<()> {
        let (record, step) = (&self.records[slot], &mut self.steps[slot]);
        let change = &mut self.changes[slot];
        step.clear(near)?;
        change.clear(near)?;
        step.c.copy_from_slice(&record.c);
        change.modal.copy_from_slice(&record.modal);
        match known_v {
            Some(v) => step.v.copy_from_slice(v),
            None => {
                preconditioner.near_coordinates(env, &step.c, &[], &near.ranges, &mut room.q);
                near.decode(env, &room.q, &mut step.v)?;
            }
        }
        let is_same = record.centres == near.centres
            && record.t.len() == step.t.len()
            && record.eta.len() == change.eta.len();
        if is_same {
            step.t.copy_from_slice(&record.t);
            change.r.copy_from_slice(&record.r);
            change.eta.copy_from_slice(&record.eta);
        } else {
            // Where it was far it was linear.
            for (at, &node) in record.nodes.iter().enumerate() {
                if near.holds(node) {
                    let place = 3 * near.place(node).unwrap_or_default();
                    step.t[place..place + 3].copy_from_slice(&record.t[3 * at..3 * at + 3]);
                }
            }
            resize(&mut room.field, 3 * near.nodes.len())?;
            resize(&mut room.linear, 3 * near.free)?;
            room.field.copy_from_slice(&step.v);
            add(1.0, &step.t, &mut room.field);
            near.linear(env, &room.field, &mut room.linear);
            change.eta.copy_from_slice(&room.linear);
            let inside = 3 * near.inside;
            change.r.copy_from_slice(&change.eta[..inside]);
            near.linear(env, &step.v, &mut room.linear);
            add(-1.0, &room.linear, &mut change.eta);
            for (at, &node) in record.nodes.iter().enumerate() {
                if near.holds(node) {
                    let place = 3 * near.place(node).unwrap_or_default();
                    let from = 3 * at..3 * at + 3;
                    change.r[place..place + 3].copy_from_slice(&record.r[from.clone()]);
                    change.eta[place..place + 3].copy_from_slice(&record.eta[from]);
                }
            }
        }
        self.laid_out[slot] = true;
        Ok(())
    }

    /// Products of the pair at `at` in the order with the older ones.
    fn multiply(&mut self, at: usize) {
        let slot = self.order[at];
        for &i in &self.order[..=at] {
            self.products[i][slot] = self.changes[slot].over(&self.steps[i]);
        }
    }

    /// Stores a pair in place of the oldest, if it has curvature. The step's `v` is decoded from its `c`.
    pub fn store(
        &mut self,
        env: Env<'_>,
        near: &NearSet,
        preconditioner: &mut Preconditioner,
        room: &mut Room,
        about: &[u32],
        (step, change): (&Step, &Change),
    ) -> Result<()> {
        if self.order.len() == PAIRS {
            self.order.remove(0);
        }
        // Fewer than PAIRS are in use, and at most PAIRS are published.
        let free = |slot: &usize| !self.order.contains(slot) && !self.published.contains(slot);
        let slot = (0..SLOTS).find(free).unwrap_or(0);
        self.laid_out[slot] = false;
        self.records[slot].fill(near, about, step, change)?;
        self.lay_out_one(env, near, preconditioner, room, (slot, Some(&step.v)))?;
        self.order.push(slot);
        self.multiply(self.order.len() - 1);
        if self.products[slot][slot] <= 0.0 {
            self.order.retain(|&other| other != slot);
        }
        Ok(())
    }

    /// The first recursion: `r` becomes `r - sum_i alpha_i y_i`.
    pub fn descend(&self, isa: Isa, r: &mut Change) -> Recursion {
        let used = self.used();
        let steps = |of: fn(&Step) -> &[f32]| self.steps(used, of);
        let mut products = [0.0; PAIRS];
        sum_dots(isa, &steps(|s| &s.t), &r.r, used.1, &mut products);
        sum_dots(isa, &steps(|s| &s.v), &r.eta, used.1, &mut products);
        sum_dots(isa, &steps(|s| &s.c), &r.modal, used.1, &mut products);
        let (slots, count) = (&used.0[..used.1], used.1);
        let alpha = alpha(&self.products, slots, &products[..count]);
        let factors = alpha.map(|a| -a as f32);
        let changes = |of: fn(&Change) -> &[f32]| self.changes(used, of);
        piece_add(
            isa,
            &changes(|y| &y.r)[..count],
            &factors[..count],
            0,
            &mut r.r,
        );
        piece_add(
            isa,
            &changes(|y| &y.eta)[..count],
            &factors[..count],
            0,
            &mut r.eta,
        );
        piece_add(
            isa,
            &changes(|y| &y.modal)[..count],
            &factors[..count],
            0,
            &mut r.modal,
        );
        Recursion { used, alpha }
    }

    /// The second recursion: `z` becomes `-(z + sum_i w_i s_i)`.
    pub fn ascend(&self, isa: Isa, recursion: Recursion, z: &mut Step) {
        let (used, count) = (recursion.used, recursion.used.1);
        let changes = |of: fn(&Change) -> &[f32]| self.changes(used, of);
        let mut products = [0.0; PAIRS];
        sum_dots(isa, &changes(|y| &y.r), &z.t, count, &mut products);
        let (eta, free) = (changes(|y| &y.eta), self.free(used, z));
        sum_dots(isa, &eta, &z.v[..free], count, &mut products);
        sum_dots(isa, &changes(|y| &y.modal), &z.c, count, &mut products);
        let slots = &used.0[..count];
        let weights = weight(&self.products, slots, &recursion.alpha, &products[..count]);
        let factors = weights.map(|w| w as f32);
        let steps = |of: fn(&Step) -> &[f32]| self.steps(used, of);
        piece_add(
            isa,
            &steps(|s| &s.t)[..count],
            &factors[..count],
            0,
            &mut z.t,
        );
        piece_add(
            isa,
            &steps(|s| &s.v)[..count],
            &factors[..count],
            0,
            &mut z.v,
        );
        piece_add(
            isa,
            &steps(|s| &s.c)[..count],
            &factors[..count],
            0,
            &mut z.c,
        );
        z.scale(-1.0);
    }

    /// The slots in use, oldest first, and how many.
    fn used(&self) -> ([usize; PAIRS], usize) {
        let mut used = [0; PAIRS];
        used[..self.order.len()].copy_from_slice(&self.order);
        (used, self.order.len())
    }

    fn steps(
        &self,
        (used, count): ([usize; PAIRS], usize),
        of: fn(&Step) -> &[f32],
    ) -> [&[f32]; PAIRS] {
        let mut lists: [&[f32]; PAIRS] = [&[]; PAIRS];
        for (list, &slot) in lists.iter_mut().zip(&used[..count]) {
            *list = of(&self.steps[slot]);
        }
        lists
    }

    fn changes(
        &self,
        (used, count): ([usize; PAIRS], usize),
        of: fn(&Change) -> &[f32],
    ) -> [&[f32]; PAIRS] {
        let mut lists: [&[f32]; PAIRS] = [&[]; PAIRS];
        for (list, &slot) in lists.iter_mut().zip(&used[..count]) {
            *list = of(&self.changes[slot]);
        }
        lists
    }

    /// Numbers of `v` at the free nodes.
    fn free(&self, (used, count): ([usize; PAIRS], usize), z: &Step) -> usize {
        match count {
            0 => z.v.len(),
            _ => self.changes[used[0]].eta.len(),
        }
    }
}

/// Scratch of a layout.
#[derive(Debug, Default, HeldBytes)]
pub(in crate::corrections) struct Room {
    /// Coordinates `[Q]`, of the near blocks alone.
    pub q: Vec<f32>,
    /// A field by place, and one at the free nodes.
    pub field: Vec<f32>,
    pub linear: Vec<f32>,
}

/// Adds `rows_i . x` to the first `count` sums; rows may be longer than `x`. Sums over pieces are in f64.
fn sum_dots(isa: Isa, rows: &[&[f32]; PAIRS], x: &[f32], count: usize, sums: &mut [f64; PAIRS]) {
    const PIECE: usize = 4096;
    for (piece, x) in x.chunks(PIECE).enumerate() {
        let mut own = [0.0f32; PAIRS];
        piece_dots(isa, &rows[..count], x, piece * PIECE, &mut own[..count]);
        for (sum, own) in sums.iter_mut().zip(own) {
            *sum += f64::from(own);
        }
    }
}
