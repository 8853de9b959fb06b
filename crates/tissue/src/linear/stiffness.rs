//! Stiffness of linear tetrahedra, held nodes removed.
//!
//! `K[a i, b j] = sum_e V (lambda g_a,i g_b,j + mu g_a,j g_b,i + mu delta_ij g_a . g_b)`
//! with the shape gradients `g` `[4,3]` of an element and its volume `V`, times its stiffness over the material's.

use super::{Lame, LinearError};
use crate::mesh::Mesh;

/// Numbering of the nodes that are not held.
#[derive(Debug, Clone)]
pub struct FreeNodes {
    /// Node of each free index, ascending.
    pub nodes: Vec<u32>,
    /// Free index of each node, `u32::MAX` where held.
    pub index: Vec<u32>,
}

impl FreeNodes {
    /// All nodes of `0..count` but `held`.
    pub fn new(count: usize, held: &[u32]) -> Self {
        let mut index = vec![0u32; count];
        for &node in held {
            index[node as usize] = u32::MAX;
        }
        let mut nodes = Vec::with_capacity(count);
        for (node, slot) in index.iter_mut().enumerate() {
            if *slot != u32::MAX {
                *slot = nodes.len() as u32;
                nodes.push(node as u32);
            }
        }
        Self { nodes, index }
    }

    /// Free index of a node, `None` where held or outside of the mesh.
    pub fn get(&self, node: u32) -> Option<usize> {
        self.index
            .get(node as usize)
            .and_then(|&i| (i != u32::MAX).then_some(i as usize))
    }
}

/// Lower triangle of the stiffness in compressed columns, rows ascending; dof `3 * free + axis`.
#[derive(Debug, Clone)]
pub struct Stiffness {
    /// Numbering of the free nodes.
    pub free: FreeNodes,
    /// `[n+1]`, `n = 3 * free.nodes.len()`.
    pub column_offsets: Vec<usize>,
    /// Row of each entry.
    pub rows: Vec<usize>,
    /// mN/mm.
    pub values: Vec<f64>,
}

/// Shape gradients (1/mm) and volume (mm³) of a tetrahedron.
fn gradients(corners: [[f64; 3]; 4]) -> ([[f64; 3]; 4], f64) {
    let edge = |k: usize| {
        [
            corners[k][0] - corners[0][0],
            corners[k][1] - corners[0][1],
            corners[k][2] - corners[0][2],
        ]
    };
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let (e1, e2, e3) = (edge(1), edge(2), edge(3));
    let (c1, c2, c3) = (cross(e2, e3), cross(e3, e1), cross(e1, e2));
    let det = e1[0] * c1[0] + e1[1] * c1[1] + e1[2] * c1[2];
    let scale = |v: [f64; 3]| [v[0] / det, v[1] / det, v[2] / det];
    let (g1, g2, g3) = (scale(c1), scale(c2), scale(c3));
    let g0 = [
        -g1[0] - g2[0] - g3[0],
        -g1[1] - g2[1] - g3[1],
        -g1[2] - g2[2] - g3[2],
    ];
    ([g0, g1, g2, g3], det / 6.0)
}

/// Free neighbours of each free node that are not smaller, ascending, itself first.
fn upper_neighbours(free: &FreeNodes, tets: &[[u32; 4]]) -> Vec<Vec<u32>> {
    let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); free.nodes.len()];
    for tet in tets {
        for &a in tet {
            for &b in tet {
                if let (Some(i), Some(j)) = (free.get(a), free.get(b))
                    && j >= i
                {
                    neighbours[i].push(j as u32);
                }
            }
        }
    }
    for list in &mut neighbours {
        list.sort_unstable();
        list.dedup();
    }
    neighbours
}

impl Stiffness {
    /// Assembles the stiffness of `mesh` with the nodes `held` removed; reads its positions, tetrahedra and
    /// element stiffness.
    ///
    /// # Errors
    /// A node index out of range, a flat or inverted element, nothing held, a node without element.
    pub fn assemble(mesh: &Mesh, held: &[u32], lame: Lame) -> Result<Self, LinearError> {
        let (positions, tets) = (&mesh.positions, &mesh.tets);
        if held.is_empty() {
            return Err(LinearError::NothingHeld);
        }
        for (tet, nodes) in tets.iter().enumerate() {
            for &node in nodes {
                if node as usize >= positions.len() {
                    return Err(LinearError::Node {
                        tet,
                        node,
                        nodes: positions.len(),
                    });
                }
            }
        }
        let free = FreeNodes::new(positions.len(), held);
        let neighbours = upper_neighbours(&free, tets);
        if let Some(loose) = neighbours.iter().position(Vec::is_empty) {
            return Err(LinearError::Loose {
                node: free.nodes[loose] as usize,
            });
        }

        // Column 3 b + j holds rows 3 b + (j..3), then 3 a + (0..3) of each larger neighbour a.
        let mut column_offsets = Vec::with_capacity(3 * free.nodes.len() + 1);
        let mut rows = Vec::new();
        column_offsets.push(0);
        for (b, list) in neighbours.iter().enumerate() {
            for axis in 0..3 {
                rows.extend((axis..3).map(|i| 3 * b + i));
                for &a in &list[1..] {
                    rows.extend((0..3).map(|i| 3 * a as usize + i));
                }
                column_offsets.push(rows.len());
            }
        }
        let mut values = vec![0.0; rows.len()];

        for (tet, nodes) in tets.iter().enumerate() {
            let corners = nodes.map(|n| positions[n as usize].map(f64::from));
            let (g, volume) = gradients(corners);
            if volume <= 0.0 || !volume.is_finite() {
                return Err(LinearError::Volume { tet, volume });
            }
            let weight = volume * f64::from(mesh.stiffness_of(tet));
            for (p, &node_b) in nodes.iter().enumerate() {
                let Some(b) = free.get(node_b) else {
                    continue;
                };
                for (q, &node_a) in nodes.iter().enumerate() {
                    let Some(a) = free.get(node_a) else {
                        continue;
                    };
                    if a < b {
                        continue;
                    }
                    let slot = neighbours[b]
                        .binary_search(&(a as u32))
                        .unwrap_or_else(|_| unreachable!("neighbours hold every pair of a tet"));
                    let dot = g[q][0] * g[p][0] + g[q][1] * g[p][1] + g[q][2] * g[p][2];
                    for j in 0..3 {
                        let start = column_offsets[3 * b + j];
                        for i in 0..3 {
                            if slot == 0 && i < j {
                                continue;
                            }
                            let at = if slot == 0 {
                                start + i - j
                            } else {
                                start + (3 - j) + 3 * (slot - 1) + i
                            };
                            let identity = if i == j { dot } else { 0.0 };
                            values[at] += weight
                                * (lame.lambda * g[q][i] * g[p][j]
                                    + lame.mu * (g[q][j] * g[p][i] + identity));
                        }
                    }
                }
            }
        }
        Ok(Self {
            free,
            column_offsets,
            rows,
            values,
        })
    }

    /// Number of free degrees of freedom.
    pub fn dofs(&self) -> usize {
        3 * self.free.nodes.len()
    }

    /// `y = K x` over the free dofs (for residual checks).
    pub fn multiply(&self, x: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; self.dofs()];
        for column in 0..self.dofs() {
            for at in self.column_offsets[column]..self.column_offsets[column + 1] {
                let row = self.rows[at];
                y[row] += self.values[at] * x[column];
                if row != column {
                    y[column] += self.values[at] * x[row];
                }
            }
        }
        y
    }
}
