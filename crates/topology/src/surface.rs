//! The closed surface of a body as it is now: the mesh's own where nothing has happened, the lips of cuts and what removal has laid bare.
//!
//! Vertices and slots of triangles keep their numbers where nothing changed. A vertex lies at fixed weights on nodes, so it moves with the tissue, and its
//! rest position is that of the intact tissue there.

use std::collections::{BTreeMap, BTreeSet};

use crate::body::{Body, Cell};
use crate::connect::{common, on_face};
use crate::polytope::{Side, Weights};
use crate::rest::{FACES, OUTSIDE};
use crate::room::{push, reserve, room};
use crate::{Point, RestMesh, TopologyError};

mod edges;
mod skin;

pub use skin::{Skin, SkinTriangle};

/// Weights below this are none, and vertices on the same nodes whose weights differ by less are one.
const SAME: f64 = 1e-6;
/// No node.
pub const NONE: u32 = u32::MAX;

/// A point on nodes of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vertex {
    /// Ascending, then [`NONE`].
    pub nodes: [u32; 4],
    pub weights: Weights,
}

/// What has changed since the surface before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceChange {
    /// Vertices from here on are new.
    pub first_vertex: u32,
    /// Slots of triangles with other corners, ascending.
    pub triangles: Vec<u32>,
}

/// See the module.
#[derive(Clone, Debug)]
pub struct Surface {
    /// The first `K` are the mesh's nodes.
    pub vertices: Vec<Vertex>,
    /// Outward; `[0, 0, 0]` in slots that are empty.
    pub triangles: Vec<[u32; 3]>,
    /// By triangle: it was inside of the intact body.
    pub inside: Vec<bool>,
    by_nodes: BTreeMap<[u32; 4], Vec<u32>>,
    /// The border of the mesh by element and face, ascending: the first slots.
    border: Vec<(u32, u8)>,
    /// Those of its slots that are empty, ascending.
    hidden: Vec<u32>,
}

/// A polygon of the surface, outward.
struct Piece {
    /// Element and face of the mesh's border that it is a part of; none inside of the intact body.
    border: Option<(u32, u8)>,
    /// A blade has gone through an element here.
    is_cut: bool,
    corners: Vec<u32>,
}

impl Surface {
    /// That of the intact body: its slots are in the order of elements and faces.
    ///
    /// # Errors
    /// No memory.
    pub fn new(mesh: &RestMesh) -> Result<Surface, TopologyError> {
        let mut surface = Surface {
            vertices: Vec::new(),
            triangles: Vec::new(),
            inside: Vec::new(),
            by_nodes: BTreeMap::new(),
            border: Vec::new(),
            hidden: Vec::new(),
        };
        for node in 0..mesh.node_count() as u32 {
            surface.vertex(vec![(node, 1.0)])?;
        }
        for element in 0..mesh.element_count() as u32 {
            for (face, &over) in mesh.neighbours(element).iter().enumerate() {
                if over == OUTSIDE {
                    push(&mut surface.border, (element, face as u8))?;
                    let tet = mesh.tet(element);
                    let corners = FACES[face].map(|corner| tet[corner]);
                    push(&mut surface.triangles, corners)?;
                    push(&mut surface.inside, false)?;
                }
            }
        }
        Ok(surface)
    }

    /// Where a vertex is, given where nodes are.
    pub fn place(&self, vertex: u32, position: impl Fn(u32) -> Point) -> Point {
        let own = self.vertices[vertex as usize];
        let mut at = [0.0; 3];
        for (node, weight) in own.nodes.into_iter().zip(own.weights) {
            if node != NONE {
                let corner = position(node);
                at = [0, 1, 2].map(|k| at[k] + weight * corner[k]);
            }
        }
        at
    }

    /// Follows the body; says what is different.
    ///
    /// # Errors
    /// No memory: another call then follows the body from where it was.
    pub fn update(&mut self, body: &Body) -> Result<SurfaceChange, TopologyError> {
        let first_vertex = self.vertices.len() as u32;
        let mut pieces = self.pieces(body)?;
        cancel(&mut pieces);
        let split = self.split_edges(body, &mut pieces)?;
        let mut wanted: BTreeMap<[u32; 3], bool> = BTreeMap::new();
        let mut extra = Vec::new();
        for piece in pieces {
            self.fill(&piece, &mut |triangle, inside| {
                let first = (0..3).min_by_key(|at| triangle[*at]).unwrap_or(0);
                let turned = [0, 1, 2].map(|k| triangle[(first + k) % 3]);
                if wanted.insert(turned, inside).is_some() {
                    extra.push((turned, inside));
                }
            })?;
        }
        let mut hidden = Vec::new();
        let faces =
            (body.cells.keys()).flat_map(|element| (0..4).map(move |face| (*element, face)));
        for own in faces.chain(split) {
            if let Ok(slot) = self.border.binary_search(&own) {
                push(&mut hidden, slot as u32)?;
            }
        }
        hidden.sort_unstable();
        hidden.dedup();
        // From here on nothing asks for memory, so that no slot changes without being listed.
        let slots = self.triangles.len() + wanted.len() + extra.len();
        reserve(&mut self.triangles, wanted.len() + extra.len())?;
        reserve(&mut self.inside, wanted.len() + extra.len())?;
        let mut empty = room(slots)?;
        let mut change = SurfaceChange {
            first_vertex,
            triangles: room(slots)?,
        };
        for &slot in self
            .hidden
            .iter()
            .filter(|slot| hidden.binary_search(slot).is_err())
        {
            let (element, face) = self.border[slot as usize];
            let tet = body.mesh().tet(element);
            self.triangles[slot as usize] = FACES[usize::from(face)].map(|corner| tet[corner]);
            change.triangles.push(slot);
        }
        for &slot in hidden
            .iter()
            .filter(|slot| self.hidden.binary_search(slot).is_err())
        {
            self.triangles[slot as usize] = [0; 3];
            change.triangles.push(slot);
        }
        self.hidden = hidden;
        for slot in self.border.len()..self.triangles.len() {
            let own = self.triangles[slot];
            if wanted.get(&own) == Some(&self.inside[slot]) {
                wanted.remove(&own);
            } else {
                empty.push(slot);
            }
        }
        let mut empty = empty.into_iter();
        for (triangle, inside) in wanted.into_iter().chain(extra) {
            let slot = match empty.next() {
                Some(slot) => slot,
                None => {
                    self.triangles.push([0; 3]);
                    self.inside.push(false);
                    self.triangles.len() - 1
                }
            };
            self.triangles[slot] = triangle;
            self.inside[slot] = inside;
            change.triangles.push(slot as u32);
        }
        for slot in empty {
            if self.triangles[slot] != [0; 3] {
                self.triangles[slot] = [0; 3];
                change.triangles.push(slot as u32);
            }
        }
        change.triangles.sort_unstable();
        Ok(change)
    }

    /// The vertex at weights on nodes.
    fn vertex(&mut self, mut at: Vec<(u32, f64)>) -> Result<u32, TopologyError> {
        at.retain(|(_, weight)| *weight > SAME);
        at.sort_unstable_by_key(|(node, _)| *node);
        let mut vertex = Vertex {
            nodes: [NONE; 4],
            weights: [0.0; 4],
        };
        for (k, (node, weight)) in at.into_iter().enumerate() {
            vertex.nodes[k] = node;
            vertex.weights[k] = weight;
        }
        let known = self.by_nodes.entry(vertex.nodes).or_default();
        let is_same = |other: &u32| {
            let other = &self.vertices[*other as usize].weights;
            (0..4).all(|k| (other[k] - vertex.weights[k]).abs() < SAME)
        };
        if let Some(found) = known.iter().copied().find(is_same) {
            return Ok(found);
        }
        let number = self.vertices.len() as u32;
        push(&mut self.vertices, vertex)?;
        known.push(number);
        Ok(number)
    }

    /// Adds a polygon of a cell, given in its element's coordinates.
    fn add(
        &mut self,
        cell: &Cell,
        points: &[Weights],
        (border, is_cut): (Option<(u32, u8)>, bool),
        pieces: &mut Vec<Piece>,
    ) -> Result<(), TopologyError> {
        let corner = |at: &Weights| (0..4).map(|k| (cell.nodes[k], at[k])).collect();
        let found = points.iter().map(|at| self.vertex(corner(at)));
        let mut corners = found.collect::<Result<Vec<u32>, TopologyError>>()?;
        corners.dedup();
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        if corners.len() >= 3 {
            let piece = Piece {
                border,
                is_cut,
                corners,
            };
            push(pieces, piece)?;
        }
        Ok(())
    }

    /// The surface where it is not the mesh's own.
    fn pieces(&mut self, body: &Body) -> Result<Vec<Piece>, TopologyError> {
        let mesh = body.mesh();
        let mut pieces = Vec::new();
        for (&element, cells) in &body.cells {
            for cell in cells.iter().filter(|cell| cell.is_alive) {
                for (side, points) in &cell.material().faces {
                    match side {
                        Side::Cut { .. } => self.add(cell, points, (None, true), &mut pieces)?,
                        Side::Face(face)
                            if mesh.neighbours(element)[usize::from(*face)] == OUTSIDE =>
                        {
                            let border = Some((element, *face));
                            self.add(cell, points, (border, false), &mut pieces)?;
                        }
                        Side::Face(face) => {
                            let over = mesh.neighbours(element)[usize::from(*face)];
                            let own = (element, cell, usize::from(*face));
                            self.add_bare(body, own, over, &mut pieces)?;
                        }
                    }
                }
            }
            for over in mesh.neighbours(element) {
                if over == OUTSIDE || body.cells.contains_key(&over) {
                    continue;
                }
                let back = mesh.neighbours(over).iter().position(|own| *own == element);
                let whole = Cell::whole(mesh.tet(over));
                if let Some(face) = back {
                    self.add_bare(body, (over, &whole, face), element, &mut pieces)?;
                }
            }
        }
        Ok(pieces)
    }

    /// What of a cell's part of a face no cell beyond it is joined to.
    fn add_bare(
        &mut self,
        body: &Body,
        (element, cell, face): (u32, &Cell, usize),
        over: u32,
        pieces: &mut Vec<Piece>,
    ) -> Result<(), TopologyError> {
        let mesh = body.mesh();
        let back = mesh.neighbours(over).iter().position(|own| *own == element);
        let (Some(back), Some(own)) = (back, on_face(mesh.tet(element), cell, face)) else {
            return Ok(());
        };
        let tet = mesh.tet(element);
        let mut corners = FACES[face];
        corners.sort_unstable_by_key(|corner| tet[*corner]);
        // Whether the ascending order goes round the same way as outward.
        let at = |corner: usize| FACES[face].iter().position(|own| *own == corner);
        let is_outward =
            (0..3).any(|k| at(corners[0]) == Some(k) && at(corners[1]) == Some((k + 1) % 3));
        for other in body.cells(over).iter() {
            if body.is_joined((element, cell), face, over, other) {
                continue;
            }
            let Some(others) = on_face(mesh.tet(over), other, back) else {
                continue;
            };
            let mut bare = common(&own, &others);
            if !is_outward {
                bare.reverse();
            }
            let widen = |point: &[f64; 2]| {
                let mut weights = [0.0; 4];
                weights[corners[0]] = 1.0 - point[0] - point[1];
                weights[corners[1]] = point[0];
                weights[corners[2]] = point[1];
                weights
            };
            let points: Vec<Weights> = bare.iter().map(widen).collect();
            self.add(cell, &points, (None, false), pieces)?;
        }
        Ok(())
    }

    /// Triangles of a convex polygon.
    fn fill(
        &mut self,
        piece: &Piece,
        take: &mut impl FnMut([u32; 3], bool),
    ) -> Result<(), TopologyError> {
        let corners = &piece.corners;
        if corners.len() <= 4 {
            for pair in corners[1..].windows(2) {
                take([corners[0], pair[0], pair[1]], piece.border.is_none());
            }
            return Ok(());
        }
        // From its middle, so that none has its corners on one line.
        let part = 1.0 / corners.len() as f64;
        let mut sum: BTreeMap<u32, f64> = BTreeMap::new();
        for corner in corners {
            let own = self.vertices[*corner as usize];
            for (node, weight) in own.nodes.into_iter().zip(own.weights) {
                if node != NONE {
                    *sum.entry(node).or_default() += part * weight;
                }
            }
        }
        let middle = self.vertex(sum.into_iter().collect())?;
        for (at, corner) in corners.iter().enumerate() {
            take(
                [*corner, corners[(at + 1) % corners.len()], middle],
                piece.border.is_none(),
            );
        }
        Ok(())
    }
}

/// Takes out lips that lie on each other with the same corners: nothing is open there.
fn cancel(pieces: &mut Vec<Piece>) {
    let mut by_corners: BTreeMap<Vec<u32>, Vec<usize>> = BTreeMap::new();
    for (at, piece) in pieces.iter().enumerate() {
        let mut sorted = piece.corners.clone();
        sorted.sort_unstable();
        by_corners.entry(sorted).or_default().push(at);
    }
    let mut gone = BTreeSet::new();
    for at in by_corners.values() {
        for (k, &a) in at.iter().enumerate() {
            let back = |b: &&usize| {
                !gone.contains(*b) && is_reverse(&pieces[a].corners, &pieces[**b].corners)
            };
            if !gone.contains(&a)
                && let Some(&b) = at[k + 1..].iter().find(back)
            {
                gone.extend([a, b]);
            }
        }
    }
    let mut at = 0;
    pieces.retain(|_| {
        at += 1;
        !gone.contains(&(at - 1))
    });
}

fn is_reverse(a: &[u32], b: &[u32]) -> bool {
    let count = a.len();
    let start = b.iter().position(|corner| *corner == a[0]);
    start.is_some_and(|start| (0..count).all(|k| a[k] == b[(start + count - k) % count]))
}
