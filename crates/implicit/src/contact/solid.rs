//! The solid that the whole surface bounds: which points lie in it, and where a ray crosses its surface.

use ::contact::friction::frame;
use ::contact::{Body, Pose, Vector};

use super::state::State;
use crate::bundle::Mesh;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// Probes of a tool that are its middle and the ends of its axes.
const CONVEX_PROBES: usize = 7;
/// A part of the surface is clearly nearer than another if it is by this factor.
const CLEARLY: f32 = 1.5;
/// A unit direction along no axis or diagonal.
const OBLIQUE: Vector = Vector::new(0.365_148, 0.547_723, 0.752_773);
/// Rays lean this much to it: along edges of a regular mesh they would hit none of the faces there.
const TILT: f32 = 1e-3;

/// On which sides of two planes through a ray each node of the surface lies, by node, and behind them the corners of a cut body: bits for above and below the one, and for above and below
/// the other. Faces whose corners share a bit are not crossed.
#[derive(Debug, HeldBytes)]
pub(super) struct Sides(Vec<u8>);

impl Sides {
    /// Of a mesh.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn of(mesh: &Mesh) -> Result<Sides> {
        Self::new(mesh.node_count() + mesh.domain.opened.bounds.corners.len())
    }

    fn new(count: usize) -> Result<Sides> {
        let mut sides = memory::room(count, "the sides of a ray")?;
        sides.resize(count, 0);
        Ok(Sides(sides))
    }
}

/// A corner of a cut body's surface: nodes and weights.
type Corner = ([u32; 4], [f32; 4]);

/// The surface of a body, where it is in a state: faces of nodes, and of a cut body triangles of corners besides.
pub(super) struct Solid<'a> {
    nodes: &'a [u32],
    faces: &'a [[u32; 3]],
    corners: &'a [Corner],
    pieces: &'a [[u32; 3]],
    pub state: State<'a>,
    sides: &'a mut Sides,
}

/// What a ray has crossed.
#[derive(Clone, Copy)]
enum Part {
    /// By its nodes.
    Face([u32; 3]),
    /// By its corners.
    Piece([u32; 3]),
}

/// Where a ray crosses the surface.
pub(super) struct Crossing {
    /// From the ray's start, mm.
    pub along: f32,
    /// Whether the ray leaves the solid there.
    pub leaves: bool,
    part: Part,
}

impl<'a> Solid<'a> {
    pub fn of(mesh: &'a Mesh, state: State<'a>, sides: &'a mut Sides) -> Solid<'a> {
        let bounds = &mesh.domain.opened.bounds;
        let (nodes, faces) = match bounds.faces.is_empty() {
            true => (&mesh.surface.nodes, mesh.surface.faces.as_chunks().0),
            false => (&bounds.nodes, bounds.faces.as_slice()),
        };
        Solid {
            nodes,
            faces,
            corners: &bounds.corners,
            pieces: &bounds.pieces,
            state,
            sides,
        }
    }

    /// Whether a node of the surface is clearly nearer to a point than `depth`, mm.
    pub fn is_nearer(&self, point: Vector, depth: f32) -> bool {
        let nodes = self.nodes.iter().map(|node| self.state.position(*node));
        let places = nodes.chain(self.corners.iter().map(|corner| self.corner_at(corner)));
        let squares = places.map(|at| at.distance_squared(point));
        depth > CLEARLY * squares.fold(f32::MAX, f32::min).sqrt()
    }

    /// Whether a ray from a point leaves the surface more often than it enters it.
    pub fn is_inside(&mut self, point: Vector) -> bool {
        let mut leaves = 0i32;
        self.each_crossing(point, OBLIQUE, |crossing| {
            leaves += if crossing.leaves { 1 } else { -1 };
        });
        leaves != 0
    }

    /// Whether a tool with a probe at `point` in the solid leaves it through faces alone that are not of the nodes `touchable`: its shaft lies across a fold
    /// there, and did not come in through the touchable surface. A tool that is wholly in the solid leaves it nowhere.
    pub fn is_left_elsewhere(
        &mut self,
        (body, pose): (&Body, &Pose),
        point: Vector,
        touchable: &[u32],
    ) -> bool {
        let mut is_left = false;
        for probe in body.probes().take(CONVEX_PROBES) {
            let way = pose.transform_point(probe) - point;
            let (mut nearest, mut left) = (way.length(), None);
            let Some(ray) = way.try_normalize() else {
                continue;
            };
            self.each_crossing(point, ray, |crossing| {
                if crossing.along < nearest {
                    (nearest, left) = (crossing.along, Some(crossing.part));
                }
            });
            let is_touchable = |node: &u32| touchable.binary_search(node).is_ok();
            let is_out = left.map(|part| match part {
                Part::Face(nodes) => nodes.iter().all(is_touchable),
                Part::Piece(corners) => (corners.iter())
                    .all(|corner| self.corners[*corner as usize].0.iter().all(is_touchable)),
            });
            match is_out {
                Some(true) => return false,
                Some(false) => is_left = true,
                None => {}
            }
        }
        is_left
    }

    /// Where a corner is.
    fn corner_at(&self, (nodes, weights): &Corner) -> Vector {
        let places = nodes.iter().zip(weights);
        let places = places.map(|(node, weight)| self.state.position(*node) * *weight);
        places.sum()
    }

    /// Calls with each crossing of a ray from a point along a unit direction, in no order.
    pub fn each_crossing(
        &mut self,
        point: Vector,
        direction: Vector,
        mut take: impl FnMut(Crossing),
    ) {
        let ray = match direction == OBLIQUE {
            true => OBLIQUE,
            false => (direction + TILT * OBLIQUE).normalize(),
        };
        let across = frame(ray);
        let (e, f) = (across.y_axis, across.z_axis);
        let sides = |at: Vector| {
            let side = |x: f32| u8::from(x > 0.0) | u8::from(x < 0.0) << 1;
            side(at.dot(e)) | side(at.dot(f)) << 2
        };
        for &node in self.nodes {
            self.sides.0[node as usize] = sides(self.state.position(node) - point);
        }
        let first_corner = self.sides.0.len() - self.corners.len();
        for (at, corner) in self.corners.iter().enumerate() {
            self.sides.0[first_corner + at] = sides(self.corner_at(corner) - point);
        }
        let is_beside = |at: [f32; 3]| at.iter().all(|x| *x > 0.0) || at.iter().all(|x| *x < 0.0);
        let mut cross = |part: Part, corners: [Vector; 3]| {
            let [x, y] = [e, f].map(|axis| corners.map(|corner| corner.dot(axis)));
            let side = |i: usize, j: usize| x[i] * y[j] - y[i] * x[j];
            let [u, v, w] = [side(1, 2), side(2, 0), side(0, 1)];
            if is_beside([u, v, w]) {
                let [a, b, c] = corners;
                let along = (u * a + v * b + w * c).dot(ray) / (u + v + w);
                if along > 0.0 {
                    take(Crossing {
                        along,
                        leaves: u > 0.0,
                        part,
                    });
                }
            }
        };
        // Most triangles lie on one side of a plane through the ray.
        let is_missed = |[a, b, c]: [usize; 3]| {
            let sides = &self.sides.0;
            sides[a] & sides[b] & sides[c] != 0
        };
        for &face in self.faces {
            if !is_missed(face.map(|node| node as usize)) {
                let corners = face.map(|node| self.state.position(node) - point);
                cross(Part::Face(face), corners);
            }
        }
        for &piece in self.pieces {
            if !is_missed(piece.map(|corner| first_corner + corner as usize)) {
                let corner = |at: u32| self.corner_at(&self.corners[at as usize]) - point;
                cross(Part::Piece(piece), piece.map(corner));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::contact::Shape;

    /// A block of 40 by 10 by 40 mm; tools touch its top alone.
    #[test]
    fn a_shaft_that_came_in_from_below_has_no_way_out_at_the_top() {
        let mut rest = Vec::new();
        for corner in 0..8u32 {
            let side = |axis: u32| {
                if corner >> axis & 1 == 1 {
                    1.0f32
                } else {
                    -1.0
                }
            };
            rest.extend([20.0 * side(0), 5.0 * side(1), 20.0 * side(2)]);
        }
        // Each side of the block by two triangles, outward.
        let quads = [
            [2, 6, 7, 3],
            [0, 1, 5, 4],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let faces: Vec<[u32; 3]> = quads
            .into_iter()
            .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect();
        let (nodes, top): (Vec<u32>, _) = ((0..8).collect(), [2, 3, 6, 7]);
        let mut sides = Sides::new(8).unwrap();
        let state = State {
            rest: &rest,
            u: &[],
            start: &[],
        };
        let mut solid = Solid {
            nodes: &nodes,
            faces: &faces,
            corners: &[],
            pieces: &[],
            state,
            sides: &mut sides,
        };
        let point = Vector::new(1.3, 3.0, 0.7);
        assert!(solid.is_inside(point) && !solid.is_inside(point + 3.0 * Vector::Y));
        let needle = Body::new(&Shape::Capsule {
            half_length: 30.0,
            radius: 0.5,
        });
        let needle = needle.unwrap();
        let mut is_left = |body: &Body, at: Vector| {
            solid.is_left_elsewhere((body, &Pose::from_translation(at)), point, &top)
        };
        // Its tip at the point: from below, from above; and through the whole block.
        assert!(is_left(&needle, point - 30.0 * Vector::Y));
        assert!(!is_left(&needle, point + 30.0 * Vector::Y));
        assert!(!is_left(&needle, point));
        let ball = Body::new(&Shape::Sphere { radius: 1.0 }).unwrap();
        assert!(!is_left(&ball, point));
    }
}
