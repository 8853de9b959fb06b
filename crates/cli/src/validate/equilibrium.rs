//! Forces of a body in an equilibrium, and the nodes of its ends.

use elements::{Material, Tetrahedron};
use tissue::mesh::Mesh;

/// Forces of the elements on the nodes, mN.
pub fn forces(mesh: &Mesh, material: &Material, u: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut out = vec![[0.0; 3]; mesh.node_count()];
    for (at, corners) in mesh.tets.iter().enumerate() {
        let rest = corners.map(|node| mesh.positions[node as usize].map(f64::from));
        let element = Tetrahedron::new(*corners, rest, f64::from(mesh.stiffness_of(at)))
            .along(mesh.laws().fibre_of(at));
        let state = element.deformation(corners.map(|node| u[node as usize]));
        for (node, force) in corners
            .iter()
            .zip(element.forces(&state, material.moduli()))
        {
            for k in 0..3 {
                out[*node as usize][k] += 1e-3 * force[k];
            }
        }
    }
    out
}

/// Nodes of the planes across z at both ends.
pub fn ends(mesh: &Mesh, length: f32) -> [Vec<u32>; 2] {
    let on = |z: f32| {
        let nodes = mesh.positions.iter().enumerate();
        let near = nodes.filter(move |(_, p)| (p[2] - z).abs() < 1e-3 * length);
        near.map(|(node, _)| node as u32).collect()
    };
    [on(0.0), on(length)]
}
