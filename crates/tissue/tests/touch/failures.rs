//! What is refused, and by which words.

use crate::bench::{TOP, block, level, solver, sphere};
use contact::{Pose, Rotation, Shape, Vector};
use tissue::mesh::Boundary;
use tissue::solver::{Tool, ToolPose};

#[test]
fn a_tool_that_starts_deep_in_the_tissue_is_refused() {
    let mesh = block();
    let mut solver = solver(&mesh, 1, 20.0);
    let mut place = |shape: Shape, at: Vector| {
        let tool = Tool {
            shape,
            friction: 0.0,
            tear_off_mn: 0.0,
        };
        let samples = mesh.samples(Boundary::Fixed);
        solver
            .set_tools(samples, &[tool], &[level(at)])
            .map_err(|error| error.to_string())
    };
    let ball = Shape::Sphere { radius: 4.0 };
    let deep = place(ball.clone(), TOP + Vector::Z * 2.0).unwrap_err();
    assert!(
        deep.starts_with("tools[0]: starts 2.00 mm deep in the tissue"),
        "{deep}"
    );
    // Wholly inside no sample is touched.
    let inside = place(Shape::Sphere { radius: 2.0 }, TOP - Vector::Z * 9.0).unwrap_err();
    assert!(inside.contains("lies in element"), "{inside}");
    // A shaft whose tip has come out again on another side.
    let shaft = Shape::Capsule {
        half_length: 30.0,
        radius: 2.0,
    };
    let through = place(shaft, TOP - Vector::Z * 10.0).unwrap_err();
    assert!(through.contains("lies in element"), "{through}");
    place(ball, TOP + Vector::Z * 3.7).unwrap();
}

#[test]
fn bad_tools_and_poses_are_named() {
    let mesh = block();
    let mut solver = solver(&mesh, 1, 20.0);
    let samples = mesh.samples(Boundary::Fixed);
    let above = level(TOP + Vector::Z * 8.0);
    let mut refuse = |tool: Tool, pose: Pose| {
        solver
            .set_tools(samples.clone(), &[sphere(1.0, 0.0), tool], &[above, pose])
            .unwrap_err()
            .to_string()
    };
    let error = refuse(sphere(-1.0, 0.0), above);
    assert_eq!(
        error,
        "tools[1]: radius is -1 mm; it must be a length above 0 mm"
    );
    let error = refuse(sphere(1.0, -0.5), above);
    assert!(error.starts_with("tools[1]: `friction` is -0.5"), "{error}");
    let nowhere = Pose::from_parts(Vector::NAN, Rotation::IDENTITY);
    assert_eq!(
        refuse(sphere(1.0, 0.0), nowhere),
        "tools[1]: the pose is not finite"
    );
    let twice = Rotation::from_array([0.0, 0.0, 0.0, 2.0]);
    let skewed = Pose::from_parts(above.translation, twice);
    let error = refuse(sphere(1.0, 0.0), skewed);
    assert!(
        error.starts_with("tools[1]: the rotation has length 2"),
        "{error}"
    );
    let to = ToolPose {
        pose: above,
        grasp: false,
    };
    let error = solver.step_tools(&[], &[to], 0.05).unwrap_err();
    assert!(
        error.to_string().starts_with("1 poses for 0 tools"),
        "{error}"
    );
}

#[test]
fn a_frame_that_fails_leaves_tissue_and_tools_as_they_were() {
    let mesh = block();
    let mut solver = solver(&mesh, 1, 20.0);
    let start = level(TOP + Vector::Z * 6.2);
    let samples = mesh.samples(Boundary::Fixed);
    solver
        .set_tools(samples, &[sphere(6.0, 0.3)], &[start])
        .unwrap();
    let to = |z: f32| ToolPose {
        pose: level(TOP + Vector::Z * z),
        grasp: false,
    };
    solver.step_tools(&[], &[to(5.0)], 0.05).unwrap();
    let mut twin = Vec::new();
    for broken in [false, true] {
        let mut solver = self::solver(&mesh, 1, 20.0);
        let samples = mesh.samples(Boundary::Fixed);
        solver
            .set_tools(samples, &[sphere(6.0, 0.3)], &[start])
            .unwrap();
        solver.step_tools(&[], &[to(5.0)], 0.05).unwrap();
        if broken {
            // Through the whole block within a frame.
            let error = solver.step_tools(&[], &[to(-14.0)], 0.05).unwrap_err();
            assert!(error.to_string().contains("inverted"), "{error}");
        }
        let report = solver.step_tools(&[], &[to(4.5)], 0.05).unwrap();
        let mut u = vec![[0.0; 3]; mesh.node_count()];
        solver.displacement(&mut u);
        twin.push((u, report.tools, report.sample_forces));
    }
    assert!(twin[0] == twin[1]);
}
