//! The runtime's reaction forces against those of the reference solver, on the same displacement.

use tissue::mesh::{Boundary, box_phantom};
use tissue::solver::{ContactNode, Solver, SolverOptions};
use upt::forces::ReactionForces;

/// Verifies REQ-043.
#[test]
fn reaction_equals_the_reference_solvers() {
    let mut mesh = box_phantom([40.0, 40.0, 24.0], [10, 10, 6]).unwrap();
    // A stiff half, so that the elements' own moduli take part.
    mesh.stiffness = (mesh.tets.iter())
        .map(|tet| {
            let x: f32 = tet.iter().map(|&n| mesh.positions[n as usize][0]).sum();
            if x < 4.0 * 18.0 { 5.0 } else { 1.0 }
        })
        .collect();
    let nodes: Vec<u32> = (0..mesh.node_count() as u32)
        .filter(|&i| {
            let [x, y, z] = mesh.positions[i as usize];
            z > 23.9 && (x - 20.0).hypot(y - 20.0) < 9.0
        })
        .collect();
    assert!(nodes.len() > 8);
    let options = SolverOptions::default();
    let material = options.material;
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options).unwrap();
    let mut forces = ReactionForces::new(mesh.tetrahedra(), &nodes, material.moduli()).unwrap();
    let mut displacement = vec![[0.0; 3]; mesh.node_count()];
    let mut reaction = vec![0.0; 3 * nodes.len()];
    for frame in 1..=6 {
        let push = [0.3 * frame as f32, 0.1, -0.9 * frame as f32];
        let contact: Vec<ContactNode> = nodes
            .iter()
            .map(|&node| ContactNode {
                node,
                displacement: push,
            })
            .collect();
        let report = solver.step_frame(&contact, 0.05).unwrap();
        solver.displacement(&mut displacement);
        let used = forces
            .reaction(displacement.as_flattened(), &nodes, &mut reaction)
            .unwrap();
        assert_eq!(used.inverted, 0);
        let want = report.reaction.as_flattened();
        let size = want.iter().map(|f| f.abs()).fold(0.0, f32::max);
        let error = want
            .iter()
            .zip(&reaction)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max);
        println!("frame {frame}: largest force {size:.1} mN, error {error:.2e} mN");
        assert!(
            size > 1.0 && error < 2e-3 * size,
            "frame {frame}: {error:e} of {size:e}"
        );
        // The tissue resists the push.
        let total: f32 = reaction.chunks_exact(3).map(|f| f[2]).sum();
        assert!(total > 0.0);
    }
}
