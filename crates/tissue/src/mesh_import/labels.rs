//! Names that a mesh file gives to parts of itself: groups, objects and materials of an OBJ, vertex colours of a PLY, physical
//! groups of Gmsh, values of VTK arrays, sets of Abaqus and FEBio. A [`super::Region`] `group:NAME` chooses by them.
//!
//! Names belong to places, not to node numbers, so they survive repair and filling: a point on the surface has the name of the
//! file's nearest triangle, or of that triangle's nearest corner; a tetrahedron has that of its centroid.

use super::ImportError;
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::{TriMesh, TrianglePointLocation};
use std::collections::{BTreeSet, HashSet};
use std::path::Path;

/// Names of a file's parts; several a part.
#[derive(Default)]
pub struct Labels {
    /// `[V, 3]`, in the file's unit.
    pub positions: Vec<[f64; 3]>,
    pub faces: Vec<[u32; 3]>,
    pub tets: Vec<[u32; 4]>,
    pub of_face: Vec<Vec<String>>,
    pub of_point: Vec<Vec<String>>,
    pub of_tet: Vec<Vec<String>>,
}

impl Labels {
    /// All names, ascending.
    pub fn names(&self) -> BTreeSet<&str> {
        let lists = [&self.of_face, &self.of_point, &self.of_tet];
        let names = lists.into_iter().flatten().flatten();
        names.map(String::as_str).collect()
    }

    /// The part of this name, with lengths multiplied by `scale`.
    ///
    /// # Errors
    /// No part has the name; the message lists those that are there.
    pub fn group(&self, name: &str, path: &Path, scale: f64) -> Result<Group, ImportError> {
        let has = |list: &Vec<String>| list.iter().any(|n| n.eq_ignore_ascii_case(name));
        let faces: Vec<bool> = self.of_face.iter().map(has).collect();
        let points: Vec<bool> = self.of_point.iter().map(has).collect();
        let tets: Vec<bool> = self.of_tet.iter().map(has).collect();
        let format = |reason: String| ImportError::Format {
            path: path.into(),
            reason,
        };
        if ![&faces, &points, &tets].into_iter().flatten().any(|&x| x) {
            let names: Vec<&str> = self.names().into_iter().take(40).collect();
            return Err(format(if names.is_empty() {
                format!("no part of the file is called `{name}`; the file names no parts")
            } else {
                format!(
                    "no part of the file is called `{name}`; the file names {}",
                    names.join(", ")
                )
            }));
        }
        let scaled: Vec<[f64; 3]> = self
            .positions
            .iter()
            .map(|p| p.map(|x| x * scale))
            .collect();
        let surface = (!self.faces.is_empty())
            .then(|| {
                let points = scaled.iter().map(|p| Vector::new(p[0], p[1], p[2]));
                TriMesh::new(points.collect(), self.faces.clone())
            })
            .transpose()
            .map_err(|error| format(error.to_string()))?;
        let centroids = self.tets.iter().zip(&tets).filter(|(_, inside)| **inside);
        let cells = centroids.map(|(tet, _)| {
            let corners = tet.map(|node| scaled[node as usize]);
            let centre: [f64; 3] =
                std::array::from_fn(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 4.0);
            key(centre)
        });
        Ok(Group {
            cells: cells.collect(),
            surface,
            faces,
            points,
        })
    }
}

/// A named part of a file.
pub struct Group {
    surface: Option<TriMesh>,
    faces: Vec<bool>,
    points: Vec<bool>,
    /// Centroids of its tetrahedra, rounded.
    cells: HashSet<[i64; 3]>,
}

/// Rounded to what single precision keeps of an organ's coordinates, mm.
fn key(point: [f64; 3]) -> [i64; 3] {
    point.map(|x| (x * 200.0).round() as i64)
}

impl Group {
    fn nearest(&self, [x, y, z]: [f64; 3]) -> Option<(u32, TrianglePointLocation)> {
        let surface = self.surface.as_ref()?;
        let point = Vector::new(x, y, z);
        let (_, place) = surface.project_local_point_and_get_location(point, false);
        Some(place)
    }

    /// Whether the file's triangle nearest to a point on the body's surface, mm, belongs to it.
    pub fn holds_by_face(&self, point: [f64; 3]) -> bool {
        let face = self.nearest(point).map(|(face, _)| face as usize);
        face.is_some_and(|face| self.faces.get(face).copied().unwrap_or(false))
    }

    /// Whether the nearest corner of that triangle belongs to it.
    pub fn holds_by_corner(&self, point: [f64; 3]) -> bool {
        let (Some(surface), Some((face, place))) = (&self.surface, self.nearest(point)) else {
            return false;
        };
        let corner = match place {
            TrianglePointLocation::OnVertex(at) => at as usize,
            TrianglePointLocation::OnEdge(edge, weights) => {
                let ends = [[0, 1], [1, 2], [2, 0]][edge as usize % 3];
                ends[usize::from(weights[1] > weights[0])]
            }
            TrianglePointLocation::OnFace(_, weights) => (0..3)
                .max_by(|&a, &b| weights[a].total_cmp(&weights[b]))
                .unwrap_or(0),
            TrianglePointLocation::OnSolid => 0,
        };
        let node = surface.indices()[face as usize][corner % 3];
        self.points.get(node as usize).copied().unwrap_or(false)
    }

    /// Whether a tetrahedron with this centroid, mm, belongs to it.
    pub fn holds_tet(&self, centroid: [f64; 3]) -> bool {
        let [x, y, z] = key(centroid);
        // The neighbours too: rounding may go the other way.
        (-1..=1).any(|i| {
            (-1..=1).any(|j| (-1..=1).any(|k| self.cells.contains(&[x + i, y + j, z + k])))
        })
    }
}
