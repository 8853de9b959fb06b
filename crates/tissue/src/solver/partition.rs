//! The mesh as the solver stores it: compact chunks of elements with their own nodes.
//!
//! Elements are split by recursive coordinate bisection into chunks of about
//! [`CHUNK_ELEMENTS`]. Each chunk has *slots*: first the nodes that it owns, then
//! copies (*ghosts*) of nodes that another chunk owns, so that its elements read
//! and write a few kilobytes that stay in the first-level cache. Ghost forces are
//! added to the owner in ascending slot order. The split depends on the mesh
//! alone: a result has the same bits for any number of threads.

use super::cluster::{Cluster, Group, Groups, Octahedra, Pairs, Singles, corners};
use super::lanes::WIDTH;
use crate::mesh::Mesh;
use std::ops::Range;

/// Target number of elements in a chunk.
const CHUNK_ELEMENTS: usize = 2048;

/// Marks a slot that only pads a chunk to a cache line.
pub(crate) const PADDING: u32 = u32::MAX;

/// A chunk's nodes and elements.
pub(crate) struct Chunk {
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
pub(crate) struct Partition {
    pub chunks: Vec<Chunk>,
    pub octahedra: Kind<6, 4>,
    pub pairs: Kind<5, 2>,
    pub singles: Kind<4, 1>,
    /// Mesh node of each slot, ghosts too; [`PADDING`] where there is none.
    pub node_of_slot: Vec<u32>,
    /// Owned slot of each mesh node.
    pub slot_of_node: Vec<u32>,
}

/// Batches of one kind of cluster.
#[derive(Default)]
pub(crate) struct Kind<const NODES: usize, const TETS: usize> {
    pub batches: Vec<Cluster<NODES, TETS>>,
    /// Mesh elements of each batch; [`PADDING`] in padding lanes.
    pub elements: Vec<[[u32; WIDTH]; TETS]>,
}

/// One tetrahedron as the kernels see it.
pub(crate) struct Element {
    /// Its number in the mesh.
    pub number: u32,
    /// Twice the chunk-local slots of its corners.
    pub slots: [u16; 4],
    /// Gradients of the shape functions of corners 1 to 3, 1/mm.
    pub gradient: [[f32; 3]; 3],
    /// mm³, see [`Cluster::volume`].
    pub volume: f32,
}

impl Partition {
    /// Splits a validated mesh. `O(T log T)`.
    pub fn new(mesh: &Mesh) -> Self {
        let (positions, tets) = (&mesh.positions, &mesh.tets);
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
        };
        for (chunk, leaf) in leaves.iter().enumerate() {
            partition.push_chunk(chunk as u32, leaf, &owner, mesh);
        }
        partition.connect();
        partition
    }

    fn push_chunk(&mut self, chunk: u32, leaf: &[u32], owner: &[u32], mesh: &Mesh) {
        let tets = &mesh.tets;
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
        let groups = Groups::new(leaf, tets, &mesh.positions);
        self.chunks.push(Chunk {
            first,
            owned: own.len(),
            octahedra: self.octahedra.push(&groups.octahedra, mesh, local),
            pairs: self.pairs.push(&groups.pairs, mesh, local),
            singles: self.singles.push(&groups.singles, mesh, local),
            ghosts: ghost,
            contributions: Vec::new(),
        });
        let padded = self.node_of_slot.len().next_multiple_of(4);
        self.node_of_slot.resize(padded, PADDING);
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

impl<const NODES: usize, const TETS: usize> Kind<NODES, TETS> {
    /// Packs groups into batches; `local` maps a mesh node to its chunk-local slot. Returns where they lie.
    fn push(
        &mut self,
        groups: &[Group<NODES, TETS>],
        mesh: &Mesh,
        local: impl Fn(u32) -> u16,
    ) -> Range<usize> {
        let start = self.batches.len();
        for groups in disjoint_batches(groups) {
            let mut batch = Cluster {
                gradient: [[[0.0; WIDTH]; 9]; TETS],
                volume: [[0.0; WIDTH]; TETS],
                slots: [[0; WIDTH]; NODES],
            };
            let mut elements = [[PADDING; WIDTH]; TETS];
            for (lane, group) in groups.iter().enumerate() {
                for (slots, node) in batch.slots.iter_mut().zip(group.nodes) {
                    slots[lane] = 2 * local(node);
                }
                for (tet, element) in group.tets.into_iter().enumerate() {
                    let [a, b, c] = corners::<NODES>(tet).map(|corner| group.nodes[corner]);
                    let nodes = [group.nodes[0], a, b, c];
                    let (gradient, volume) = shape_gradients(&mesh.positions, nodes);
                    for (k, value) in gradient.iter().flatten().enumerate() {
                        batch.gradient[tet][k][lane] = *value as f32;
                    }
                    // The order of the corners in a group may turn the element around.
                    batch.volume[tet][lane] =
                        volume.abs() as f32 * mesh.stiffness_of(element as usize);
                    elements[tet][lane] = element;
                }
            }
            self.batches.push(batch);
            self.elements.push(elements);
        }
        start..self.batches.len()
    }

    /// The elements of some batches.
    fn elements(&self, batches: Range<usize>) -> impl Iterator<Item = Element> + '_ {
        let lanes = (0..TETS).flat_map(|tet| (0..WIDTH).map(move |lane| (tet, lane)));
        batches
            .flat_map(move |batch| lanes.clone().map(move |(tet, lane)| (batch, tet, lane)))
            .filter(|(batch, tet, lane)| self.elements[*batch][*tet][*lane] != PADDING)
            .map(|(batch, tet, lane)| {
                let cluster = &self.batches[batch];
                let [a, b, c] = corners::<NODES>(tet);
                let slope = |k: usize| cluster.gradient[tet][k][lane];
                Element {
                    number: self.elements[batch][tet][lane],
                    slots: [0, a, b, c].map(|corner| cluster.slots[corner][lane]),
                    gradient: [0, 3, 6].map(|k| [slope(k), slope(k + 1), slope(k + 2)]),
                    volume: cluster.volume[tet][lane],
                }
            })
    }

    /// Bytes of the batches.
    pub fn bytes(&self) -> usize {
        size_of_val(self.batches.as_slice())
    }
}

/// Groups of 16 that, while it lasts, share no node among them: their force
/// additions then do not wait for each other.
fn disjoint_batches<const NODES: usize, const TETS: usize>(
    groups: &[Group<NODES, TETS>],
) -> Vec<Vec<Group<NODES, TETS>>> {
    let mut remaining = groups.to_vec();
    let mut batches = Vec::with_capacity(groups.len() / WIDTH + 1);
    let mut used = std::collections::HashSet::with_capacity(NODES * WIDTH);
    while !remaining.is_empty() {
        let mut batch = Vec::with_capacity(WIDTH);
        used.clear();
        remaining.retain(|group| {
            if batch.len() == WIDTH || group.nodes.iter().any(|n| used.contains(n)) {
                return true;
            }
            used.extend(group.nodes);
            batch.push(*group);
            false
        });
        let missing = (WIDTH - batch.len()).min(remaining.len());
        batch.extend(remaining.drain(..missing));
        batches.push(batch);
    }
    batches
}

/// Gradients of the shape functions of corners 1..=3 (1/mm) and the rest volume (mm³), in f64.
pub(crate) fn shape_gradients(positions: &[[f32; 3]], tet: [u32; 4]) -> ([[f64; 3]; 3], f64) {
    let corner = |k: usize| positions[tet[k] as usize].map(f64::from);
    let origin = corner(0);
    let edge = [1, 2, 3].map(|k| {
        let p = corner(k);
        [p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]]
    });
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let normals = [
        cross(edge[1], edge[2]),
        cross(edge[2], edge[0]),
        cross(edge[0], edge[1]),
    ];
    let determinant: f64 = (0..3).map(|k| edge[0][k] * normals[0][k]).sum();
    (
        normals.map(|n| n.map(|v| v / determinant)),
        determinant / 6.0,
    )
}
