//! Ties against closed forms: springs in series with a bar, a weight on a thread, breaking, a suture, and a tie to a tool.

use contact::{End, Pose, Shape, Spring, Tie, TiePoint, Vector};
use tissue::mesh::{Boundary, Mesh, box_phantom, regular_box};
use tissue::solver::{FrameReport, Loads, Solver, SolverError, SolverOptions, Tool, ToolPose};

const YOUNG_PA: f64 = 3000.0;

fn options(damping_per_s: f64) -> SolverOptions {
    let mut options = SolverOptions::default();
    options.material.poisson = 0.0;
    options.material.damping_per_s = damping_per_s;
    options
}

fn at_node(node: u32) -> TiePoint {
    TiePoint {
        nodes: [node; 3],
        weights: [1.0, 0.0, 0.0],
    }
}

fn thread(stiffness: f32, slack_mm: f32) -> Spring {
    Spring {
        stiffness,
        slack_mm,
        ..Spring::default()
    }
}

/// A bar of 10 x 10 x 40 mm that is held at z = 0, and the nodes of its other end with their shares of its area.
fn bar() -> (Mesh, Vec<(u32, f32)>) {
    let mut mesh = regular_box([10.0, 10.0, 40.0], [2, 2, 10]).unwrap();
    let nodes = || (0..mesh.node_count() as u32).map(|node| (node, mesh.positions[node as usize]));
    let fixed: Vec<u32> = nodes()
        .filter(|(_, x)| x[2] < 0.1)
        .map(|(node, _)| node)
        .collect();
    let end = nodes().filter(|(_, x)| x[2] > 39.9);
    // What lies on an edge of the end has half an edge's share.
    let inner = |v: f32| if (1.0..9.0).contains(&v) { 1.0 } else { 0.5 };
    let end = end.map(|(node, x)| (node, 0.25 * inner(x[0]) * inner(x[1])));
    let end: Vec<(u32, f32)> = end.collect();
    assert!((end.iter().map(|(_, share)| share).sum::<f32>() - 1.0).abs() < 1e-6);
    mesh.fixed = fixed;
    (mesh, end)
}

/// The end of the bar on threads of this stiffness altogether (N/m), whose far ends are `pulled` farther up than they are slack.
fn bed(mesh: &Mesh, end: &[(u32, f32)], stiffness: f32, slack_mm: f32, pulled: f32) -> Vec<Tie> {
    let tie = |&(node, share): &(u32, f32)| {
        let up = Vector::Z * (slack_mm + pulled);
        Tie {
            point: at_node(node),
            end: End::World(Vector::from(mesh.positions[node as usize]) + up),
            spring: thread(stiffness * share, slack_mm),
            break_mn: 0.0,
        }
    };
    end.iter().map(tie).collect()
}

fn run(solver: &mut Solver, frames: u32) -> FrameReport {
    let mut report = solver.step_frame(&[], 0.05).unwrap();
    for _ in 1..frames {
        report = solver.step_frame(&[], 0.05).unwrap();
    }
    report
}

/// Bar and threads in series, soft, as stiff as the bar, and 1e4 N/m: `u = pulled k / (k + E A / L)`, where the bar of neo-Hookean tissue stiffens by less than 3 %.
#[test]
fn a_bar_on_threads_is_two_springs_in_series() {
    let (mesh, end) = bar();
    // mN/mm: Pa mm² / mm, a thousandth.
    let own = 1e-3 * YOUNG_PA * 100.0 / 40.0;
    for stiffness in [1.0f32, own as f32, 1e4] {
        let mut solver = Solver::new(&mesh, Boundary::Fixed, options(60.0)).unwrap();
        let pulled = 0.4;
        solver
            .set_ties(&bed(&mesh, &end, stiffness, 3.0, pulled))
            .unwrap();
        let report = run(&mut solver, 24);
        assert_eq!(report.inner_steps, 500, "a stiff tie takes no shorter step");
        let series = f64::from(stiffness) * own / (f64::from(stiffness) + own);
        let wanted = series * f64::from(pulled);
        let found: f32 = report.ties.iter().map(|tie| tie.force[2]).sum();
        assert!(
            (f64::from(found) / wanted - 1.0).abs() < 0.02,
            "{stiffness}: {found} mN, not {wanted}"
        );
        for (tie, (_, share)) in report.ties.iter().zip(&end) {
            let own = stiffness * share * (tie.length_mm - 3.0);
            // Of a length that is known to 1e-5 mm.
            assert!(
                (tie.force[2] - own).abs() < 2e-3 * own + 1e-5 * stiffness,
                "{tie:?} {own}"
            );
        }
    }
}

/// A body that nothing else holds hangs on a thread by its weight, and swings up and down at `sqrt(k / m)` while nothing damps it.
#[test]
fn a_weight_hangs_on_its_thread() {
    let mut mesh = box_phantom([20.0; 3], [4; 3]).unwrap();
    mesh.fixed.clear();
    let top = (0..mesh.node_count() as u32).filter(|node| {
        let [x, y, z] = mesh.positions[*node as usize];
        z > 19.9 && (x - 10.0).hypot(y - 10.0) < 0.1
    });
    let top: Vec<u32> = top.collect();
    assert_eq!(top.len(), 1);
    let from = Vector::from(mesh.positions[top[0] as usize]);
    let weight_mn = 0.008 * 500.0; // 8 cm³ of 1000 kg/m³ under 0.5 m/s².
    for (stiffness, damping) in [(2.0f32, 0.0), (1e4, 40.0)] {
        let mut solver = Solver::new(&mesh, Boundary::Fixed, options(damping)).unwrap();
        let gravity = [0.0, 0.0, -500.0];
        solver
            .set_loads(&Loads {
                gravity,
                ..Loads::default()
            })
            .unwrap();
        solver.step_frame(&[], 1e-4).unwrap();
        let tie = Tie {
            point: at_node(top[0]),
            end: End::World(from + Vector::Z * 5.0),
            spring: thread(stiffness, 5.0),
            break_mn: 0.0,
        };
        solver.set_ties(&[tie]).unwrap();
        let report = run(&mut solver, if damping > 0.0 { 20 } else { 1 });
        if damping > 0.0 {
            let found = report.ties[0].force[2];
            assert!(
                (found / weight_mn - 1.0).abs() < 5e-3,
                "{found} for {weight_mn} mN"
            );
            continue;
        }
        // sqrt(2 N/m / 8 g): a period of 0.397 s; after half of it it is at its lowest, at twice the weight.
        let half = std::f64::consts::PI * (0.008f64 / 2.0).sqrt();
        let mut most = (0.0f32, 0.0);
        for _ in 0..60 {
            let report = solver.step_frame(&[], 0.005).unwrap();
            let found = report.ties[0].force[2];
            if found > most.0 {
                most = (found, report.time_s);
            }
        }
        assert!((most.0 / (2.0 * weight_mn) - 1.0).abs() < 0.05, "{most:?}");
        assert!((most.1 - half).abs() < 0.015, "{most:?} for {half} s");
    }
}

/// Pulled evenly, the threads of a bed break at their force, each once; what is left is a bar without a load, and a list without them heals them.
#[test]
fn a_thread_breaks_at_its_force_and_stays_broken() {
    let (mesh, end) = bar();
    let own = 1e-3 * YOUNG_PA * 100.0 / 40.0;
    let series = 0.5 * own;
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options(60.0)).unwrap();
    let ties_at = |pulled: f32| {
        let mut ties = bed(&mesh, &end, own as f32, 0.0, pulled);
        for (tie, (_, share)) in ties.iter_mut().zip(&end) {
            // 1.5 mN altogether: at a pull of 0.4 mm.
            tie.break_mn = 1.5 * share;
        }
        ties
    };
    assert!((series * 0.4 - 1.5).abs() < 1e-9);
    let mut report = None;
    for frame in 1..=30 {
        // 0.02 mm a frame: slow beside the bar's own motion.
        solver.set_ties(&ties_at(0.02 * frame as f32)).unwrap();
        report = Some(solver.step_frame(&[], 0.05).unwrap());
    }
    let report = report.unwrap();
    let times = report.ties.iter().map(|tie| tie.broke_s.unwrap());
    let (first, last) = times.fold((f64::MAX, 0.0f64), |(a, b), t| (a.min(t), b.max(t)));
    // At 0.4 mm, 20 frames; the tissue's inertia and damping are a few per cent of it.
    assert!(
        (first - 1.0).abs() < 0.06 && last - first < 0.06,
        "{first} to {last} s"
    );
    assert!(report.ties.iter().all(|tie| tie.force == [0.0; 3]));
    assert!(
        report.strain_energy < 1e-3 * 0.5 * 1.5 * 0.2,
        "{}",
        report.strain_energy
    );
    solver.set_ties(&[]).unwrap();
    solver.set_ties(&ties_at(0.2)).unwrap();
    let healed = run(&mut solver, 10);
    assert!(
        healed
            .ties
            .iter()
            .all(|tie| tie.broke_s.is_none() && tie.force[2] > 0.0)
    );
}

/// A suture across a body that nothing holds draws its two sides together, and the body as a whole stays where it is.
#[test]
fn a_suture_draws_together_what_it_ties() {
    let mut mesh = box_phantom([30.0, 10.0, 10.0], [6, 2, 2]).unwrap();
    mesh.fixed.clear();
    let by = |x: f32| {
        let near = |node: &u32| {
            let [own, y, z] = mesh.positions[*node as usize];
            (own - x).abs() < 0.1 && (y - 5.0).hypot(z - 5.0) < 0.1
        };
        (0..mesh.node_count() as u32).find(near).unwrap()
    };
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options(60.0)).unwrap();
    let tie = Tie {
        point: at_node(by(0.0)),
        end: End::Tissue(at_node(by(30.0))),
        spring: thread(5.0, 26.0),
        break_mn: 0.0,
    };
    solver.set_ties(&[tie]).unwrap();
    let report = run(&mut solver, 20);
    let [tie] = report.ties[..] else {
        panic!("a tie")
    };
    assert!(tie.length_mm < 29.5 && tie.length_mm > 26.0, "{tie:?}");
    // It pulls its first end towards the second, +x.
    assert!(
        (tie.force[0] - 5.0 * (tie.length_mm - 26.0)).abs() < 1e-2,
        "{tie:?}"
    );
    let mut u = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut u);
    let mean: f32 = u.iter().map(|u| u[0]).sum::<f32>() / u.len() as f32;
    let most = u.iter().fold(0.0f32, |most, u| most.max(u[0].abs()));
    assert!(mean.abs() < 0.02 * most, "{mean} of {most}");
}

/// A tool that holds a thread feels what it pulls with; without damping the work of tool and tie is the body's energy.
#[test]
fn a_tool_feels_its_thread_and_energy_balances() {
    let (mesh, end) = bar();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options(0.0)).unwrap();
    let start = Pose::from_translation(Vector::new(5.0, 5.0, 60.0));
    let tool = Tool {
        shape: Shape::Sphere { radius: 2.0 },
        friction: 0.0,
        tear_off_mn: 0.0,
    };
    let samples = mesh.samples(Boundary::Fixed);
    solver.set_tools(samples, &[tool], &[start]).unwrap();
    let middle = end.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap().0;
    let tie = Tie {
        point: at_node(middle),
        end: End::Tool {
            tool: 0,
            place: Vector::new(0.0, 0.0, -2.0),
        },
        spring: thread(3.0, 18.0),
        break_mn: 0.0,
    };
    solver.set_ties(&[tie]).unwrap();
    for frame in 1..=10 {
        let pose = Pose::from_translation(start.translation + Vector::Z * (0.1 * frame as f32));
        let report = solver
            .step_tools(&[], &[ToolPose { pose, grasp: false }], 0.05)
            .unwrap();
        let (own, felt) = (report.ties[0].force, report.tools[0].force);
        assert!(
            (own[2] + felt[2]).abs() < 1e-4 * (1.0 + own[2]),
            "{own:?} {felt:?}"
        );
        let energy = report.strain_energy + report.kinetic_energy;
        assert!(
            (report.external_work - energy).abs() < 0.02 * energy.max(1e-4),
            "{} for {energy}",
            report.external_work
        );
    }
}

#[test]
fn ties_that_there_cannot_be_are_named() {
    let (mesh, end) = bar();
    let mut solver = Solver::new(&mesh, Boundary::Fixed, options(0.0)).unwrap();
    let good = bed(&mesh, &end, 1.0, 0.0, 1.0)[0];
    let with = |change: &dyn Fn(&mut Tie)| {
        let mut tie = good;
        change(&mut tie);
        tie
    };
    for (tie, word) in [
        (with(&|tie| tie.spring.stiffness = -1.0), "stiffness"),
        (with(&|tie| tie.spring.slack_mm = f32::NAN), "slack_mm"),
        (with(&|tie| tie.break_mn = -2.0), "break_mn"),
        (with(&|tie| tie.point.nodes[0] = 100_000), "node 100000"),
        (with(&|tie| tie.point.weights[0] = 0.5), "weights"),
        (
            with(&|tie| tie.end = End::World(Vector::splat(f32::INFINITY))),
            "far end",
        ),
        (
            with(&|tie| {
                tie.end = End::Tool {
                    tool: 3,
                    place: Vector::ZERO,
                }
            }),
            "tool 3",
        ),
    ] {
        let error = solver.set_ties(&[good, tie]).unwrap_err();
        assert!(
            matches!(error, SolverError::Tie { index: 1, .. }),
            "{error}"
        );
        assert!(error.to_string().contains(word), "{error}");
    }
    assert!(solver.step_frame(&[], 0.01).unwrap().ties.is_empty());
}
