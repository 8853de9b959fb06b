//! The mesh as the solver stores it: compact chunks of elements with their own nodes.
//!
//! Elements are split by recursive coordinate bisection into chunks of about
//! [`CHUNK_ELEMENTS`]. Each chunk has *slots*: first the nodes that it owns, then
//! copies (*ghosts*) of nodes that another chunk owns, so that its elements read
//! and write a few kilobytes that stay in the first-level cache. Ghost forces are
//! added to the owner in ascending slot order. The split depends on the mesh
//! alone: a result has the same bits for any number of threads.

use super::lanes::WIDTH;
use crate::mesh::Mesh;

/// Target number of elements in a chunk.
const CHUNK_ELEMENTS: usize = 2048;

/// Marks a slot that only pads a chunk to a cache line.
pub(crate) const PADDING: u32 = u32::MAX;

/// Sixteen elements, structure of arrays; 768 bytes.
#[repr(C, align(64))]
pub(crate) struct Batch {
    /// `gradient[3 (a - 1) + j]`: derivative of the shape function of corner `a` (1..=3) along axis `j`, 1/mm.
    pub gradient: [[f32; WIDTH]; 9],
    /// Rest volume, mm³, times the element's stiffness over the material's: the energy density is
    /// proportional to the modulus. Zero in padding lanes.
    pub volume: [f32; WIDTH],
    /// Twice the chunk-local slot of each corner (see `lanes`).
    pub corners: [[u16; WIDTH]; 4],
}

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
    /// Batches of this chunk.
    pub batches: std::ops::Range<usize>,
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
    pub batches: Vec<Batch>,
    /// Mesh node of each slot, ghosts too; [`PADDING`] where there is none.
    pub node_of_slot: Vec<u32>,
    /// Owned slot of each mesh node.
    pub slot_of_node: Vec<u32>,
    /// Mesh element of each batch lane; [`PADDING`] in padding lanes.
    pub element_of_lane: Vec<[u32; WIDTH]>,
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
            batches: Vec::new(),
            node_of_slot: Vec::new(),
            slot_of_node: vec![PADDING; positions.len()],
            element_of_lane: Vec::new(),
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
        let batch_start = self.batches.len();
        for elements in disjoint_batches(leaf, tets) {
            let mut batch = Batch {
                gradient: [[0.0; WIDTH]; 9],
                volume: [0.0; WIDTH],
                corners: [[0; WIDTH]; 4],
            };
            let mut lanes = [PADDING; WIDTH];
            for (lane, element) in elements.iter().enumerate() {
                let tet = tets[*element as usize];
                let (gradient, volume) = shape_gradients(&mesh.positions, tet);
                for (k, value) in gradient.iter().flatten().enumerate() {
                    batch.gradient[k][lane] = *value as f32;
                }
                batch.volume[lane] = volume as f32 * mesh.stiffness_of(*element as usize);
                for k in 0..4 {
                    batch.corners[k][lane] = 2 * local(tet[k]);
                }
                lanes[lane] = *element;
            }
            self.batches.push(batch);
            self.element_of_lane.push(lanes);
        }
        self.chunks.push(Chunk {
            first,
            owned: own.len(),
            ghosts: ghost,
            contributions: Vec::new(),
            batches: batch_start..self.batches.len(),
        });
        let padded = self.node_of_slot.len().next_multiple_of(4);
        self.node_of_slot.resize(padded, PADDING);
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

/// Groups a chunk's elements by 16 so that, while it lasts, no two in a group
/// share a node: their force additions then do not wait for each other.
fn disjoint_batches(leaf: &[u32], tets: &[[u32; 4]]) -> Vec<Vec<u32>> {
    let mut remaining = leaf.to_vec();
    let mut batches = Vec::with_capacity(leaf.len() / WIDTH + 1);
    let mut used = std::collections::HashSet::with_capacity(4 * WIDTH);
    while !remaining.is_empty() {
        let mut batch = Vec::with_capacity(WIDTH);
        used.clear();
        remaining.retain(|element| {
            let nodes = tets[*element as usize];
            if batch.len() == WIDTH || nodes.iter().any(|n| used.contains(n)) {
                return true;
            }
            used.extend(nodes);
            batch.push(*element);
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
