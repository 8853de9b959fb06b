//! Forces, friction, penetration and energy.

use crate::bench::{TOP, block, drive, largest, level, solver, sphere};
use contact::{Shape, Vector};
use tissue::mesh::Boundary;
use tissue::solver::{Tool, ToolPose};

/// From 0.2 mm above the top, `depth` down within `frames`, then still.
fn press(radius: f32, depth: f32, frames: usize, still: usize) -> Vec<(Vector, bool)> {
    let above = radius + 0.2;
    (1..=frames + still)
        .map(|frame| {
            let part = frame.min(frames) as f32 / frames as f32;
            (TOP + Vector::Z * (above - (0.2 + depth) * part), false)
        })
        .collect()
}

#[test]
fn a_pressed_sphere_feels_the_tissue_and_hardly_sinks_into_it() {
    let mesh = block();
    let mut solver = solver(&mesh, 1, 20.0);
    let samples = mesh.samples(Boundary::Fixed);
    let tool = [sphere(6.0, 0.0)];
    solver
        .set_tools(samples, &tool, &[level(TOP + Vector::Z * 6.2)])
        .unwrap();
    let reports = drive(&mut solver, press(6.0, 3.0, 8, 6), 0.05);
    let forces: Vec<f32> = reports.iter().map(|r| r.tools[0].force[2]).collect();
    // Against the push, larger with depth, without a step back.
    assert!(forces[..8].windows(2).all(|w| w[1] > w[0]), "{forces:?}");
    assert!(forces[7] > 20.0, "{forces:?}");
    let last = &reports[13].tools[0];
    // Straight down on a symmetric block: sideways forces and torque are the mesh's alone.
    let sideways = last.force[0].hypot(last.force[1]);
    assert!(sideways < 0.05 * last.force[2], "{last:?}");
    let torque = last.torque.iter().fold(0.0f32, |m, v| m.max(v.abs()));
    assert!(torque < 0.02 * 6.0 * last.force[2], "{last:?}");
    assert!(last.contacts >= 3);
    for report in &reports {
        let tool = &report.tools[0];
        assert!(tool.penetration_mm < 0.02, "{tool:?}");
        let sum = report.sample_forces.iter().map(|s| s.force[2]).sum::<f32>();
        assert!((sum + tool.force[2]).abs() < 1e-3 * sum.abs() + 1e-6);
        // Unilateral: nothing is pulled.
        assert!(report.sample_forces.iter().all(|s| s.force[2] <= 0.0));
    }
    // At rest the force is that of equilibrium: it no longer changes.
    assert!(
        (forces[13] - forces[12]).abs() < 0.01 * forces[13],
        "{forces:?}"
    );
    assert!(largest(&solver, &mesh) > 2.8);
}

/// A needle of half a millimetre comes down between the samples, 0.6 mm beside the middle, and pushes as the tissue does at any point.
#[test]
fn a_needle_does_not_pass_between_the_samples() {
    let mesh = block();
    let mut solver = solver(&mesh, 1, 20.0);
    let needle = Tool {
        shape: Shape::Capsule {
            half_length: 20.0,
            radius: 0.25,
        },
        friction: 0.0,
        tear_off_mn: 0.0,
    };
    // Its shaft is along y: upright on the block.
    let upright = contact::Rotation::from_rotation_x(std::f32::consts::FRAC_PI_2);
    let pose = |depth: f32| {
        let at = TOP + Vector::new(0.6, 0.4, 20.25 - depth);
        contact::Pose::from_parts(at, upright)
    };
    let samples = mesh.samples(Boundary::Fixed);
    solver.set_tools(samples, &[needle], &[pose(-0.2)]).unwrap();
    let mut last = 0.0;
    for frame in 1..=8 {
        let to = ToolPose {
            pose: pose(0.375 * frame as f32),
            grasp: false,
        };
        let report = solver.step_tools(&[], &[to], 0.05).unwrap();
        let tool = &report.tools[0];
        assert!(tool.penetration_mm < 0.6, "frame {frame}: {tool:?}");
        last = tool.force[2];
    }
    assert!(last > 5.0, "{last} mN");
    assert!(largest(&solver, &mesh) > 2.0);
}

#[test]
fn a_frictionless_press_and_release_gives_no_energy() {
    let mesh = block();
    let mut solver = solver(&mesh, 1, 0.0);
    let samples = mesh.samples(Boundary::Fixed);
    let start = level(TOP + Vector::Z * 6.2);
    solver
        .set_tools(samples, &[sphere(6.0, 0.0)], &[start])
        .unwrap();
    let mut path = press(6.0, 3.0, 6, 2);
    path.extend(press(6.0, 3.0, 6, 0).into_iter().rev());
    path.extend((0..4).map(|_| (TOP + Vector::Z * 10.0, false)));
    let reports = drive(&mut solver, path, 0.05);
    let most = reports.iter().map(|r| r.strain_energy).fold(0.0, f64::max);
    assert!(most > 0.02, "{most} mJ is a real load");
    for (frame, report) in reports.iter().enumerate() {
        let energy = report.strain_energy + report.kinetic_energy;
        // What the body has, contact brought; and what contact brought, the tool spent.
        assert!(
            (report.external_work - energy).abs() < 0.01 * most,
            "frame {frame}: work {} mJ, energy {energy} mJ",
            report.external_work
        );
        assert!(
            energy <= report.tools[0].work + 0.005 * most,
            "frame {frame}: tool {} mJ, energy {energy} mJ",
            report.tools[0].work
        );
    }
}

#[test]
fn a_sliding_tool_drags_with_mu_times_its_load_and_a_slow_one_sticks() {
    let mesh = block();
    for friction in [0.1f32, 0.3] {
        let mut solver = solver(&mesh, 1, 20.0);
        let samples = mesh.samples(Boundary::Fixed);
        let start = TOP + Vector::new(-6.0, 0.0, 6.2);
        solver
            .set_tools(samples, &[sphere(6.0, friction)], &[level(start)])
            .unwrap();
        let mut path: Vec<(Vector, bool)> = (1..=6)
            .map(|i| (start - Vector::Z * (1.7 * i as f32 / 6.0), false))
            .collect();
        path.extend((1..=12).map(|i| {
            let along = Vector::new(i as f32, 0.0, -1.7);
            (start + along, false)
        }));
        let reports = drive(&mut solver, path, 0.05);
        let last = &reports[17].tools[0];
        // Against the motion; each sample drags with mu, on a dent that slopes.
        assert!(last.force[0] < 0.0, "{last:?}");
        for sample in &reports[17].sample_forces {
            assert!(Vector::from(sample.force).length() > 0.0);
        }
        // The reported force is a mean over 2 ms, in whose middle the tool was here.
        let centre = start + Vector::new(12.0 - 0.02, 0.0, -1.7);
        let worst = cone(&reports[17].sample_forces, centre, &mesh, &solver);
        assert!(
            (worst - friction).abs() < 0.02 * friction,
            "mu {friction}: {worst}"
        );
    }
}

/// Sum of tangential over sum of normal forces of the samples of a sphere.
fn cone(
    forces: &[tissue::solver::SampleForce],
    centre: Vector,
    mesh: &tissue::mesh::Mesh,
    solver: &tissue::solver::Solver,
) -> f32 {
    let samples = mesh.samples(Boundary::Fixed);
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut u);
    let position = |n: u32| Vector::from(mesh.positions[n as usize]) + Vector::from(u[n as usize]);
    let (mut across, mut along) = (0.0, 0.0);
    for entry in forces {
        let point = samples.at(entry.sample).gather(position);
        let normal = (point - centre).normalize();
        let force = Vector::from(entry.force);
        let push = force.dot(normal);
        along += push;
        across += (force - normal * push).length();
    }
    across / along
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let mesh = box_of_chunks();
    let run = |threads: usize| {
        let mut solver = solver(&mesh, threads, 20.0);
        let samples = mesh.samples(Boundary::Fixed);
        let tools = [
            sphere(6.0, 0.3),
            Tool {
                shape: Shape::Box {
                    half_extents: [4.0, 4.0, 3.0],
                },
                friction: 0.0,
                tear_off_mn: 0.0,
            },
        ];
        let at = [Vector::new(15.0, 30.0, 66.1), Vector::new(42.0, 30.0, 63.1)];
        solver.set_tools(samples, &tools, &at.map(level)).unwrap();
        let mut reports = Vec::new();
        for frame in 1..=3 {
            let down = Vector::new(0.6, 0.0, -1.2) * frame as f32;
            let poses = at.map(|at| ToolPose {
                pose: level(at + down),
                grasp: frame == 3,
            });
            reports.push(solver.step_tools(&[], &poses, 0.02).unwrap());
        }
        let mut u = vec![[0.0; 3]; mesh.node_count()];
        solver.displacement(&mut u);
        (u, reports)
    };
    let alone = run(1);
    assert!(
        alone.1[2]
            .tools
            .iter()
            .all(|t| t.contacts > 3 && t.held > 0),
        "{:?}",
        alone.1[2].tools
    );
    for threads in [2, 3] {
        assert!(alone == run(threads), "{threads} threads");
    }
}

fn box_of_chunks() -> tissue::mesh::Mesh {
    tissue::mesh::box_phantom([60.0; 3], [12; 3]).unwrap()
}
