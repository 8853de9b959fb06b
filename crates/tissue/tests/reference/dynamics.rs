//! Motion: energy balance, wave speed, free oscillation, convergence under refinement.

use tissue::mesh::{Boundary, Mesh, box_phantom, regular_box};
use tissue::solver::{ContactNode, Pressure, Solver, SolverOptions};

fn top_nodes(mesh: &Mesh, height: f32) -> Vec<u32> {
    (0..mesh.node_count() as u32)
        .filter(|node| mesh.positions[*node as usize][2] > height - 1e-3)
        .collect()
}

fn push(nodes: &[u32], displacement: [f32; 3]) -> Vec<ContactNode> {
    nodes
        .iter()
        .map(|node| ContactNode {
            node: *node,
            displacement,
        })
        .collect()
}

#[test]
fn without_damping_the_work_of_the_contact_is_the_energy_gained() {
    let mesh = box_phantom([40.0; 3], [6; 3]).unwrap();
    let mut options = SolverOptions::default();
    options.material.damping_per_s = 0.0;
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options).unwrap();
    let nodes = top_nodes(&mesh, 40.0);
    let mut scale: f64 = 0.0;
    for frame in 0..12 {
        let part = (frame as f32 + 1.0) / 6.0;
        // Six frames of pushing sideways and down, then free vibration.
        let contact = if frame < 6 {
            push(&nodes, [3.0 * part, 0.0, -2.0 * part])
        } else {
            Vec::new()
        };
        let report = solver.step_frame(&contact, 0.05).unwrap();
        let energy = report.strain_energy + report.kinetic_energy;
        scale = scale.max(energy);
        assert!(
            (report.external_work - energy).abs() < 0.005 * scale,
            "frame {frame}: work {} mJ, energy {energy} mJ",
            report.external_work
        );
    }
    assert!(scale > 0.1, "{scale} mJ is a real load");
}

#[test]
fn damping_only_takes_energy_away_after_a_release() {
    let mesh = box_phantom([40.0; 3], [6; 3]).unwrap();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, SolverOptions::default()).unwrap();
    let nodes = top_nodes(&mesh, 40.0);
    let pushed = solver
        .step_frame(&push(&nodes, [4.0, 0.0, 0.0]), 0.05)
        .unwrap();
    let mut last = pushed.strain_energy + pushed.kinetic_energy;
    for _ in 0..20 {
        let report = solver.step_frame(&[], 0.05).unwrap();
        let energy = report.strain_energy + report.kinetic_energy;
        assert!(energy <= last * 1.0001);
        assert_eq!(report.external_work, pushed.external_work);
        last = energy;
    }
    assert!(last < 1e-3 * pushed.strain_energy);
}

/// nu = 0 makes a bar one-dimensional: `c = sqrt(E / rho)` = 1.732 m/s for 3000 Pa and 1000 kg/m³.
#[test]
fn a_wave_arrives_in_a_bar_when_its_speed_says() {
    let mesh = box_phantom([8.0, 8.0, 160.0], [2, 2, 40]).unwrap();
    let mut options = SolverOptions::default();
    options.material.poisson = 0.0;
    options.material.damping_per_s = 0.0;
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options).unwrap();
    let top = push(&top_nodes(&mesh, 160.0), [0.0, 0.0, -0.2]);
    let distance = 100.0;
    let station: Vec<usize> = (0..mesh.node_count())
        .filter(|i| (mesh.positions[*i][2] - (160.0 - distance)).abs() < 1e-3)
        .collect();
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    let (mut before, mut arrival) = (0.0, None);
    for _ in 0..100 {
        solver.step_frame(&top, 0.001).unwrap();
        solver.displacement(&mut u);
        let mean = station.iter().map(|i| u[*i][2]).sum::<f32>() / station.len() as f32;
        if mean <= -0.1 {
            let part = f64::from((-0.1 - before) / (mean - before));
            arrival = Some(solver.time_s() - 0.001 * (1.0 - part));
            break;
        }
        before = mean;
    }
    // The top is at half its way after 0.5 ms.
    let speed = 1000.0 * (3000.0f64 / 1000.0).sqrt();
    let expected = 0.0005 + f64::from(distance) / speed;
    let found = arrival.expect("the wave never arrived");
    assert!(
        (found / expected - 1.0).abs() < 0.03,
        "arrived after {found} s, wave speed says {expected} s"
    );
}

#[test]
fn the_answer_converges_under_refinement() {
    let reaction = |cells: usize| {
        let mesh = box_phantom([40.0; 3], [cells; 3]).unwrap();
        let mut options = SolverOptions::default();
        options.material.poisson = 0.3;
        options.material.damping_per_s = 60.0;
        let mut solver = Solver::new(&mesh, Boundary::Fixed, options).unwrap();
        let contact = push(&top_nodes(&mesh, 40.0), [0.0, 0.0, -6.0]);
        let mut total = 0.0;
        for _ in 0..24 {
            let report = solver.step_frame(&contact, 0.05).unwrap();
            total = report.reaction.iter().map(|f| f64::from(f[2])).sum();
        }
        total
    };
    let [coarse, middle, fine, finest] = [3, 6, 12, 24].map(reaction);
    let (first, second, third) = (coarse - middle, middle - fine, fine - finest);
    assert!(
        first > 0.0 && second > 0.0 && third > 0.0,
        "a conforming mesh is too stiff, less so when finer: {coarse} {middle} {fine} {finest}"
    );
    assert!(second < 0.75 * first && third < 0.75 * second);
}

#[test]
fn average_nodal_pressure_relieves_locking() {
    let reaction = |pressure: Pressure| {
        let mesh = box_phantom([40.0; 3], [6; 3]).unwrap();
        let mut options = SolverOptions {
            pressure,
            ..SolverOptions::default()
        };
        options.material.damping_per_s = 60.0;
        let mut solver = Solver::new(&mesh, Boundary::Fixed, options).unwrap();
        let rows = &mesh.domain[mesh.domain.len() / 2..mesh.domain.len() / 2 + 2];
        let mut nodes: Vec<u32> = rows
            .iter()
            .flat_map(|row| mesh.surface[*row as usize])
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        let contact = push(&nodes, [0.0, 0.0, -3.0]);
        let mut total = 0.0;
        for _ in 0..12 {
            let report = solver.step_frame(&contact, 0.05).unwrap();
            total = report.reaction.iter().map(|f| f64::from(f[2])).sum();
        }
        total
    };
    let (element, nodal) = (
        reaction(Pressure::Element),
        reaction(Pressure::AverageNodal),
    );
    assert!(
        nodal > 0.3 * element && nodal < 0.92 * element,
        "element pressure {element} mN, nodal {nodal} mN"
    );
}

#[test]
fn the_asked_step_is_cut_where_the_mesh_needs_it() {
    let mesh = regular_box([10.0; 3], [10; 3]).unwrap();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, SolverOptions::default()).unwrap();
    let critical = solver.critical_step_at_rest_s();
    assert!(critical < 1e-4, "1 mm elements: {critical} s");
    let report = solver.step_frame(&[], 0.05).unwrap();
    assert!(f64::from(report.inner_steps) >= 0.05 / critical);
}

#[test]
fn mass_scaling_lengthens_the_step_and_leaves_statics_alone() {
    // Layers of 1 mm set the step of a body of 5 mm elements.
    let mut mesh = box_phantom([30.0, 30.0, 30.0], [6, 6, 6]).unwrap();
    for position in &mut mesh.positions {
        if (position[2] - 25.0).abs() < 1e-3 {
            position[2] = 29.0;
        }
    }
    let settle = |mass_scaling_s: f64| {
        let options = SolverOptions {
            mass_scaling_s,
            ..SolverOptions::default()
        };
        let mut solver = Solver::new(&mesh, Boundary::Fixed, options).unwrap();
        let contact = push(&top_nodes(&mesh, 30.0), [1.0, 0.0, -3.0]);
        for _ in 0..40 {
            solver.step_frame(&contact, 0.05).unwrap();
        }
        let mut u = vec![[0.0; 3]; mesh.node_count()];
        solver.displacement(&mut u);
        (u, solver.critical_step_at_rest_s(), solver.added_mass())
    };
    let (plain, short, nothing) = settle(0.0);
    let (scaled, long, added) = settle(2e-4);
    assert_eq!(nothing, 0.0);
    assert!(added > 0.01 && added < 1.0, "added {added}");
    assert!(
        long > 1.5 * short,
        "critical step {short} s, scaled {long} s"
    );
    let worst = plain
        .iter()
        .flatten()
        .zip(scaled.iter().flatten())
        .fold(0.0f32, |m, (a, b)| m.max((a - b).abs()));
    assert!(worst < 2e-3, "statics differ by {worst} mm");
}
