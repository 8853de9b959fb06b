//! Central differences over many inner steps, split over threads.
//!
//! `d` is the increment `u^{n+1/2}` (displacement over one inner step):
//! `d <- beta d + g f`, `u <- u + d`, with `beta = (1 - alpha dt/2) / (1 + alpha dt/2)`
//! and `g = dt² / (m (1 + alpha dt/2))`; `g` sits in the fourth component of `d`,
//! zero at held and prescribed nodes. Contact nodes move on a straight line and
//! end the frame exactly at their target. Tools ([`super::touch`]) then correct what has moved. Two phases a step, a barrier after each:
//! chunks add element forces to their own slots; owners collect ghost forces and move. Loads ([`super::body_load`]) are added in between.

use super::barrier::SpinBarrier;
use super::body_load::{self, BodyLoad};
use super::fields::{Fields, Node};
use super::relaxing::{Relaxing, View};
use super::ties::Ties;
use super::touch::Touch;
use elements::PADDED;
use elements::{Chunk, Kernels, Partition};
use lanes::FlushToZero;
use rayon::ThreadPool;
use std::sync::Mutex;

/// A contact node's straight path over the frame.
#[derive(Clone, Copy)]
pub(crate) struct Path {
    pub slot: u32,
    pub start: [f32; 3],
    pub target: [f32; 3],
}

/// What one chunk reports from a march.
#[derive(Clone, Copy, Default)]
pub(crate) struct Tally {
    /// Work done by contact nodes and loads on the tissue, nJ.
    pub work: f64,
    /// First inner step (from 1) at which an element was inverted; 0 when none was.
    pub inverted_at: u32,
}

/// Everything that stays the same over a march.
pub(crate) struct March<'a> {
    pub partition: &'a Partition,
    pub kernels: Kernels,
    pub averaged: bool,
    /// Four times the nodal rest volume times the bulk modulus by slot, nJ (averaged only).
    pub rest_volume: &'a [f32],
    /// Nodal mass by slot, g.
    pub mass: &'a [f32],
    pub beta: f32,
    pub dt: f64,
    pub damping: f64,
    /// Ascending slots.
    pub paths: &'a [Path],
    /// Tools, resolved by the first thread between two barriers.
    pub touch: Option<Mutex<&'a mut Touch>>,
    /// Loads beside contact, computed by the first thread between two barriers.
    pub load: Option<Mutex<&'a mut BodyLoad>>,
    /// Ties, resolved before the tools by the same thread.
    pub ties: Option<Mutex<&'a mut Ties>>,
    /// What relaxing tissue remembers.
    pub relaxing: Option<Mutex<&'a mut Relaxing>>,
    pub steps: u32,
}

/// Raw views of the slot arrays that threads share.
///
/// In the element phase a thread writes the forces of its own chunks (with averaged
/// elements also their dilatations, between two barriers) and reads owned displacements;
/// in the node phase it writes displacements, increments and owned forces of its own
/// chunks (of ghosts only what no one reads) and reads ghost forces.
/// Barriers separate the phases, so no location is written by one thread while
/// another touches it.
#[derive(Clone, Copy)]
pub(super) struct Shared {
    pub displacement: *mut Node,
    pub increment: *mut Node,
    pub force: *mut Node,
    /// Loads of the inner step; null where there are none.
    load: *const Node,
    pub(super) relaxing: Option<View>,
    pub tallies: *mut Tally,
}

impl Shared {
    fn new(fields: &mut Fields, tallies: &mut [Tally]) -> Self {
        Self {
            displacement: fields.displacement.as_mut_ptr(),
            increment: fields.increment.as_mut_ptr(),
            force: fields.force.as_mut_ptr(),
            load: std::ptr::null(),
            relaxing: None,
            tallies: tallies.as_mut_ptr(),
        }
    }
}

// SAFETY: see the type's description.
unsafe impl Send for Shared {}
// SAFETY: see the type's description.
unsafe impl Sync for Shared {}

impl March<'_> {
    /// Runs all inner steps; one tally a chunk. The same bits for any pool.
    pub fn run(&self, fields: &mut Fields, pool: Option<&ThreadPool>) -> Vec<Tally> {
        let mut tallies = vec![Tally::default(); self.partition.chunks.len()];
        let mut shared = Shared::new(fields, &mut tallies);
        if let Some(Ok(load)) = self.load.as_ref().map(Mutex::lock) {
            shared.load = load.now.as_ptr();
        }
        shared.relaxing = self.relaxing_view();
        self.on_threads(pool, |first, mine, barrier| {
            let mut positions = self.positions();
            for step in 1..=self.steps {
                // SAFETY: phases and barriers as `Shared` demands; `mine` is disjoint a thread.
                unsafe {
                    self.remember(shared, mine.clone(), &mut positions, step);
                    self.element_phase(shared, mine.clone(), barrier, &mut positions, step);
                    barrier.wait();
                    if let Some(load) = &self.load {
                        // Poisoned only where this thread panicked, which ends the march.
                        if first && let Ok(mut load) = load.lock() {
                            load.evaluate(shared.displacement, step);
                        }
                        barrier.wait();
                    }
                    for chunk in mine.clone() {
                        self.node_phase(shared, chunk, step);
                    }
                    barrier.wait();
                    if self.touch.is_some() || self.ties.is_some() {
                        if first {
                            self.touch_phase(shared, step);
                        }
                        barrier.wait();
                    }
                }
            }
        });
        tallies
    }

    /// Computes the forces of the present state into `fields.force` (owned slots complete).
    pub fn forces(&self, fields: &mut Fields, pool: Option<&ThreadPool>) {
        let mut tallies = vec![Tally::default(); self.partition.chunks.len()];
        let mut shared = Shared::new(fields, &mut tallies);
        shared.relaxing = self.relaxing_view();
        self.on_threads(pool, |_, mine, barrier| {
            let mut positions = self.positions();
            // SAFETY: as in `run`.
            unsafe {
                self.element_phase(shared, mine.clone(), barrier, &mut positions, 1);
                barrier.wait();
                for chunk in mine {
                    let chunk = &self.partition.chunks[chunk];
                    self.collect(shared, chunk);
                    if let Some(relaxing) = &shared.relaxing {
                        relaxing.add(chunk, shared.force);
                    }
                }
            }
        });
    }

    /// Room for the node positions of any chunk.
    fn positions(&self) -> Vec<Node> {
        let sizes = self.partition.chunks.iter().map(Chunk::slot_count);
        vec![Node::default(); sizes.max().unwrap_or(0).next_multiple_of(PADDED)]
    }

    /// Calls `work` with each thread's chunks, and whether it is the first thread.
    fn on_threads(
        &self,
        pool: Option<&ThreadPool>,
        work: impl Fn(bool, std::ops::Range<usize>, &SpinBarrier) + Sync,
    ) {
        let count = self.partition.chunks.len();
        match pool {
            None => {
                let _mode = FlushToZero::enter();
                work(true, 0..count, &SpinBarrier::new(1));
            }
            Some(pool) => {
                let threads = pool.current_num_threads();
                let barrier = SpinBarrier::new(threads);
                pool.broadcast(|context| {
                    let _mode = FlushToZero::enter();
                    let index = context.index();
                    work(
                        index == 0,
                        count * index / threads..count * (index + 1) / threads,
                        &barrier,
                    );
                });
            }
        }
    }

    /// Element forces of the chunks in `mine` into their own slots; `positions` is scratch.
    unsafe fn element_phase(
        &self,
        shared: Shared,
        mine: std::ops::Range<usize>,
        barrier: &SpinBarrier,
        positions: &mut [Node],
        step: u32,
    ) {
        // SAFETY: the caller's: these chunks are this worker's, and phases are separated by the barrier.
        unsafe {
            if self.averaged {
                for chunk in mine.clone() {
                    let chunk = &self.partition.chunks[chunk];
                    self.prepare(shared, chunk, positions);
                    (self.kernels.volumes)(
                        self.partition,
                        chunk,
                        positions.as_ptr().cast(),
                        shared.force.add(chunk.first).cast(),
                    );
                }
                barrier.wait();
                for chunk in mine.clone() {
                    self.nodal_dilatation(shared, &self.partition.chunks[chunk]);
                }
                barrier.wait();
            }
            for index in mine {
                let chunk = &self.partition.chunks[index];
                self.prepare(shared, chunk, positions);
                let smallest = (self.kernels.forces)(
                    self.partition,
                    chunk,
                    positions.as_ptr().cast(),
                    shared.force.add(chunk.first).cast(),
                    self.averaged,
                );
                let tally = &mut *shared.tallies.add(index);
                if smallest <= 0.0 && tally.inverted_at == 0 {
                    tally.inverted_at = step;
                }
            }
        }
    }

    /// Puts the chunk's nodes where they are now, from its centre, and clears its forces.
    unsafe fn prepare(&self, shared: Shared, chunk: &Chunk, positions: &mut [Node]) {
        // SAFETY: the caller's: the chunk's slots are this worker's in this phase.
        unsafe {
            let rest = self.partition.base(chunk);
            (self.kernels.place)(
                chunk.owned,
                rest.as_ptr(),
                shared.displacement.add(chunk.first).cast(),
                positions.as_mut_ptr().cast(),
            );
            let ghosts = positions[chunk.owned..]
                .iter_mut()
                .zip(&rest[chunk.owned..]);
            for ((position, rest), owner) in ghosts.zip(&chunk.ghosts) {
                let displacement = (*shared.displacement.add(*owner as usize)).0;
                *position = Node(std::array::from_fn(|k| rest[k] + displacement[k]));
            }
            std::ptr::write_bytes(shared.force.add(chunk.first), 0, chunk.slot_count());
        }
    }

    /// Adds ghost forces to the chunk's own nodes, in ascending slot order.
    unsafe fn collect(&self, shared: Shared, chunk: &Chunk) {
        // SAFETY: the caller's: the chunk's slots are this worker's in this phase.
        unsafe {
            for (own, ghost) in &chunk.contributions {
                let source = *shared.force.add(*ghost as usize);
                let target = &mut *shared.force.add(*own as usize);
                for k in 0..4 {
                    target.0[k] += source.0[k];
                }
            }
        }
    }

    /// Nodal `J - 1` from the nodal volumes, for average-pressure elements.
    unsafe fn nodal_dilatation(&self, shared: Shared, chunk: &Chunk) {
        // SAFETY: the caller's: the chunk's slots are this worker's in this phase.
        unsafe {
            self.collect(shared, chunk);
            for slot in chunk.first..chunk.first + chunk.owned {
                let volume = (*shared.force.add(slot)).0[2];
                (*shared.displacement.add(slot)).0[3] = volume / self.rest_volume[slot] - 1.0;
            }
        }
    }

    /// Moves the chunk's own nodes by one inner step.
    unsafe fn node_phase(&self, shared: Shared, index: usize, step: u32) {
        // SAFETY: the caller's: the chunk's slots are this worker's in this phase.
        unsafe {
            let chunk = &self.partition.chunks[index];
            self.collect(shared, chunk);
            let own = chunk.first..chunk.first + chunk.owned;
            let first = self
                .paths
                .partition_point(|path| (path.slot as usize) < own.start);
            let last = self
                .paths
                .partition_point(|path| (path.slot as usize) < own.end);
            let paths = &self.paths[first..last];
            let tally = &mut *shared.tallies.add(index);
            if let Some(relaxing) = &shared.relaxing {
                if relaxing.is_due(step) {
                    relaxing.collect(chunk);
                }
                relaxing.add(chunk, shared.force);
            }
            if !shared.load.is_null() {
                body_load::add(shared.load, shared.force, own.clone());
                tally.work += body_load::half_work(shared.load, shared.increment, own.clone());
            }
            for path in paths {
                tally.work += self.follow(shared, path, step);
            }
            (self.kernels.advance)(
                chunk.owned,
                self.beta,
                shared.force.add(chunk.first).cast(),
                shared.increment.add(chunk.first).cast(),
                shared.displacement.add(chunk.first).cast(),
            );
            for path in paths {
                let (increment, displacement) = (
                    &mut *shared.increment.add(path.slot as usize),
                    &mut *shared.displacement.add(path.slot as usize),
                );
                let (start, end) = (path.at(step - 1, self.steps), path.at(step, self.steps));
                for k in 0..3 {
                    increment.0[k] = end[k] - start[k];
                    displacement.0[k] = end[k];
                }
            }
            if !shared.load.is_null() {
                tally.work += body_load::half_work(shared.load, shared.increment, own);
            }
        }
    }

    /// Work of the instrument on one contact node over this step, nJ:
    /// the force that the discrete equation of motion asks for, times the mean of both increments.
    unsafe fn follow(&self, shared: Shared, path: &Path, step: u32) -> f64 {
        let slot = path.slot as usize;
        // SAFETY: the caller's: the chunk's slots are this worker's in this phase.
        let (force, before) = unsafe { (*shared.force.add(slot), *shared.increment.add(slot)) };
        let (start, end) = (path.at(step - 1, self.steps), path.at(step, self.steps));
        let mass = f64::from(self.mass[slot]);
        (0..3)
            .map(|k| {
                let old = f64::from(before.0[k]);
                let new = f64::from(end[k] - start[k]);
                let inertia = mass / (self.dt * self.dt) * (new - old);
                let drag = self.damping * mass / (2.0 * self.dt) * (new + old);
                (inertia + drag - f64::from(force.0[k])) * 0.5 * (new + old)
            })
            .sum()
    }
}

impl Path {
    /// Position after `step` of `steps`.
    #[inline(always)]
    pub fn at(&self, step: u32, steps: u32) -> [f32; 3] {
        if step == steps {
            return self.target;
        }
        let part = step as f32 / steps as f32;
        [0, 1, 2].map(|k| self.start[k] + (self.target[k] - self.start[k]) * part)
    }
}
