//! Gravity, forces and pressure against closed forms, and the energy that they bring.

use tissue::mesh::{Boundary, Mesh, box_phantom, regular_box};
use tissue::solver::{
    ContactNode, FrameReport, Loads, Solver, SolverError, SolverOptions, SurfacePressure,
};

/// 1000 kg/m³ under 0.5 m/s², in N/m³.
const WEIGHT: f64 = 500.0;

fn options(poisson: f64, damping_per_s: f64) -> SolverOptions {
    let mut options = SolverOptions::default();
    options.material.poisson = poisson;
    options.material.damping_per_s = damping_per_s;
    options
}

fn on_all_faces(mesh: &Mesh, pascal: f64) -> Vec<SurfacePressure> {
    vec![SurfacePressure {
        faces: (0..mesh.surface.len() as u32).collect(),
        pascal,
    }]
}

/// Frames of 50 ms until the body has come to rest.
fn settle(solver: &mut Solver, contact: &[ContactNode], frames: u32) -> FrameReport {
    let mut report = solver.step_frame(contact, 0.05).unwrap();
    for _ in 1..frames {
        report = solver.step_frame(contact, 0.05).unwrap();
    }
    report
}

fn displacement(solver: &Solver, mesh: &Mesh) -> Vec<[f32; 3]> {
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut u);
    u
}

/// A bar without lateral strain, hung from its top: `u(s) = rho g (L s - s²/2) / E` at the distance `s` from there.
#[test]
fn a_bar_under_its_own_weight_has_the_closed_form() {
    const LENGTH: f64 = 40.0;
    let mesh = regular_box([10.0, 10.0, LENGTH as f32], [2, 2, 10]).unwrap();
    let top: Vec<ContactNode> = (0..mesh.node_count() as u32)
        .filter(|node| mesh.positions[*node as usize][2] > 39.9)
        .map(|node| ContactNode {
            node,
            displacement: [0.0; 3],
        })
        .collect();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options(0.0, 100.0)).unwrap();
    let young = 3000.0;
    solver
        .set_loads(&Loads {
            gravity: [0.0, 0.0, -500.0],
            ..Loads::default()
        })
        .unwrap();
    let report = settle(&mut solver, &top, 24);
    let u = displacement(&solver, &mesh);
    // mm: N/m³ mm² / Pa, a thousandth.
    let farthest = 1e-3 * WEIGHT * 0.5 * LENGTH * LENGTH / young;
    assert!(farthest > 0.1);
    // The grid's corners have unequal shares of the mass: a layer is compared by its mean.
    for layer in 0..=10 {
        let height = 4.0 * layer as f64;
        let own = mesh.positions.iter().zip(&u);
        let own = own.filter(|(position, _)| (f64::from(position[2]) - height).abs() < 0.1);
        let (count, sum) = own.fold((0, 0.0), |(count, sum), (_, u)| (count + 1, sum + u[2]));
        let s = LENGTH - height;
        let wanted = -1e-3 * WEIGHT * (LENGTH * s - 0.5 * s * s) / young;
        let found = f64::from(sum) / f64::from(count);
        let off = (found - wanted).abs();
        assert!(off < 0.01 * farthest, "at {height}: {found}, not {wanted}");
    }
    // What holds it carries its weight, but for the half row of elements that hangs at the held nodes themselves.
    let carried: f64 = report.reaction.iter().map(|f| f64::from(f[2])).sum();
    let weight = 1e-6 * WEIGHT * 100.0 * (LENGTH - 2.0);
    assert!(
        (carried.abs() / weight - 1.0).abs() < 2e-3,
        "{carried} mN, {weight} mN"
    );
}

/// Pressure follows the surface: `p = kappa (1 - J)` on the faces as they are, not as they were, when that would be a ninth more.
#[test]
fn a_body_under_pressure_has_the_closed_form() {
    let mut mesh = regular_box([20.0; 3], [4; 3]).unwrap();
    // Held at its middle alone.
    let middle = |p: &[f32; 3]| p.iter().all(|v| (v - 10.0).abs() < 0.1);
    mesh.fixed = (0..mesh.node_count() as u32)
        .filter(|node| middle(&mesh.positions[*node as usize]))
        .collect();
    assert_eq!(mesh.fixed.len(), 1);
    let settings = options(0.3, 100.0);
    let pascal = 0.15 * settings.material.bulk_pa();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, settings).unwrap();
    let pressures = on_all_faces(&mesh, pascal);
    solver
        .set_loads(&Loads {
            pressures,
            ..Loads::default()
        })
        .unwrap();
    settle(&mut solver, &[], 16);
    let stretch = 0.85f64.cbrt();
    for (position, u) in mesh.positions.iter().zip(displacement(&solver, &mesh)) {
        for axis in 0..3 {
            let wanted = (stretch - 1.0) * (f64::from(position[axis]) - 10.0);
            let off = (f64::from(u[axis]) - wanted).abs();
            assert!(off < 1e-3, "{position:?}: {u:?}, not {wanted} along {axis}");
        }
    }
}

/// Without damping the work of all loads is strain energy and motion.
#[test]
fn loads_bring_the_energy_that_the_body_has() {
    let mesh = box_phantom([30.0; 3], [5; 3]).unwrap();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options(0.45, 0.0)).unwrap();
    let mut forces = vec![[0.0; 3]; mesh.node_count()];
    let corner = (0..forces.len())
        .max_by(|a, b| {
            let sum = |node: &usize| mesh.positions[*node].iter().sum::<f32>();
            sum(a).total_cmp(&sum(b))
        })
        .unwrap();
    forces[corner] = [3.0, 0.0, -2.0];
    let loads = Loads {
        gravity: [4000.0, 0.0, -4000.0],
        forces,
        pressures: on_all_faces(&mesh, 60.0),
    };
    solver.set_loads(&loads).unwrap();
    for frame in 0..8 {
        let report = solver.step_frame(&[], 0.02).unwrap();
        let held = report.strain_energy + report.kinetic_energy;
        let off = (held / report.external_work - 1.0).abs();
        assert!(
            report.kinetic_energy > 1e-3 * held,
            "frame {frame} is not moving"
        );
        // The pressure's bottom is held, so all of its work is of moving faces.
        assert!(off < 0.01, "frame {frame}: {report:?}");
    }
}

#[test]
fn loads_end_where_they_began() {
    let mesh = box_phantom([30.0; 3], [4; 3]).unwrap();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options(0.45, 60.0)).unwrap();
    let turned = Loads {
        gravity: [5000.0, 0.0, 0.0],
        pressures: on_all_faces(&mesh, 100.0),
        ..Loads::default()
    };
    solver.set_loads(&turned).unwrap();
    settle(&mut solver, &[], 10);
    let moved = displacement(&solver, &mesh);
    let largest = |u: &[[f32; 3]]| u.as_flattened().iter().fold(0.0f32, |m, v| m.max(v.abs()));
    assert!(largest(&moved) > 0.3, "{}", largest(&moved));
    solver.set_loads(&Loads::default()).unwrap();
    settle(&mut solver, &[], 30);
    let left = largest(&displacement(&solver, &mesh));
    assert!(left < 2e-3, "{left} mm");
}

#[test]
fn bad_loads_are_typed_errors_and_change_nothing() {
    let mesh = box_phantom([20.0; 3], [2; 3]).unwrap();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, SolverOptions::default()).unwrap();
    let pressure = |faces: Vec<u32>, pascal| Loads {
        pressures: vec![SurfacePressure { faces, pascal }],
        ..Loads::default()
    };
    let bad = [
        (
            "gravity",
            Loads {
                gravity: [0.0, f64::NAN, 0.0],
                ..Loads::default()
            },
        ),
        (
            "forces",
            Loads {
                forces: vec![[1.0; 3]; 3],
                ..Loads::default()
            },
        ),
        ("pressures[0]", pressure(vec![], 10.0)),
        ("pressures[0]", pressure(vec![0], f64::INFINITY)),
        (
            "pressures[0]",
            pressure(vec![mesh.surface.len() as u32], 10.0),
        ),
    ];
    for (name, loads) in bad {
        let error = solver.set_loads(&loads).unwrap_err();
        assert!(
            matches!(&error, SolverError::Load { field, .. } if field == name),
            "{error}"
        );
    }
    solver.step_frame(&[], 0.01).unwrap();
    let u = displacement(&solver, &mesh);
    assert!(u.as_flattened().iter().all(|v| v.abs() < 1e-5));
}
