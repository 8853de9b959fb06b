//! A body some of whose elements have become others: a cut, a resection, other stiffness. The packing of the body before stays, and what is new is packed
//! behind it.
//!
//! A cluster with an element that has changed is taken out of its lane. Its other elements and what the changed ones have become lie in chunks of their own,
//! one or more for each chunk that they were in. What results depends on the body before and the change alone, not on the way to it.

use crate::batches::{Kind, PADDING};
use crate::internal_forces::ElementForces;
use crate::material::Material;
use crate::partition::{CHUNK_ELEMENTS, Chunk, Partition};
use crate::regions::Laws;
use crate::room::{collected, copied_with_room, filled, push, room};
use crate::tetrahedra::Tetrahedra;
use lanes::WIDTH;
use std::collections::TryReserveError;

/// What an intact body has become.
#[derive(Clone, Copy, Debug)]
pub struct CutTetrahedra<'a> {
    /// Rest positions `[K',3]`, mm: those of the intact body, and behind them those of copies of nodes.
    pub positions: &'a [[f32; 3]],
    /// Corners of the intact body's elements `[T,4]`.
    pub tets: &'a [[u32; 4]],
    /// Stiffness of the intact body's elements over the material's `[T]`; empty where it is uniform.
    pub stiffness: &'a [f32],
    /// Directions of the fibres of the intact body's elements `[T]`; empty where it has none. What has become of an element has its direction.
    pub fibre: &'a [[f32; 3]],
    /// Elements of the intact body that are there no more, ascending.
    pub changed: &'a [u32],
    /// What is there in their place: the place in `changed`, corners, stiffness over the material's; ascending. The number of the `i`-th is `T + i`.
    pub cells: &'a [(u32, [u32; 4], f32)],
}

/// An element of a new chunk.
struct Packed {
    /// In the intact body, or `T + i` of the `i`-th cell.
    number: u32,
    /// Nodes of the cut body.
    corners: [u32; 4],
    /// Over the material's.
    stiffness: f32,
    /// At rest, of the element that it is or was a part of.
    fibre: [f32; 3],
}

impl ElementForces {
    /// This body, after some of its elements have become others.
    ///
    /// # Errors
    /// No memory.
    /// This body stays as it is. The large arrays of constants are copied, and only batches with a
    /// changed element are written to.
    pub fn cut(
        &self,
        cut: CutTetrahedra<'_>,
        material: &Material,
    ) -> Result<Self, TryReserveError> {
        let mut partition = self.partition.copied(cut.positions.len())?;
        // By element: asked for each lane of each batch below.
        let mut is_changed = filled(cut.tets.len(), false)?;
        for &element in cut.changed {
            is_changed[element as usize] = true;
        }
        let fibre_of = |number: u32| cut.fibre.get(number as usize).copied().unwrap_or_default();
        let base = partition.chunks.len();
        let mut parents = Vec::new();
        // The chunk of each changed element, by its place in `changed`.
        let mut chunk_of = filled(cut.changed.len(), 0)?;
        // Elements whose clusters are taken out of one chunk, the changed ones among them.
        let mut out = Vec::new();
        let mut packed = room(base)?;
        for at in 0..base {
            out.clear();
            let Partition {
                chunks,
                octahedra,
                pairs,
                singles,
                ..
            } = &mut partition;
            let chunk = &mut chunks[at];
            octahedra.take_out(&mut chunk.octahedra, &is_changed, &mut out)?;
            pairs.take_out(&mut chunk.pairs, &is_changed, &mut out)?;
            singles.take_out(&mut chunk.singles, &is_changed, &mut out)?;
            // Clusters are taken out batch by batch; the new chunks are packed in the order of the
            // mesh.
            out.sort_unstable();
            let mut own = Vec::new();
            for &number in &out {
                match cut.changed.binary_search(&number) {
                    Ok(place) => chunk_of[place] = at,
                    Err(_) => push(
                        &mut own,
                        Packed {
                            number,
                            corners: cut.tets[number as usize],
                            stiffness: cut.stiffness.get(number as usize).copied().unwrap_or(1.0),
                            fibre: fibre_of(number),
                        },
                    )?,
                }
            }
            packed.push(own);
        }
        for (at, &(place, corners, stiffness)) in cut.cells.iter().enumerate() {
            let number = (cut.tets.len() + at) as u32;
            let own = Packed {
                number,
                corners,
                stiffness,
                fibre: fibre_of(cut.changed[place as usize]),
            };
            push(&mut packed[chunk_of[place as usize]], own)?;
        }
        for (at, own) in packed.iter().enumerate() {
            let law = partition.chunks[at].law;
            // No new chunk has more elements than an ordinary one: the numbers of its slots have to
            // fit 16 bits.
            for own in own.chunks(CHUNK_ELEMENTS) {
                partition.push_packed((own, law), cut.positions, material)?;
                push(&mut parents, at as u32)?;
            }
        }
        // New chunks may own copies of nodes and share others as ghosts; owners in the old chunks
        // get further contributions.
        partition.connect_from(base)?;
        partition.fit_zeros()?;
        Ok(self.with(partition, parents, cut.positions.len()))
    }
}

impl Partition {
    /// A copy, for a body of so many nodes.
    /// With room for some chunks more. Nodes beyond the old body's have no slot yet.
    fn copied(&self, nodes: usize) -> Result<Partition, TryReserveError> {
        let mut chunks = room(self.chunks.len() + 8)?;
        for chunk in &self.chunks {
            chunks.push(Chunk {
                ghosts: collected(chunk.ghosts.iter().copied())?,
                contributions: collected(chunk.contributions.iter().copied())?,
                octahedra: chunk.octahedra.clone(),
                pairs: chunk.pairs.clone(),
                singles: chunk.singles.clone(),
                ..*chunk
            });
        }
        let mut copy = Partition::empty_of(self)?;
        copy.relaxation = self.relaxation;
        copy.relaxations = collected(self.relaxations.iter().copied())?;
        copy.chunks = chunks;
        copy.octahedra = self.octahedra.copied()?;
        copy.pairs = self.pairs.copied()?;
        copy.singles = self.singles.copied()?;
        copy.node_of_slot = copied_with_room(&self.node_of_slot)?;
        copy.slot_of_node = room(nodes)?;
        copy.slot_of_node.extend_from_slice(&self.slot_of_node);
        copy.slot_of_node.resize(nodes, PADDING);
        copy.rest = copied_with_room(&self.rest)?;
        Ok(copy)
    }

    /// A chunk of elements of a law behind the others. It owns the nodes that have no owner yet.
    fn push_packed(
        &mut self,
        (elements, law): (&[Packed], u8),
        positions: &[[f32; 3]],
        material: &Material,
    ) -> Result<(), TryReserveError> {
        let tets = collected(elements.iter().map(|element| element.corners))?;
        let stiffness = collected(elements.iter().map(|element| element.stiffness))?;
        let fibre = collected(elements.iter().map(|element| element.fibre))?;
        let leaf = collected(0..elements.len() as u32)?;
        // Copies of nodes, or nodes inside the body before: the first new chunk that has them owns
        // them.
        let mut fresh = room(4 * tets.len())?;
        let owners = &self.slot_of_node;
        fresh.extend((tets.iter().flatten()).filter(|node| owners[**node as usize] == PADDING));
        fresh.sort_unstable();
        let mesh = Tetrahedra {
            positions,
            tets: &tets,
            stiffness: &stiffness,
            laws: Laws {
                fibre: &fibre,
                ..Laws::default()
            },
        };
        self.push_chunk(
            (&leaf, law),
            |node| fresh.binary_search(&node).is_ok(),
            mesh,
            material,
        )?;
        let Some(chunk) = self.chunks.last() else {
            return Ok(());
        };
        let number = |place: u32| elements[place as usize].number;
        self.octahedra.renumber(chunk.octahedra.clone(), number);
        self.pairs.renumber(chunk.pairs.clone(), number);
        self.singles.renumber(chunk.singles.clone(), number);
        Ok(())
    }
}

impl<const NODES: usize, const TETS: usize> Kind<NODES, TETS> {
    /// A copy of all lists, with room for what cuts put behind them.
    fn copied(&self) -> Result<Self, TryReserveError> {
        Ok(Kind {
            batches: copied_with_room(&self.batches)?,
            gradients: copied_with_room(&self.gradients)?,
            directions: copied_with_room(&self.directions)?,
            elements: copied_with_room(&self.elements)?,
        })
    }

    /// From places in the list that was packed to numbers of elements.
    fn renumber(&mut self, batches: std::ops::Range<usize>, number: impl Fn(u32) -> u32) {
        for element in self.elements[batches].as_flattened_mut().as_flattened_mut() {
            if *element != PADDING {
                *element = number(*element);
            }
        }
    }

    /// Takes the clusters out of which an element has changed; their elements go to `out`. A lane that is free has the shape of another one that is not, without
    /// stiffness: what no element is left of must not show in det F.
    fn take_out(
        &mut self,
        batches: &mut std::ops::Range<usize>,
        is_changed: &[bool],
        out: &mut Vec<u32>,
    ) -> Result<(), TryReserveError> {
        let is_out = |element: u32| element != PADDING && is_changed[element as usize];
        // Batches with a lane that has become free; they are given a shape below, once it is known
        // which lanes stay.
        let mut touched = Vec::new();
        for batch in batches.clone() {
            let mut is_touched = false;
            for lane in 0..WIDTH {
                let elements = &mut self.elements[batch];
                if !elements.iter().any(|row| is_out(row[lane])) {
                    continue;
                }
                for row in elements {
                    push(out, std::mem::replace(&mut row[lane], PADDING))?;
                }
                is_touched = true;
            }
            if is_touched {
                push(&mut touched, batch)?;
            }
        }
        // A lane that is still in use, of this batch or else of any of the chunk.
        let live = |batch: usize| (0..WIDTH).find(|lane| self.elements[batch][0][*lane] != PADDING);
        let Some(any) = batches
            .clone()
            .find_map(|batch| Some((batch, live(batch)?)))
        else {
            // No cluster of this kind is left in the chunk: its range becomes empty, and the
            // batches lie there unused.
            batches.end = batches.start;
            return Ok(());
        };
        for batch in touched {
            let from = live(batch).map_or(any, |lane| (batch, lane));
            let source = self.batches[from.0];
            let gradients = self.gradients.get(from.0).copied();
            for lane in 0..WIDTH {
                if self.elements[batch][0][lane] != PADDING {
                    continue;
                }
                self.batches[batch].take_shape(&source, from.1, lane);
                if let (Some(own), Some(source)) = (self.gradients.get_mut(batch), &gradients) {
                    own.copy_lane(source, from.1, lane);
                    own.volume.iter_mut().for_each(|row| row[lane] = 0.0);
                }
                if let Some(own) = self.directions.get_mut(batch) {
                    own.clear_lane(lane);
                }
            }
        }
        Ok(())
    }
}
