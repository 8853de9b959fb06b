//! Convex polygons in space.
//!
//! Corners are in order and the last is joined to the first. `N` is 3 in space, 4 in the
//! barycentric coordinates of an element, 2 on a face.

use crate::Point;
use crate::rest::{cross, minus};

/// What of a convex polygon is not on the negative side of `value`, which is linear (Sutherland and Hodgman 1974).
pub fn clip<const N: usize>(
    points: &[[f64; N]],
    value: impl Fn(&[f64; N]) -> f64,
) -> Vec<[f64; N]> {
    // A corner that lies on the line counts as inside and is not made a second time.
    let mut kept = Vec::with_capacity(points.len() + 1);
    for (at, point) in points.iter().enumerate() {
        let next = &points[(at + 1) % points.len()];
        let (own, other) = (value(point), value(next));
        if own >= 0.0 {
            kept.push(*point);
        }
        if own > 0.0 && other < 0.0 {
            kept.push(between(point, next, own, other));
        } else if own < 0.0 && other > 0.0 {
            kept.push(between(next, point, other, own));
        }
    }
    kept
}

/// Where a linear function that is positive at `p` and negative at `n` is zero: the same bits whichever polygon asks.
pub fn between<const N: usize>(p: &[f64; N], n: &[f64; N], at_p: f64, at_n: f64) -> [f64; N] {
    let part = at_p / (at_p - at_n);
    std::array::from_fn(|k| p[k] + part * (n[k] - p[k]))
}

/// Mean of the corners.
pub fn middle<const N: usize>(points: &[[f64; N]]) -> [f64; N] {
    std::array::from_fn(|k| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64)
}

/// Normal, as long as the area.
pub fn normal(points: &[Point]) -> Point {
    let mut sum = [0.0; 3];
    for pair in points[1..].windows(2) {
        let part = cross(minus(pair[0], points[0]), minus(pair[1], points[0]));
        for k in 0..3 {
            sum[k] += 0.5 * part[k];
        }
    }
    sum
}

/// Twice the area of a polygon in the plane, positive where its corners go round to the left.
pub fn double_area(points: &[[f64; 2]]) -> f64 {
    let mut sum = 0.0;
    for (at, a) in points.iter().enumerate() {
        let b = points[(at + 1) % points.len()];
        sum += a[0] * b[1] - a[1] * b[0];
    }
    sum
}
