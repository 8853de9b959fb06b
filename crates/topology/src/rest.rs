//! The mesh before any cut.

use std::sync::OnceLock;

use crate::room::{collected, copied, filled, push, room};
use crate::{Point, TopologyError};

/// Faces of a tetrahedron by opposite corner, outward.
pub const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
/// A face without an element on its other side.
pub const OUTSIDE: u32 = u32::MAX;

/// Rest positions, tetrahedra, and what follows from them.
/// It never changes: bodies that are cut share one and keep what differs from it.
#[derive(Clone, Debug)]
pub struct RestMesh {
    /// `[K,3]`, mm.
    positions: Vec<[f32; 3]>,
    /// `[T,4]`, of positive volume.
    tets: Vec<[u32; 4]>,
    /// Over each face, by opposite corner; [`OUTSIDE`] at the border.
    neighbours: Vec<[u32; 4]>,
    /// Where the elements of each node start in `around`.
    starts: Vec<u32>,
    /// Elements of each node, ascending, node after node.
    around: Vec<u32>,
    /// See [`RestMesh::gradients`].
    gradients: OnceLock<Vec<f32>>,
}

impl RestMesh {
    /// Takes `[K,3]` rest positions, mm, and `[T,4]` corners of positive volume.
    ///
    /// # Errors
    /// A corner beyond the nodes, a position that is not finite, an element without volume, no memory.
    pub fn new(positions: &[[f32; 3]], tets: &[[u32; 4]]) -> Result<RestMesh, TopologyError> {
        if let Some(index) = (positions.iter()).position(|at| !at.iter().all(|x| x.is_finite())) {
            return Err(TopologyError::NotFinite {
                field: "positions",
                index,
            });
        }
        let count = positions.len();
        for (index, tet) in tets.iter().enumerate() {
            if let Some(&found) = tet.iter().find(|node| **node as usize >= count) {
                return Err(TopologyError::Index {
                    field: "tets",
                    index,
                    found,
                    count,
                });
            }
            let volume = volume(tet.map(|node| positions[node as usize].map(f64::from)));
            if volume.is_nan() || volume <= 0.0 {
                return Err(TopologyError::Volume { index, volume });
            }
        }
        let mut starts = filled(0, count + 1)?;
        for node in tets.iter().flatten() {
            starts[*node as usize + 1] += 1;
        }
        // Counts become starts: lists of all nodes lie one behind the other in `around`.
        for node in 0..count {
            starts[node + 1] += starts[node];
        }
        let mut next: Vec<u32> = copied(&starts)?;
        let mut around = filled(0, 4 * tets.len())?;
        for (element, tet) in tets.iter().enumerate() {
            for &node in tet {
                around[next[node as usize] as usize] = element as u32;
                next[node as usize] += 1;
            }
        }
        Ok(RestMesh {
            neighbours: neighbours(tets)?,
            positions: copied(positions)?,
            tets: copied(tets)?,
            starts,
            around,
            gradients: OnceLock::new(),
        })
    }

    /// Nodes, `K`.
    pub fn node_count(&self) -> usize {
        self.positions.len()
    }

    /// Elements, `T`.
    pub fn element_count(&self) -> usize {
        self.tets.len()
    }

    /// Corners of an element.
    pub fn tet(&self, element: u32) -> [u32; 4] {
        self.tets[element as usize]
    }

    /// Elements over the four faces of one; [`OUTSIDE`] at the border.
    pub fn neighbours(&self, element: u32) -> [u32; 4] {
        self.neighbours[element as usize]
    }

    /// Faces without an element on their other side for which `is_wanted` says so, by their nodes in ascending order: an element and a face each, ascending.
    ///
    /// # Errors
    /// No memory.
    pub fn border(
        &self,
        is_wanted: impl Fn([u32; 3]) -> bool,
    ) -> Result<Vec<(u32, u8)>, TopologyError> {
        let mut border = Vec::new();
        for (element, over) in self.neighbours.iter().enumerate() {
            for face in (0..4).filter(|face| over[*face] == OUTSIDE) {
                let mut corners = FACES[face].map(|corner| self.tets[element][corner]);
                corners.sort_unstable();
                if is_wanted(corners) {
                    push(&mut border, (element as u32, face as u8))?;
                }
            }
        }
        Ok(border)
    }

    /// Elements that have a node, ascending.
    pub fn around(&self, node: u32) -> &[u32] {
        let at = node as usize;
        &self.around[self.starts[at] as usize..self.starts[at + 1] as usize]
    }

    /// Where a node is at rest.
    pub fn position(&self, node: u32) -> Point {
        self.positions[node as usize].map(f64::from)
    }

    /// Volume of an element at rest, mm³.
    pub fn volume(&self, element: u32) -> f64 {
        volume(self.tet(element).map(|node| self.position(node)))
    }

    /// Of each element an upper bound of what its gradient makes of displacements, 1/mm: the Frobenius norm of the inverse of its edges `[b - a, c - a, d - a]`.
    ///
    /// # Errors
    /// No memory.
    pub fn gradients(&self) -> Result<&[f32], TopologyError> {
        if let Some(known) = self.gradients.get() {
            return Ok(known);
        }
        let of = |tet: &[u32; 4]| {
            let [a, b, c, d] = tet.map(|node| self.position(node));
            let [b, c, d] = [b, c, d].map(|corner| minus(corner, a));
            let rows = [cross(c, d), cross(d, b), cross(b, c)];
            let square: f64 = rows.iter().map(|row| dot(*row, *row)).sum();
            // A little more than the norm: rounding to f32 must not take it below.
            (1.0001 * square.sqrt() / dot(b, rows[0])) as f32
        };
        let made = collected(self.tets.len(), self.tets.iter().map(of))?;
        Ok(self.gradients.get_or_init(|| made))
    }

    /// Mean length of the edges at a node, mm.
    /// An edge counts once for each element that has it. The node itself is among the ends, at
    /// distance 0, hence three edges an element.
    pub fn edge_length(&self, node: u32) -> f64 {
        let own = self.position(node);
        let around = self.around(node);
        let ends = around.iter().flat_map(|element| self.tet(*element));
        let sum: f64 = ends.map(|end| length(minus(self.position(end), own))).sum();
        sum / (3 * around.len().max(1)) as f64
    }

    /// Bytes of the heap that this holds.
    pub fn heap_bytes(&self) -> usize {
        size_of_val(self.positions.as_slice())
            + size_of_val(self.tets.as_slice())
            + size_of_val(self.neighbours.as_slice())
            + size_of_val(self.starts.as_slice())
            + size_of_val(self.around.as_slice())
            + self
                .gradients
                .get()
                .map_or(0, |own| size_of_val(own.as_slice()))
    }
}

fn neighbours(tets: &[[u32; 4]]) -> Result<Vec<[u32; 4]>, TopologyError> {
    let mut faces = room(4 * tets.len())?;
    for (element, tet) in tets.iter().enumerate() {
        for (face, corners) in FACES.iter().enumerate() {
            let mut nodes = corners.map(|corner| tet[corner]);
            nodes.sort_unstable();
            faces.push((nodes, element as u32, face));
        }
    }
    // Both elements of an inner face list it with the same sorted nodes, so they stand side by side
    // now.
    faces.sort_unstable();
    let mut found = filled([OUTSIDE; 4], tets.len())?;
    for pair in faces.windows(2) {
        let [(nodes, a, at_a), (others, b, at_b)] = [pair[0], pair[1]];
        if nodes == others {
            found[a as usize][at_a] = b;
            found[b as usize][at_b] = a;
        }
    }
    Ok(found)
}

fn volume([a, b, c, d]: [Point; 4]) -> f64 {
    dot(cross(minus(b, a), minus(c, a)), minus(d, a)) / 6.0
}

pub(crate) fn minus(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|k| a[k] - b[k])
}

pub(crate) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(crate) fn length(a: Point) -> f64 {
    dot(a, a).sqrt()
}
