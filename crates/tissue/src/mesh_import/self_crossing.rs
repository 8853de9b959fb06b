//! Whether a closed surface passes through itself: an edge of one triangle through the inside of another.
//!
//! Triangles that share a point are not compared, and edges that only touch a triangle are not counted, so that a surface which
//! lies on itself within rounding passes. Candidates come from parry's bounding volume hierarchy. Filling a surface rounds it at
//! the scale of a lattice, so that places where it hardly passes through itself are harmless; they are called a repair.

use super::{ImportError, RawSurface, Repair};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};

/// Where an edge ends, measured along it, or a point lies in a triangle: this near to a border it only touches.
const MARGIN: f64 = 1e-9;

/// An edge that ends this near behind a face, over the diagonal of the surface's box, hardly passes through.
const SHALLOW: f64 = 0.01;

/// Refuses a surface that passes through itself; with `repair`, shallow places are listed and left to the filling.
///
/// # Errors
/// [`ImportError::SelfCrossing`] with two of its faces.
pub fn check(
    surface: &RawSurface,
    repair: bool,
    repairs: &mut Vec<Repair>,
) -> Result<(), ImportError> {
    let points: Vec<Vector> = surface
        .positions
        .iter()
        .map(|p| Vector::new(p[0], p[1], p[2]))
        .collect();
    let Ok(hierarchy) =
        TriMesh::with_flags(points.clone(), surface.faces.clone(), TriMeshFlags::empty())
    else {
        return Ok(()); // An empty surface is told of elsewhere.
    };
    let at = |node: u32| points[node as usize];
    let diagonal = hierarchy.local_aabb().extents().length();
    // The deepest place.
    let mut found: Option<(f64, usize, usize, Vector)> = None;
    let mut count = 0;
    for (index, face) in surface.faces.iter().enumerate() {
        let bounds = Aabb::from_points(face.iter().map(|&node| at(node)));
        for other in hierarchy.bvh().intersect_aabb(&bounds) {
            let other = other as usize;
            let corners = surface.faces[other];
            if other == index || corners.iter().any(|node| face.contains(node)) {
                continue;
            }
            let triangle = corners.map(at);
            for side in 0..3 {
                let [p, q] = [face[side], face[(side + 1) % 3]].map(at);
                let Some(place) = pierced(p, q, triangle) else {
                    continue;
                };
                let deep = depth(p, q, triangle);
                count += 1;
                if found.is_none_or(|(most, ..)| deep > most) {
                    found = Some((deep, index, other, place));
                }
            }
        }
    }
    match found {
        None => Ok(()),
        Some((deep, first, ..)) if repair && deep < SHALLOW * diagonal => {
            repairs.push(Repair {
                what: "places where the surface hardly passes through itself, left to the filling",
                count,
                first,
            });
            Ok(())
        }
        Some((depth_mm, first, second, at)) => Err(ImportError::SelfCrossing {
            first,
            second,
            at: [at.x, at.y, at.z],
            depth_mm,
            count,
        }),
    }
}

/// How far the nearer end of a segment lies behind a triangle's plane.
fn depth(p: Vector, q: Vector, [a, b, c]: [Vector; 3]) -> f64 {
    let normal = (b - a).cross(c - a).normalize();
    (p - a).dot(normal).abs().min((q - a).dot(normal).abs())
}

/// Where the segment from `p` to `q` passes through the inside of a triangle (Moeller and Trumbore 1997).
fn pierced(p: Vector, q: Vector, [a, b, c]: [Vector; 3]) -> Option<Vector> {
    let (ab, ac, pq) = (b - a, c - a, q - p);
    let across = pq.cross(ac);
    let det = ab.dot(across);
    if det.abs() < 1e-14 * ab.length() * ac.length() * pq.length() {
        return None;
    }
    let from = p - a;
    let u = from.dot(across) / det;
    let turned = from.cross(ab);
    let v = pq.dot(turned) / det;
    let t = ac.dot(turned) / det;
    let inside = |x: f64| x > MARGIN && x < 1.0 - MARGIN;
    (inside(u) && inside(v) && u + v < 1.0 - MARGIN && inside(t)).then(|| p + pq * t)
}
