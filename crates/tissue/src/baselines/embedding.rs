//! Barycentric interpolation of a field from the nodes of one tetrahedral mesh to those of another.
//!
//! A node is searched in the element that holds a point moved slightly towards the middle of the node's own
//! elements, so that coincident nodes on either side of a cut (the two hemispheres at the midline) find their own
//! side. Nodes outside of the coarse mesh take the element with the smallest violation, weights clamped.

use crate::mesh::Mesh;

/// Four coarse nodes and weights (sum 1) for each fine node.
#[derive(Debug, Clone)]
pub struct Embedding {
    /// `[K_fine,4]` coarse nodes.
    pub nodes: Vec<[u32; 4]>,
    /// `[K_fine,4]`, non-negative.
    pub weights: Vec<[f32; 4]>,
}

/// How far a search point is moved towards the middle of the node's elements.
const INWARD: f64 = 0.2;

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn determinant(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1])
        + a[1] * (b[2] * c[0] - b[0] * c[2])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

/// Barycentric coordinates of a point.
fn barycentric(corners: [[f64; 3]; 4], point: [f64; 3]) -> [f64; 4] {
    let (e1, e2, e3) = (
        difference(corners[1], corners[0]),
        difference(corners[2], corners[0]),
        difference(corners[3], corners[0]),
    );
    let d = difference(point, corners[0]);
    let volume = determinant(e1, e2, e3);
    let b1 = determinant(d, e2, e3) / volume;
    let b2 = determinant(e1, d, e3) / volume;
    let b3 = determinant(e1, e2, d) / volume;
    [1.0 - b1 - b2 - b3, b1, b2, b3]
}

fn clamped(weights: [f64; 4]) -> [f32; 4] {
    let positive = weights.map(|w| w.max(0.0));
    let sum: f64 = positive.iter().sum();
    positive.map(|w| (w / sum) as f32)
}

/// Elements by cells of a regular grid.
struct Grid {
    low: [f64; 3],
    cell: f64,
    shape: [usize; 3],
    members: Vec<Vec<u32>>,
}

impl Grid {
    fn new(mesh: &Mesh) -> Self {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        for point in &mesh.positions {
            for axis in 0..3 {
                low[axis] = low[axis].min(f64::from(point[axis]));
                high[axis] = high[axis].max(f64::from(point[axis]));
            }
        }
        let extent = (0..3).map(|a| high[a] - low[a]).fold(0.0, f64::max);
        let cell = (extent / (mesh.tets.len() as f64).cbrt()).max(1e-9) * 1.5;
        let shape = std::array::from_fn(|a| ((high[a] - low[a]) / cell) as usize + 1);
        let mut grid = Self {
            low,
            cell,
            shape,
            members: vec![Vec::new(); shape[0] * shape[1] * shape[2]],
        };
        for (tet, nodes) in mesh.tets.iter().enumerate() {
            let corner = |k: usize| mesh.positions[nodes[k] as usize].map(f64::from);
            let mut from = grid.cell_of(corner(0));
            let mut to = from;
            for k in 1..4 {
                let at = grid.cell_of(corner(k));
                for axis in 0..3 {
                    from[axis] = from[axis].min(at[axis]);
                    to[axis] = to[axis].max(at[axis]);
                }
            }
            for z in from[2]..=to[2] {
                for y in from[1]..=to[1] {
                    for x in from[0]..=to[0] {
                        let index = grid.index([x, y, z]);
                        grid.members[index].push(tet as u32);
                    }
                }
            }
        }
        grid
    }

    fn cell_of(&self, point: [f64; 3]) -> [usize; 3] {
        std::array::from_fn(|a| {
            (((point[a] - self.low[a]) / self.cell).max(0.0) as usize).min(self.shape[a] - 1)
        })
    }

    fn index(&self, cell: [usize; 3]) -> usize {
        (cell[2] * self.shape[1] + cell[1]) * self.shape[0] + cell[0]
    }

    /// The element whose smallest barycentric coordinate of `point` is largest, among the elements of cells within
    /// a growing distance.
    fn find(&self, mesh: &Mesh, point: [f64; 3]) -> Option<u32> {
        let home = self.cell_of(point);
        let reach = self.shape.iter().copied().max().unwrap_or(1);
        for ring in 0..=reach {
            let mut best: Option<(f64, u32)> = None;
            let range =
                |a: usize| home[a].saturating_sub(ring)..(home[a] + ring + 1).min(self.shape[a]);
            for z in range(2) {
                for y in range(1) {
                    for x in range(0) {
                        for &tet in &self.members[self.index([x, y, z])] {
                            let corners = mesh.tets[tet as usize]
                                .map(|n| mesh.positions[n as usize].map(f64::from));
                            let inside = barycentric(corners, point)
                                .into_iter()
                                .fold(f64::INFINITY, f64::min);
                            if best.is_none_or(|(value, _)| inside > value) {
                                best = Some((inside, tet));
                            }
                        }
                    }
                }
            }
            // A point outside of every element found so far may be closer to one in the next ring.
            if let Some((inside, tet)) = best
                && (inside >= -1e-9 || ring > 0)
            {
                return Some(tet);
            }
        }
        None
    }
}

impl Embedding {
    /// Embeds the nodes of `fine` in the elements of `coarse`. `None` if `coarse` has no element.
    pub fn new(coarse: &Mesh, fine: &Mesh) -> Option<Self> {
        let grid = Grid::new(coarse);
        let mut middle = vec![[0.0f64; 3]; fine.node_count()];
        let mut count = vec![0.0f64; fine.node_count()];
        for tet in &fine.tets {
            let centre: [f64; 3] = std::array::from_fn(|axis| {
                let sum: f64 = tet
                    .iter()
                    .map(|&n| f64::from(fine.positions[n as usize][axis]))
                    .sum();
                sum / 4.0
            });
            for &node in tet {
                for (sum, value) in middle[node as usize].iter_mut().zip(centre) {
                    *sum += value;
                }
                count[node as usize] += 1.0;
            }
        }
        let mut nodes = Vec::with_capacity(fine.node_count());
        let mut weights = Vec::with_capacity(fine.node_count());
        for (node, position) in fine.positions.iter().enumerate() {
            let own = position.map(f64::from);
            let inner = std::array::from_fn(|axis| {
                let centre = middle[node][axis] / count[node].max(1.0);
                own[axis] + INWARD * (centre - own[axis])
            });
            let tet = coarse.tets[grid.find(coarse, inner)? as usize];
            let corners = tet.map(|n| coarse.positions[n as usize].map(f64::from));
            nodes.push(tet);
            weights.push(clamped(barycentric(corners, own)));
        }
        Some(Self { nodes, weights })
    }

    /// `out[K_fine] = sum_k weights[k] * field[nodes[k]]`.
    pub fn interpolate(&self, field: &[[f32; 3]], out: &mut [[f32; 3]]) {
        for ((nodes, weights), u) in self.nodes.iter().zip(&self.weights).zip(out) {
            *u = [0.0; 3];
            for (&node, weight) in nodes.iter().zip(weights) {
                for axis in 0..3 {
                    u[axis] += weight * field[node as usize][axis];
                }
            }
        }
    }
}
