//! A rigid instrument: a convex core (segment or box) rounded by a radius, at a pose.
//!
//! The distance of a point to the surface is its distance to the core (by parry3d) less the radius;
//! the way out of the instrument runs along the same line. Lengths in mm.

use crate::error::{Error, Result};
use parry3d::math::{Pose, Rotation, Vector};
use parry3d::query::PointQuery;
use parry3d::shape::{Cuboid, Segment};

/// An instrument's shape in its own frame, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// All points within `radius` of a segment along local y, `half_length` to either side.
    Capsule { half_length: f32, radius: f32 },
    /// A box.
    Box { half_extents: [f32; 3] },
    /// A box with rounded corners: `half_extents` are those of the whole, `radius` at most the smallest.
    Spatula { half_extents: [f32; 3], radius: f32 },
}

/// A shape at a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instrument {
    /// Its shape.
    pub shape: Shape,
    /// Centre, mm, in the mesh's frame.
    pub position: [f32; 3],
    /// Unit quaternion x, y, z, w.
    pub rotation: [f32; 4],
    /// Touched nodes move with the instrument until it leaves; otherwise they slide without friction.
    pub sticking: bool,
}

enum Core {
    Segment(Segment),
    Cuboid(Cuboid),
}

/// An instrument ready for queries.
pub(super) struct Placed {
    core: Core,
    radius: f32,
    pose: Pose,
    /// Half sizes of the axis-aligned box around it, mm.
    reach: Vector,
    pub sticking: bool,
}

/// The nearest point of an instrument's surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Nearest {
    /// Negative inside, mm.
    pub distance: f32,
    pub point: Vector,
    /// Out of the instrument, unit length.
    pub normal: Vector,
}

impl Placed {
    /// Checks and places an instrument; `index` names it in errors.
    pub fn new(instrument: &Instrument, index: usize) -> Result<Self> {
        let bad = |what: String| Error::Argument(format!("instruments[{index}]: {what}"));
        let numbers = instrument.position.iter().chain(&instrument.rotation);
        if numbers.into_iter().any(|x| !x.is_finite()) {
            return Err(Error::NonFinite(format!(
                "instruments[{index}]: pose is not finite"
            )));
        }
        let positive = |name: &str, x: f32| {
            if x.is_finite() && x > 0.0 && x < 1e4 {
                Ok(x)
            } else {
                Err(bad(format!(
                    "{name} is {x}; it must be a length above 0 mm"
                )))
            }
        };
        let half = |sizes: [f32; 3]| -> Result<Vector> {
            for x in sizes {
                positive("half_extents", x)?;
            }
            Ok(Vector::from(sizes))
        };
        let (core, radius, core_half) = match instrument.shape {
            Shape::Capsule {
                half_length,
                radius,
            } => {
                let end = Vector::new(0.0, positive("half length", half_length)?, 0.0);
                let core = Core::Segment(Segment::new(-end, end));
                (core, positive("radius", radius)?, end)
            }
            Shape::Box { half_extents } => {
                let half = half(half_extents)?;
                (Core::Cuboid(Cuboid::new(half)), 0.0, half)
            }
            Shape::Spatula {
                half_extents,
                radius,
            } => {
                let half = half(half_extents)?;
                positive("radius", radius)?;
                if radius > half.min_element() {
                    return Err(bad(format!(
                        "corner radius {radius} mm exceeds the smallest half extent {} mm",
                        half.min_element()
                    )));
                }
                let inner = half - Vector::splat(radius);
                (Core::Cuboid(Cuboid::new(inner)), radius, inner)
            }
        };
        let rotation = Rotation::from_array(instrument.rotation);
        if (rotation.length() - 1.0).abs() > 1e-2 {
            return Err(bad(format!(
                "rotation has length {}, not 1",
                rotation.length()
            )));
        }
        let rotation = rotation.normalize();
        let axes = [Vector::X, Vector::Y, Vector::Z].map(|axis| (rotation * axis).abs());
        let reach = axes[0] * core_half.x + axes[1] * core_half.y + axes[2] * core_half.z;
        Ok(Self {
            core,
            radius,
            pose: Pose::from_parts(Vector::from(instrument.position), rotation),
            reach: reach + Vector::splat(radius),
            sticking: instrument.sticking,
        })
    }

    /// Corners of the axis-aligned box around it, widened by `margin`.
    pub fn bounds(&self, margin: f32) -> (Vector, Vector) {
        let reach = self.reach + Vector::splat(margin);
        let centre = self.pose.translation;
        (centre - reach, centre + reach)
    }

    /// The nearest surface point; where the way out is not unique (on the core), along `hint`.
    pub fn nearest(&self, point: Vector, hint: Vector) -> Nearest {
        let local = self.pose.inverse_transform_point(point);
        let on_core = match &self.core {
            Core::Segment(core) => core.project_local_point(local, false),
            Core::Cuboid(core) => core.project_local_point(local, false),
        };
        let inside = on_core.is_inside && matches!(self.core, Core::Cuboid(_));
        let sign = if inside { -1.0 } else { 1.0 };
        let away = (local - on_core.point) * sign;
        let length = away.length();
        let normal = if length > 1e-5 {
            away / length
        } else {
            self.pose.rotation.inverse() * hint
        };
        Nearest {
            distance: sign * length - self.radius,
            point: self
                .pose
                .transform_point(on_core.point + normal * self.radius),
            normal: self.pose.rotation * normal,
        }
    }

    /// Length of the way out of the instrument from an inner point along a unit direction, or `None`
    /// where it is longer than `limit`.
    pub fn way_out(&self, from: Vector, direction: Vector, limit: f32) -> Option<f32> {
        let mut length = 0.0;
        // Inside, the surface is at least `-distance` away in any direction.
        while length <= limit {
            let distance = self.nearest(from + direction * length, direction).distance;
            if distance >= -1e-3 {
                return Some(length);
            }
            length += -distance;
        }
        None
    }

    pub fn to_local(&self, point: Vector) -> Vector {
        self.pose.inverse_transform_point(point)
    }

    pub fn to_world(&self, local: Vector) -> Vector {
        self.pose.transform_point(local)
    }

    pub fn pose(&self) -> Pose {
        self.pose
    }
}
