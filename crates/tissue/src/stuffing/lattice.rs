//! The BCC lattice: two interleaved cubic grids, its 14 edges a node, and the warp of nodes that
//! lie too close to the surface (Labelle and Shewchuk, section 3).
//!
//! Where a body is thin the lattice's tetrahedra may have been bisected (`bisection`); its nodes are
//! therefore listed one by one.

use super::{Field, StuffError};
use rayon::prelude::*;
use std::collections::HashMap;

/// Safe warp distances as fractions of an edge's length, for edges along an axis (they join nodes of
/// one cubic grid: long) and for all others (short).
const ALPHA_LONG: f64 = 0.24999;
const ALPHA_SHORT: f64 = 0.41189;

/// Nodes of a lattice, at most: about a gigabyte.
pub const MOST_NODES: f64 = 16e6;

/// Bisection steps of a cut point; below the rounding of an f32 position.
const BISECTIONS: usize = 40;

/// Coordinates of nodes are whole multiples of half a cube over this, so that every node that
/// bisection can make has some.
pub const UNITS: i64 = 64;

/// A lattice over a field. Nodes: corner grid first, then the cube centres, z fastest, then
/// midpoints of bisected edges in the order in which they were made.
pub struct Lattice {
    spacing: f64,
    /// Where each node was before the warp, in units of `spacing / 2 / UNITS`.
    pub coordinates: Vec<[i64; 3]>,
    /// Field at each node; 0 for nodes moved onto the surface.
    pub values: Vec<f64>,
    /// Position of each node, after the warp.
    pub positions: Vec<[f64; 3]>,
    pub tets: Vec<[u32; 4]>,
    /// Where the field is 0 on edges between nodes that have not moved; made by the warp.
    cuts: HashMap<[u32; 2], [f64; 3]>,
    /// For a distance, whose zeros a few steps along an edge find.
    pub is_distance: bool,
}

/// A uniform lattice's cubes.
struct Cubes {
    /// First cube, in cubes.
    low: [i64; 3],
    /// Cubes along each axis; corner and centre grids have this shape each.
    shape: [usize; 3],
}

impl Cubes {
    fn count(&self) -> usize {
        self.shape.iter().product()
    }

    /// Coordinates of a node in half cubes: even for corners, odd for centres.
    fn half_coordinates(&self, node: usize) -> [i64; 3] {
        let centre = i64::from(node >= self.count());
        let cell = node % self.count();
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
        Some(cell + if half[0] % 2 == 0 { 0 } else { self.count() })
    }

    /// Every tetrahedron of the lattice: two neighbouring cube centres and an edge of the face
    /// that their cubes share.
    fn for_each_tet(&self, mut visit: impl FnMut([usize; 4])) {
        for first in self.count()..2 * self.count() {
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
}

fn not_finite(value: f64, [x, y, z]: [f64; 3]) -> StuffError {
    StuffError::NotFinite { value, x, y, z }
}

impl Lattice {
    /// Samples the field at every lattice node of its bounds, with a margin of a cube, and keeps the
    /// tetrahedra for which `keep` is true of their nodes' values.
    pub fn sample(
        field: &impl Field,
        spacing: f64,
        keep: impl Fn([f64; 4]) -> bool,
    ) -> Result<Self, StuffError> {
        let (lower, upper) = field.bounds();
        let low = lower.map(|x| (x / spacing).floor() as i64 - 1);
        let high = upper.map(|x| (x / spacing).ceil() as i64 + 2);
        let shape = [0, 1, 2].map(|axis| (high[axis] - low[axis]) as usize);
        let count = shape.iter().fold(2.0, |n, &s| n * s as f64);
        if count >= MOST_NODES {
            return Err(StuffError::TooLarge(count as u64, spacing));
        }
        let cubes = Cubes { low, shape };
        let mut lattice = Self {
            spacing,
            coordinates: Vec::new(),
            values: Vec::new(),
            positions: Vec::new(),
            tets: Vec::new(),
            cuts: HashMap::new(),
            is_distance: false,
        };
        let nodes = (0..2 * cubes.count()).into_par_iter();
        let coordinates = nodes.map(|node| cubes.half_coordinates(node).map(|h| UNITS * h));
        lattice.coordinates = coordinates.collect();
        lattice.positions = (lattice.coordinates.iter())
            .map(|&at| lattice.position(at))
            .collect();
        lattice.values = (lattice.positions.par_iter())
            .map(|&at| field.value(at))
            .collect();
        if let Some(bad) = lattice.values.iter().position(|value| !value.is_finite()) {
            return Err(not_finite(lattice.values[bad], lattice.positions[bad]));
        }
        let values = &lattice.values;
        cubes.for_each_tet(|tet| {
            if keep(tet.map(|node| values[node])) {
                lattice.tets.push(tet.map(|node| node as u32));
            }
        });
        Ok(lattice)
    }

    /// Adds a node.
    pub fn add(&mut self, field: &impl Field, coordinates: [i64; 3]) -> Result<u32, StuffError> {
        let position = self.position(coordinates);
        let value = field.value(position);
        if !value.is_finite() {
            return Err(not_finite(value, position));
        }
        self.coordinates.push(coordinates);
        self.values.push(value);
        self.positions.push(position);
        Ok(self.values.len() as u32 - 1)
    }

    fn position(&self, coordinates: [i64; 3]) -> [f64; 3] {
        let unit = self.spacing / (2 * UNITS) as f64;
        coordinates.map(|h| h as f64 * unit)
    }

    /// Squared length of an edge before the warp, in units.
    pub fn length2(&self, one: usize, other: usize) -> i64 {
        let (a, b) = (self.coordinates[one], self.coordinates[other]);
        (0..3).map(|axis| (a[axis] - b[axis]).pow(2)).sum()
    }

    /// Where the field changes sign on the edge between two nodes that have not moved.
    pub fn cut(&self, one: usize, other: usize) -> [f64; 3] {
        let edge = [one.min(other), one.max(other)];
        self.cuts[&edge.map(|node| node as u32)]
    }

    fn find_cut(&self, field: &impl Field, [a, b]: [usize; 2]) -> [f64; 3] {
        let (from, to) = (self.positions[a], self.positions[b]);
        let at = |t: f64| {
            [
                from[0] + t * (to[0] - from[0]),
                from[1] + t * (to[1] - from[1]),
                from[2] + t * (to[2] - from[2]),
            ]
        };
        if self.is_distance {
            return at(false_position(self.values[a], self.values[b], |t| {
                field.value(at(t))
            }));
        }
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

    /// Edges on which the field changes sign, from both of their ends, ordered by the first end.
    fn cut_edges(&self) -> Vec<(u32, u32)> {
        let mut edges = Vec::new();
        for tet in &self.tets {
            for &a in tet {
                for &b in tet {
                    if self.values[a as usize] * self.values[b as usize] < 0.0 {
                        edges.push((a, b));
                    }
                }
            }
        }
        // Along an axis first.
        let order = |&(a, b): &(u32, u32)| {
            let (from, to) = (self.coordinates[a as usize], self.coordinates[b as usize]);
            let way = [0, 1, 2].map(|axis| to[axis] - from[axis]);
            let short = way.iter().filter(|&&x| x != 0).count() > 1;
            let axis = way.iter().position(|&x| x != 0);
            (a, short, if short { None } else { axis }, way)
        };
        edges.sort_unstable_by_key(order);
        edges.dedup();
        edges
    }

    /// Moves every node that has a cut point within alpha of an edge onto the nearest such point.
    /// A moved node has value 0, so the cut points of its edges are gone for the nodes after it.
    pub fn warp(&mut self, field: &impl Field) {
        let edges = self.cut_edges();
        let once = edges.par_iter().filter(|(a, b)| a < b);
        self.cuts = once
            .map(|&(a, b)| ([a, b], self.find_cut(field, [a as usize, b as usize])))
            .collect();
        let shortest = self.shortest_edges();
        for own in edges.chunk_by(|one, other| one.0 == other.0) {
            let node = own[0].0 as usize;
            let value = self.values[node];
            if value == 0.0 {
                continue;
            }
            let origin = self.positions[node];
            let mut nearest = f64::INFINITY;
            let mut target = origin;
            for &(_, neighbour) in own {
                let neighbour = neighbour as usize;
                if value * self.values[neighbour] >= 0.0 {
                    continue;
                }
                let most = ALPHA_SHORT * self.spacing * shortest[node];
                let reach = self.reach(node, neighbour).min(most);
                let cut = self.cut(node, neighbour);
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

    /// Length of the shortest edge of each node before the warp, over the spacing. It matters where sizes change.
    fn shortest_edges(&self) -> Vec<f64> {
        let mut shortest = vec![i64::MAX; self.values.len()];
        for tet in &self.tets {
            for &a in tet {
                for &b in tet {
                    if a != b {
                        let length2 = self.length2(a as usize, b as usize);
                        shortest[a as usize] = shortest[a as usize].min(length2);
                    }
                }
            }
        }
        let length = |length2: i64| (length2 as f64).sqrt() / (2 * UNITS) as f64;
        shortest.into_iter().map(length).collect()
    }

    /// How far a node may move along an edge, mm.
    fn reach(&self, node: usize, neighbour: usize) -> f64 {
        let (from, to) = (self.coordinates[node], self.coordinates[neighbour]);
        let axes = (0..3).filter(|&axis| from[axis] != to[axis]).count();
        let length = (self.length2(node, neighbour) as f64).sqrt() / (2 * UNITS) as f64;
        let alpha = if axes == 1 { ALPHA_LONG } else { ALPHA_SHORT };
        alpha * (self.spacing * length)
    }
}

/// Where a function of [0, 1] with these ends is 0, by false position with halved weights (the Illinois rule).
fn false_position(start: f64, end: f64, value: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = ((0.0, start), (1.0, end));
    let small = 1e-9 * (start - end).abs();
    for _ in 0..BISECTIONS {
        let t = (low.0 * high.1 - high.0 * low.1) / (high.1 - low.1);
        let found = value(t);
        if found.abs() <= small || high.0 - low.0 < 1e-10 {
            return t;
        }
        if (found < 0.0) == (low.1 < 0.0) {
            low = (t, found);
            high.1 *= 0.5;
        } else {
            high = (t, found);
            low.1 *= 0.5;
        }
    }
    0.5 * (low.0 + high.0)
}
