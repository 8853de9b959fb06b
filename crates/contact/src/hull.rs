//! Signed distance to a convex hull: the nearest triangle by parry3d's bounding-volume tree.

use crate::shape::ShapeError;
use parry3d::math::Vector;
use parry3d::query::{PointQuery, PointQueryWithLocation};
use parry3d::shape::{TriMesh, TriMeshFlags};
use parry3d::transformation::try_convex_hull;

/// Below this the direction to the nearest point is rounding, and the triangle's normal is taken, mm.
const CLOSE: f32 = 1e-4;

#[derive(Clone, Debug)]
pub(crate) struct Hull {
    faces: TriMesh,
}

impl Hull {
    pub fn new(points: &[[f32; 3]]) -> Result<Self, ShapeError> {
        let flat = |reason: String| ShapeError::Flat {
            count: points.len(),
            reason,
        };
        let cloud: Vec<Vector> = points.iter().map(|p| Vector::from(*p)).collect();
        let (vertices, triangles) = try_convex_hull(&cloud).map_err(|e| flat(e.to_string()))?;
        let middle = vertices.iter().sum::<Vector>() / vertices.len().max(1) as f32;
        let volume: f32 = triangles
            .iter()
            .map(|t| t.map(|v| vertices[v as usize] - middle))
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum();
        let reach = vertices.iter().map(|v| (*v - middle).length());
        let reach = reach.fold(0.0, f32::max);
        if volume.is_nan() || volume <= 1e-6 * reach.powi(3) {
            return Err(flat(format!("{volume:e} mm³")));
        }
        let faces = TriMesh::with_flags(vertices, triangles, TriMeshFlags::ORIENTED)
            .map_err(|error| flat(error.to_string()))?;
        Ok(Self { faces })
    }

    /// Distance (negative inside) and outward normal at a local point.
    pub fn nearest(&self, point: Vector) -> (f32, Vector) {
        let (nearest, (face, _)) = self
            .faces
            .project_local_point_and_get_location(point, false);
        let away = point - nearest.point;
        let length = away.length();
        let normal = || self.faces.triangle(face).normal().unwrap_or(Vector::Y);
        if length < CLOSE {
            let normal = normal();
            return (away.dot(normal), normal);
        }
        // The sign by the tree's pseudo-normals holds on edges and corners too.
        if nearest.is_inside || self.faces.contains_local_point(point) {
            (-length, -away / length)
        } else {
            (length, away / length)
        }
    }

    /// Its corners.
    pub fn corners(&self) -> &[Vector] {
        self.faces.vertices()
    }

    /// Corners of the box around it.
    pub fn bounds(&self) -> (Vector, Vector) {
        let vertices = self.faces.vertices();
        let low = vertices.iter().copied().reduce(Vector::min);
        let high = vertices.iter().copied().reduce(Vector::max);
        (low.unwrap_or_default(), high.unwrap_or_default())
    }
}
