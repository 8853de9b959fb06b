//! The chunks of a body one by one, for what is summed over them.

use crate::internal_forces::{ElementForces, Scratch};
use crate::material::Moduli;
use crate::tetrahedron::Tetrahedron;

impl ElementForces {
    /// Chunks of the body; each element is in one of them.
    pub fn chunk_count(&self) -> usize {
        self.partition.chunks.len()
    }

    /// The material's moduli with the law of a chunk.
    pub fn moduli_of(&self, chunk: usize) -> Moduli {
        self.partition.moduli_of(&self.partition.chunks[chunk])
    }

    /// Mesh nodes of a chunk's elements, each once.
    pub fn chunk_nodes(&self, chunk: usize) -> &[u32] {
        let chunk = &self.partition.chunks[chunk];
        &self.partition.node_of_slot[chunk.first..chunk.first + chunk.slot_count()]
    }

    /// The elements of a chunk with their numbers in the mesh; their corners are places in [`ElementForces::chunk_nodes`].
    pub fn chunk_tetrahedra(&self, chunk: usize) -> impl Iterator<Item = (u32, Tetrahedron)> + '_ {
        self.partition.tetrahedra(&self.partition.chunks[chunk])
    }
}

impl Scratch {
    /// Smallest det F of each chunk in the last evaluation of the whole body.
    pub fn smallest_by_chunk(&self) -> &[f32] {
        &self.smallest
    }
}
