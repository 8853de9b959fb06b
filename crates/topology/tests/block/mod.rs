//! A block of tetrahedra, its inner nodes shifted, and whether a surface is closed.

use std::collections::BTreeMap;
use std::sync::Arc;

use topology::{Body, Point, RestMesh, Surface};

/// Numbers in [0, 1) that look random.
pub struct Draw(pub u64);

impl Draw {
    pub fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        ((self.0 >> 33) as f64) / (1u64 << 31) as f64
    }
}

/// `cells` cubes of `edge` mm along each axis, six tetrahedra each; inner nodes are moved by up to `shift` edges.
pub fn block(cells: [usize; 3], edge: f64, shift: f64) -> Arc<RestMesh> {
    let mut draw = Draw(7);
    let counts = cells.map(|n| n + 1);
    let number = |at: [usize; 3]| ((at[2] * counts[1] + at[1]) * counts[0] + at[0]) as u32;
    let mut positions = Vec::new();
    for z in 0..counts[2] {
        for y in 0..counts[1] {
            for x in 0..counts[0] {
                let at = [x, y, z];
                let is_inner = (0..3).all(|k| at[k] > 0 && at[k] < cells[k]);
                positions.push([0, 1, 2].map(|k| {
                    let off = (draw.next() - 0.5) * shift * f64::from(u8::from(is_inner));
                    ((at[k] as f64 + off) * edge) as f32
                }));
            }
        }
    }
    // Paths from corner 0 to corner 7 along the axes (Kuhn 1960).
    let orders = [
        [0, 1, 2],
        [1, 2, 0],
        [2, 0, 1],
        [0, 2, 1],
        [2, 1, 0],
        [1, 0, 2],
    ];
    let mut tets = Vec::new();
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                for (at, order) in orders.iter().enumerate() {
                    let mut corner = [x, y, z];
                    let mut tet = [number(corner); 4];
                    for (k, axis) in order.iter().enumerate() {
                        corner[*axis] += 1;
                        tet[k + 1] = number(corner);
                    }
                    if at >= 3 {
                        tet.swap(1, 2);
                    }
                    tets.push(tet);
                }
            }
        }
    }
    Arc::new(RestMesh::new(&positions, &tets).unwrap())
}

/// Where all nodes are at rest.
pub fn rest(body: &Body) -> Vec<Point> {
    let nodes = 0..body.node_count() as u32;
    nodes
        .map(|node| body.mesh().position(body.parent(node)))
        .collect()
}

/// Directed edges of the triangles that no other triangle has the other way round.
pub fn open_edges(surface: &Surface) -> usize {
    let mut sums: BTreeMap<[u32; 2], i32> = BTreeMap::new();
    for [a, b, c] in &surface.triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            if from != to {
                let (key, sign) = if from < to {
                    ([*from, *to], 1)
                } else {
                    ([*to, *from], -1)
                };
                *sums.entry(key).or_default() += sign;
            }
        }
    }
    sums.values().filter(|sum| **sum != 0).count()
}
