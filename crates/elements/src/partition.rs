//! The mesh as the solver stores it: compact chunks of elements with their own nodes.
//!
//! Elements are split by recursive coordinate bisection into chunks of about
//! [`CHUNK_ELEMENTS`]. Each chunk has *slots*: first the nodes that it owns, then
//! copies (*ghosts*) of nodes that another chunk owns, so that its elements read
//! and write a few kilobytes that stay in the first-level cache. Ghost forces are
//! added to the owner in ascending slot order. The split depends on the mesh
//! alone: a result has the same bits for any number of threads.

use crate::batches::{Element, Kind, PADDING, Source};
use crate::bisection::bisect;
use crate::cluster::{Groups, Octahedra, Pairs, Singles};
use crate::gradients::Gradients;
use crate::laws::Law;
use crate::material::{Material, Moduli};
use crate::relaxation::Relaxation;
use crate::room::{collected, filled, grow, room};
use crate::slots::PADDED;
use crate::tetrahedra::Tetrahedra;
use crate::tetrahedron::Tetrahedron;
use std::collections::TryReserveError;
use std::ops::Range;

/// Target number of elements in a chunk.
pub const CHUNK_ELEMENTS: usize = 2048;

/// A chunk's nodes and elements.
pub struct Chunk {
    /// First slot; a multiple of 4.
    pub first: usize,
    /// Owned slots are `first..first + owned`.
    pub owned: usize,
    /// Owner's slot of each ghost; ghosts are `first + owned..`.
    pub ghosts: Vec<u32>,
    /// `(own slot, ghost slot elsewhere)` whose force is added here, ascending.
    pub contributions: Vec<(u32, u32)>,
    /// Number of the law that all its elements have, see [`crate::Laws`].
    pub law: u8,
    /// This chunk's part of [`Partition::octahedra`].
    pub octahedra: Range<usize>,
    /// This chunk's part of [`Partition::pairs`].
    pub pairs: Range<usize>,
    /// This chunk's part of [`Partition::singles`].
    pub singles: Range<usize>,
}

impl Chunk {
    /// Owned and ghost slots together.
    pub fn slot_count(&self) -> usize {
        self.owned + self.ghosts.len()
    }
}

/// All chunks, with the maps between the mesh's nodes and slots.
pub struct Partition {
    pub chunks: Vec<Chunk>,
    pub octahedra: Kind<6, 4>,
    pub pairs: Kind<5, 2>,
    pub singles: Kind<4, 1>,
    /// Mesh node of each slot, ghosts too; [`PADDING`] where there is none.
    pub node_of_slot: Vec<u32>,
    /// Owned slot of each mesh node.
    pub slot_of_node: Vec<u32>,
    /// Rest position of each slot from its chunk's centre, mm, and a zero: small numbers, so that a sum with the
    /// displacement keeps its last bits.
    pub rest: Vec<[f32; 4]>,
    /// Zeros in place of `rest` where the kernel takes displacements, for the widest chunk.
    zeros: Vec<[f32; 4]>,
    /// The material's.
    pub moduli: Moduli,
    /// Of the body's regions.
    pub laws: Vec<Law>,
    /// The material's.
    pub relaxation: Relaxation,
    /// Of the body's regions.
    pub relaxations: Vec<Relaxation>,
}

impl Partition {
    /// Splits a validated mesh of a material. `O(T log T)`.
    ///
    /// # Errors
    /// No memory.
    pub fn new(mesh: Tetrahedra<'_>, material: &Material) -> Result<Self, TryReserveError> {
        Self::in_chunks(mesh, material, CHUNK_ELEMENTS)
    }

    /// The same in chunks of about `elements` each.
    ///
    /// # Errors
    /// No memory.
    pub fn in_chunks(
        mesh: Tetrahedra<'_>,
        material: &Material,
        elements: usize,
    ) -> Result<Self, TryReserveError> {
        let (positions, tets) = (mesh.positions, mesh.tets);
        let centroids = collected(tets.iter().map(|tet| {
            [0, 1, 2].map(|k| tet.iter().map(|n| positions[*n as usize][k]).sum::<f32>())
        }))?;
        let mut order = collected(0..tets.len() as u32)?;
        // A chunk has one law: those of a law are split on their own.
        if !mesh.laws.of_tet.is_empty() {
            order
                .sort_unstable_by_key(|element| (mesh.laws.number_of(*element as usize), *element));
        }
        let law_of = |element: &u32| mesh.laws.number_of(*element as usize);
        let mut sizes = room(tets.len().div_ceil(elements) + mesh.laws.regions.len() + 1)?;
        for same in order.chunk_by_mut(|a, b| law_of(a) == law_of(b)) {
            bisect(same, &centroids, same.len().div_ceil(elements), &mut sizes);
        }
        if sizes.is_empty() {
            sizes.push(0);
        }
        let leaves = || {
            let mut rest = order.as_slice();
            sizes.iter().map(move |size| {
                let (leaf, after) = rest.split_at(*size);
                rest = after;
                leaf
            })
        };

        let mut owner = filled(positions.len(), PADDING)?;
        for (chunk, leaf) in leaves().enumerate() {
            for node in leaf.iter().flat_map(|e| tets[*e as usize]) {
                if owner[node as usize] == PADDING {
                    owner[node as usize] = chunk as u32;
                }
            }
        }
        let mut partition = Self {
            chunks: room(sizes.len())?,
            octahedra: Kind::default(),
            pairs: Kind::default(),
            singles: Kind::default(),
            node_of_slot: Vec::new(),
            slot_of_node: filled(positions.len(), PADDING)?,
            rest: Vec::new(),
            zeros: Vec::new(),
            moduli: material.moduli(),
            laws: collected(mesh.laws.regions.iter().map(|region| region.law))?,
            relaxation: material.relaxation,
            relaxations: collected((mesh.laws.regions.iter()).map(|region| {
                let own = region.relaxation;
                own.unwrap_or(material.relaxation)
            }))?,
        };
        for (chunk, leaf) in leaves().enumerate() {
            let is_own = |node: u32| owner[node as usize] == chunk as u32;
            let law = leaf.first().map_or(0, law_of);
            partition.push_chunk((leaf, law), is_own, mesh, material)?;
        }
        partition.connect_from(0)?;
        partition.fit_zeros()?;
        Ok(partition)
    }

    /// Slots of the widest chunk, padded.
    pub fn widest(&self) -> usize {
        let widest = self.chunks.iter().map(Chunk::slot_count).max();
        widest.unwrap_or(0).next_multiple_of(PADDED)
    }

    /// The law of a number.
    #[inline(always)]
    fn law(&self, number: u8) -> &Law {
        match usize::from(number).checked_sub(1) {
            None => &self.moduli.law,
            Some(at) => &self.laws[at],
        }
    }

    /// The material's moduli with the law of a chunk.
    #[inline(always)]
    pub fn moduli_of(&self, chunk: &Chunk) -> Moduli {
        Moduli {
            law: *self.law(chunk.law),
            ..self.moduli
        }
    }

    /// Whether any law takes displacements.
    #[inline(always)]
    fn takes_displacements(&self) -> bool {
        self.moduli.law.takes_displacements()
            || self.laws.iter().any(|law| law.takes_displacements())
    }

    /// Whether batches have gradients.
    #[inline(always)]
    fn has_gradients(&self) -> bool {
        self.takes_displacements() || self.relaxes()
    }

    /// Makes the zeros as long as the widest chunk, where a law takes displacements.
    pub fn fit_zeros(&mut self) -> Result<(), TryReserveError> {
        let widest = self.widest();
        if self.takes_displacements() && self.zeros.len() < widest {
            self.zeros.try_reserve(widest - self.zeros.len())?;
            self.zeros.resize(widest, [0.0; 4]);
        }
        Ok(())
    }

    /// Without any element, for the laws of a body.
    ///
    /// # Errors
    /// No memory.
    pub fn empty_of(body: &Self) -> Result<Self, TryReserveError> {
        Ok(Self {
            chunks: Vec::new(),
            octahedra: Kind::default(),
            pairs: Kind::default(),
            singles: Kind::default(),
            node_of_slot: Vec::new(),
            slot_of_node: Vec::new(),
            rest: Vec::new(),
            zeros: Vec::new(),
            moduli: body.moduli,
            laws: collected(body.laws.iter().copied())?,
            relaxation: Relaxation::default(),
            relaxations: Vec::new(),
        })
    }

    /// A chunk of some elements of a law behind the others; `is_own` says whether it owns a node.
    pub(crate) fn push_chunk(
        &mut self,
        (leaf, law): (&[u32], u8),
        is_own: impl Fn(u32) -> bool,
        mesh: Tetrahedra<'_>,
        material: &Material,
    ) -> Result<(), TryReserveError> {
        let tets = mesh.tets;
        let first = self.node_of_slot.len();
        let mut nodes = room(4 * leaf.len())?;
        nodes.extend(leaf.iter().flat_map(|e| tets[*e as usize]));
        nodes.sort_unstable();
        nodes.dedup();
        let owned = |node: &&u32| is_own(**node);
        let count = nodes.iter().filter(owned).count();
        let (mut own, mut ghost) = (room(count)?, room(nodes.len() - count)?);
        own.extend(nodes.iter().filter(owned));
        ghost.extend(nodes.iter().filter(|node| !owned(node)));
        let padded = (first + nodes.len()).next_multiple_of(4);
        grow(&mut self.node_of_slot, padded - first)?;
        grow(&mut self.rest, padded - first)?;
        for (offset, node) in own.iter().enumerate() {
            self.slot_of_node[*node as usize] = (first + offset) as u32;
        }
        self.node_of_slot.extend(own.iter().chain(&ghost));
        let local = |node: u32| -> u16 {
            match own.binary_search(&node) {
                Ok(offset) => offset as u16,
                Err(_) => (own.len() + ghost.partition_point(|g| *g < node)) as u16,
            }
        };
        let here = self.node_of_slot[first..].iter();
        let here = collected(here.map(|node| mesh.positions[*node as usize]))?;
        let mut rest = room(here.len())?;
        rest.extend(from_centre(here.iter().copied()));
        let groups = Groups::new(leaf, tets, mesh.positions)?;
        let source = Source {
            rest: &rest,
            mesh,
            material,
            gradients: self.has_gradients(),
            directions: self.has_fibres(),
        };
        self.chunks.push(Chunk {
            first,
            owned: own.len(),
            law,
            octahedra: self.octahedra.push(&groups.octahedra, source, local)?,
            pairs: self.pairs.push(&groups.pairs, source, local)?,
            singles: self.singles.push(&groups.singles, source, local)?,
            ghosts: ghost,
            contributions: Vec::new(),
        });
        self.node_of_slot.resize(padded, PADDING);
        self.rest.extend(rest);
        self.rest.resize(padded, [0.0; 4]);
        Ok(())
    }

    /// The batches of a chunk.
    #[inline(always)]
    pub fn clusters(&self, chunk: &Chunk) -> (&[Octahedra], &[Pairs], &[Singles]) {
        (
            &self.octahedra.batches[chunk.octahedra.clone()],
            &self.pairs.batches[chunk.pairs.clone()],
            &self.singles.batches[chunk.singles.clone()],
        )
    }

    /// The gradients of a chunk's batches; empty where all laws take positions and the material does not relax.
    #[inline(always)]
    pub fn gradients(&self, chunk: &Chunk) -> (&[Gradients<4>], &[Gradients<2>], &[Gradients<1>]) {
        if !self.has_gradients() {
            return (&[], &[], &[]);
        }
        (
            &self.octahedra.gradients[chunk.octahedra.clone()],
            &self.pairs.gradients[chunk.pairs.clone()],
            &self.singles.gradients[chunk.singles.clone()],
        )
    }

    /// What the displacements of a chunk's slots are added to before the kernel reads them: rest positions, or zeros for a law that
    /// takes displacements.
    pub fn base(&self, chunk: &Chunk) -> &[[f32; 4]] {
        if self.law(chunk.law).takes_displacements() {
            &self.zeros[..chunk.slot_count()]
        } else {
            &self.rest[chunk.first..chunk.first + chunk.slot_count()]
        }
    }

    /// The elements of a chunk in f64 with their numbers in the mesh, always in the same order; their corners are chunk-local slots.
    pub fn tetrahedra(&self, chunk: &Chunk) -> impl Iterator<Item = (u32, Tetrahedron)> + '_ {
        let rest = &self.rest[chunk.first..];
        let bulk = self.moduli.bulk_pa;
        self.elements(chunk).map(move |element| {
            // Twice the slot, see `Cluster::slots`.
            let corners = element.slots.map(|slot| u32::from(slot / 2));
            let at = corners.map(|place| {
                let [x, y, z, _] = rest[place as usize];
                [x, y, z].map(f64::from)
            });
            let stiffness = 6.0 * f64::from(element.bulk.abs()) / bulk;
            let tetrahedron = Tetrahedron::new(corners, at, stiffness).along(element.fibre);
            // The order of the corners in a cluster may turn an element around.
            let volume = tetrahedron.volume.abs();
            let tetrahedron = Tetrahedron {
                volume,
                ..tetrahedron
            };
            (element.number, tetrahedron)
        })
    }

    /// The elements of a chunk, always in the same order.
    pub fn elements(&self, chunk: &Chunk) -> impl Iterator<Item = Element> + '_ {
        self.octahedra
            .elements(chunk.octahedra.clone())
            .chain(self.pairs.elements(chunk.pairs.clone()))
            .chain(self.singles.elements(chunk.singles.clone()))
    }

    /// Turns the ghost node numbers of the chunks from the `first`-th on into owner slots and lists the forces that each owner collects from them.
    pub(crate) fn connect_from(&mut self, first: usize) -> Result<(), TryReserveError> {
        let starts = collected(self.chunks.iter().map(|c| c.first))?;
        let owner = |slot: u32| starts.partition_point(|s| *s <= slot as usize) - 1;
        let mut counts = filled(self.chunks.len(), 0)?;
        for chunk in &mut self.chunks[first..] {
            for ghost in &mut chunk.ghosts {
                *ghost = self.slot_of_node[*ghost as usize];
                counts[owner(*ghost)] += 1;
            }
        }
        for (chunk, count) in self.chunks.iter_mut().zip(counts) {
            chunk.contributions.try_reserve_exact(count)?;
        }
        for at in first..self.chunks.len() {
            for offset in 0..self.chunks[at].ghosts.len() {
                let chunk = &self.chunks[at];
                let (slot, here) = (chunk.ghosts[offset], chunk.first + chunk.owned + offset);
                let contributions = &mut self.chunks[owner(slot)].contributions;
                contributions.push((slot, here as u32));
            }
        }
        for chunk in &mut self.chunks {
            chunk.contributions.sort_unstable();
        }
        Ok(())
    }
}

/// Positions from the middle of their box.
pub fn from_centre(
    positions: impl Iterator<Item = [f32; 3]> + Clone,
) -> impl Iterator<Item = [f32; 4]> {
    let centre = [0, 1, 2].map(|k| {
        let values = positions.clone().map(|p| p[k]);
        let (low, high) = (
            values.clone().fold(f32::MAX, f32::min),
            values.fold(f32::MIN, f32::max),
        );
        0.5 * (f64::from(low) + f64::from(high))
    });
    positions.map(move |p| {
        let [x, y, z] = [0, 1, 2].map(|k| (f64::from(p[k]) - centre[k]) as f32);
        [x, y, z, 0.0]
    })
}
