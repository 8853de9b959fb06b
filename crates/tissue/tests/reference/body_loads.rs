//! Gravity, forces and pressure against closed forms, and the energy that they bring.

use tissue::mesh::{Boundary, Mesh, box_phantom, regular_box};
use tissue::solver::{
    ContactNode, FrameReport, Loads, Solver, SolverError, SolverOptions, SupportMotion,
    SurfacePressure,
};
#[cfg(feature = "linear")]
use tissue::statics;

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
        walls: true,
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

/// A body that was scanned under its weight: the solver takes the rest shape that is found for it back to the scan.
#[cfg(feature = "linear")]
#[test]
fn a_rest_shape_hangs_as_it_was_scanned() {
    let scan = box_phantom([60.0, 60.0, 30.0], [5, 5, 3]).unwrap();
    let settings = options(0.45, 60.0);
    let gravity = [6.0, 0.0, 8.0];
    let rest = statics::unload(&scan, &scan.fixed, &settings.material, gravity).unwrap();
    let mut mesh = scan.clone();
    let mut farthest = 0.0f64;
    for (position, own) in mesh.positions.iter_mut().zip(&rest) {
        let way = (0..3).map(|k| (own[k] - f64::from(position[k])).powi(2));
        farthest = farthest.max(way.sum::<f64>().sqrt());
        *position = own.map(|x| x as f32);
    }
    let mut solver = Solver::new(&mesh, Boundary::Fixed, settings).unwrap();
    let load = Loads {
        gravity: gravity.map(|g| 1e3 * g),
        ..Loads::default()
    };
    solver.set_loads(&load).unwrap();
    settle(&mut solver, &[], 40);
    let mut most = 0.0f64;
    for ((there, u), wanted) in (mesh.positions.iter())
        .zip(displacement(&solver, &mesh))
        .zip(&scan.positions)
    {
        for axis in 0..3 {
            most = most.max(f64::from((there[axis] + u[axis] - wanted[axis]).abs()));
        }
    }
    println!("{farthest:.2} mm between scan and rest, {most:.1e} mm off");
    assert!(farthest > 3.0 && most < 1e-3, "{farthest} mm, {most} mm");
    // Of a weight that no such tissue bears nothing is made up.
    let soft = tissue::material::Material {
        young_pa: 30.0,
        ..options(0.45, 60.0).material
    };
    let error = statics::unload(&scan, &scan.fixed, &soft, [0.0, 0.0, -400.0]).unwrap_err();
    assert!(error.to_string().contains("no rest shape"), "{error}");
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
        ..Loads::default()
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
        pressures: vec![SurfacePressure {
            faces,
            pascal,
            walls: false,
        }],
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

/// Down to nothing at both ends: part and rate of a smooth way, by part of the time.
fn eased(s: f64) -> [f64; 2] {
    let s = s.min(1.0);
    [s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s)]
}

/// Turned by 90 degrees and carried 60 mm, a body has no stress at the end: a large motion of the frame is no strain.
#[test]
fn a_body_that_its_support_carries_comes_to_rest_without_stress() {
    let mesh = box_phantom([20.0, 20.0, 12.0], [4, 4, 3]).unwrap();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options(0.45, 40.0)).unwrap();
    let (turn, way) = ([0.0, 0.0, std::f64::consts::FRAC_PI_2], [60.0, -20.0, 10.0]);
    let mut largest = 0.0f64;
    for frame in 1..=36 {
        let [part, rate] = eased(f64::from(frame) / 20.0);
        let motion = SupportMotion {
            position: way.map(|x| part * x),
            velocity: way.map(|x| rate * x),
            turn: turn.map(|x| part * x),
            turning: turn.map(|x| rate * x),
        };
        solver.set_support(motion, 0.05).unwrap();
        largest = largest.max(solver.step_frame(&[], 0.05).unwrap().strain_energy);
    }
    let report = solver.step_frame(&[], 0.05).unwrap();
    let u = displacement(&solver, &mesh);
    let squares = mesh.positions.iter().zip(&u).map(|(x, u)| {
        let wanted = [-x[1] + 60.0, x[0] - 20.0, x[2] + 10.0];
        (0..3)
            .map(|k| f64::from(x[k] + u[k] - wanted[k]).powi(2))
            .sum::<f64>()
    });
    let mse = squares.sum::<f64>() / u.len() as f64;
    println!("{mse:e} mm², {:e} of {largest:e} mJ", report.strain_energy);
    assert!(mse < 1e-6, "{mse:e} mm²");
    assert!(report.strain_energy < 1e-4 * largest && (report.min_det_f - 1.0).abs() < 1e-4);
}

/// In the frame of a support that is pushed to and fro the body feels its acceleration as gravity.
#[test]
fn a_pushed_support_is_gravity_in_its_frame() {
    let mesh = box_phantom([20.0, 20.0, 12.0], [4, 4, 3]).unwrap();
    let new = || Solver::new(&mesh, Boundary::Fixed, options(0.45, 20.0)).unwrap();
    let (mut carried, mut shaken) = (new(), new());
    let (size, omega) = (4.0, 12.0);
    let (mut off, mut most) = (0.0f64, 0.0f64);
    for frame in 1..=30 {
        let time = 0.01 * f64::from(frame);
        let (sine, cosine) = (omega * time).sin_cos();
        let motion = SupportMotion {
            position: [size * (1.0 - cosine), 0.0, 0.0],
            velocity: [size * omega * sine, 0.0, 0.0],
            ..SupportMotion::default()
        };
        carried.set_support(motion, 0.01).unwrap();
        carried.step_frame(&[], 0.01).unwrap();
        let loads = Loads {
            gravity: [-size * omega * omega * cosine, 0.0, 0.0],
            ..Loads::default()
        };
        if frame == 1 {
            // Loads change on a line over a frame: at its start it stands under the first acceleration already.
            let at_once = Loads {
                gravity: [-size * omega * omega, 0.0, 0.0],
                ..Loads::default()
            };
            shaken.set_loads(&at_once).unwrap();
            shaken.step_frame(&[], 1e-6).unwrap();
        }
        shaken.set_loads(&loads).unwrap();
        shaken.step_frame(&[], 0.01).unwrap();
        let [one, other] = [&carried, &shaken].map(|solver| displacement(solver, &mesh));
        for (one, other) in one.iter().zip(&other) {
            let moved = f64::from(one[0]) - size * (1.0 - cosine);
            off = off.max((moved - f64::from(other[0])).abs());
            most = most.max(f64::from(other[0]).abs());
        }
    }
    println!("{off} of {most} mm");
    assert!(most > 0.05 && off < 0.02 * most, "{off} of {most} mm");
}

#[test]
fn a_support_that_is_nowhere_is_refused() {
    let mesh = box_phantom([20.0, 20.0, 12.0], [2, 2, 2]).unwrap();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options(0.45, 20.0)).unwrap();
    let motion = SupportMotion {
        turn: [f64::NAN, 0.0, 0.0],
        ..SupportMotion::default()
    };
    let error = solver.set_support(motion, 0.05).unwrap_err();
    assert!(
        matches!(&error, SolverError::Load { field, .. } if field == "support"),
        "{error}"
    );
    let report = solver.step_frame(&[], 0.05).unwrap();
    assert!(report.strain_energy < 1e-9, "{}", report.strain_energy);
}
