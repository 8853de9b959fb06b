//! Baselines on box phantoms: what they must reproduce exactly, and that they stay near the solver.

use super::*;
use crate::linear::{Lame, LinearElastic};
use crate::mesh::{Boundary, Mesh, box_phantom};
use crate::schemes::FRAME_S;
use crate::solver::{ContactNode, Solver, SolverOptions};

fn box_of(cells: [usize; 3]) -> Mesh {
    box_phantom([60.0, 60.0, 40.0], cells).unwrap()
}

/// Top nodes within `radius` mm of the middle of the top.
fn patch(mesh: &Mesh, radius: f32) -> Vec<u32> {
    (0..mesh.node_count() as u32)
        .filter(|&n| {
            let p = mesh.positions[n as usize];
            p[2] > 39.9 && (p[0] - 30.0).hypot(p[1] - 30.0) <= radius
        })
        .collect()
}

#[test]
fn zero_and_copy_keep_contact_nodes() {
    let mut out = vec![[9.0; 3]; 4];
    predict_zero(&[2], &[[1.0, 2.0, 3.0]], &mut out);
    assert_eq!(out, [[0.0; 3], [0.0; 3], [1.0, 2.0, 3.0], [0.0; 3]]);
    let last = vec![[1.0; 3]; 4];
    copy_last(&last, &[0], &[[5.0; 3]], &mut out);
    assert_eq!(out, [[5.0; 3], [1.0; 3], [1.0; 3], [1.0; 3]]);
}

#[test]
fn the_decay_of_a_geometric_sequence_is_found() {
    let mut fit = DecayFit::default();
    assert_eq!(fit.decay(), None);
    let field = vec![[1.0, -2.0, 0.5]; 3];
    let after: Vec<[f32; 3]> = field.iter().map(|u| u.map(|x| 0.7 * x)).collect();
    fit.add(&field, &after);
    assert!((fit.decay().unwrap() - 0.7).abs() < 1e-6);
}

#[test]
fn quasi_static_steps_equal_the_linear_response_then_decay() {
    let mesh = box_of([6, 6, 4]);
    let lame = Lame::from_young(3000.0, 0.49).unwrap();
    let nodes = patch(&mesh, 11.0);
    let vectors: Vec<[f32; 3]> = nodes
        .iter()
        .map(|&n| [0.2, 0.01 * n as f32, -3.0])
        .collect();
    let held = mesh.held_nodes(Boundary::Fixed);
    let elastic = LinearElastic::new(&mesh, &held, &nodes, lame, 1).unwrap();
    let (expected, _) = elastic.response(&nodes, &vectors).unwrap();

    let mut method = LinearQuasiStatic::new(&mesh, Boundary::Fixed, lame, 0.5, 1).unwrap();
    let mut out = vec![[0.0; 3]; mesh.node_count()];
    method.step(&nodes, &vectors, &mut out).unwrap();
    for (a, b) in out.iter().flatten().zip(expected.iter().flatten()) {
        assert!((a - b).abs() < 2e-5, "{a} against {b}");
    }
    assert!(method.last_times().0 >= method.last_times().1);
    let pressed = out.clone();
    method.step(&[], &[], &mut out).unwrap();
    for (a, b) in out.iter().flatten().zip(pressed.iter().flatten()) {
        assert_eq!(*a, 0.5 * b);
    }
    let before = out.clone();
    assert!(method.step(&held[..1], &[[1.0; 3]], &mut out).is_err());
    assert!(method.step(&nodes, &[], &mut out).is_err());
    assert_eq!(out, before);
    method.reset();
    method.step(&[], &[], &mut out).unwrap();
    // At rest, but for the rounding of f32 positions.
    assert!(out.iter().flatten().all(|&u| u.abs() < 1e-5));
}

#[test]
fn an_embedding_reproduces_linear_fields_inside() {
    let (coarse, fine) = (box_of([3, 3, 2]), box_of([7, 6, 5]));
    let embedding = Embedding::new(&coarse, &fine).unwrap();
    let linear = |p: &[f32; 3]| [p[0] - 2.0 * p[1], 0.5 * p[2] + 1.0, p[0] + p[1] + p[2]];
    let field: Vec<[f32; 3]> = coarse.positions.iter().map(linear).collect();
    let mut out = vec![[0.0; 3]; fine.node_count()];
    embedding.interpolate(&field, &mut out);
    for (found, position) in out.iter().zip(&fine.positions) {
        for (a, b) in found.iter().zip(linear(position)) {
            assert!((a - b).abs() < 1e-3, "{found:?} at {position:?}");
        }
    }
}

#[test]
fn coarse_tled_on_the_same_mesh_is_the_solver() {
    let mesh = box_of([4, 4, 3]);
    let options = SolverOptions::default();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options.clone()).unwrap();
    let mut method = CoarseTled::new(&mesh, &mesh, Boundary::Fixed, options).unwrap();
    let nodes = patch(&mesh, 16.0);
    let (mut truth, mut found) = (
        vec![[0.0; 3]; mesh.node_count()],
        vec![[0.0; 3]; mesh.node_count()],
    );
    for frame in 1..=4 {
        let vectors = vec![[0.0, 0.1, -0.5 * frame as f32]; nodes.len()];
        let contact: Vec<ContactNode> = nodes
            .iter()
            .zip(&vectors)
            .map(|(&node, &displacement)| ContactNode { node, displacement })
            .collect();
        solver.step_frame(&contact, FRAME_S).unwrap();
        solver.displacement(&mut truth);
        method.step(&nodes, &vectors, &mut found).unwrap();
    }
    assert!(truth.iter().flatten().any(|u| u.abs() > 1.0));
    for (a, b) in truth.iter().flatten().zip(found.iter().flatten()) {
        assert!((a - b).abs() < 1e-4, "{a} against {b}");
    }
    assert!(!method.last_time().is_zero());
}

#[test]
fn a_patch_between_coarse_nodes_still_moves_the_coarse_mesh() {
    let (coarse, fine) = (box_of([2, 2, 2]), box_of([13, 13, 6]));
    let mut method =
        CoarseTled::new(&coarse, &fine, Boundary::Fixed, SolverOptions::default()).unwrap();
    let node = (0..fine.node_count() as u32)
        .find(|&n| {
            let p = fine.positions[n as usize];
            p[2] > 39.9 && (p[0] - 13.8).abs() < 1.0 && (p[1] - 13.8).abs() < 1.0
        })
        .unwrap();
    let mut out = vec![[0.0; 3]; fine.node_count()];
    method.step(&[node], &[[0.0, 0.0, -2.0]], &mut out).unwrap();
    assert_eq!(out[node as usize], [0.0, 0.0, -2.0]);
    assert!(out.iter().filter(|u| u[2] < -0.05).count() > 20);
    method.reset();
    method.step(&[], &[], &mut out).unwrap();
    // At rest, but for the rounding of f32 positions.
    assert!(out.iter().flatten().all(|&u| u.abs() < 1e-5));
}
