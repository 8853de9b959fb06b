//! A tool ready for queries: signed distance and outward normal at any point.
//!
//! Each shape is a core rounded by a radius: a point, a segment, a box or a closed surface. The distance is that to the core
//! less the radius. Boxes and segments are closed forms that stay exact on the surface itself, where the direction to a
//! projected point is rounding.

use crate::error::ShapeError;
use crate::shape::{Shape, THINNEST_MM};
use crate::triangles::Triangles;
use parry3d::math::{Pose, Vector};
use std::sync::Arc;

/// A tool may sink this deep between the samples, mm.
const SUNK_MM: f32 = 0.5;
/// Rods touch as ones of this radius at least, and blades as ones of half this half thickness, mm: what is thinner than an element of
/// the tissue feels no difference, and the contact of a finer tip is not to be solved on it. Ends of rods stay where they are.
const LEAST_RADIUS_MM: f32 = 1.0;
/// A tool of less half thickness pierces the surface before it has pushed it, mm.
const THIN_MM: f32 = 1.45;
/// Hulls at least this thick a millimetre behind each corner, as boxes are, have no point, mm.
const BLUNT_MM: f32 = 0.65;
/// See [`Body::check_hull`], mm.
const POINTED_MM: f32 = 0.2;
/// Corners of a hull that serve as probes at most.
const MOST_CORNERS: usize = 64;

#[derive(Clone, Debug)]
/// What is rounded by the radius.
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

/// The shape that a body was made of. One with lists is shared, so that no clone of a body allocates.
#[derive(Clone, Debug)]
enum Origin {
    Plain(Shape),
    Listed(Arc<Shape>),
}

/// A shape ready for queries. Cheap to clone, never changes.
#[derive(Clone, Debug)]
pub struct Body {
    origin: Origin,
    /// What distances are measured to; a rod's or blade's may be thicker than the shape asked for.
    core: Core,
    /// By which the core is rounded, mm.
    radius: f32,
    /// It has a corner that is less than [`BLUNT_MM`] thick a millimetre behind.
    pointed: bool,
    /// Of a surface that may have hollows: half the thickness of its thinnest wall, and points inside of it.
    walls: Option<(f32, Arc<[Vector]>)>,
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

    /// The shape that it was made of.
    pub fn shape(&self) -> &Shape {
        match &self.origin {
            Origin::Plain(shape) => shape,
            Origin::Listed(shape) => shape,
        }
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
                let end = half_length + radius;
                let radius = radius.max(LEAST_RADIUS_MM.min(end));
                let half_length = end - radius;
                (Core::Segment { half_length }, radius)
            }
            Shape::Box { half_extents } => {
                let half = Vector::from(*half_extents);
                let half = half.max(Vector::splat(0.5 * LEAST_RADIUS_MM));
                (Core::Cuboid { half }, 0.0)
            }
            Shape::Spatula {
                half_extents,
                radius,
            } => {
                let half = Vector::from(*half_extents);
                let half = half.max(Vector::splat(0.5 * LEAST_RADIUS_MM));
                (
                    Core::Cuboid {
                        half: half - Vector::splat(*radius),
                    },
                    *radius,
                )
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
        let origin = match shape {
            Shape::Hull { .. } | Shape::Mesh { .. } => Origin::Listed(Arc::new(shape.clone())),
            plain => Origin::Plain(plain.clone()),
        };
        let mut body = Self {
            origin,
            core,
            radius,
            pointed: false,
            walls: None,
            middle: 0.5 * (low + high),
            half: 0.5 * (high - low) + Vector::splat(radius),
        };
        match (body.core.clone(), shape) {
            (Core::Triangles(surface), Shape::Hull { .. }) => {
                body.pointed = body.check_hull(&surface)? < BLUNT_MM;
                if body.pointed {
                    body.round_off(&surface)?;
                }
            }
            (Core::Triangles(surface), _) => body.walls = Some(body.check_walls(&surface)?),
            _ => {}
        }
        Ok(body)
    }

    /// No wall of a surface is thinner than a blade may be. Returns half its thinnest, and middles of some walls.
    fn check_walls(&self, surface: &Triangles) -> Result<(f32, Arc<[Vector]>), ShapeError> {
        let walls: Vec<(Vector, f32)> = surface.walls().collect();
        let thinnest = walls.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        let (at, length) = thinnest.copied().unwrap_or((Vector::ZERO, 0.0));
        let thickness = length + 2.0 * self.radius;
        if thickness < 0.4 * THINNEST_MM {
            let at = at.to_array();
            return Err(ShapeError::Wall { at, thickness });
        }
        let some = walls.len().div_ceil(MOST_CORNERS).max(1);
        let inside = walls.iter().step_by(some).map(|wall| wall.0);
        Ok((0.5 * thickness, inside.collect()))
    }

    /// Gives a hull with a point that of a rod: a ball of [`LEAST_RADIUS_MM`], which ends where the point does. Its sides stay where they are
    /// within some tenths of a millimetre, but for those of a hull that is thinner than the ball.
    fn round_off(&mut self, hull: &Triangles) -> Result<(), ShapeError> {
        let more = (LEAST_RADIUS_MM - self.radius).max(0.0);
        let sides = more.min(0.5 * self.size());
        let corners = hull.corners().iter().zip(hull.inward());
        let core: Vec<[f32; 3]> = corners
            .map(|(corner, inward)| {
                // A millimetre behind the corner its faces are so far away; farther behind, in proportion.
                let depth = -self.nearest(*corner + inward).distance - self.radius;
                let by = match 2.0 * depth < BLUNT_MM {
                    true => more,
                    false => sides / depth,
                };
                (*corner + inward * by).to_array()
            })
            .collect();
        let core = Triangles::hull(&core)?;
        let (low, high) = core.bounds();
        self.radius += more;
        self.middle = 0.5 * (low + high);
        self.half = 0.5 * (high - low) + Vector::splat(self.radius);
        self.core = Core::Triangles(Arc::new(core));
        Ok(())
    }

    /// A hull is thick, and no more pointed than that it is [`POINTED_MM`] thick a millimetre behind each corner.
    /// Returns that thickness of its finest corner.
    fn check_hull(&self, hull: &Triangles) -> Result<f32, ShapeError> {
        let thickness = 2.0 * self.size();
        if thickness < 0.4 * THINNEST_MM {
            return Err(ShapeError::Thin { thickness });
        }
        let mut least = f32::MAX;
        for (corner, inward) in hull.corners().iter().zip(hull.inward()) {
            let behind = *corner + inward;
            let thickness = -2.0 * self.nearest(behind).distance;
            if thickness < POINTED_MM {
                let corner = corner.to_array();
                return Err(ShapeError::Pointed { corner, thickness });
            }
            least = least.min(thickness);
        }
        Ok(least)
    }

    /// Whether it sinks more than `SUNK_MM` between samples `spacing` apart, or passes between them: by its half thickness, or by
    /// the margin of a hull, which may have a point.
    pub fn sinks_between(&self, spacing: f32) -> bool {
        if self.is_broad() {
            return false;
        }
        let round = self.finest();
        // A point of an equilateral triangle is at most so far from its corners.
        let far = spacing / 3.0f32.sqrt();
        round < far || round - (round * round - far * far).sqrt() > SUNK_MM
    }

    /// Whether it is so thin that it pierces the surface before it has pushed it.
    pub fn pierces(&self) -> bool {
        self.finest() < THIN_MM
    }

    /// Whether it is a hull with a point.
    pub fn has_point(&self) -> bool {
        self.pointed
    }

    /// Half the thickness of its thinnest part: its size, or the radius of its point.
    pub fn finest(&self) -> f32 {
        match self.pointed {
            true => self.radius,
            false => self.size(),
        }
    }

    /// Whether it has broad sides, as thick boxes, spatulas and hulls without a point have: several folds of the tissue may lie on them.
    pub fn is_broad(&self) -> bool {
        let is_flat = match self.core {
            Core::Segment { .. } => false,
            Core::Cuboid { .. } => true,
            Core::Triangles(_) => !self.pointed,
        };
        is_flat && self.finest() >= THIN_MM
    }

    /// How round its edges are at least, mm; 0 where they are sharp.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// Half its smallest extent: the radius of a rod, half the thickness of a blade or of the thinnest wall of a surface with hollows, mm.
    pub fn size(&self) -> f32 {
        match &self.walls {
            Some((thin, _)) => *thin,
            None => self.half.min_element(),
        }
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

    /// Points inside the tool, in its frame, by which to see whether it lies in something: the middle, the middles of the faces of the box
    /// around it, drawn in to the core, and corners of a hull; of a surface with hollows middles of its walls.
    pub fn probes(&self) -> impl Iterator<Item = Vector> {
        let core = self.half - Vector::splat(self.radius);
        let [x, y, z] = [Vector::X, Vector::Y, Vector::Z].map(|axis| axis * core);
        let inside: &[Vector] = self.walls.as_ref().map_or(&[], |(_, inside)| inside);
        let corners: &[Vector] = match &self.core {
            Core::Triangles(surface) if inside.is_empty() => surface.corners(),
            _ => &[],
        };
        let middle = self.middle;
        let corners = corners
            .iter()
            .step_by(corners.len().div_ceil(MOST_CORNERS).max(1));
        let offsets = [Vector::ZERO, x, -x, y, -y, z, -z];
        // The middle of the box around a surface may lie in a hollow.
        let convex = offsets.into_iter().take(match inside.is_empty() {
            true => offsets.len(),
            false => 0,
        });
        (convex.chain(corners.map(move |corner| *corner - middle)))
            .map(move |offset| middle + 0.999 * offset)
            .chain(inside.iter().copied())
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
