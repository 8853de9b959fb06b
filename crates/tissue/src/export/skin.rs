//! The surface of a deformed mesh by itself, with normals.

use crate::mesh::Mesh;

/// Surface vertices and triangles, renumbered to the vertices in use.
pub(super) struct Skin {
    /// `[V, 3]` mm, deformed.
    pub positions: Vec<[f32; 3]>,
    /// `[V, 3]` mm.
    pub displacement: Vec<[f32; 3]>,
    /// `[V, 3]` unit outward, the mean of the faces' area vectors.
    pub normals: Vec<[f32; 3]>,
    /// `[F, 3]`.
    pub faces: Vec<[u32; 3]>,
}

impl Skin {
    pub fn new(mesh: &Mesh, displacement: &[[f32; 3]]) -> Self {
        let mut nodes: Vec<u32> = mesh.surface.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let moved = |&node: &u32| {
            let (p, u) = (mesh.positions[node as usize], displacement[node as usize]);
            [0, 1, 2].map(|k| p[k] + u[k])
        };
        let positions: Vec<[f32; 3]> = nodes.iter().map(moved).collect();
        let row = |node: u32| nodes.partition_point(|&other| other < node) as u32;
        let faces: Vec<[u32; 3]> = mesh.surface.iter().map(|face| face.map(row)).collect();
        let mut sums = vec![[0.0f64; 3]; positions.len()];
        for &face in &faces {
            let normal = crate::mesh::face_normal(&positions, face);
            let area = crate::mesh::face_area(&positions, face);
            for vertex in face {
                for k in 0..3 {
                    sums[vertex as usize][k] += area * normal[k];
                }
            }
        }
        let unit = |v: &[f64; 3]| {
            let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
            v.map(|x| (x / length.max(f64::MIN_POSITIVE)) as f32)
        };
        Self {
            normals: sums.iter().map(unit).collect(),
            displacement: nodes
                .iter()
                .map(|&node| displacement[node as usize])
                .collect(),
            positions,
            faces,
        }
    }
}
