//! Central differences over many inner steps, split over threads.
//!
//! `d` is the increment `u^{n+1/2}` (displacement over one inner step):
//! `d <- beta d + g f`, `u <- u + d`, with `beta = (1 - alpha dt/2) / (1 + alpha dt/2)`
//! and `g = dt² / (m (1 + alpha dt/2))`; `g` sits in the fourth component of `d`,
//! zero at held and prescribed nodes. Contact nodes move on a straight line and
//! end the frame exactly at their target. Two phases a step, a barrier after each:
//! chunks add element forces to their own slots; owners collect ghost forces and move.

use super::barrier::{FlushDenormals, SpinBarrier};
use super::dispatch::Kernels;
use super::kernel::Law;
use super::partition::{Chunk, Partition};
use rayon::ThreadPool;

/// Four floats on a 16-byte boundary.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Node(pub [f32; 4]);

/// Slot arrays (owned and ghost), see `partition`.
#[derive(Clone, Default)]
pub(crate) struct Fields {
    /// Displacement, mm; fourth component: nodal pressure, Pa (averaged elements only).
    pub displacement: Vec<Node>,
    /// Displacement over the last inner step, mm; fourth component: `g`, mm/µN.
    pub increment: Vec<Node>,
    /// Internal force, µN; fourth component: current nodal volume × 4, mm³ (averaged only).
    pub force: Vec<Node>,
}

/// A contact node's straight path over the frame.
#[derive(Clone, Copy)]
pub(crate) struct Path {
    pub slot: u32,
    pub start: [f32; 3],
    pub target: [f32; 3],
}

/// What one chunk reports from a march.
#[derive(Clone, Copy)]
pub(crate) struct Tally {
    /// Work done by contact nodes on the tissue, nJ.
    pub work: f64,
    /// First inner step (from 1) at which an element was inverted; 0 when none was.
    pub inverted_at: u32,
}

/// Everything that stays the same over a march.
pub(crate) struct March<'a> {
    pub partition: &'a Partition,
    pub kernels: Kernels,
    pub law: Law,
    pub averaged: bool,
    /// Four times the nodal rest volume by slot, mm³ (averaged only).
    pub rest_volume: &'a [f32],
    /// Nodal mass by slot, g.
    pub mass: &'a [f32],
    pub beta: f32,
    pub dt: f64,
    pub damping: f64,
    /// Ascending slots.
    pub paths: &'a [Path],
    pub steps: u32,
}

/// Raw views of the slot arrays that threads share.
///
/// In the element phase a thread writes the forces and ghost displacements of its
/// own chunks and reads owned displacements; in the node phase it writes owned
/// displacements, increments and forces of its own chunks and reads ghost forces.
/// Barriers separate the phases, so no location is written by one thread while
/// another touches it.
#[derive(Clone, Copy)]
struct Shared {
    displacement: *mut Node,
    increment: *mut Node,
    force: *mut Node,
    tallies: *mut Tally,
}

// SAFETY: see the type's description.
unsafe impl Send for Shared {}
// SAFETY: see the type's description.
unsafe impl Sync for Shared {}

impl March<'_> {
    /// Runs all inner steps; one tally a chunk. The same bits for any pool.
    pub fn run(&self, fields: &mut Fields, pool: Option<&ThreadPool>) -> Vec<Tally> {
        let mut tallies = vec![
            Tally {
                work: 0.0,
                inverted_at: 0
            };
            self.partition.chunks.len()
        ];
        let shared = Shared {
            displacement: fields.displacement.as_mut_ptr(),
            increment: fields.increment.as_mut_ptr(),
            force: fields.force.as_mut_ptr(),
            tallies: tallies.as_mut_ptr(),
        };
        self.on_threads(pool, |mine, barrier| {
            for step in 1..=self.steps {
                // SAFETY: phases and barriers as `Shared` demands; `mine` is disjoint a thread.
                unsafe {
                    self.element_phase(shared, mine.clone(), barrier, step);
                    barrier.wait();
                    for chunk in mine.clone() {
                        self.node_phase(shared, chunk, step);
                    }
                    barrier.wait();
                }
            }
        });
        tallies
    }

    /// Computes the forces of the present state into `fields.force` (owned slots complete).
    pub fn forces(&self, fields: &mut Fields, pool: Option<&ThreadPool>) {
        let mut tallies = vec![
            Tally {
                work: 0.0,
                inverted_at: 0
            };
            self.partition.chunks.len()
        ];
        let shared = Shared {
            displacement: fields.displacement.as_mut_ptr(),
            increment: fields.increment.as_mut_ptr(),
            force: fields.force.as_mut_ptr(),
            tallies: tallies.as_mut_ptr(),
        };
        self.on_threads(pool, |mine, barrier| {
            // SAFETY: as in `run`.
            unsafe {
                self.element_phase(shared, mine.clone(), barrier, 1);
                barrier.wait();
                for chunk in mine {
                    self.collect(shared, &self.partition.chunks[chunk]);
                }
            }
        });
    }

    /// Calls `work` with each thread's chunks.
    fn on_threads(
        &self,
        pool: Option<&ThreadPool>,
        work: impl Fn(std::ops::Range<usize>, &SpinBarrier) + Sync,
    ) {
        let count = self.partition.chunks.len();
        match pool {
            None => {
                let _mode = FlushDenormals::new();
                work(0..count, &SpinBarrier::new(1));
            }
            Some(pool) => {
                let threads = pool.current_num_threads();
                let barrier = SpinBarrier::new(threads);
                pool.broadcast(|context| {
                    let _mode = FlushDenormals::new();
                    let index = context.index();
                    work(
                        count * index / threads..count * (index + 1) / threads,
                        &barrier,
                    );
                });
            }
        }
    }

    /// Element forces of the chunks in `mine` into their own slots.
    unsafe fn element_phase(
        &self,
        shared: Shared,
        mine: std::ops::Range<usize>,
        barrier: &SpinBarrier,
        step: u32,
    ) {
        unsafe {
            if self.averaged {
                for chunk in mine.clone() {
                    let chunk = &self.partition.chunks[chunk];
                    self.prepare(shared, chunk);
                    (self.kernels.volumes)(
                        self.partition,
                        chunk,
                        shared.displacement.add(chunk.first).cast(),
                        shared.force.add(chunk.first).cast(),
                    );
                }
                barrier.wait();
                for chunk in mine.clone() {
                    self.nodal_pressure(shared, &self.partition.chunks[chunk]);
                }
                barrier.wait();
            }
            for index in mine {
                let chunk = &self.partition.chunks[index];
                self.prepare(shared, chunk);
                let kernel = if self.averaged {
                    self.kernels.averaged_forces
                } else {
                    self.kernels.forces
                };
                let smallest = kernel(
                    self.partition,
                    chunk,
                    shared.displacement.add(chunk.first).cast(),
                    shared.force.add(chunk.first).cast(),
                    self.law,
                );
                let tally = &mut *shared.tallies.add(index);
                if smallest <= 0.0 && tally.inverted_at == 0 {
                    tally.inverted_at = step;
                }
            }
        }
    }

    /// Copies owners' displacements to the chunk's ghosts and clears its forces.
    unsafe fn prepare(&self, shared: Shared, chunk: &Chunk) {
        unsafe {
            let ghosts = shared.displacement.add(chunk.first + chunk.owned);
            for (offset, owner) in chunk.ghosts.iter().enumerate() {
                *ghosts.add(offset) = *shared.displacement.add(*owner as usize);
            }
            std::ptr::write_bytes(shared.force.add(chunk.first), 0, chunk.slot_count());
        }
    }

    /// Adds ghost forces to the chunk's own nodes, in ascending slot order.
    unsafe fn collect(&self, shared: Shared, chunk: &Chunk) {
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

    /// Nodal pressure `kappa (J - 1)` from the nodal volumes, for average-pressure elements.
    unsafe fn nodal_pressure(&self, shared: Shared, chunk: &Chunk) {
        unsafe {
            self.collect(shared, chunk);
            for slot in chunk.first..chunk.first + chunk.owned {
                let volume = (*shared.force.add(slot)).0[3];
                (*shared.displacement.add(slot)).0[3] =
                    self.law.bulk * (volume / self.rest_volume[slot] - 1.0);
            }
        }
    }

    /// Moves the chunk's own nodes by one inner step.
    unsafe fn node_phase(&self, shared: Shared, index: usize, step: u32) {
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
            for path in paths {
                tally.work += self.follow(shared, path, step);
            }
            // The fourth components, gain and pressure, stay: one and nought there keep whole vectors going.
            let beta = [self.beta, self.beta, self.beta, 1.0];
            let moves = [1.0, 1.0, 1.0, 0.0];
            for slot in own {
                let force = (*shared.force.add(slot)).0;
                let increment = &mut (*shared.increment.add(slot)).0;
                let displacement = &mut (*shared.displacement.add(slot)).0;
                let gain = increment[3];
                for k in 0..4 {
                    increment[k] = beta[k] * increment[k] + gain * moves[k] * force[k];
                    displacement[k] += moves[k] * increment[k];
                }
            }
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
        }
    }

    /// Work of the instrument on one contact node over this step, nJ:
    /// the force that the discrete equation of motion asks for, times the mean of both increments.
    unsafe fn follow(&self, shared: Shared, path: &Path, step: u32) -> f64 {
        let slot = path.slot as usize;
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
