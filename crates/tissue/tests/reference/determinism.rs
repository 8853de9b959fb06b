//! The same bits for any number of threads; the same answer on any instruction set.

use contact::{End, Spring, Tie, TiePoint, Vector};
use tissue::mesh::{Boundary, box_phantom};
use tissue::solver::{
    ContactNode, FrameReport, Isa, Loads, Pressure, Solver, SolverOptions, SurfacePressure,
};

fn march(threads: usize, isa: Option<Isa>, pressure: Pressure) -> (Vec<[f32; 3]>, FrameReport) {
    // Six chunks, so that threads really share nodes.
    let mesh = box_phantom([60.0; 3], [12; 3]).unwrap();
    let options = SolverOptions {
        threads,
        isa,
        pressure,
        ..SolverOptions::default()
    };
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options).unwrap();
    let mut nodes: Vec<u32> = mesh.domain[100..140]
        .iter()
        .flat_map(|row| mesh.surface[*row as usize])
        .collect();
    nodes.sort_unstable();
    nodes.dedup();
    let loads = Loads {
        gravity: [2000.0, 0.0, 0.0],
        pressures: vec![SurfacePressure {
            faces: mesh.domain[..200].to_vec(),
            pascal: 40.0,
            walls: false,
        }],
        ..Loads::default()
    };
    solver.set_loads(&loads).unwrap();
    // A thread from the block's farthest corner.
    let corner = mesh.node_count() as u32 - 1;
    let point = TiePoint {
        nodes: [corner; 3],
        weights: [1.0, 0.0, 0.0],
    };
    let spring = Spring {
        stiffness: 50.0,
        ..Spring::default()
    };
    let end = Vector::from(mesh.positions[corner as usize]) + Vector::Z;
    let tie = Tie {
        point,
        end: End::World(end),
        spring,
        break_mn: 0.0,
    };
    solver.set_ties(&[tie]).unwrap();
    let mut report = None;
    for frame in 1..=3 {
        let contact: Vec<ContactNode> = nodes
            .iter()
            .map(|node| ContactNode {
                node: *node,
                displacement: [0.5 * frame as f32, 0.0, -1.5 * frame as f32],
            })
            .collect();
        report = Some(solver.step_frame(&contact, 0.02).unwrap());
    }
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut u);
    (u, report.unwrap())
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    for pressure in [Pressure::Element, Pressure::AverageNodal] {
        let (alone, report) = march(1, None, pressure);
        assert!(alone.iter().flatten().any(|v| v.abs() > 1.0));
        for threads in [2, 3, 5] {
            let (together, other) = march(threads, None, pressure);
            let bits = |u: &[[f32; 3]]| {
                u.as_flattened()
                    .iter()
                    .map(|v| v.to_bits())
                    .collect::<Vec<_>>()
            };
            assert!(bits(&alone) == bits(&together), "{threads} threads");
            assert_eq!(report, other);
        }
    }
}

#[test]
fn every_instruction_set_gives_the_scalar_answer() {
    for pressure in [Pressure::Element, Pressure::AverageNodal] {
        let (reference, scalar) = march(1, Some(Isa::Scalar), pressure);
        for isa in Isa::available() {
            let (found, report) = march(1, Some(isa), pressure);
            let worst = found
                .as_flattened()
                .iter()
                .zip(reference.as_flattened())
                .fold(0.0f32, |m, (a, b)| m.max((a - b).abs()));
            assert!(worst < 1e-4, "{isa:?} is off by {worst} mm");
            assert!((report.strain_energy / scalar.strain_energy - 1.0).abs() < 1e-5);
        }
    }
}
