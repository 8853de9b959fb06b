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

/// On which sides of two planes through a ray each node of the surface lies, by node: bits for above and below the one, and for above and below
/// the other. Faces whose corners share a bit are not crossed.
#[derive(Debug, HeldBytes)]
pub(super) struct Sides(Vec<u8>);

impl Sides {
    /// Of a mesh with `count` nodes.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(count: usize) -> Result<Sides> {
        let mut sides = memory::room(count, "the sides of a ray")?;
        sides.resize(count, 0);
        Ok(Sides(sides))
    }
}

/// The surface of a body `[F,3]` and its nodes, where they are in a state.
pub(super) struct Solid<'a> {
    pub nodes: &'a [u32],
    pub faces: &'a [u32],
    pub state: State<'a>,
    pub sides: &'a mut Sides,
}

/// Where a ray crosses the surface.
pub(super) struct Crossing {
    /// From the ray's start, mm.
    pub along: f32,
    /// Whether the ray leaves the solid there.
    pub leaves: bool,
    face: [u32; 3],
}

impl<'a> Solid<'a> {
    pub fn of(mesh: &'a Mesh, state: State<'a>, sides: &'a mut Sides) -> Solid<'a> {
        Solid {
            nodes: &mesh.surface_nodes,
            faces: &mesh.surface_faces,
            state,
            sides,
        }
    }

    /// Whether a node of the surface is clearly nearer to a point than `depth`, mm.
    pub fn is_nearer(&self, point: Vector, depth: f32) -> bool {
        let nodes = self.nodes.iter();
        let squares = nodes.map(|node| self.state.position(*node).distance_squared(point));
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
                    (nearest, left) = (crossing.along, Some(crossing.face));
                }
            });
            let is_touchable = |node: &u32| touchable.binary_search(node).is_ok();
            match left {
                Some(face) if face.iter().all(is_touchable) => return false,
                Some(_) => is_left = true,
                None => {}
            }
        }
        is_left
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
        for &node in self.nodes {
            let at = self.state.position(node) - point;
            let side = |x: f32| u8::from(x > 0.0) | u8::from(x < 0.0) << 1;
            self.sides.0[node as usize] = side(at.dot(e)) | side(at.dot(f)) << 2;
        }
        let is_beside = |at: [f32; 3]| at.iter().all(|x| *x > 0.0) || at.iter().all(|x| *x < 0.0);
        for &face in self.faces.as_chunks::<3>().0 {
            // Most faces lie on one side of a plane through the ray.
            let [a, b, c] = face.map(|node| self.sides.0[node as usize]);
            if a & b & c != 0 {
                continue;
            }
            let corners = face.map(|node| self.state.position(node) - point);
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
                        face,
                    });
                }
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
        let faces: Vec<u32> = quads
            .into_iter()
            .flat_map(|[a, b, c, d]| [a, b, c, a, c, d])
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
