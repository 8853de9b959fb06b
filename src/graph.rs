//! Seeded supernodes and the radius graph (`docs/reference/formats.md`), the same in Python and in Rust.
//!
//! Unlike the paper's code, a capped ball keeps the *nearest* `max_degree` nodes and never loses its own self edge.

use crate::bundle::{Graph, Mesh};
use crate::error::Result;
use crate::grid::PointGrid;
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the graph of the supernodes";

/// Supernodes and, for each, a CSR row of neighbours.
#[derive(Debug, Clone, PartialEq, Eq, HeldBytes)]
pub struct SupernodeGraph {
    /// `[n_S]`, ascending.
    pub supernodes: Vec<u32>,
    /// `[n_S + 1]`.
    pub offsets: Vec<u32>,
    /// Nodes, ascending in a row; a row holds its own supernode.
    pub neighbours: Vec<u32>,
}

/// The pseudo-random order of nodes: `splitmix64(seed * 0x9E3779B97F4A7C15 + node)`, wrapping.
pub fn node_key(seed: u64, node: u64) -> u64 {
    const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;
    let mut x = seed
        .wrapping_mul(GOLDEN)
        .wrapping_add(node)
        .wrapping_add(GOLDEN);
    x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

impl SupernodeGraph {
    /// Builds the graph of a mesh. `O(K log K)`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(
        positions: &[f32],
        domain_nodes: &[u32],
        settings: &Graph,
    ) -> Result<SupernodeGraph> {
        let supernodes = select(positions.len() / 3, domain_nodes, settings)?;
        let grid = PointGrid::try_new(memory::copied(positions, WHAT)?)?;
        let mut offsets = memory::room(supernodes.len() + 1, WHAT)?;
        offsets.push(0);
        let mut neighbours = Vec::new();
        // A ball may hold all nodes.
        let mut row: Vec<(f64, u32)> = memory::room(positions.len() / 3 + 1, WHAT)?;
        for &supernode in &supernodes {
            let i = 3 * supernode as usize;
            row.clear();
            grid.within(
                [positions[i], positions[i + 1], positions[i + 2]],
                settings.radius_mm,
                |node, d2| row.push((d2, node)),
            );
            row.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            row.truncate(settings.max_degree);
            if !row.iter().any(|&(_, node)| node == supernode) {
                row.truncate(settings.max_degree - 1);
                row.push((0.0, supernode));
            }
            let start = neighbours.len();
            memory::tried(neighbours.try_reserve(row.len()), WHAT)?;
            neighbours.extend(row.iter().map(|&(_, node)| node));
            neighbours[start..].sort_unstable();
            offsets.push(neighbours.len() as u32);
        }
        Ok(SupernodeGraph {
            supernodes,
            offsets,
            neighbours,
        })
    }

    /// The graph of a checked mesh.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn of_mesh(mesh: &Mesh, settings: &Graph) -> Result<SupernodeGraph> {
        SupernodeGraph::new(&mesh.positions, &mesh.domain.nodes, settings)
    }

    /// Supernodes and all their neighbours, ascending: the nodes whose state the recurrence needs.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn needed_nodes(&self) -> Result<Vec<u32>> {
        let count = self.neighbours.len() + self.supernodes.len();
        let both = self.neighbours.iter().chain(&self.supernodes);
        let mut nodes = memory::collected(count, both.copied(), WHAT)?;
        nodes.sort_unstable();
        nodes.dedup();
        Ok(nodes)
    }
}

fn select(count: usize, domain_nodes: &[u32], settings: &Graph) -> Result<Vec<u32>> {
    let wanted = settings.supernodes.min(count);
    let key = |node: &u32| (node_key(settings.seed, *node as u64), *node);
    let mut from_domain = memory::copied(domain_nodes, WHAT)?;
    from_domain.sort_unstable_by_key(key);
    let quota = round_half_even(settings.domain_fraction * settings.supernodes as f64);
    from_domain.truncate(quota.min(wanted));
    let mut taken = memory::filled(count, false, WHAT)?;
    for &node in &from_domain {
        taken[node as usize] = true;
    }
    let rest = (0..count as u32).filter(|&node| !taken[node as usize]);
    let mut rest = memory::collected(count, rest, WHAT)?;
    rest.sort_unstable_by_key(key);
    rest.truncate(wanted - from_domain.len());
    let mut supernodes = from_domain;
    memory::reserve(&mut supernodes, rest.len(), WHAT)?;
    supernodes.extend(rest);
    supernodes.sort_unstable();
    Ok(supernodes)
}

/// Ties to even, as Python's `round`.
fn round_half_even(x: f64) -> usize {
    x.round_ties_even() as usize
}
