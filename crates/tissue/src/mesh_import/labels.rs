//! Names that a mesh file gives to parts of itself: groups, objects and materials of an OBJ, vertex colours of a PLY, physical
//! groups of Gmsh, values of VTK arrays, sets of Abaqus and FEBio. A [`super::Region`] `group:NAME` chooses by them.
//!
//! Names belong to places, not to node numbers, so they survive repair and filling: a point on the surface has the name of the
//! file's nearest triangle, or of that triangle's nearest corner; a tetrahedron has that of its centroid.

use super::ImportError;
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQueryWithLocation;
use parry3d_f64::shape::{TriMesh, TrianglePointLocation};
use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::Path;

/// Names of a file's parts; several a part.
#[derive(Default)]
pub struct Labels {
    /// `[V, 3]`, in the file's unit.
    pub positions: Vec<[f64; 3]>,
    pub faces: Vec<[u32; 3]>,
    pub tets: Vec<[u32; 4]>,
    named: Vec<Named>,
    place_of_name: HashMap<String, usize>,
    /// Members of all names together, and how many there may be.
    members: usize,
    most_members: usize,
}

/// What has a name, by index.
#[derive(Default)]
struct Named {
    name: String,
    faces: Vec<u32>,
    points: Vec<u32>,
    tets: Vec<u32>,
}

/// What a name is given to, by index.
#[derive(Clone, Copy)]
pub(super) enum Part {
    Face(usize),
    Point(usize),
    Tet(usize),
}

impl Labels {
    /// Without names; a file of this many bytes can give so many parts a name that memory still holds them.
    pub(super) fn of_file(bytes: usize) -> Self {
        Self {
            most_members: bytes.saturating_mul(16).saturating_add(1 << 20),
            ..Self::default()
        }
    }

    /// The number of a name, for [`Self::add`].
    pub(super) fn name(&mut self, name: &str) -> usize {
        if let Some(&place) = self.place_of_name.get(name) {
            return place;
        }
        self.named.push(Named {
            name: name.to_owned(),
            ..Named::default()
        });
        let place = self.named.len() - 1;
        self.place_of_name.insert(name.to_owned(), place);
        place
    }

    /// Gives a part of the file a name, by its number.
    ///
    /// # Errors
    /// The names have more members than a file of this size needs.
    pub(super) fn add(&mut self, name: usize, part: Part) -> Result<(), String> {
        self.members += 1;
        if self.members > self.most_members {
            return Err(format!(
                "its groups and sets name more than {} members in all; leave out those that are not needed",
                self.most_members
            ));
        }
        let named = &mut self.named[name];
        match part {
            Part::Face(index) => named.faces.push(index as u32),
            Part::Point(index) => named.points.push(index as u32),
            Part::Tet(index) => named.tets.push(index as u32),
        }
        Ok(())
    }

    /// All names that parts have, ascending.
    pub fn names(&self) -> BTreeSet<&str> {
        let used = self.named.iter().filter(|named| {
            !(named.faces.is_empty() && named.points.is_empty() && named.tets.is_empty())
        });
        used.map(|named| named.name.as_str()).collect()
    }

    /// The part of this name, with lengths multiplied by `scale`.
    ///
    /// # Errors
    /// No part has the name; the message lists those that are there.
    pub fn group(&self, name: &str, path: &Path, scale: f64) -> Result<Group, ImportError> {
        let mut faces = vec![false; self.faces.len()];
        let mut points = vec![false; self.positions.len()];
        let mut tets = vec![false; self.tets.len()];
        let mut found = false;
        for named in &self.named {
            if !named.name.eq_ignore_ascii_case(name) {
                continue;
            }
            let flags = [&mut faces, &mut points, &mut tets];
            for (flags, members) in
                flags
                    .into_iter()
                    .zip([&named.faces, &named.points, &named.tets])
            {
                for &member in members {
                    flags[member as usize] = true;
                    found = true;
                }
            }
        }
        let format = |reason: String| ImportError::format(path, &reason);
        if !found {
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
        let count = self.positions.len();
        let corners = self
            .faces
            .iter()
            .flatten()
            .chain(self.tets.iter().flatten());
        if let Some(node) = corners.copied().find(|&node| node as usize >= count) {
            return Err(format(format!(
                "an element names node {node}, but there are {count} nodes"
            )));
        }
        let broken = |p: &[f64; 3]| p.iter().any(|x| !x.is_finite());
        if let Some(node) = self.positions.iter().position(broken) {
            return Err(format(format!(
                "node {node} has a coordinate that is no number, so that its names have no place"
            )));
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

    /// Whether it has tetrahedra.
    pub fn has_tets(&self) -> bool {
        !self.cells.is_empty()
    }

    /// Whether a tetrahedron with this centroid, mm, belongs to it.
    pub fn holds_tet(&self, centroid: [f64; 3]) -> bool {
        let [x, y, z] = key(centroid);
        // The neighbours too: rounding may go the other way.
        (-1..=1).any(|i| {
            (-1..=1).any(|j| {
                (-1..=1).any(|k| {
                    let near = [(x, i), (y, j), (z, k)].map(|(at, by)| at.saturating_add(by));
                    self.cells.contains(&near)
                })
            })
        })
    }
}

/// Faces of one tetrahedron alone, outward: where the names of points are looked up in a file without triangles.
pub(super) fn boundary(tets: &[[u32; 4]]) -> Vec<[u32; 3]> {
    let faces = |&[a, b, c, d]: &[u32; 4]| [[a, c, b], [a, b, d], [a, d, c], [b, c, d]];
    let mut uses: HashMap<[u32; 3], u32> = HashMap::new();
    for face in tets.iter().flat_map(faces) {
        *uses.entry(sorted(face)).or_default() += 1;
    }
    let alone = |face: &[u32; 3]| uses[&sorted(*face)] == 1;
    tets.iter().flat_map(faces).filter(alone).collect()
}

/// A triangle's nodes, ascending: the same for both of its sides.
pub(super) fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}
