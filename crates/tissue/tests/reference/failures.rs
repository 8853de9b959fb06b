//! Loads and settings that cannot work: typed errors, state unchanged.

use tissue::material::Material;
use tissue::mesh::{Boundary, box_phantom};
use tissue::solver::{ContactNode, Solver, SolverError, SolverOptions, Substep};

fn all_at(nodes: &[u32], displacement: [f32; 3]) -> Vec<ContactNode> {
    nodes
        .iter()
        .map(|node| ContactNode {
            node: *node,
            displacement,
        })
        .collect()
}

#[test]
fn an_impossible_push_is_an_inverted_element_and_the_state_stays() {
    let mesh = box_phantom([30.0; 3], [4; 3]).unwrap();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, SolverOptions::default()).unwrap();
    let top: Vec<u32> = (0..mesh.node_count() as u32)
        .filter(|n| mesh.positions[*n as usize][2] > 29.9)
        .collect();
    solver
        .step_frame(&all_at(&top, [1.0, 0.0, -2.0]), 0.05)
        .unwrap();
    let mut before = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut before);
    // The top pushed through the bottom.
    let error = solver
        .step_frame(&all_at(&top, [0.0, 0.0, -36.0]), 0.05)
        .unwrap_err();
    match &error {
        SolverError::Inverted {
            time_s,
            element,
            det_f,
            ..
        } => {
            assert!(*time_s > 0.05 && *time_s < 0.1);
            assert!(*element < mesh.tets.len());
            assert!(*det_f <= 0.05, "{det_f}");
        }
        other => panic!("{other}"),
    }
    assert!(error.to_string().contains("push less"));
    let mut after = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut after);
    assert_eq!(before, after);
    assert_eq!(solver.time_s(), 0.05);
    solver
        .step_frame(&all_at(&top, [1.0, 0.0, -2.5]), 0.05)
        .expect("goes on from the last good state");
}

#[test]
fn a_step_above_the_critical_one_can_be_refused() {
    let mesh = box_phantom([20.0; 3], [10; 3]).unwrap();
    let options = SolverOptions {
        inner_step_s: 2e-3,
        substep: Substep::Refuse,
        ..SolverOptions::default()
    };
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options).unwrap();
    let error = solver.step_frame(&[], 0.05).unwrap_err();
    assert!(matches!(error, SolverError::StepTooLong { .. }), "{error}");
}

/// The estimate is right: just below it the body is stable, half above it is not.
#[test]
fn the_estimated_critical_step_is_where_stability_ends() {
    let mesh = box_phantom([20.0; 3], [5; 3]).unwrap();
    let critical = Solver::new(&mesh, Boundary::Fixed, SolverOptions::default())
        .unwrap()
        .critical_step_at_rest_s();
    let run = |factor: f64| {
        let mut options = SolverOptions {
            inner_step_s: factor * critical,
            safety: 10.0,
            substep: Substep::Refuse,
            ..SolverOptions::default()
        };
        options.material.damping_per_s = 0.0;
        let mut solver = Solver::new(&mesh, Boundary::Fixed, options).unwrap();
        let face = mesh.surface[mesh.domain[20] as usize];
        let mut nodes = face.to_vec();
        nodes.sort_unstable();
        solver
            .step_frame(&all_at(&nodes, [0.0, 0.0, -0.01]), 0.05)
            .and_then(|_| solver.step_frame(&[], 0.4))
    };
    assert!(run(0.97).is_ok());
    assert!(run(1.05).is_err());
}

#[test]
fn contact_and_material_faults_are_named() {
    let mesh = box_phantom([20.0; 3], [2; 3]).unwrap();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, SolverOptions::default()).unwrap();
    let far = mesh.node_count() as u32;
    let cases = [
        (vec![far], "no such node"),
        (vec![20, 19], "ascending"),
        (vec![mesh.fixed[0]], "held"),
    ];
    for (nodes, word) in cases {
        let error = solver
            .step_frame(&all_at(&nodes, [0.0; 3]), 0.05)
            .unwrap_err();
        assert!(error.to_string().contains(word), "{error}");
    }
    let error = solver
        .step_frame(&all_at(&[20], [f32::NAN, 0.0, 0.0]), 0.05)
        .unwrap_err();
    assert!(error.to_string().contains("not finite"), "{error}");
    let options = SolverOptions {
        material: Material {
            poisson: 0.5,
            ..Material::default()
        },
        ..SolverOptions::default()
    };
    let Err(error) = Solver::new(&mesh, Boundary::Fixed, options) else {
        panic!("nu = 0.5 was accepted");
    };
    assert!(error.to_string().contains("poisson"), "{error}");
}
