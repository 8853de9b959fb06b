//! Whole steps: the table of `docs/performance.md`. One `ROW {json}` a line; medians, rivals alternating in one run.
//!
//! `cargo bench --bench step` runs every bundle in `onnx/` and in the folder that `UPT_BENCH_BUNDLES` names.
//! `UPT_BENCH_QUICK=1` asks for a short run. A bundle that carries `paper_encoder.onnx` and `paper_decoder.onnx` is
//! also run through ONNX Runtime as the paper splits it, with the same weights and threads.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use serde_json::json;
use upt::model::{KindModel, UptModel};
use upt::onnx::{ProviderPlan, Runtime, Stage, StageOptions};
use upt::{
    Contact, GuardPolicy, IndexSet, InitOptions, Kind, Model, ModelOptions, Scene, SceneOptions,
    StepInput,
};

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    find_runtime(root);
    let folders = [
        Some(root.join("onnx")),
        std::env::var_os("UPT_BENCH_BUNDLES").map(PathBuf::from),
    ];
    let mut bundles: Vec<PathBuf> = folders
        .iter()
        .flatten()
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flat_map(|entries| entries.flatten().map(|entry| entry.path()))
        .filter(|path| path.join("bundle.json").exists())
        .collect();
    bundles.sort();
    for bundle in bundles {
        if let Err(error) = run(&bundle) {
            eprintln!("{}: {error}", bundle.display());
            std::process::exit(1);
        }
    }
}

fn find_runtime(root: &Path) {
    let fetched = root.join("target/ort").join("libonnxruntime.so");
    let path = std::env::var_os("ORT_DYLIB_PATH")
        .map(PathBuf::from)
        .or_else(|| fetched.exists().then_some(fetched));
    let options = InitOptions {
        threads: 0,
        onnxruntime_path: path,
    };
    upt::init(&options).expect("first call");
}

fn steps(slow: bool) -> usize {
    match (std::env::var_os("UPT_BENCH_QUICK").is_some(), slow) {
        (true, true) => 12,
        (true, false) => 100,
        (false, true) => 40,
        (false, false) => 1000,
    }
}

fn row(name: &str, value: f64, unit: &str, bar: Option<f64>, goal: Option<f64>) {
    println!(
        "ROW {}",
        json!({"name": name, "value": value, "unit": unit, "against": null, "ratio": null, "error": null,
               "bar": bar, "goal": goal})
    );
}

fn run(path: &Path) -> upt::Result<()> {
    let start = Instant::now();
    let model = Model::open(path, &ModelOptions::default())?;
    let scene = Scene::new(Arc::clone(&model), &options(1))?;
    scene.step(FREE, None)?;
    let opened = start.elapsed().as_secs_f64();
    drop(scene);
    let name = model.manifest.name.clone();
    let info = model.info();
    println!("{name}: K = {}, {:?}", info.node_count, info.kind);
    row(
        &format!("{name}/open to first step"),
        opened,
        "s",
        Some(2.0),
        Some(0.5),
    );
    let reduced = info.kind == Kind::Reduced;
    for threads in [1, 2] {
        for surface in [false, true] {
            let scene = Scene::new(Arc::clone(&model), &options(threads))?;
            if surface {
                scene.set_region(Some(model.indices(IndexSet::SurfaceNodes)))?;
            }
            let (bar, goal) = match (reduced, surface) {
                _ if threads == 1 => (None, None),
                (true, false) => (Some(3.0), Some(1.0)),
                (true, true) => (Some(1.5), Some(0.4)),
                (false, false) => (Some(10.0), Some(5.0)),
                (false, true) => (Some(6.0), Some(3.0)),
            };
            let part = if surface { "surface" } else { "all" };
            steady(
                &scene,
                &format!("{name}/{part}/{threads} threads"),
                bar,
                goal,
            )?;
        }
    }
    if reduced {
        site_change(&model, &name)?;
        sleeping(&model, &name)?;
    }
    if let KindModel::Upt(kind) = &model.kind
        && path.join("paper_encoder.onnx").exists()
    {
        paper_split(path, &model, kind, &name)?;
    }
    Ok(())
}

const FREE: StepInput<'static> = StepInput {
    displacement: None,
    contact: Contact::None,
};

fn options(threads: usize) -> SceneOptions {
    SceneOptions {
        threads,
        guard_policy: GuardPolicy::Report,
        no_sleep: true,
        ..SceneOptions::default()
    }
}

/// Nodes of the domain within 8 mm of one of them.
fn patch(model: &Model, around: usize) -> Vec<u32> {
    let domain = model.indices(IndexSet::DomainNodes);
    let p = |node: u32| &model.positions()[3 * node as usize..3 * node as usize + 3];
    let centre = p(domain[around % domain.len()]);
    let near = |node: &u32| {
        let d2: f32 = p(*node)
            .iter()
            .zip(centre)
            .map(|(a, b)| (a - b).powi(2))
            .sum();
        d2 < 64.0
    };
    domain.iter().copied().filter(near).collect()
}

/// A push of 5 mm that moves a little each step.
fn pushed(nodes: &[u32], t: usize) -> Vec<f32> {
    let depth = -5.0 + 0.01 * (t % 7) as f32;
    nodes.iter().flat_map(|_| [0.0, 0.0, depth]).collect()
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn steady(scene: &Scene, name: &str, bar: Option<f64>, goal: Option<f64>) -> upt::Result<()> {
    let nodes = patch(scene.model(), 300);
    let mut out = vec![0.0; 3 * scene.region_count()];
    let slow = scene.model().info().kind == Kind::Upt;
    let (mut times, mut outside) = (Vec::new(), Vec::new());
    for t in 0..steps(slow) + 5 {
        let vectors = pushed(&nodes, t);
        let contact = Contact::Sparse {
            nodes: &nodes,
            vectors: &vectors,
        };
        let input = StepInput {
            displacement: None,
            contact,
        };
        let start = Instant::now();
        scene.step(input, Some(&mut out))?;
        if t >= 5 {
            times.push(start.elapsed().as_secs_f64() * 1e3);
            let s = scene.stats();
            let work = s.prior_ms + s.encode_ms + s.aggregate_ms + s.latent_ms + s.decode_ms;
            outside.push(100.0 * (s.step_ms - work) / s.step_ms);
        }
    }
    let p99 = {
        times.sort_by(f64::total_cmp);
        times[times.len() * 99 / 100]
    };
    let middle = median(&mut times);
    row(&format!("{name}/step"), middle, "ms", bar, goal);
    row(
        &format!("{name}/p99 over median"),
        p99 / middle,
        "",
        Some(1.5),
        Some(1.2),
    );
    row(
        &format!("{name}/outside kernels and sessions"),
        median(&mut outside),
        "%",
        Some(5.0),
        Some(2.0),
    );
    let s = scene.stats();
    println!(
        "{name}: prior {:.3} encode {:.3} aggregate {:.3} latent {:.3} decode {:.3} guard {:.3} ms, {} nodes, {} in contact, {:.1} MB",
        s.prior_ms,
        s.encode_ms,
        s.aggregate_ms,
        s.latent_ms,
        s.decode_ms,
        s.guard_ms,
        s.decoded_node_count,
        s.contact_count,
        s.memory_bytes as f64 / 1e6
    );
    Ok(())
}

/// Extra time of a step whose contact nodes are new, against one whose are not.
fn site_change(model: &Arc<Model>, name: &str) -> upt::Result<()> {
    let scene = Scene::new(Arc::clone(model), &options(1))?;
    let patches = [patch(model, 300), patch(model, 301)];
    let (mut same, mut new) = (Vec::new(), Vec::new());
    for t in 0..steps(false) {
        let nodes = &patches[(t / 2) % 2];
        let vectors = pushed(nodes, t);
        let contact = Contact::Sparse {
            nodes,
            vectors: &vectors,
        };
        scene.step(
            StepInput {
                displacement: None,
                contact,
            },
            None,
        )?;
        let times = if t.is_multiple_of(2) {
            &mut new
        } else {
            &mut same
        };
        times.push(scene.stats().prior_ms);
    }
    let extra = median(&mut new) - median(&mut same);
    row(
        &format!("{name}/site change, {} nodes", patches[0].len()),
        extra,
        "ms",
        Some(5.0),
        Some(1.0),
    );
    Ok(())
}

/// A step of a scene at rest.
fn sleeping(model: &Arc<Model>, name: &str) -> upt::Result<()> {
    let scene = Scene::new(
        Arc::clone(model),
        &SceneOptions {
            no_sleep: false,
            ..options(1)
        },
    )?;
    while !scene.stats().sleeping {
        scene.step(FREE, None)?;
    }
    let mut times: Vec<f64> = (0..steps(false))
        .map(|_| {
            let start = Instant::now();
            scene
                .step(FREE, None)
                .map(|()| start.elapsed().as_secs_f64() * 1e6)
        })
        .collect::<upt::Result<_>>()?;
    row(
        &format!("{name}/sleeping step"),
        median(&mut times),
        "us",
        Some(10.0),
        None,
    );
    Ok(())
}

/// ONNX Runtime with the paper's split, alternating with a scene: the same weights, the same threads.
fn paper_split(path: &Path, model: &Arc<Model>, kind: &UptModel, name: &str) -> upt::Result<()> {
    let runtime = Runtime::get(None)?;
    let count = model.info().node_count as usize;
    let (d, f) = (kind.entry.dims.encoder, kind.entry.feature_width());
    let graph = &kind.tables.graph;
    let rows = graph.supernodes.len();
    let target: Vec<i64> = (0..rows)
        .flat_map(|row| {
            let degree = graph.offsets[row + 1] - graph.offsets[row];
            std::iter::repeat_n(i64::from(graph.supernodes[row]), degree as usize)
        })
        .collect();
    let source: Vec<i64> = graph
        .neighbours
        .iter()
        .map(|&node| i64::from(node))
        .collect();
    let read =
        |file: &str| std::fs::read(path.join(file)).map_err(|e| upt::Error::State(e.to_string()));
    for threads in [1, 2] {
        let stage = StageOptions {
            threads,
            plan: ProviderPlan::cpu(),
        };
        let mut encoder = Stage::with_indices(
            runtime,
            "paper_encoder.onnx",
            &read("paper_encoder.onnx")?,
            &[("features", &[count, f]), ("positions", &[count, 3])],
            &[("edge_source", &source), ("edge_target", &target)],
            &[("messages", &[source.len(), d])],
            &stage,
        )?;
        let mut decoder = Stage::new(
            runtime,
            "paper_decoder.onnx",
            &read("paper_decoder.onnx")?,
            &[("supernodes", &[rows, d]), ("positions", &[count, 3])],
            &[("displacement", &[count, 3])],
            &stage,
        )?;
        encoder.input(1).copy_from_slice(model.positions());
        decoder.input(1).copy_from_slice(model.positions());
        // From rest without contact: displacement and collision are zero, so every step has the same input.
        let norm = &kind.entry.normalisation;
        for row in encoder.input(0).chunks_exact_mut(f) {
            let mut at = 0;
            for feature in &kind.entry.features {
                for axis in 0..feature.width() {
                    row[at + axis] = if feature.width() == 3 {
                        -norm.mean[axis] / norm.std[axis]
                    } else {
                        0.0
                    };
                }
                at += feature.width();
            }
        }
        let scene = Scene::new(
            Arc::clone(model),
            &SceneOptions {
                free_boundary: true,
                ..options(threads)
            },
        )?;
        let mut out = vec![0.0; 3 * count];
        let (mut theirs, mut ours) = (Vec::new(), Vec::new());
        for _ in 0..steps(true) {
            let start = Instant::now();
            encoder.run()?;
            for (row, sum) in decoder.input(0).chunks_exact_mut(d).enumerate() {
                let edges = graph.offsets[row] as usize..graph.offsets[row + 1] as usize;
                let degree = edges.len() as f32;
                sum.fill(0.0);
                for message in encoder.output(0)[edges.start * d..edges.end * d].chunks_exact(d) {
                    for (s, m) in sum.iter_mut().zip(message) {
                        *s += m;
                    }
                }
                sum.iter_mut().for_each(|s| *s /= degree);
            }
            decoder.run()?;
            theirs.push(start.elapsed().as_secs_f64() * 1e3);
            scene.reset()?;
            let start = Instant::now();
            scene.step(FREE, Some(&mut out))?;
            ours.push(start.elapsed().as_secs_f64() * 1e3);
        }
        let error = out
            .iter()
            .zip(decoder.output(0))
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max);
        let (ours, theirs) = (median(&mut ours), median(&mut theirs));
        println!(
            "ROW {}",
            json!({"name": format!("{name}/against the paper's split/{threads} threads"), "value": ours, "unit": "ms",
                   "against": "ONNX Runtime, paper's split", "ratio": theirs / ours, "error": error,
                   "bar": 1.6, "goal": 3.0})
        );
    }
    Ok(())
}
