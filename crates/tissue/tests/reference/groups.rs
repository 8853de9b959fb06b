//! Support groups: what holds a body in two places, as prescribed nodes.

use tissue::mesh::{Boundary, Mesh, regular_box};
use tissue::solver::{ContactNode, Solver, SolverError, SolverOptions};

/// A bar of 40 mm, held at both ends; the upper one is a group.
fn bar() -> (Mesh, Vec<u32>) {
    let mut mesh = regular_box([10.0, 10.0, 40.0], [2, 2, 8]).unwrap();
    let at = |z: f32| {
        let nodes = 0..mesh.node_count() as u32;
        let there = nodes.filter(|node| (mesh.positions[*node as usize][2] - z).abs() < 0.1);
        there.collect::<Vec<_>>()
    };
    let (lower, upper) = (at(0.0), at(40.0));
    mesh.fixed = [lower, upper.clone()].concat();
    mesh.fixed.sort_unstable();
    (mesh, upper)
}

fn options() -> SolverOptions {
    let mut options = SolverOptions::default();
    options.material.poisson = 0.0;
    options.material.damping_per_s = 60.0;
    options
}

fn displacement(solver: &Solver, mesh: &Mesh) -> Vec<[f32; 3]> {
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut u);
    u
}

fn led(nodes: &[u32], to: impl Fn(u32) -> [f32; 3]) -> Vec<ContactNode> {
    let at = |node: &u32| ContactNode {
        node: *node,
        displacement: to(*node),
    };
    nodes.iter().map(at).collect()
}

/// All that holds it turns by 90 degrees: a body carried by both of its groups has no stress at the end.
#[test]
fn a_body_that_both_groups_carry_comes_to_rest_without_stress() {
    let (mesh, _) = bar();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options()).unwrap();
    solver.let_go(&mesh.fixed).unwrap();
    let turned = |part: f64, node: u32| {
        let [x, y, z] = mesh.positions[node as usize].map(f64::from);
        let (sin, cos) = (part * std::f64::consts::FRAC_PI_2).sin_cos();
        let to = [cos * x - sin * y + 30.0 * part, sin * x + cos * y, z];
        [0, 1, 2].map(|k| (to[k] - [x, y, z][k]) as f32)
    };
    let mut largest = 0.0f64;
    let mut report = None;
    for frame in 1..=50 {
        let s = (f64::from(frame) / 25.0).min(1.0);
        let contact = led(&mesh.fixed, |node| turned(s * s * (3.0 - 2.0 * s), node));
        let own = solver.step_frame(&contact, 0.05).unwrap();
        largest = largest.max(own.strain_energy);
        report = Some(own);
    }
    let u = displacement(&solver, &mesh);
    let nodes = 0..mesh.node_count() as u32;
    let squares = nodes.map(|node| {
        let (wanted, u) = (turned(1.0, node), u[node as usize]);
        (0..3)
            .map(|k| f64::from(u[k] - wanted[k]).powi(2))
            .sum::<f64>()
    });
    let mse = squares.sum::<f64>() / u.len() as f64;
    let energy = report.unwrap().strain_energy;
    println!("{mse:e} mm², {energy:e} of {largest:e} mJ");
    assert!(mse < 1e-6 && energy < 1e-4 * largest);
}

/// Drawn out by 4 mm the bar is stretched evenly (but for its ends, which do not narrow); let go, it comes back, and held again it stays.
#[test]
fn a_group_stretches_is_let_go_and_is_held_again() {
    let (mesh, upper) = bar();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options()).unwrap();
    solver.let_go(&upper).unwrap();
    let drawn = |part: f32| led(&upper, |_| [0.0, 0.0, 4.0 * part]);
    for frame in 1..=60 {
        let contact = drawn((frame as f32 / 20.0).min(1.0));
        solver.step_frame(&contact, 0.05).unwrap();
    }
    let largest = |u: &[[f32; 3]], wanted: &dyn Fn(f32) -> f32| {
        let pairs = mesh.positions.iter().zip(u);
        pairs
            .map(|(x, u)| (u[2] - wanted(x[2])).abs())
            .fold(0.0, f32::max)
    };
    let u = displacement(&solver, &mesh);
    assert!(
        largest(&u, &|z| 0.1 * z) < 1e-2,
        "{}",
        largest(&u, &|z| 0.1 * z)
    );
    for _ in 0..4 {
        solver.step_frame(&[], 0.05).unwrap();
    }
    let u = displacement(&solver, &mesh);
    let there = led(&upper, |node| u[node as usize]);
    let held = largest(&u, &|_| 0.0);
    assert!(held < 4.0);
    for _ in 0..60 {
        solver.step_frame(&there, 0.05).unwrap();
    }
    let end = upper[0] as usize;
    assert_eq!(displacement(&solver, &mesh)[end], u[end]);
    for _ in 0..80 {
        solver.step_frame(&[], 0.05).unwrap();
    }
    let u = displacement(&solver, &mesh);
    assert!(largest(&u, &|_| 0.0) < 1e-2, "{}", largest(&u, &|_| 0.0));
}

#[test]
fn a_node_that_nothing_holds_is_refused() {
    let (mesh, upper) = bar();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options()).unwrap();
    solver.let_go(&upper).unwrap();
    for nodes in [&upper[..1], &[1_000_000]] {
        let error = solver.let_go(nodes).unwrap_err();
        assert!(
            matches!(&error, SolverError::Load { field, .. } if field == "nodes"),
            "{error}"
        );
    }
}
