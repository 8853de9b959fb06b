//! Seeded supernodes and the radius graph (`docs/reference/formats.md`), the same in Python and in Rust.
//!
//! Unlike the paper's code, a capped ball keeps the *nearest* `max_degree` nodes and never loses its own self edge.

use crate::bundle::{Graph, Mesh};
use crate::grid::PointGrid;

/// Supernodes and, for each, a CSR row of neighbours.
#[derive(Debug, Clone, PartialEq, Eq)]
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
    pub fn new(positions: &[f32], domain_nodes: &[u32], settings: &Graph) -> SupernodeGraph {
        let supernodes = select(positions.len() / 3, domain_nodes, settings);
        let grid = PointGrid::new(positions.to_vec());
        let mut offsets = vec![0];
        let mut neighbours = Vec::new();
        let mut row: Vec<(f64, u32)> = Vec::new();
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
            neighbours.extend(row.iter().map(|&(_, node)| node));
            neighbours[start..].sort_unstable();
            offsets.push(neighbours.len() as u32);
        }
        SupernodeGraph {
            supernodes,
            offsets,
            neighbours,
        }
    }

    /// The graph of a checked mesh.
    pub fn of_mesh(mesh: &Mesh, settings: &Graph) -> SupernodeGraph {
        SupernodeGraph::new(&mesh.positions, &mesh.domain_nodes, settings)
    }

    /// Supernodes and all their neighbours, ascending: the nodes whose state the recurrence needs.
    pub fn needed_nodes(&self) -> Vec<u32> {
        let mut nodes: Vec<u32> = self
            .neighbours
            .iter()
            .chain(&self.supernodes)
            .copied()
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}

fn select(count: usize, domain_nodes: &[u32], settings: &Graph) -> Vec<u32> {
    let wanted = settings.supernodes.min(count);
    let key = |node: &u32| (node_key(settings.seed, *node as u64), *node);
    let mut from_domain = domain_nodes.to_vec();
    from_domain.sort_unstable_by_key(key);
    let quota = round_half_even(settings.domain_fraction * settings.supernodes as f64);
    from_domain.truncate(quota.min(wanted));
    let mut taken = vec![false; count];
    for &node in &from_domain {
        taken[node as usize] = true;
    }
    let mut rest: Vec<u32> = (0..count as u32)
        .filter(|&node| !taken[node as usize])
        .collect();
    rest.sort_unstable_by_key(key);
    rest.truncate(wanted - from_domain.len());
    let mut supernodes = from_domain;
    supernodes.extend(rest);
    supernodes.sort_unstable();
    supernodes
}

/// Ties to even, as Python's `round`.
fn round_half_even(x: f64) -> usize {
    x.round_ties_even() as usize
}
