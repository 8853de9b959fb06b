//! The L-BFGS pairs of local iterations: steps and changes of the residual where the tools are, and on the modes elsewhere.
//!
//! A step is `s = t + Phi c`: any field `t` at the inside nodes, and modes. A change of the residual is known by what it does over such steps,
//! `y . s = y_S . t + (Phi^T y) . c`.
//!
//! A pair is kept as a [`Record`] that does not depend on what else is near, and laid out for the near set of the moment: where nodes
//! have come to it the change is that of linear elasticity, as it was while they were far.

use std::ops::Range;

use super::linear::WHAT;
use super::near::NearSet;
use super::record::Record;
use super::step::{Change, Step, add, resize};
use crate::corrections::history::PAIRS;
use crate::corrections::memory::{SLOTS, alpha, weight};
use crate::corrections::precondition::Env;
use crate::error::Result;
use crate::kernels::Isa;
use crate::kernels::vectors::{piece_add, piece_dots};
use crate::memory::{self, HeldBytes};

/// The pairs of a scene, oldest first by `order`.
#[derive(HeldBytes)]
pub(in crate::corrections) struct Pairs {
    /// By slot: the pair as it lasts, by nodes.
    records: Vec<Record>,
    /// The same laid out for the near set of the moment, by place; of use where `laid_out` says so.
    steps: Vec<Step>,
    changes: Vec<Change>,
    laid_out: [bool; SLOTS],
    /// Slots from the oldest to the newest, of the step being made and of the last published one.
    order: Vec<usize>,
    published: Vec<usize>,
    /// `s_i . y_j`.
    products: Vec<[f64; SLOTS]>,
}

/// What the second recursion needs of the first.
#[derive(Clone, Copy, Debug)]
pub(in crate::corrections) struct Recursion {
    /// Slots of the pairs, oldest first, and how many: those of the first recursion, which the
    /// second has to use as well.
    used: ([usize; PAIRS], usize),
    /// `alpha_i` of the first recursion, by the place in `used`.
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
        let mut copies = memory::room(self.published.len(), WHAT)?;
        for &slot in &self.published {
            let mut copy = Record::default();
            copy.take(&self.records[slot])?;
            copies.push(copy);
        }
        Ok(copies)
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
    ///
    /// Only pairs that are not laid out yet are touched. Afterwards every pair in the order has
    /// `s . y > 0` over what is near now, without which the recursions would not give a descent.
    pub fn lay_out(&mut self, env: Env<'_>, near: &NearSet, room: &mut Room) -> Result<()> {
        let (mut is_new, mut listed) = (false, None);
        for at in 0..self.order.len() {
            let slot = self.order[at];
            if !self.laid_out[slot] {
                self.lay_out_one(env, near, room, (slot, &mut listed))?;
                is_new = true;
            }
        }
        if is_new {
            for at in 0..self.order.len() {
                self.multiply(at);
            }
            // Curvature on the nodes that were near before says nothing of those that are near now.
            let products = &self.products;
            self.order.retain(|&slot| products[slot][slot] > 0.0);
        }
        Ok(())
    }

    /// The pair of a slot. `listed` is that of which `room` knows the elements at nodes that it does not know.
    fn lay_out_one(
        &mut self,
        env: Env<'_>,
        near: &NearSet,
        room: &mut Room,
        (slot, listed): (usize, &mut Option<usize>),
    ) -> Result<()> {
        let (record, step) = (&self.records[slot], &mut self.steps[slot]);
        let change = &mut self.changes[slot];
        step.clear(near)?;
        change.clear(near)?;
        step.c.copy_from_slice(&record.c);
        change.p.copy_from_slice(&record.p);
        // The same tools at the same places: the same nodes, in the same order.
        if record.centres == near.centres && record.t.len() == step.t.len() {
            step.t.copy_from_slice(&record.t);
            change.r.copy_from_slice(&record.r);
        } else {
            let places = record
                .nodes
                .iter()
                .map(|&node| match near.places.holds(node) {
                    true => near.places.of(node),
                    false => None,
                });
            let kept = |from: &[f32], to: &mut [f32]| {
                for (place, from) in places.clone().zip(from.as_chunks::<3>().0) {
                    if let Some(place) = place {
                        to[3 * place..3 * place + 3].copy_from_slice(from);
                    }
                }
            };
            kept(&record.t, &mut step.t);
            // Where it was far it was linear. A set that moves on has few such nodes, and the pairs have them in common.
            let is_listed =
                listed.is_some_and(|other: usize| self.records[other].nodes == record.nodes);
            if !is_listed {
                *listed = None;
                room.find_unknown(near, &record.nodes)?;
                *listed = Some(slot);
            }
            resize(&mut room.field, 3 * near.places.nodes.len())?;
            resize(&mut room.linear, 3 * near.places.free)?;
            env.near_coordinates(&step.c, &near.blocks.all.ranges, &mut room.q);
            near.decode(env, &room.q, &mut room.field)?;
            add(1.0, &step.t, &mut room.field);
            near.linear(env, &room.field, Some(&room.found), &mut room.linear);
            change
                .r
                .copy_from_slice(&room.linear[..3 * near.places.inside]);
            // Where the pair knows the nonlinear change it takes the place of the linear one.
            kept(&record.r, &mut change.r);
        }
        self.laid_out[slot] = true;
        Ok(())
    }

    /// Products of the pair at `at` in the order with the older ones.
    fn multiply(&mut self, at: usize) {
        let slot = self.order[at];
        for &i in &self.order[..=at] {
            // `s_i . y_slot` with `i` not newer: the recursions ask for no others.
            self.products[i][slot] = self.changes[slot].over(&self.steps[i]);
        }
    }

    /// Stores a pair in place of the oldest, if it has curvature.
    pub fn store(
        &mut self,
        env: Env<'_>,
        near: &NearSet,
        room: &mut Room,
        about: &[u32],
        (step, change): (&Step, &Change),
    ) -> Result<()> {
        if self.order.len() == PAIRS {
            // Its slot is free again only when no published list has it: a refused step goes back
            // to that list.
            self.order.remove(0);
        }
        // Fewer than PAIRS are in use, and at most PAIRS are published.
        let free = |slot: &usize| !self.order.contains(slot) && !self.published.contains(slot);
        let slot = (0..SLOTS).find(free).unwrap_or(0);
        self.laid_out[slot] = false;
        // The slot is in no list until the pair is whole: what fails below loses this pair and nothing else.
        self.records[slot].fill(near, about, step, change)?;
        self.lay_out_one(env, near, room, (slot, &mut None))?;
        self.order.push(slot);
        self.multiply(self.order.len() - 1);
        if self.products[slot][slot] <= 0.0 {
            self.order.retain(|&other| other != slot);
        }
        Ok(())
    }

    /// The first recursion: `r` becomes `r - sum_i alpha_i y_i`.
    ///
    /// `alpha_i = s_i . r / (s_i . y_i)`, from the newest pair to the oldest, each of the residual
    /// that the newer ones have left. The products with `r` are made at once; what the newer pairs
    /// take off is known from the products `s_i . y_j` (Nocedal and Wright, Numerical Optimization,
    /// algorithm 7.4).
    pub fn descend(&self, isa: Isa, r: &mut Change) -> Recursion {
        let used = self.used();
        let count = used.1;
        let mut products = [0.0; PAIRS];
        // `s . r = t . r_S + c . (Phi^T r)`: both halves into the same sums.
        sum_dots(isa, &self.steps(used, |s| &s.t), &r.r, count, &mut products);
        sum_dots(isa, &self.steps(used, |s| &s.c), &r.p, count, &mut products);
        let alpha = alpha(&self.products, &used.0[..count], &products[..count]);
        let factors = alpha.map(|a| -a as f32);
        let (rows, modes) = (self.changes(used, |y| &y.r), self.changes(used, |y| &y.p));
        piece_add(isa, &rows[..count], &factors[..count], 0, &mut r.r);
        piece_add(isa, &modes[..count], &factors[..count], 0, &mut r.p);
        Recursion { used, alpha }
    }

    /// The second recursion: `z` becomes `-(z + sum_i w_i s_i)`.
    ///
    /// `w_i = alpha_i - y_i . z / (s_i . y_i)`, from the oldest to the newest; the minus makes it a
    /// step of descent.
    pub fn ascend(&self, isa: Isa, recursion: Recursion, z: &mut Step) {
        let (used, count) = (recursion.used, recursion.used.1);
        let mut products = [0.0; PAIRS];
        sum_dots(
            isa,
            &self.changes(used, |y| &y.r),
            &z.t,
            count,
            &mut products,
        );
        sum_dots(
            isa,
            &self.changes(used, |y| &y.p),
            &z.c,
            count,
            &mut products,
        );
        let slots = &used.0[..count];
        let weights = weight(&self.products, slots, &recursion.alpha, &products[..count]);
        let factors = weights.map(|w| w as f32);
        let (rows, modes) = (self.steps(used, |s| &s.t), self.steps(used, |s| &s.c));
        piece_add(isa, &rows[..count], &factors[..count], 0, &mut z.t);
        piece_add(isa, &modes[..count], &factors[..count], 0, &mut z.c);
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
}

/// Scratch of a layout.
#[derive(Debug, Default, HeldBytes)]
pub(in crate::corrections) struct Room {
    /// Coordinates `[Q]`, of the near blocks alone, and those of nine fields `[9,Q]`.
    pub q: Vec<f32>,
    pub nine: Vec<f32>,
    /// A field by place, or three at the free nodes; and one at those, or what three have of the modes.
    pub field: Vec<f32>,
    pub linear: Vec<f32>,
    /// The blocks that the vectors of nine fields are of.
    pub used: Vec<Range<usize>>,
    /// By inside place: whether a pair does not know it; and the elements at those.
    pub unknown: Vec<bool>,
    pub found: Vec<u32>,
}

impl Room {
    /// Lists the elements at those inside nodes that are not among the known ones.
    fn find_unknown(&mut self, near: &NearSet, known: &[u32]) -> Result<()> {
        self.unknown.clear();
        memory::fit(&mut self.unknown, near.places.inside, WHAT)?;
        self.unknown.resize(near.places.inside, true);
        let places = known.iter().filter_map(|node| near.places.of(*node));
        for place in places.filter(|place| *place < near.places.inside) {
            self.unknown[place] = false;
        }
        near.elements.find(&self.unknown, &mut self.found)
    }

    /// `linear [n,r] = Phi^T field` of up to three fields `[n, 3 free]` that are zero beyond the core and what is around it.
    pub fn on_modes(&mut self, env: Env<'_>, near: &NearSet, count: usize) -> Result<()> {
        let size = self.q.len();
        if self.nine.len() != 9 * size {
            resize(&mut self.nine, 9 * size)?;
        }
        let three = &mut self.nine[..count * size];
        let fields = self.field.chunks_exact((3 * near.places.free).max(1));
        for (field, q) in fields.zip(three.chunks_exact_mut(size)) {
            near.blocks.around.project(env, field, q);
        }
        env.on_modes_in(&near.blocks.around.ranges, three, &mut self.linear);
        Ok(())
    }

    /// `linear [9,r] = Phi^T (e_i w_j)`, field `3 i + j`, of vectors `w` at some places.
    pub fn products_on_modes(
        &mut self,
        env: Env<'_>,
        near: &NearSet,
        vectors: &[(u32, [f32; 3])],
    ) -> Result<()> {
        let size = self.q.len();
        if self.nine.len() != 9 * size {
            resize(&mut self.nine, 9 * size)?;
        }
        near.ranges_of(env, vectors, &mut self.used)?;
        for q in self.nine.chunks_exact_mut(size) {
            for range in &self.used {
                q[range.clone()].fill(0.0);
            }
        }
        near.project_products(env, vectors, &mut self.nine);
        resize(&mut self.linear, 9 * env.space.count())?;
        env.on_modes_in(&self.used, &self.nine, &mut self.linear);
        Ok(())
    }
}

/// Adds `rows_i . x` to the first `count` sums; rows may be longer than `x`. Sums over pieces are in f64.
fn sum_dots(isa: Isa, rows: &[&[f32]; PAIRS], x: &[f32], count: usize, sums: &mut [f64; PAIRS]) {
    const PIECE: usize = 4096;
    for (piece, x) in x.chunks(PIECE).enumerate() {
        // In f32 within a piece, as the lanes have it; over thousands of nodes f32 would lose the digits that the pairs live of.
        let mut own = [0.0f32; PAIRS];
        piece_dots(isa, &rows[..count], x, piece * PIECE, &mut own[..count]);
        for (sum, own) in sums.iter_mut().zip(own) {
            *sum += f64::from(own);
        }
    }
}
