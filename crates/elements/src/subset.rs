//! Some elements of a body, packed anew for the same kernels: what a scene evaluates that needs the forces near its tools alone.
//!
//! Whole clusters are taken, with the constants that they have in the body. They lie in pieces, each a chunk with slots of its own.

use crate::batches::{Kind, PADDING};
use crate::dispatch::Kernels;
use crate::internal_forces::{ElementForces, Line, place};
use crate::partition::{Chunk, Partition, from_centre};
use crate::room::{filled, push};
use crate::tetrahedron::Tetrahedron;
use lanes::WIDTH;
use std::collections::TryReserveError;
use std::ops::Range;

/// Slots of a piece, at most: a slot's double is 16 bits wide. A chunk of the body has at most 2048
/// elements of four nodes, so each fits into an empty piece.
const MOST_SLOTS: usize = 8192;

/// Clusters of a body. [`Subset::clear`], [`Subset::push`] chunk by chunk and [`Subset::finish`] fill it in the room that it has.
pub struct Subset {
    /// The pieces, as chunks that own all of their nodes: a node of two pieces has a slot in both.
    partition: Partition,
    /// Those of the body.
    kernels: Kernels,
    /// Of the piece being filled; all [`PADDING`] between two fillings.
    slots: Slots,
    /// Lanes of the last batch of each kind that are in use.
    used: [usize; 3],
    /// Where the piece being filled starts: its slots, and its batches of each kind.
    starts: [usize; 4],
    /// The law of the piece being filled.
    law: u8,
    /// By slot of the piece at hand, for the widest one.
    positions: Vec<Line>,
    /// As long; zeroed for each piece.
    forces: Vec<Line>,
}

/// The slots of the piece being filled.
struct Slots {
    /// By mesh node; [`PADDING`] where it has none.
    of_node: Vec<u32>,
    /// Where the piece's slots start in the list of all.
    first: usize,
}

/// The chunk of the body that clusters are taken from.
struct Source<'a, F> {
    /// Mesh node of each of its slots.
    nodes: &'a [u32],
    /// Whether forces are asked for at a node.
    is_wanted: F,
}

impl Subset {
    /// No element of a body.
    ///
    /// # Errors
    /// No memory.
    pub fn new(body: &ElementForces) -> Result<Subset, TryReserveError> {
        Ok(Subset {
            partition: Partition::empty_of(&body.partition)?,
            kernels: body.kernels,
            slots: Slots {
                of_node: filled(body.node_count(), PADDING)?,
                first: 0,
            },
            used: [WIDTH; 3],
            starts: [0; 4],
            law: 0,
            positions: Vec::new(),
            forces: Vec::new(),
        })
    }

    /// Takes all elements out.
    pub fn clear(&mut self) {
        self.slots.forget(&self.partition.node_of_slot);
        let partition = &mut self.partition;
        partition.chunks.clear();
        partition.node_of_slot.clear();
        partition.rest.clear();
        partition.octahedra.clear();
        partition.pairs.clear();
        partition.singles.clear();
        self.used = [WIDTH; 3];
        self.starts = [0; 4];
        self.slots.first = 0;
    }

    /// Adds those clusters of a chunk of the body of which a node is wanted. Returns their volume at rest, mm³, each element's times its
    /// stiffness over the material's.
    ///
    /// # Errors
    /// No memory.
    pub fn push(
        &mut self,
        body: &ElementForces,
        chunk: usize,
        is_wanted: impl Fn(u32) -> bool,
    ) -> Result<f64, TryReserveError> {
        let from = &body.partition;
        let chunk = &from.chunks[chunk];
        let slots = self.partition.node_of_slot.len() - self.starts[0];
        if slots + chunk.slot_count() > MOST_SLOTS || self.law != chunk.law {
            self.end_piece()?;
        }
        self.law = chunk.law;
        let source = Source {
            nodes: &from.node_of_slot[chunk.first..],
            is_wanted,
        };
        let own = &mut self.partition;
        let slots = (&mut self.slots, &mut own.node_of_slot);
        let (slots, nodes) = slots;
        let [a, b, c] = &mut self.used;
        let octahedra = (&from.octahedra, chunk.octahedra.clone());
        let pairs = (&from.pairs, chunk.pairs.clone());
        let singles = (&from.singles, chunk.singles.clone());
        let volume = source.take(octahedra, &mut own.octahedra, a, (slots, nodes))?
            + source.take(pairs, &mut own.pairs, b, (slots, nodes))?
            + source.take(singles, &mut own.singles, c, (slots, nodes))?;
        Ok(volume / from.moduli.bulk_pa)
    }

    /// Ends the filling.
    ///
    /// # Errors
    /// No memory.
    /// `positions [K,3]` are the body's at rest, mm. Only after it may the subset be evaluated.
    pub fn finish(&mut self, positions: &[[f32; 3]]) -> Result<(), TryReserveError> {
        self.end_piece()?;
        let partition = &mut self.partition;
        let slots = partition.node_of_slot.len();
        partition.rest.clear();
        partition.rest.try_reserve(slots)?;
        for chunk in &partition.chunks {
            let nodes = &partition.node_of_slot[chunk.first..chunk.first + chunk.owned];
            let at = nodes.iter().map(|node| positions[*node as usize]);
            partition.rest.extend(from_centre(at));
            partition
                .rest
                .resize(partition.rest.len().next_multiple_of(4), [0.0; 4]);
        }
        partition.fit_zeros()?;
        let lines = partition.widest().div_ceil(4);
        for list in [&mut self.positions, &mut self.forces] {
            list.try_reserve(lines.saturating_sub(list.len()))?;
            list.resize(lines, Line::default());
        }
        Ok(())
    }

    /// What has been filled becomes a chunk. The next piece begins on a whole cache line of slots.
    fn end_piece(&mut self) -> Result<(), TryReserveError> {
        let partition = &mut self.partition;
        let [first, octahedra, pairs, singles] = self.starts;
        let owned = partition.node_of_slot.len() - first;
        if owned == 0 {
            return Ok(());
        }
        partition.octahedra.pad(self.used[0]);
        partition.pairs.pad(self.used[1]);
        partition.singles.pad(self.used[2]);
        self.slots.forget(&partition.node_of_slot[first..]);
        let padded = (first + owned).next_multiple_of(4);
        partition.node_of_slot.try_reserve(padded - first - owned)?;
        partition.node_of_slot.resize(padded, PADDING);
        let ends = [
            partition.octahedra.batches.len(),
            partition.pairs.batches.len(),
            partition.singles.batches.len(),
        ];
        let piece = Chunk {
            first,
            owned,
            law: self.law,
            ghosts: Vec::new(),
            contributions: Vec::new(),
            octahedra: octahedra..ends[0],
            pairs: pairs..ends[1],
            singles: singles..ends[2],
        };
        push(&mut partition.chunks, piece)?;
        self.used = [WIDTH; 3];
        self.starts = [padded, ends[0], ends[1], ends[2]];
        self.slots.first = padded;
        Ok(())
    }

    /// The nodes of each piece, those of one piece each once.
    pub fn nodes(&self) -> impl Iterator<Item = &[u32]> + '_ {
        let partition = &self.partition;
        let chunks = partition.chunks.iter();
        chunks.map(|chunk| &partition.node_of_slot[chunk.first..chunk.first + chunk.owned])
    }

    /// The elements with their numbers in the mesh, their corners as mesh nodes.
    pub fn tetrahedra(&self) -> impl Iterator<Item = (u32, Tetrahedron)> + '_ {
        let partition = &self.partition;
        partition.chunks.iter().flat_map(move |chunk| {
            let nodes = &partition.node_of_slot[chunk.first..];
            partition.tetrahedra(chunk).map(move |(number, element)| {
                let corners = element.corners.map(|slot| nodes[slot as usize]);
                (number, Tetrahedron { corners, ..element })
            })
        })
    }

    /// Calls `add` with a node and `-f_int` (µN; the fourth component means nothing) of a piece there; a node may come once a piece. Returns the
    /// smallest det F. `displacement [K,3]` is read at the subset's nodes. Allocates nothing.
    ///
    /// # Panics
    /// If `displacement` is too short.
    pub fn evaluate(&mut self, displacement: &[f32], mut add: impl FnMut(u32, &[f32; 4])) -> f32 {
        let partition = &self.partition;
        let positions = self.positions.as_mut_ptr().cast::<[f32; 4]>();
        let forces = self.forces.as_mut_ptr().cast::<[f32; 4]>();
        let mut smallest = f32::MAX;
        for chunk in &partition.chunks {
            let count = chunk.slot_count();
            // SAFETY: both buffers have room for the widest piece, and belong to this call alone.
            let own = unsafe {
                place(partition, chunk, displacement, positions);
                std::ptr::write_bytes(forces, 0, count);
                let det = (self.kernels.forces)(partition, chunk, positions, forces, false);
                smallest = smallest.min(det);
                std::slice::from_raw_parts(forces, count)
            };
            let nodes = &partition.node_of_slot[chunk.first..chunk.first + count];
            for (&node, force) in nodes.iter().zip(own) {
                add(node, force);
            }
        }
        smallest
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        let partition = &self.partition;
        let lines = self.positions.capacity() + self.forces.capacity();
        partition.octahedra.bytes()
            + partition.pairs.bytes()
            + partition.singles.bytes()
            + 4 * (partition.node_of_slot.capacity() + self.slots.of_node.capacity())
            + 16 * partition.rest.capacity()
            + size_of::<Line>() * lines
    }
}

impl Slots {
    /// The slot of a node in the piece.
    fn of(&mut self, node: u32, nodes: &mut Vec<u32>) -> Result<u16, TryReserveError> {
        let slot = &mut self.of_node[node as usize];
        if *slot == PADDING {
            push(nodes, node)?;
            *slot = (nodes.len() - 1 - self.first) as u32;
        }
        Ok(*slot as u16)
    }

    /// A few nodes are reset, not the whole list: it is as long as the mesh.
    fn forget(&mut self, nodes: &[u32]) {
        for &node in nodes.iter().filter(|node| **node != PADDING) {
            self.of_node[node as usize] = PADDING;
        }
    }
}

impl<F: Fn(u32) -> bool> Source<'_, F> {
    /// Copies the wanted clusters of some batches; returns their volume times the bulk modulus, nJ.
    fn take<const NODES: usize, const TETS: usize>(
        &self,
        (from, batches): (&Kind<NODES, TETS>, Range<usize>),
        own: &mut Kind<NODES, TETS>,
        used: &mut usize,
        (slots, nodes): (&mut Slots, &mut Vec<u32>),
    ) -> Result<f64, TryReserveError> {
        let mut sum = 0.0;
        for batch in batches {
            let cluster = &from.batches[batch];
            for lane in 0..WIDTH {
                if from.elements[batch][0][lane] == PADDING {
                    continue;
                }
                let corners = (cluster.slots).map(|row| self.nodes[usize::from(row[lane] / 2)]);
                if !corners.iter().any(|node| (self.is_wanted)(*node)) {
                    continue;
                }
                let mut here = [0; NODES];
                for (slot, node) in here.iter_mut().zip(corners) {
                    *slot = slots.of(node, nodes)?;
                }
                *used = own.copy(from, (batch, lane), here, *used)?;
                for (bulk, inverse) in cluster.bulk.iter().zip(&cluster.inverse) {
                    // `kappa / 6` over `1 / det D0 = 1 / (6 V)`: both signs cancel.
                    sum += f64::from(bulk[lane]) / f64::from(inverse[lane]);
                }
            }
        }
        Ok(sum)
    }
}
