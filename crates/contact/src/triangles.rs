//! Signed distance to a closed surface of triangles, convex or not: the nearest one by parry3d's bounding-volume tree.

use crate::error::ShapeError;
use parry3d::math::Vector;
use parry3d::query::{PointQueryWithLocation, Ray, RayCast};
use parry3d::shape::{CompositeShapeRef, TriMesh, TriMeshFlags};
use parry3d::transformation::try_convex_hull;
use std::collections::HashMap;

/// Below this the direction to the nearest point is rounding, and the triangle's normal is taken,
/// mm: coordinates of some hundred millimetres are known to 3e-5 mm in f32.
const CLOSE: f32 = 1e-4;
/// Faces of less than this share of the surface may be slivers, whose normal is rounding: an honest
/// mesh from a scanner has some, and is not refused for them.
const NO_FACE: f32 = 1e-3;

/// A closed surface in the tool's own frame, mm, whose faces look outward; made once, read by all threads.
#[derive(Clone, Debug)]
pub(crate) struct Triangles {
    faces: TriMesh,
}

impl Triangles {
    /// The convex hull of points.
    ///
    /// # Errors
    /// [`ShapeError::Flat`] where they have no volume.
    pub fn hull(points: &[[f32; 3]]) -> Result<Self, ShapeError> {
        let cloud: Vec<Vector> = points.iter().map(|p| Vector::from(*p)).collect();
        let (vertices, faces) = try_convex_hull(&cloud).map_err(|error| ShapeError::Flat {
            count: points.len(),
            reason: error.to_string(),
        })?;
        Self::new(vertices, faces)
    }

    /// A closed surface, turned outward where it is inside out. Several closed parts may be in it, or hollows, if none crosses another.
    ///
    /// # Errors
    /// [`ShapeError::Face`], [`ShapeError::Open`], [`ShapeError::Crossing`],
    /// [`ShapeError::InsideOut`] and [`ShapeError::Flat`], with the place where it is wrong.
    pub fn surface(points: &[[f32; 3]], faces: &[[u32; 3]]) -> Result<Self, ShapeError> {
        let count = points.len();
        // A closed surface has each directed edge once, and its opposite once.
        let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
        for (index, face) in faces.iter().enumerate() {
            if face.iter().any(|node| *node as usize >= count) {
                return Err(ShapeError::Face { index, count });
            }
            for k in 0..3 {
                let (a, b) = (face[k], face[(k + 1) % 3]);
                *edges.entry((a, b)).or_default() += 1;
            }
        }
        let open = |(a, b): &(u32, u32)| edges[&(*a, *b)] != 1 || edges.get(&(*b, *a)) != Some(&1);
        // The lowest, so that the message does not depend on a hash.
        if let Some((a, b)) = edges.keys().filter(|edge| open(edge)).min() {
            return Err(ShapeError::Open { a: *a, b: *b });
        }
        let vertices = points.iter().map(|p| Vector::from(*p)).collect();
        let surface = Self::new(vertices, faces.to_vec())?;
        surface.check_inside()?;
        Ok(surface)
    }

    /// What is inside must be the same to each face: no edge pierces a face, and behind each face one leaves through the inside of another.
    /// The sign of the distance is that of the nearest face alone.
    fn check_inside(&self) -> Result<(), ShapeError> {
        let (corners, indices) = (self.faces.vertices(), self.faces.indices());
        for face in indices {
            for k in 0..3 {
                let (a, b) = (face[k], face[(k + 1) % 3]);
                let from = corners[a as usize];
                let ray = Ray::new(from, corners[b as usize] - from);
                // Each edge once: its other face has it the other way round.
                let pierced = (a < b).then(|| {
                    self.faces.bvh().cast_ray(&ray, 1.0, |other, best| {
                        let meets = indices[other as usize].iter().any(|n| *n == a || *n == b);
                        (!meets).then(|| {
                            let triangle = self.faces.triangle(other);
                            triangle.cast_local_ray(&ray, best, false)
                        })?
                    })
                });
                if let Some(Some((_, t))) = pierced
                    && t <= 1.0
                {
                    let at = (from + t * ray.dir).to_array();
                    return Err(ShapeError::Crossing { at });
                }
            }
        }
        let (mut astray, mut area) = (None, [0.0; 2]);
        for face in self.faces.triangles() {
            let Some(normal) = face.normal() else {
                continue;
            };
            area[0] += face.area();
            // A ray may slip through between two faces: one of several must not.
            let ways = [[4.0, 4.0, 4.0], [5.0, 4.0, 3.0], [3.1, 4.2, 4.7]];
            let leaves = |[a, b, c]: [f32; 3]| {
                let start = (a * face.a + b * face.b + c * face.c) / 12.0;
                let ray = Ray::new(start - CLOSE * normal, -normal);
                let hit = CompositeShapeRef(&self.faces).cast_local_ray(&ray, f32::MAX, false);
                let other = hit.and_then(|(other, _)| self.faces.triangle(other).normal());
                other.is_some_and(|other| other.dot(normal) < 0.0)
            };
            if !ways.into_iter().any(leaves) {
                area[1] += face.area();
                astray = astray.or(Some(face.a));
            }
        }
        match astray {
            Some(at) if area[1] > NO_FACE * area[0] => {
                Err(ShapeError::InsideOut { at: at.to_array() })
            }
            _ => Ok(()),
        }
    }

    /// Turns the surface outward by the sign of its volume, and refuses one that has none: a millionth of its size cubed.
    fn new(vertices: Vec<Vector>, mut faces: Vec<[u32; 3]>) -> Result<Self, ShapeError> {
        let flat = |reason: String| ShapeError::Flat {
            count: vertices.len(),
            reason,
        };
        let middle = vertices.iter().sum::<Vector>() / vertices.len().max(1) as f32;
        let volume: f32 = faces
            .iter()
            .map(|t| t.map(|v| vertices[v as usize] - middle))
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum();
        let reach = vertices.iter().map(|v| (*v - middle).length());
        let reach = reach.fold(0.0, f32::max);
        if volume.is_nan() || volume.abs() <= 1e-6 * reach.powi(3) {
            return Err(flat(format!("{volume:e} mm³")));
        }
        if volume < 0.0 {
            faces.iter_mut().for_each(|face| face.swap(1, 2));
        }
        let count = vertices.len();
        let faces =
            TriMesh::with_flags(vertices, faces, TriMeshFlags::ORIENTED).map_err(|error| {
                let reason = error.to_string();
                ShapeError::Flat { count, reason }
            })?;
        Ok(Self { faces })
    }

    /// Distance (negative inside) and outward normal at a local point.
    pub fn nearest(&self, point: Vector) -> (f32, Vector) {
        let (nearest, (face, _)) = self
            .faces
            .project_local_point_and_get_location(point, false);
        let away = point - nearest.point;
        let length = away.length();
        if length < CLOSE {
            let normal = self.faces.triangle(face).normal().unwrap_or(Vector::Y);
            return (away.dot(normal), normal);
        }
        // The sign by pseudo-normals holds on edges and corners too.
        if nearest.is_inside {
            (-length, -away / length)
        } else {
            (length, away / length)
        }
    }

    /// From the middle of each face straight through what it bounds: the middle of that way, and its length.
    pub fn walls(&self) -> impl Iterator<Item = (Vector, f32)> {
        (self.faces.triangles()).filter_map(|face| {
            let inward = -face.normal()?;
            let middle = (face.a + face.b + face.c) / 3.0;
            // Not onto the face itself.
            let ray = Ray::new(middle + CLOSE * inward, inward);
            let length = CLOSE + self.faces.cast_local_ray(&ray, f32::MAX, false)?;
            Some((middle + 0.5 * length * inward, length))
        })
    }

    /// Its corners.
    pub fn corners(&self) -> &[Vector] {
        self.faces.vertices()
    }

    /// Unit directions from its corners inward: the mean of those along the edges.
    pub fn inward(&self) -> Vec<Vector> {
        let corners = self.faces.vertices();
        let mut inward = vec![Vector::ZERO; corners.len()];
        for face in self.faces.indices() {
            for k in 0..3 {
                let (a, b) = (face[k] as usize, face[(k + 1) % 3] as usize);
                inward[a] += (corners[b] - corners[a]).normalize_or_zero();
            }
        }
        inward.into_iter().map(Vector::normalize_or_zero).collect()
    }

    /// Corners of the box around it.
    pub fn bounds(&self) -> (Vector, Vector) {
        let vertices = self.faces.vertices();
        let low = vertices.iter().copied().reduce(Vector::min);
        let high = vertices.iter().copied().reduce(Vector::max);
        (low.unwrap_or_default(), high.unwrap_or_default())
    }
}
