//! What a blade's edge passes on its way: a strip of triangles.

use crate::polygon;
use crate::rest::{cross, dot, length, minus};
use crate::{Point, TopologyError};

/// A triangle of less area, mm², is nothing.
const LEAST_AREA: f64 = 1e-9;
/// A cut polygon is of a triangle where its middle lies no further from its plane, in edges of the element: elsewhere another part of a
/// bent strip passes.
const NEAR: f64 = 0.35;

/// Triangles `[p, q, r]`, mm, turned the same way.
/// A blade that stands still sweeps nothing, which is an error.
#[derive(Clone, Debug, PartialEq)]
pub struct Sweep {
    triangles: Vec<[Point; 3]>,
    way: Point,
}

impl Sweep {
    /// The way of an edge, a line of points (two for a straight blade), from pose to pose.
    ///
    /// # Errors
    /// Fewer than two poses or points, poses of other lengths, numbers that are not finite, no area.
    pub fn new(poses: &[Vec<Point>]) -> Result<Sweep, TopologyError> {
        let mut triangles = Vec::new();
        for (index, pose) in poses.iter().enumerate() {
            if pose.len() != poses[0].len() {
                return Err(TopologyError::EdgeLength {
                    index,
                    found: pose.len(),
                    expected: poses[0].len(),
                });
            }
            if !pose.iter().flatten().all(|x| x.is_finite()) {
                return Err(TopologyError::NotFinite {
                    field: "blade",
                    index,
                });
            }
        }
        for pair in poses.windows(2) {
            for (start, end) in pair[0].windows(2).zip(pair[1].windows(2)) {
                let [a, b, c, d] = [start[0], start[1], end[1], end[0]];
                for triangle in [[a, b, c], [a, c, d]] {
                    if area(triangle) > LEAST_AREA {
                        triangles.push(triangle);
                    }
                }
            }
        }
        match triangles.is_empty() {
            true => Err(TopologyError::NoArea),
            false => Ok(Sweep {
                triangles,
                way: way(&poses[0], &poses[poses.len() - 1]),
            }),
        }
    }

    /// How far the edge goes from its first pose to its last, in the mean of its points, mm.
    pub fn way(&self) -> Point {
        self.way
    }

    /// The triangles.
    pub fn triangles(&self) -> &[[Point; 3]] {
        &self.triangles
    }

    /// Smallest and largest corner of a box around all.
    pub fn bounds(&self) -> [Point; 2] {
        let points = self.triangles.iter().flatten();
        points.fold([[f64::MAX; 3], [f64::MIN; 3]], |[low, high], point| {
            [
                [0, 1, 2].map(|k| low[k].min(point[k])),
                [0, 1, 2].map(|k| high[k].max(point[k])),
            ]
        })
    }

    /// Distance of a point from the plane of the triangle nearest to it, mm; positive on one side of the strip. Beyond the strip the
    /// plane goes on.
    /// Inside of an element the distance counts as linear between those of its corners.
    pub fn distance(&self, point: Point) -> f64 {
        let mut nearest = (f64::MAX, 0.0f64);
        for triangle in &self.triangles {
            let off = length(minus(point, closest(*triangle, point)));
            let own = plane(*triangle, point);
            // Of two triangles that share the nearest edge, the plane that is further away is on the side where the point is.
            let tie = (off - nearest.0).abs() < 1e-9 && own.abs() > nearest.1.abs();
            if off < nearest.0 - 1e-9 || tie {
                nearest = (off, own);
            }
        }
        nearest.1
    }

    /// Area of a convex polygon, mm², that the strip passes, of an element with edges of about `edge` mm.
    pub fn overlap(&self, points: &[Point], edge: f64) -> f64 {
        let mut sum = 0.0;
        for triangle in &self.triangles {
            let [a, b, c] = *triangle;
            let normal = cross(minus(b, a), minus(c, a));
            let mut clipped = points.to_vec();
            // Clipped by the planes through the triangle's edges and across it: what is left is
            // what the triangle passes, with the polygon's own area and not that of its shadow.
            for [from, to] in [[a, b], [b, c], [c, a]] {
                let inward = cross(normal, minus(to, from));
                clipped = polygon::clip(&clipped, |point| dot(inward, minus(*point, from)));
                if clipped.len() < 3 {
                    break;
                }
            }
            if clipped.len() < 3 {
                continue;
            }
            let middle = polygon::middle(&clipped);
            if plane(*triangle, middle).abs() <= NEAR * edge {
                sum += length(polygon::normal(&clipped));
            }
        }
        sum
    }
}

fn way(from: &[Point], to: &[Point]) -> Point {
    let [a, b] = [from, to].map(polygon::middle);
    minus(b, a)
}

fn area([a, b, c]: [Point; 3]) -> f64 {
    0.5 * length(cross(minus(b, a), minus(c, a)))
}

/// Distance from the plane of a triangle.
fn plane([a, b, c]: [Point; 3], point: Point) -> f64 {
    let normal = cross(minus(b, a), minus(c, a));
    dot(normal, minus(point, a)) / length(normal)
}

/// The point of a triangle that is closest to one (Ericson 2005, section 5.1.5).
fn closest([a, b, c]: [Point; 3], point: Point) -> Point {
    let (ab, ac, ap) = (minus(b, a), minus(c, a), minus(point, a));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = minus(point, b);
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let along = |from: Point, way: Point, t: f64| [0, 1, 2].map(|k| from[k] + t * way[k]);
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return along(a, ab, d1 / (d1 - d3));
    }
    let cp = minus(point, c);
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return along(a, ac, d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return along(b, minus(c, b), (d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    along(along(a, ab, vb / sum), ac, vc / sum)
}
