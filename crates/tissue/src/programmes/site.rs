//! Where a programme goes to work: a face of the domain, with the mean normal of what the tool will cover.

use crate::mesh::{FaceAdjacency, Mesh, face_area, face_centroid, face_normal, face_values};
use contact::Vector;

/// The touchable surface, ready to draw sites from.
pub(super) struct Sites {
    centroids: Vec<Vector>,
    /// Times the area.
    normals: Vec<Vector>,
    /// Faces with an edge that no other face of the domain has.
    border: Vec<usize>,
}

/// A site and the frame that motion is expressed in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Site {
    pub at: Vector,
    /// Mean outward normal over the faces within reach.
    pub outward: Vector,
}

impl Sites {
    pub fn new(mesh: &Mesh) -> Self {
        let faces: Vec<[u32; 3]> = mesh
            .domain
            .iter()
            .map(|row| mesh.surface[*row as usize])
            .collect();
        let vector = |v: [f64; 3]| Vector::from(v.map(|x| x as f32));
        let adjacency = FaceAdjacency::new(&faces);
        let border = (0..faces.len()).filter(|face| adjacency.of(*face).len() < 3);
        Self {
            centroids: face_values(&faces, |f| vector(face_centroid(&mesh.positions, f))),
            normals: face_values(&faces, |f| {
                vector(face_normal(&mesh.positions, f)) * face_area(&mesh.positions, f) as f32
            }),
            border: border.collect(),
        }
    }

    /// The site of a draw in [0, 1); faces within `reach` decide its normal.
    pub fn draw(&self, unit: f64, border: bool, reach: f32) -> Option<Site> {
        let among = if border {
            self.border.len()
        } else {
            self.centroids.len()
        };
        let at = (unit * among as f64) as usize;
        let face = if border { *self.border.get(at)? } else { at };
        self.at(face, reach)
    }

    /// The site whose distance from another is nearest to `distance`.
    pub fn beside(&self, from: Vector, distance: f32, turn: f64, reach: f32) -> Option<Site> {
        let mut rows: Vec<(f32, usize)> = self
            .centroids
            .iter()
            .enumerate()
            .map(|(face, at)| (((*at - from).length() - distance).abs(), face))
            .filter(|(off, _)| *off < 3.0)
            .collect();
        rows.sort_by_key(|(_, face)| *face);
        let (_, face) = rows.get((turn * rows.len() as f64) as usize)?;
        self.at(*face, reach)
    }

    fn at(&self, face: usize, reach: f32) -> Option<Site> {
        let at = *self.centroids.get(face)?;
        let near = self.centroids.iter().zip(&self.normals);
        let sum: Vector = near
            .filter(|(c, _)| (**c - at).length() <= reach)
            .map(|(_, normal)| *normal)
            .sum();
        let outward = sum.try_normalize()?;
        Some(Site { at, outward })
    }
}
