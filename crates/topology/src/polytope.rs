//! The material of a cell: a convex polytope in barycentric coordinates of its element.

use serde::{Deserialize, Serialize};

use crate::Point;
use crate::polygon;
use crate::rest::{FACES, cross, dot, minus};

/// Barycentric coordinates in an element.
pub type Weights = [f64; 4];

/// A plane is met within this part of the largest distance.
const ON_PLANE: f64 = 1e-9;

/// Whence a face of a polytope is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Side {
    /// Part of the element's face opposite to a corner.
    Face(u8),
    /// The cut of a stroke, of which the polytope is on the positive side or not.
    Cut { stroke: u32, positive: bool },
}

/// See the module.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Polytope {
    /// Convex polygons, outward.
    pub faces: Vec<(Side, Vec<Weights>)>,
}

/// Where a point of the element is in the coordinates of its three later corners.
fn place(at: &Weights) -> Point {
    [at[1], at[2], at[3]]
}

/// A corner of a face, and its normal.
/// The normal points outward and is as long as the face's area in these coordinates: who needs a
/// distance divides by it.
fn plane_of(face: &[Weights]) -> (Point, Point) {
    let corner = place(&face[0]);
    let mut sum = [0.0; 3];
    for pair in face[1..].windows(2) {
        let [a, b] = [0, 1].map(|end: usize| minus(place(&pair[end]), corner));
        let part = cross(a, b);
        (sum.iter_mut().zip(part)).for_each(|(sum, part)| *sum += 0.5 * part);
    }
    (corner, sum)
}

impl Polytope {
    /// The whole element.
    pub fn whole() -> Polytope {
        let corner = |at: usize| std::array::from_fn(|k| f64::from(u8::from(k == at)));
        let face = |(at, corners): (usize, &[usize; 3])| {
            (Side::Face(at as u8), corners.map(corner).to_vec())
        };
        Polytope {
            faces: FACES.iter().enumerate().map(face).collect(),
        }
    }

    /// All corners, those of each face.
    pub fn points(&self) -> impl Iterator<Item = &Weights> {
        self.faces.iter().flat_map(|(_, points)| points)
    }

    /// The smallest and the largest value of a function that is linear in the element, by its values at the corners; a value next to nothing is 0.
    pub fn range(&self, distance: &Weights) -> [f64; 2] {
        let value = value(distance);
        self.points().fold([f64::MAX, f64::MIN], |[low, high], at| {
            let own = value(at);
            [low.min(own), high.max(own)]
        })
    }

    /// Part of the element's volume.
    /// By the divergence theorem over the faces. The sum is six times the volume in coordinates in
    /// which the whole element has a sixth: it is the part itself.
    pub fn share(&self) -> f64 {
        // From a point inside, so that thin parts far from the origin of the coordinates keep their
        // digits.
        let centre = self.middle();
        let place = |at: &Weights| [at[1] - centre[1], at[2] - centre[2], at[3] - centre[3]];
        let mut sum = 0.0;
        for (_, points) in &self.faces {
            for pair in points[1..].windows(2) {
                sum += dot(cross(place(&points[0]), place(&pair[0])), place(&pair[1]));
            }
        }
        sum
    }

    /// Mean of the corners.
    pub fn middle(&self) -> Weights {
        let count = self.points().count().max(1) as f64;
        std::array::from_fn(|k| self.points().map(|point| point[k]).sum::<f64>() / count)
    }

    /// Whether a point of the element lies in it.
    pub fn holds(&self, at: &Weights) -> bool {
        self.faces.iter().all(|(_, points)| {
            let (corner, normal) = plane_of(points);
            // A point on a face that two parts share is in both.
            dot(normal, minus(place(at), corner)) <= 1e-12
        })
    }

    /// How far inside of it a point of the element lies, in its coordinates: the least distance from its faces, negative outside.
    pub fn depth(&self, at: &Weights) -> f64 {
        let off = |points: &Vec<Weights>| {
            let (corner, normal) = plane_of(points);
            let length = dot(normal, normal).sqrt();
            match length > 0.0 {
                true => dot(normal, minus(corner, place(at))) / length,
                // A face without area has no plane, and bounds nothing.
                false => f64::MAX,
            }
        };
        let faces = self.faces.iter().map(|(_, points)| off(points));
        faces.fold(f64::MAX, f64::min)
    }

    /// Whether a corner of the element is in it.
    pub fn has_corner(&self, corner: usize) -> bool {
        // Exact: clipping copies the corners that it keeps and never computes one anew.
        self.points().any(|at| at[corner] == 1.0)
    }

    /// The part on one side of a cut; `distance` are its values at the element's corners. `None` where nothing is left.
    /// Both sides of a cut are made by two calls with the same `distance`; they share its polygon
    /// corner by corner because [`polygon::between`] gives the same bits to both.
    pub fn part(&self, distance: &Weights, stroke: u32, positive: bool) -> Option<Polytope> {
        let value = value(distance);
        let sign = if positive { 1.0 } else { -1.0 };
        let mut faces = Vec::with_capacity(self.faces.len() + 1);
        let mut on_plane: Vec<Weights> = Vec::new();
        for (side, points) in &self.faces {
            let kept = clip_on(points, &value, sign);
            for at in kept.iter().filter(|at| at.1) {
                if !on_plane.iter().any(|other| is_same(other, &at.0)) {
                    on_plane.push(at.0);
                }
            }
            let kept = without_doubles(kept);
            if kept.len() >= 3 {
                faces.push((*side, kept));
            }
        }
        // What is closed has four faces at least, the cut among them.
        if faces.len() < 3 || on_plane.len() < 3 {
            return None;
        }
        around(&mut on_plane, distance, sign);
        faces.push((Side::Cut { stroke, positive }, on_plane));
        Some(Polytope { faces })
    }
}

/// A linear function by its values at the corners; what is next to nothing is 0, so that a corner on the plane is on both sides.
fn value(distance: &Weights) -> impl Fn(&Weights) -> f64 {
    let largest = distance.iter().fold(0.0f64, |most, d| most.max(d.abs()));
    let distance = *distance;
    move |at| {
        let sum: f64 = (0..4).map(|k| at[k] * distance[k]).sum();
        if sum.abs() <= ON_PLANE * largest {
            0.0
        } else {
            sum
        }
    }
}

/// [`polygon::clip`], with whether a corner is on the plane.
fn clip_on(points: &[Weights], value: impl Fn(&Weights) -> f64, sign: f64) -> Vec<(Weights, bool)> {
    let mut kept = Vec::with_capacity(points.len() + 1);
    for (at, point) in points.iter().enumerate() {
        let next = &points[(at + 1) % points.len()];
        let (own, other) = (value(point), value(next));
        if own == 0.0 || own * sign > 0.0 {
            kept.push((*point, own == 0.0));
        }
        if own > 0.0 && other < 0.0 {
            kept.push((polygon::between(point, next, own, other), true));
        } else if own < 0.0 && other > 0.0 {
            kept.push((polygon::between(next, point, other, own), true));
        }
    }
    kept
}

fn is_same(a: &Weights, b: &Weights) -> bool {
    (0..4).all(|k| (a[k] - b[k]).abs() < ON_PLANE)
}

/// Two corners can fall together where the plane goes through a corner; a polygon with both would
/// have an edge without length.
fn without_doubles(points: Vec<(Weights, bool)>) -> Vec<Weights> {
    let mut kept: Vec<Weights> = Vec::with_capacity(points.len());
    for (at, _) in points {
        if !kept.iter().any(|other| is_same(other, &at)) {
            kept.push(at);
        }
    }
    kept
}

/// Corners of the cut in order around it, outward for the side of `sign`.
fn around(points: &mut [Weights], distance: &Weights, sign: f64) {
    let place = |at: &Weights| -> Point { [at[1], at[2], at[3]] };
    let [d0, d1, d2, d3] = *distance;
    let outward = [d1 - d0, d2 - d0, d3 - d0].map(|d| -sign * d);
    let centre = place(&polygon::middle(points));
    let first = minus(place(&points[0]), centre);
    let second = cross(outward, first);
    let angle = |at: &Weights| {
        let off = minus(place(at), centre);
        // Components along axes that need not be of unit length keep the order.
        let along = |axis| dot(off, axis) / dot(axis, axis).sqrt();
        // By `libm`, as everything in a step: the same order on every platform.
        libm::atan2(along(second), along(first))
    };
    points.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
}
