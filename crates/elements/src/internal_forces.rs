//! Internal forces of a whole body, `f_int(u)`, by the clustered SIMD kernel: what the corrections of the runtime evaluate.
//!
//! Two phases over the chunks of the [`Partition`]: each chunk computes the forces of its elements into its own slots, then each
//! collects for its nodes what their elements in other chunks added, in ascending slot order. So the sum has the same
//! bits for any number of threads.

use crate::batches::PADDING;
use crate::dispatch::Kernels;
use crate::material::Material;
use crate::partition::{CHUNK_ELEMENTS, Chunk, Partition};
use crate::room::filled;
use crate::tetrahedra::Tetrahedra;
use lanes::Isa;
use std::collections::TryReserveError;

/// Runs `task(chunk, worker)` for each chunk below a count, in any order and on any threads; `worker` is below the number of
/// workers that `Scratch::new` was given, and two tasks that run at once have different ones.
pub type ParallelFor<'a> = &'a dyn Fn(usize, &(dyn Fn(usize, usize) + Sync));

/// Chunks that a body is split into at least, where each has [`FEWEST_ELEMENTS`]: the far field of
/// a scene takes its means over them. It is a number, not one of threads, so that the bits stay.
const CHUNKS: usize = 96;
/// Elements of a chunk at least: the smaller a chunk, the larger the part of its nodes that are
/// ghosts.
const FEWEST_ELEMENTS: usize = 256;

/// The elements of a body, ready for [`ElementForces::evaluate`].
pub struct ElementForces {
    pub(crate) partition: Partition,
    pub(crate) kernels: Kernels,
    node_count: usize,
    /// Of each chunk that a cut has made: the chunk of the intact body that its elements were in.
    parents: Vec<u32>,
}

/// Four slots, `[x, y, z, w]` each: a cache line, so that a list of them is aligned for any
/// register.
#[derive(Clone, Copy, Default)]
#[repr(C, align(64))]
pub(crate) struct Line(pub(crate) [[f32; 4]; 4]);

/// Buffers of an evaluation; kept between calls.
pub struct Scratch {
    /// Forces by slot.
    /// Between the two phases a ghost's slot holds what its chunk's elements add to that node.
    pub(crate) forces: Vec<Line>,
    /// Node positions of the chunk at hand, a row a worker.
    pub(crate) positions: Vec<Vec<Line>>,
    /// Smallest det F a chunk.
    pub(crate) smallest: Vec<f32>,
}

impl Scratch {
    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let lines: usize = self.positions.iter().map(Vec::len).sum();
        size_of::<Line>() * (self.forces.len() + lines) + 4 * self.smallest.len()
    }
}

/// A pointer that the tasks of one evaluation share.
pub(crate) struct Shared<T>(pub(crate) *mut T);
// SAFETY: the tasks touch disjoint parts (see `evaluate`).
unsafe impl<T> Send for Shared<T> {}
// SAFETY: as above.
unsafe impl<T> Sync for Shared<T> {}

impl<T> Shared<T> {
    pub(crate) fn at(&self, index: usize) -> *mut T {
        self.0.wrapping_add(index)
    }
}

impl ElementForces {
    /// Prepares a body. `O(T log T)`.
    ///
    /// # Errors
    /// Where there is no memory for it.
    ///
    /// # Panics
    /// If this processor lacks the instruction set.
    pub fn new(
        body: Tetrahedra<'_>,
        material: &Material,
        isa: Isa,
    ) -> Result<Self, TryReserveError> {
        let kernels = Kernels::of(isa);
        let elements = (body.tets.len() / CHUNKS).clamp(FEWEST_ELEMENTS, CHUNK_ELEMENTS);
        Ok(Self {
            kernels: kernels.unwrap_or_else(|| panic!("{isa:?} is not available here")),
            partition: Partition::in_chunks(body, material, elements)?,
            node_count: body.positions.len(),
            parents: Vec::new(),
        })
    }

    /// The same kernels over what a cut has made of the body.
    /// `K`.
    pub(crate) fn with(&self, partition: Partition, parents: Vec<u32>, node_count: usize) -> Self {
        Self {
            partition,
            kernels: self.kernels,
            node_count,
            parents,
        }
    }

    /// Of each chunk that a cut has made, behind those of the intact body: the one of these that its elements were in; ascending.
    pub fn cut_chunks(&self) -> &[u32] {
        &self.parents
    }

    /// Nodes of the body, `K`.
    pub fn node_count(&self) -> usize {
        self.node_count
    }

    /// Bytes that one evaluation streams through.
    pub fn bytes(&self) -> usize {
        let partition = &self.partition;
        partition.octahedra.bytes()
            + partition.pairs.bytes()
            + partition.singles.bytes()
            + partition.node_of_slot.len() * (4 + 16 + 16)
    }

    /// Buffers for up to `workers` threads.
    ///
    /// # Errors
    /// Where there is no memory for them.
    pub fn scratch(&self, workers: usize) -> Result<Scratch, TryReserveError> {
        let lines = self.partition.widest().div_ceil(4);
        let mut positions = filled(workers.max(1), Vec::new())?;
        for room in &mut positions {
            *room = filled(lines, Line::default())?;
        }
        Ok(Scratch {
            forces: filled(
                self.partition.node_of_slot.len().div_ceil(4),
                Line::default(),
            )?,
            positions,
            smallest: filled(self.partition.chunks.len(), f32::MAX)?,
        })
    }

    /// `f_int(u)` (µN) to `out`, both `[K,3]`; returns the smallest det F. Allocates nothing.
    ///
    /// A displacement that is not finite shows in `out`, not in det F.
    ///
    /// # Panics
    /// If a length is not `3 K`.
    pub fn evaluate(
        &self,
        displacement: &[f32],
        scratch: &mut Scratch,
        out: &mut [f32],
        parallel: ParallelFor<'_>,
    ) -> f32 {
        assert_eq!(displacement.len(), 3 * self.node_count, "displacement");
        assert_eq!(out.len(), 3 * self.node_count, "out");
        let forces = Shared(scratch.forces.as_mut_ptr().cast::<[f32; 4]>());
        let positions = Shared(scratch.positions.as_mut_ptr());
        let smallest = Shared(scratch.smallest.as_mut_ptr());
        let chunks = &self.partition.chunks;
        // First phase: no chunk writes to a slot of another, so there is nothing to wait for.
        parallel(chunks.len(), &|index, worker| {
            let chunk = &chunks[index];
            // SAFETY: positions belong to this worker, slots and the entry of `smallest` to this chunk.
            unsafe {
                let positions = (*positions.at(worker)).as_mut_ptr().cast::<[f32; 4]>();
                place(&self.partition, chunk, displacement, positions);
                let own = forces.at(chunk.first);
                std::ptr::write_bytes(own, 0, chunk.slot_count());
                let det = (self.kernels.forces)(&self.partition, chunk, positions, own, false);
                *smallest.at(index) = det;
            }
        });
        // Second phase, after all of the first: `parallel` returns when every task is done.
        let out = Shared(out.as_mut_ptr().cast::<[f32; 3]>());
        parallel(chunks.len(), &|index, _| {
            let chunk = &chunks[index];
            // SAFETY: own slots and own nodes are this chunk's; ghost slots are only read in this phase.
            unsafe {
                for (own, ghost) in &chunk.contributions {
                    let source = *forces.at(*ghost as usize);
                    let target = &mut *forces.at(*own as usize);
                    for k in 0..3 {
                        target[k] += source[k];
                    }
                }
                for slot in chunk.first..chunk.first + chunk.owned {
                    let [x, y, z, _] = *forces.at(slot);
                    // The kernels add forces on the tissue; `f_int` is their opposite.
                    *out.at(self.partition.node_of_slot[slot] as usize) = [-x, -y, -z];
                }
            }
        });
        scratch.smallest.iter().copied().fold(f32::MAX, f32::min)
    }
}

/// Puts the nodes of a chunk where they are now, from its centre.
/// For a law that takes displacements the base is zero, and the displacements go in as they are.
pub(crate) unsafe fn place(
    partition: &Partition,
    chunk: &Chunk,
    displacement: &[f32],
    positions: *mut [f32; 4],
) {
    let slots = chunk.first..chunk.first + chunk.slot_count();
    let rest = partition.base(chunk).iter();
    for (at, (rest, &node)) in rest.zip(&partition.node_of_slot[slots]).enumerate() {
        debug_assert_ne!(node, PADDING);
        let u = &displacement[3 * node as usize..][..3];
        // SAFETY: the caller's room holds the widest chunk.
        unsafe {
            *positions.add(at) = [rest[0] + u[0], rest[1] + u[1], rest[2] + u[2], 0.0];
        }
    }
}
