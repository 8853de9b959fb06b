//! Cost of the reference solver: a frame of the paper (50 ms, 500 inner steps of 0.1 ms), steady push.
//!
//! Prints `ROW {json}` lines (collected by `cargo xtask bench`) and a table with GFLOP/s, the bytes that an
//! inner step streams through, and the arithmetic intensity they imply. `UPT_BENCH_QUICK=1` shortens it;
//! `UPT_FINE_MESH=FILE` adds the 151,201-node mesh.

use criterion::{BenchmarkId, Criterion};
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tissue::contact::{ContactDomain, FACE_AREA_MM2};
use tissue::mesh::{Boundary, Mesh};
use tissue::solver::{ContactNode, Pressure, Solver, SolverOptions};

/// Frame of the paper's solver at K = 21,670, ms.
const PAPER_FRAME_MS: f64 = 1680.0;
const BAR_MS: f64 = 150.0;
const GOAL_MS: f64 = 75.0;

struct Setting {
    mesh: Mesh,
    label: &'static str,
    threads: usize,
    pressure: Pressure,
    /// Whether the bar of the 21,670-node mesh applies.
    barred: bool,
}

fn main() {
    let quick = std::env::var("UPT_BENCH_QUICK").is_ok_and(|v| v == "1");
    let mut criterion = Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(if quick { 2 } else { 8 }))
        .configure_from_args();
    for setting in settings() {
        measure(&mut criterion, &setting);
    }
    criterion.final_summary();
}

fn settings() -> Vec<Setting> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../onnx/meshes");
    let mut files: Vec<(&str, PathBuf)> = vec![
        ("coarse", folder.join("brain-coarse.mesh.safetensors")),
        ("brain", folder.join("brain.mesh.safetensors")),
    ];
    if let Ok(fine) = std::env::var("UPT_FINE_MESH") {
        files.push(("fine", fine.into()));
    }
    let mut settings = Vec::new();
    for (label, file) in files {
        let mesh = match Mesh::read(&file) {
            Ok(mesh) => mesh,
            Err(error) => {
                eprintln!("left out: {error}");
                continue;
            }
        };
        for threads in [1, 2] {
            settings.push(Setting {
                mesh: mesh.clone(),
                label,
                threads,
                pressure: Pressure::Element,
                barred: label == "brain" && threads == 2,
            });
        }
        if label == "brain" {
            settings.push(Setting {
                mesh,
                label,
                threads: 2,
                pressure: Pressure::AverageNodal,
                barred: false,
            });
        }
    }
    settings
}

fn measure(criterion: &mut Criterion, setting: &Setting) {
    let Setting {
        mesh,
        label,
        threads,
        pressure,
        barred,
    } = setting;
    let options = SolverOptions {
        threads: *threads,
        pressure: *pressure,
        ..SolverOptions::default()
    };
    let domain = ContactDomain::new(mesh, Boundary::Fixed).expect("brain meshes have a domain");
    let patch = domain
        .grow(domain.face_count() / 2, 50.0 * FACE_AREA_MM2)
        .expect("a patch in the middle of the domain");
    let mut solver = Solver::new(mesh, Boundary::Fixed, options).expect("a valid mesh");
    let cost = solver.step_cost();
    let seconds = RefCell::new(Vec::new());
    let steps = RefCell::new(0);
    let variant = match pressure {
        Pressure::Element => "",
        Pressure::AverageNodal => ", average pressure",
    };
    let name = format!("{label}, K = {}{variant}", mesh.node_count());
    criterion.benchmark_group("tled frame").bench_with_input(
        BenchmarkId::new(&name, format!("{threads} threads")),
        &(),
        |bench, ()| {
            bench.iter_custom(|iterations| {
                let mut total = Duration::ZERO;
                for _ in 0..iterations {
                    let contact: Vec<ContactNode> = patch
                        .nodes
                        .iter()
                        .map(|node| ContactNode {
                            node: *node,
                            displacement: patch.inward.map(|v| (3.0 * v) as f32),
                        })
                        .collect();
                    let start = Instant::now();
                    let report = solver
                        .step_frame(&contact, 0.05)
                        .expect("a gentle push is stable");
                    let elapsed = start.elapsed();
                    total += elapsed;
                    seconds.borrow_mut().push(elapsed.as_secs_f64());
                    *steps.borrow_mut() = report.inner_steps;
                }
                total
            });
        },
    );
    let seconds = seconds.into_inner();
    if seconds.is_empty() {
        return;
    }
    let median = gauge::median(seconds);
    let steps = f64::from(steps.into_inner());
    let step = median / steps;
    println!(
        "{name}, {threads} threads: {:.1} ms a frame, {steps} inner steps of {:.1} us, {:.1} GFLOP/s, {:.2} MB a step ({:.1} GB/s), {:.2} flop a byte",
        median * 1e3,
        step * 1e6,
        cost.flops as f64 / step * 1e-9,
        cost.bytes as f64 * 1e-6,
        cost.bytes as f64 / step * 1e-9,
        cost.flops as f64 / cost.bytes as f64,
    );
    let paper = (*label == "brain").then_some(PAPER_FRAME_MS);
    let row = serde_json::json!({
        "name": format!("tled/frame/{label}/{threads} threads{variant}"),
        "value": (median * 1e5).round() / 100.0,
        "unit": "ms",
        "against": paper.map(|_| "the paper's solver, 1,680 ms"),
        "ratio": paper.map(|p| (p / (median * 1e3) * 10.0).round() / 10.0),
        "error": null,
        "bar": barred.then_some(BAR_MS),
        "goal": barred.then_some(GOAL_MS),
    });
    println!("ROW {row}");
}
