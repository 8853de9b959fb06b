//! Contact at a wall that a blade has laid open.
//!
//! The two walls of a closed slit lie on each other, so that a tool in it has both inside of itself: where it is nearest to its surface a sample would
//! come out on either side, and be dragged through the tool. A wall goes back into its own tissue instead. With the tool's normal `n` where it is
//! nearest and the wall's outward normal `o` the sample comes out along
//!
//! ```text
//! m = n - max(0, n.o + OPENS) o        of unit length
//! ```
//!
//! which is `n` where the tool comes from outside of the wall, and turns to `-o` as the tool is more behind it, without a leap.

use crate::body::{Body, Nearest};
use parry3d::math::{Pose, Vector};

/// A normal that leans from the wall by more than this (cosine) is the tool's own.
const OPENS: f32 = 0.3;
/// A tool's normal may lean this much (cosine) to the outside of the tissue; beyond, the tool reaches the sample from within.
pub const LEAN: f32 = 0.2;
/// A way out that is more than this many times the shortest one grazes the tool from within: it does not touch the wall.
const LONG_WAY: f32 = 4.0;

impl Body {
    /// Distance and normal for a sample of a wall with unit normal `outward`; none where the tool does not touch that wall.
    pub fn nearest_at_wall(&self, pose: &Pose, point: Vector, outward: Vector) -> Option<Nearest> {
        let nearest = self.nearest_at(pose, point);
        let along = nearest.normal.dot(outward);
        if along <= -OPENS {
            return Some(nearest);
        }
        if nearest.distance >= 0.0 {
            return (along <= LEAN).then_some(nearest);
        }
        let normal = (nearest.normal - outward * (along + OPENS)).try_normalize()?;
        let longest = LONG_WAY * -nearest.distance;
        let way = self.way_out(pose, point, normal, longest)?;
        (way <= longest).then_some(Nearest {
            distance: -way,
            normal,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::Shape;

    /// Two walls on the plane x = 0: that of the tissue at x < 0 looks along x, the other one back.
    #[test]
    fn a_tool_in_a_closed_slit_parts_its_walls() {
        let ball = Body::new(&Shape::Sphere { radius: 3.0 }).unwrap();
        for middle in [-0.4, 0.0, 0.4] {
            let pose = Pose::from_translation(Vector::X * middle);
            for at in [Vector::ZERO, Vector::Y, Vector::new(0.0, -0.5, 1.5)] {
                for outward in [Vector::X, -Vector::X] {
                    let found = ball.nearest_at_wall(&pose, at, outward).unwrap();
                    assert!(found.normal.dot(outward) < -0.25, "{at} {found:?}");
                    let out = at + found.normal * -found.distance;
                    let left = ball.nearest_at(&pose, out).distance;
                    assert!(found.distance < 0.0 && left.abs() < 2e-3, "{at}: {left}");
                }
            }
        }
        // From outside it is the tool's own normal, and one that only just comes out of the tissue from within does not count.
        let pose = Pose::from_translation(Vector::X * 2.8);
        let (wall, point) = (Vector::X, Vector::ZERO);
        let found = ball.nearest_at_wall(&pose, point, wall).unwrap();
        assert_eq!(found, ball.nearest_at(&pose, point));
        assert_eq!(ball.nearest_at_wall(&pose, point, -wall), None);
    }

    #[test]
    fn the_way_out_of_a_wall_does_not_leap() {
        let ball = Body::new(&Shape::Sphere { radius: 3.0 }).unwrap();
        let mut last: Option<Nearest> = None;
        for step in 0..=300 {
            // Round the ball, 0.5 mm deep, from outside of the wall to where the tool is behind it.
            let turn = 0.006 * step as f32;
            let point = Vector::new(-turn.cos(), turn.sin(), 0.0) * 2.5;
            let found = ball.nearest_at_wall(&Pose::IDENTITY, point, Vector::X);
            if let (Some(last), Some(found)) = (last, found) {
                let leap = (last.distance - found.distance).abs();
                assert!(leap < 0.05, "{step}: {last:?} {found:?}");
                assert!(last.normal.distance(found.normal) < 0.05, "{step}");
            }
            last = found.or(last);
        }
        assert!(last.unwrap().normal.x < -0.29);
    }
}
