//! Ways along a line through a tool, by marches of its signed distance: where the line enters it, and how far it is out.
//!
//! Sphere tracing (Hart, Sphere tracing, The Visual Computer 12, 1996): the signed distance says
//! how far one may go in any direction without passing the surface. It works for every shape of
//! tool, since all that it asks is [`Body::nearest`].

use crate::body::Body;
use parry3d::math::{Pose, Vector};

/// Ways along a line are followed at least by this, mm: what a line cuts off less deeply is missed.
const GRAZING_MM: f32 = 0.02;
/// Steps of a march along a line at most: one from a point that is not finite, or far beyond what f32 resolves, would not end.
const MOST_MARCHES: u32 = 4096;

impl Body {
    /// Length of the way out of the tool from a point of the world along a unit direction, 0 outside; none where it is longer
    /// than `limit`.
    pub fn way_out(&self, pose: &Pose, from: Vector, direction: Vector, limit: f32) -> Option<f32> {
        let mut length = 0.0;
        // Inside, the surface is at least `-distance` away in any direction.
        for _ in 0..MOST_MARCHES {
            let distance = self.nearest_at(pose, from + direction * length).distance;
            if distance >= -1e-3 {
                return Some(length);
            }
            length -= distance;
            if length > limit {
                break;
            }
        }
        None
    }

    /// The same from a point that may lie outside: length of the way along the direction until the tool is behind, none where that is longer than
    /// `limit` or the line misses the tool.
    pub fn way_through(
        &self,
        pose: &Pose,
        from: Vector,
        direction: Vector,
        limit: f32,
    ) -> Option<f32> {
        let entry = self.first_inside(pose, from, direction, limit)?;
        let out = self.way_out(pose, from + direction * entry, direction, limit - entry)?;
        Some(entry + out)
    }

    /// Where a straight way from one point of the tool's own frame to another first lies inside of it, and the outward normal there.
    pub fn entry(&self, from: Vector, to: Vector) -> Option<(Vector, Vector)> {
        let way = to - from;
        let length = way.length();
        let direction = way.try_normalize()?;
        let at = self.first_inside(&Pose::IDENTITY, from, direction, length)?;
        // The march ends a little inside.
        let nearest = self.nearest(from + direction * at);
        let point = from + direction * (at + nearest.distance).max(0.0);
        Some((point, nearest.normal))
    }

    /// Length along a line at which it first lies inside of the tool.
    fn first_inside(
        &self,
        pose: &Pose,
        from: Vector,
        direction: Vector,
        limit: f32,
    ) -> Option<f32> {
        let mut length = 0.0;
        for _ in 0..MOST_MARCHES {
            let distance = self.nearest_at(pose, from + direction * length).distance;
            if distance < 0.0 {
                return Some(length);
            }
            length += distance.max(GRAZING_MM);
            if length > limit {
                break;
            }
        }
        None
    }
}
