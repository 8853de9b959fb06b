//! A ball pressed into a block against CalculiX's node-to-surface contact: same mesh, elements, law and ball, contact
//! at nodes alone on both sides (fixture: tests/fixtures/make_calculix_contact.py).

use contact::{Pose, Rotation, Samples, Shape, Vector};
use safetensors::SafeTensors;
use tissue::mesh::{Boundary, box_phantom};
use tissue::solver::{Solver, SolverOptions, Tool, ToolPose};
use tissue::tensors::f32_values;

#[test]
fn a_pressed_ball_agrees_with_calculix() {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/fixtures/calculix-contact.safetensors"
    );
    let bytes = std::fs::read(path).unwrap();
    let file = SafeTensors::deserialize(&bytes).unwrap();
    let vectors = |name: &str| -> Vec<[f32; 3]> {
        let values: Vec<f32> = f32_values(file.tensor(name).unwrap().data()).collect();
        values.as_chunks().0.to_vec()
    };
    let at = |name: &str| Vector::from(vectors(name)[0]);
    let mesh = box_phantom([40.0, 40.0, 20.0], [10, 10, 5]).unwrap();
    let mut options = SolverOptions::default();
    // The static end is the same for any damping; 40 /s gets there soon.
    options.material.damping_per_s = 40.0;
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options).unwrap();
    // A spacing longer than any edge: nodes alone, as CalculiX has them.
    let samples = Samples::of_domain(
        &mesh.positions,
        &mesh.surface,
        &mesh.domain,
        &mesh.fixed,
        1e3,
    );
    let ball = Tool {
        shape: Shape::Hull {
            points: vectors("points"),
            margin: 0.0,
        },
        friction: 0.0,
        tear_off_mn: 0.0,
    };
    let (start, end) = (at("start"), at("end"));
    let pose = |at: Vector| Pose::from_parts(at, Rotation::IDENTITY);
    solver.set_tools(samples, &[ball], &[pose(start)]).unwrap();
    let mut force = Vector::ZERO;
    for frame in 1..=24 {
        let part = (frame as f32 / 8.0).min(1.0);
        let to = ToolPose {
            pose: pose(start + (end - start) * part),
            grasp: false,
        };
        let report = solver.step_tools(&[], &[to], 0.05).unwrap();
        force = Vector::from(report.tools[0].force);
    }
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut u);
    let expected = vectors("displacement");
    let apart = u.iter().zip(&expected);
    let worst = apart
        .map(|(a, b)| (Vector::from(*a) - Vector::from(*b)).length())
        .fold(0.0, f32::max);
    let off = (force - at("force")).length() / at("force").length();
    println!("CalculiX: displacement {worst:.2e} mm at most, force {off:.2e} (relative)");
    // CalculiX lets nodes sink in by pressure over its stiffness, some 1e-5 mm.
    assert!(worst < 5e-4, "{worst} mm");
    assert!(off < 2e-4, "{force} mN, CalculiX {}", at("force"));
}
