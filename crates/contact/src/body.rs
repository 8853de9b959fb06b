//! A tool ready for queries: signed distance and outward normal at any point.
//!
//! Each shape is a core rounded by a radius: a point, a segment, a box or a closed surface. The distance is that to the core
//! less the radius. Boxes and segments are closed forms that stay exact on the surface itself, where the direction to a
//! projected point is rounding.

use crate::error::ShapeError;
use crate::shape::Shape;
use crate::triangles::Triangles;
use parry3d::math::{Pose, Vector};
use std::sync::Arc;

#[derive(Clone, Debug)]
enum Core {
    /// Along y; 0 is a point.
    Segment {
        half_length: f32,
    },
    Cuboid {
        half: Vector,
    },
    Triangles(Arc<Triangles>),
}

/// A shape ready for queries. Cheap to clone, never changes.
#[derive(Clone, Debug)]
pub struct Body {
    core: Core,
    radius: f32,
    /// Middle and half sizes of the box around it, in its frame.
    middle: Vector,
    half: Vector,
}

/// The nearest point of a tool's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Negative inside, mm.
    pub distance: f32,
    /// Out of the tool, unit length.
    pub normal: Vector,
}

impl Body {
    /// Whether another body is of the same shape and size; equal hulls made twice are two.
    pub fn is_same(&self, other: &Body) -> bool {
        let same = match (&self.core, &other.core) {
            (Core::Segment { half_length: a }, Core::Segment { half_length: b }) => a == b,
            (Core::Cuboid { half: a }, Core::Cuboid { half: b }) => a == b,
            (Core::Triangles(a), Core::Triangles(b)) => Arc::ptr_eq(a, b),
            _ => false,
        };
        same && self.radius == other.radius
    }

    /// Checks a shape and prepares it.
    ///
    /// # Errors
    /// [`ShapeError`] for sizes that no tool has, or a hull without volume.
    pub fn new(shape: &Shape) -> Result<Self, ShapeError> {
        shape.check()?;
        let (core, radius) = match shape {
            Shape::Sphere { radius } => (Core::Segment { half_length: 0.0 }, *radius),
            Shape::Capsule {
                half_length,
                radius,
            } => {
                let half_length = *half_length;
                (Core::Segment { half_length }, *radius)
            }
            Shape::Box { half_extents } => {
                let half = Vector::from(*half_extents);
                (Core::Cuboid { half }, 0.0)
            }
            Shape::Spatula {
                half_extents,
                radius,
            } => {
                let half = Vector::from(*half_extents) - Vector::splat(*radius);
                (Core::Cuboid { half }, *radius)
            }
            Shape::Hull { points, margin } => {
                (Core::Triangles(Arc::new(Triangles::hull(points)?)), *margin)
            }
            Shape::Mesh {
                points,
                faces,
                margin,
            } => {
                let surface = Triangles::surface(points, faces)?;
                (Core::Triangles(Arc::new(surface)), *margin)
            }
        };
        let (low, high) = match &core {
            Core::Segment { half_length } => {
                let end = Vector::new(0.0, *half_length, 0.0);
                (-end, end)
            }
            Core::Cuboid { half } => (-*half, *half),
            Core::Triangles(surface) => surface.bounds(),
        };
        Ok(Self {
            core,
            radius,
            middle: 0.5 * (low + high),
            half: 0.5 * (high - low) + Vector::splat(radius),
        })
    }

    /// How round its edges are at least, mm; 0 where they are sharp.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Half its smallest extent: the radius of a rod, half the thickness of a blade, mm.
    pub fn size(&self) -> f32 {
        self.half.min_element()
    }

    /// Signed distance and outward normal at a point of the tool's own frame.
    pub fn nearest(&self, point: Vector) -> Nearest {
        let (distance, normal) = match &self.core {
            Core::Segment { half_length } => {
                let on = Vector::new(0.0, point.y.clamp(-half_length, *half_length), 0.0);
                let away = point - on;
                let length = away.length();
                // On the core every direction is as near; x is one that all capsules have.
                let normal = if length > 0.0 {
                    away / length
                } else {
                    Vector::X
                };
                (length, normal)
            }
            Core::Cuboid { half } => cuboid(point, *half),
            Core::Triangles(surface) => surface.nearest(point),
        };
        Nearest {
            distance: distance - self.radius,
            normal,
        }
    }

    /// The same at a point of the world, the tool at `pose`.
    pub fn nearest_at(&self, pose: &Pose, point: Vector) -> Nearest {
        let local = self.nearest(pose.inverse_transform_point(point));
        Nearest {
            distance: local.distance,
            normal: pose.rotation * local.normal,
        }
    }

    /// Length of the way out of the tool from a point of the world along a unit direction, 0 outside; none where it is longer
    /// than `limit`.
    pub fn way_out(&self, pose: &Pose, from: Vector, direction: Vector, limit: f32) -> Option<f32> {
        let mut length = 0.0;
        // Inside, the surface is at least `-distance` away in any direction.
        while length <= limit {
            let distance = self.nearest_at(pose, from + direction * length).distance;
            if distance >= -1e-3 {
                return Some(length);
            }
            length -= distance;
        }
        None
    }

    /// Corners of the axis-aligned box around the tool at `pose`, widened by `margin`.
    pub fn bounds(&self, pose: &Pose, margin: f32) -> (Vector, Vector) {
        let axes = [Vector::X, Vector::Y, Vector::Z].map(|axis| (pose.rotation * axis).abs());
        let reach = axes[0] * self.half.x + axes[1] * self.half.y + axes[2] * self.half.z;
        let reach = reach + Vector::splat(margin);
        let centre = pose.transform_point(self.middle);
        (centre - reach, centre + reach)
    }

    /// The longest way that any point of the tool goes from one pose to another, at most, mm.
    pub fn motion(&self, from: &Pose, to: &Pose) -> f32 {
        let shift = to.transform_point(self.middle) - from.transform_point(self.middle);
        let turn = crate::pose::angle(&from.rotation, &to.rotation);
        shift.length() + turn * self.half.length()
    }

    /// Points inside the tool, in its frame, by which to see whether it lies in something: the middle, and the middles of
    /// the faces of the box around it, drawn in to the core.
    pub fn probes(&self) -> [Vector; 7] {
        let core = self.half - Vector::splat(self.radius);
        let [x, y, z] = [Vector::X, Vector::Y, Vector::Z].map(|axis| axis * core);
        [Vector::ZERO, x, -x, y, -y, z, -z].map(|offset| self.middle + 0.98 * offset)
    }
}

/// Signed distance to a box of half sizes `half`, and its gradient.
fn cuboid(point: Vector, half: Vector) -> (f32, Vector) {
    let sign = Vector::select(point.cmplt(Vector::ZERO), Vector::NEG_ONE, Vector::ONE);
    let beyond = point.abs() - half;
    let outside = beyond.max(Vector::ZERO);
    let length = outside.length();
    if length > 0.0 {
        return (length, sign * outside / length);
    }
    let deepest = beyond.max_element();
    let normal = if beyond.x == deepest {
        Vector::X
    } else if beyond.y == deepest {
        Vector::Y
    } else {
        Vector::Z
    };
    (deepest, sign * normal)
}
