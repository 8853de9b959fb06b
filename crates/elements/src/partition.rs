//! The mesh as the solver stores it: compact chunks of elements with their own nodes.
//!
//! Elements are split by recursive coordinate bisection into chunks of about
//! [`CHUNK_ELEMENTS`]. Each chunk has *slots*: first the nodes that it owns, then
//! copies (*ghosts*) of nodes that another chunk owns, so that its elements read
//! and write a few kilobytes that stay in the first-level cache. Ghost forces are
//! added to the owner in ascending slot order. The split depends on the mesh
//! alone: a result has the same bits for any number of threads.

use crate::batches::{Element, Kind, PADDING, Source};
use crate::cluster::{Groups, Octahedra, Pairs, Singles};
use crate::material::{Material, Moduli};
use crate::tetrahedra::Tetrahedra;
use std::ops::Range;

/// Target number of elements in a chunk.
const CHUNK_ELEMENTS: usize = 2048;

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
    /// The material's.
    pub moduli: Moduli,
}

impl Partition {
    /// Splits a validated mesh of a material. `O(T log T)`.
    pub fn new(mesh: Tetrahedra<'_>, material: &Material) -> Self {
        let (positions, tets) = (mesh.positions, mesh.tets);
        let centroids: Vec<[f32; 3]> = tets
            .iter()
            .map(|tet| {
                [0, 1, 2].map(|k| tet.iter().map(|n| positions[*n as usize][k]).sum::<f32>())
            })
            .collect();
        let mut order: Vec<u32> = (0..tets.len() as u32).collect();
        let mut leaves = Vec::new();
        let count = tets.len().div_ceil(CHUNK_ELEMENTS);
        bisect(&mut order, &centroids, count, &mut leaves);

        let mut owner = vec![PADDING; positions.len()];
        for (chunk, leaf) in leaves.iter().enumerate() {
            for node in leaf.iter().flat_map(|e| tets[*e as usize]) {
                if owner[node as usize] == PADDING {
                    owner[node as usize] = chunk as u32;
                }
            }
        }
        let mut partition = Self {
            chunks: Vec::new(),
            octahedra: Kind::default(),
            pairs: Kind::default(),
            singles: Kind::default(),
            node_of_slot: Vec::new(),
            slot_of_node: vec![PADDING; positions.len()],
            rest: Vec::new(),
            moduli: material.moduli(),
        };
        for (chunk, leaf) in leaves.iter().enumerate() {
            partition.push_chunk(chunk as u32, leaf, &owner, mesh, material);
        }
        partition.connect();
        partition
    }

    fn push_chunk(
        &mut self,
        chunk: u32,
        leaf: &[u32],
        owner: &[u32],
        mesh: Tetrahedra<'_>,
        material: &Material,
    ) {
        let tets = mesh.tets;
        let first = self.node_of_slot.len();
        let mut nodes: Vec<u32> = leaf.iter().flat_map(|e| tets[*e as usize]).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let (own, ghost): (Vec<u32>, Vec<u32>) = nodes
            .into_iter()
            .partition(|node| owner[*node as usize] == chunk);
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
        let rest = from_centre(here.map(|node| mesh.positions[*node as usize]).collect());
        let groups = Groups::new(leaf, tets, mesh.positions);
        let source = Source {
            rest: &rest,
            mesh,
            material,
        };
        self.chunks.push(Chunk {
            first,
            owned: own.len(),
            octahedra: self.octahedra.push(&groups.octahedra, source, local),
            pairs: self.pairs.push(&groups.pairs, source, local),
            singles: self.singles.push(&groups.singles, source, local),
            ghosts: ghost,
            contributions: Vec::new(),
        });
        let padded = self.node_of_slot.len().next_multiple_of(4);
        self.node_of_slot.resize(padded, PADDING);
        self.rest.extend(rest);
        self.rest.resize(padded, [0.0; 4]);
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

    /// The elements of a chunk, always in the same order.
    pub fn elements(&self, chunk: &Chunk) -> impl Iterator<Item = Element> + '_ {
        self.octahedra
            .elements(chunk.octahedra.clone())
            .chain(self.pairs.elements(chunk.pairs.clone()))
            .chain(self.singles.elements(chunk.singles.clone()))
    }

    /// Turns ghost node numbers into owner slots and lists the forces that each owner collects.
    fn connect(&mut self) {
        let mut incoming = vec![Vec::new(); self.chunks.len()];
        let starts: Vec<usize> = self.chunks.iter().map(|c| c.first).collect();
        for chunk in &mut self.chunks {
            for (offset, ghost) in chunk.ghosts.iter_mut().enumerate() {
                let slot = self.slot_of_node[*ghost as usize];
                let here = (chunk.first + chunk.owned + offset) as u32;
                *ghost = slot;
                let owner = starts.partition_point(|s| *s <= slot as usize) - 1;
                incoming[owner].push((slot, here));
            }
        }
        for (chunk, mut contributions) in self.chunks.iter_mut().zip(incoming) {
            contributions.sort_unstable();
            chunk.contributions = contributions;
        }
    }
}

/// Positions from the middle of their box.
fn from_centre(positions: Vec<[f32; 3]>) -> Vec<[f32; 4]> {
    let centre = [0, 1, 2].map(|k| {
        let values = positions.iter().map(|p| p[k]);
        let (low, high) = (
            values.clone().fold(f32::MAX, f32::min),
            values.fold(f32::MIN, f32::max),
        );
        0.5 * (f64::from(low) + f64::from(high))
    });
    let local = |p: &[f32; 3]| {
        let [x, y, z] = [0, 1, 2].map(|k| (f64::from(p[k]) - centre[k]) as f32);
        [x, y, z, 0.0]
    };
    positions.iter().map(local).collect()
}

/// Splits `order` into `count` spatially compact leaves of nearly equal size.
fn bisect(order: &mut [u32], centroids: &[[f32; 3]], count: usize, leaves: &mut Vec<Vec<u32>>) {
    if count <= 1 {
        leaves.push(order.to_vec());
        return;
    }
    let extent = |axis: usize| {
        let values = order.iter().map(|e| centroids[*e as usize][axis]);
        values.clone().fold(f32::MIN, f32::max) - values.fold(f32::MAX, f32::min)
    };
    let spans = [0, 1, 2].map(extent);
    let axis = (0..3)
        .max_by(|a, b| spans[*a].total_cmp(&spans[*b]))
        .unwrap_or(0);
    order.sort_unstable_by(|a, b| {
        centroids[*a as usize][axis]
            .total_cmp(&centroids[*b as usize][axis])
            .then(a.cmp(b))
    });
    let half = count / 2;
    let (left, right) = order.split_at_mut(order.len() * half / count);
    bisect(left, centroids, half, leaves);
    bisect(right, centroids, count - half, leaves);
}
