//! The chunks of a body one by one: what a scene evaluates that needs the forces near its tools alone.

use crate::internal_forces::{ElementForces, Scratch};
use crate::tetrahedron::Tetrahedron;

impl ElementForces {
    /// Chunks of the body; each element is in one of them.
    pub fn chunk_count(&self) -> usize {
        self.partition.chunks.len()
    }

    /// Mesh nodes of a chunk's elements, each once.
    pub fn chunk_nodes(&self, chunk: usize) -> &[u32] {
        let chunk = &self.partition.chunks[chunk];
        &self.partition.node_of_slot[chunk.first..chunk.first + chunk.slot_count()]
    }

    /// The elements of a chunk; their corners are places in [`ElementForces::chunk_nodes`].
    pub fn chunk_tetrahedra(&self, chunk: usize) -> impl Iterator<Item = Tetrahedron> + '_ {
        let partition = &self.partition;
        let chunk = &partition.chunks[chunk];
        let rest = &partition.rest[chunk.first..];
        partition.elements(chunk).map(move |element| {
            // Twice the slot, see `Cluster::slots`.
            let corners = element.slots.map(|slot| u32::from(slot / 2));
            let at = corners.map(|place| {
                let [x, y, z, _] = rest[place as usize];
                [x, y, z].map(f64::from)
            });
            let stiffness = 6.0 * f64::from(element.bulk.abs()) / partition.moduli.bulk_pa;
            let tetrahedron = Tetrahedron::new(corners, at, stiffness);
            // The order of the corners in a cluster may turn an element around.
            Tetrahedron {
                volume: tetrahedron.volume.abs(),
                ..tetrahedron
            }
        })
    }

    /// `-f_int` of the elements of one chunk alone at its nodes (µN; the fourth components mean nothing), and their smallest det F.
    /// `displacement [K,3]` is read at the chunk's nodes. Allocates nothing.
    ///
    /// # Panics
    /// If `displacement` is too short.
    pub fn evaluate_chunk<'a>(
        &self,
        chunk: usize,
        displacement: &[f32],
        scratch: &'a mut Scratch,
    ) -> (f32, &'a [[f32; 4]]) {
        let chunk = &self.partition.chunks[chunk];
        let positions = scratch.positions[0].as_mut_ptr().cast::<[f32; 4]>();
        let forces = scratch.forces.as_mut_ptr().cast::<[f32; 4]>();
        // SAFETY: positions have room for the widest chunk, and the slots from `first` on are the chunk's own; both belong to this call alone.
        unsafe {
            let own = forces.add(chunk.first);
            self.place(chunk, displacement, positions);
            std::ptr::write_bytes(own, 0, chunk.slot_count());
            let det = (self.kernels.forces)(&self.partition, chunk, positions, own);
            (det, std::slice::from_raw_parts(own, chunk.slot_count()))
        }
    }
}

impl Scratch {
    /// Smallest det F of each chunk in the last evaluation of the whole body.
    pub fn smallest_by_chunk(&self) -> &[f32] {
        &self.smallest
    }
}
