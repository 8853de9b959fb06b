//! The BCC lattice: two interleaved cubic grids, its 14 edges a node, and the warp of nodes that
//! lie too close to the surface (Labelle and Shewchuk, section 3).

use super::{Field, StuffError};

/// Safe warp distances as fractions of an edge's length, for edges that join nodes of one cubic
/// grid (long) and of both (short).
const ALPHA_LONG: f64 = 0.24999;
const ALPHA_SHORT: f64 = 0.41189;

/// Bisection steps of a cut point; below the rounding of an f32 position.
const BISECTIONS: usize = 40;

/// Nodes are numbered corner grid first, then the cube centres, z fastest.
pub struct Lattice {
    /// First cube, in cubes.
    low: [i64; 3],
    /// Cubes along each axis; corner and centre grids have this shape each.
    shape: [usize; 3],
    spacing: f64,
    /// Field at each node; 0 for nodes moved onto the surface.
    pub values: Vec<f64>,
    /// Position of each node, after the warp.
    pub positions: Vec<[f64; 3]>,
}

impl Lattice {
    /// Samples the field at every lattice node of its bounds, with a margin of a cube.
    pub fn sample(field: &impl Field, spacing: f64) -> Result<Self, StuffError> {
        let (lower, upper) = field.bounds();
        let low = lower.map(|x| (x / spacing).floor() as i64 - 1);
        let high = upper.map(|x| (x / spacing).ceil() as i64 + 2);
        let shape = [0, 1, 2].map(|axis| (high[axis] - low[axis]) as usize);
        let count = shape.iter().fold(2.0, |n, &s| n * s as f64);
        if count >= f64::from(u32::MAX / 16) {
            return Err(StuffError::TooLarge(count as u64, spacing));
        }
        let mut lattice = Self {
            low,
            shape,
            spacing,
            values: Vec::new(),
            positions: Vec::new(),
        };
        for node in 0..2 * shape.iter().product::<usize>() {
            let [x, y, z] = lattice
                .half_coordinates(node)
                .map(|h| h as f64 * (spacing / 2.0));
            let value = field.value([x, y, z]);
            if !value.is_finite() {
                return Err(StuffError::NotFinite { value, x, y, z });
            }
            lattice.values.push(value);
            lattice.positions.push([x, y, z]);
        }
        Ok(lattice)
    }

    fn cubes(&self) -> usize {
        self.shape.iter().product()
    }

    /// Whether a node is a cube centre; an edge is long where both ends agree.
    pub fn is_centre(&self, node: usize) -> bool {
        node >= self.cubes()
    }

    /// Coordinates of a node in half cubes: even for corners, odd for centres.
    pub fn half_coordinates(&self, node: usize) -> [i64; 3] {
        let centre = i64::from(self.is_centre(node));
        let cell = node % self.cubes();
        let z = cell % self.shape[2];
        let y = cell / self.shape[2] % self.shape[1];
        let x = cell / (self.shape[2] * self.shape[1]);
        [
            2 * (self.low[0] + x as i64) + centre,
            2 * (self.low[1] + y as i64) + centre,
            2 * (self.low[2] + z as i64) + centre,
        ]
    }

    /// The node at the given half coordinates (all even or all odd), where there is one.
    fn node_at(&self, half: [i64; 3]) -> Option<usize> {
        let mut cell = 0;
        for ((&h, &low), &shape) in half.iter().zip(&self.low).zip(&self.shape) {
            let at = h.div_euclid(2) - low;
            if at < 0 || at as usize >= shape {
                return None;
            }
            cell = cell * shape + at as usize;
        }
        Some(cell + if half[0] % 2 == 0 { 0 } else { self.cubes() })
    }

    /// Every tetrahedron of the lattice: two neighbouring cube centres and an edge of the face
    /// that their cubes share.
    pub fn for_each_tet(&self, mut visit: impl FnMut([usize; 4])) {
        for first in self.cubes()..2 * self.cubes() {
            let at = self.half_coordinates(first);
            for axis in 0..3 {
                let mut next = at;
                next[axis] += 2;
                let Some(second) = self.node_at(next) else {
                    continue;
                };
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let ring = [(-1, -1), (1, -1), (1, 1), (-1, 1)].map(|(du, dv)| {
                    let mut corner = at;
                    corner[axis] += 1;
                    corner[u] += du;
                    corner[v] += dv;
                    self.node_at(corner)
                });
                for side in 0..4 {
                    if let (Some(a), Some(b)) = (ring[side], ring[(side + 1) % 4]) {
                        visit([first, second, a, b]);
                    }
                }
            }
        }
    }

    /// Where the field changes sign on the edge between two nodes that have not moved.
    /// Independent of the order of the ends.
    pub fn cut(&self, field: &impl Field, one: usize, other: usize) -> [f64; 3] {
        let (a, b) = (one.min(other), one.max(other));
        let (from, to) = (self.positions[a], self.positions[b]);
        let at = |t: f64| {
            [
                from[0] + t * (to[0] - from[0]),
                from[1] + t * (to[1] - from[1]),
                from[2] + t * (to[2] - from[2]),
            ]
        };
        let rising = self.values[a] < 0.0;
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            let value = field.value(at(middle));
            if value == 0.0 {
                return at(middle);
            }
            if (value < 0.0) == rising {
                low = middle;
            } else {
                high = middle;
            }
        }
        at(0.5 * (low + high))
    }

    /// Moves every node that has a cut point within alpha of an edge onto the nearest such point.
    /// A moved node has value 0, so the cut points of its edges are gone for the nodes after it.
    pub fn warp(&mut self, field: &impl Field) {
        const SHORT: [i64; 2] = [-1, 1];
        let mut offsets = Vec::with_capacity(14);
        for axis in 0..3 {
            for step in [-2, 2] {
                let mut offset = [0; 3];
                offset[axis] = step;
                offsets.push((offset, ALPHA_LONG * self.spacing));
            }
        }
        for x in SHORT {
            for y in SHORT {
                for z in SHORT {
                    let reach = ALPHA_SHORT * self.spacing * 0.75f64.sqrt();
                    offsets.push(([x, y, z], reach));
                }
            }
        }
        for node in 0..self.values.len() {
            let value = self.values[node];
            if value == 0.0 {
                continue;
            }
            let here = self.half_coordinates(node);
            let origin = self.positions[node];
            let mut nearest = f64::INFINITY;
            let mut target = origin;
            for &(offset, reach) in &offsets {
                let at = [
                    here[0] + offset[0],
                    here[1] + offset[1],
                    here[2] + offset[2],
                ];
                let Some(neighbour) = self.node_at(at) else {
                    continue;
                };
                if value * self.values[neighbour] >= 0.0 {
                    continue;
                }
                let cut = self.cut(field, node, neighbour);
                let distance = (0..3)
                    .map(|axis| (cut[axis] - origin[axis]).powi(2))
                    .sum::<f64>()
                    .sqrt();
                if distance <= reach && distance < nearest {
                    nearest = distance;
                    target = cut;
                }
            }
            if nearest.is_finite() {
                self.positions[node] = target;
                self.values[node] = 0.0;
            }
        }
    }
}
