//! Times of bundles on one execution provider, for `xtask/gpu/run.sh`:
//!
//! `gpu-measure PROVIDER STEPS SCENES BUNDLE...`, with SCENES such as `1,2,4,8`, prints a JSON object a line: p50, p95 and
//! p99 of a step, the copies to the card and back, the deviation of a rollout from the CPU's float32 path, FLOP and bytes.
//! What the provider refuses is a line with `not_measured` and `why`. No card has run it yet; `tests/gpu_package.rs`
//! rehearses it on the CPU.

#[path = "../../../benches/step/cost.rs"]
mod cost;
#[path = "../../../benches/step/split.rs"]
mod split;

use std::path::Path;
use std::sync::{Arc, Barrier};
use std::time::Instant;

use serde_json::{Value, json};
use upt::model::KindModel;
use upt::onnx::ProviderPlan;
use upt::{
    Contact, Corrections, GuardPolicy, IndexSet, Model, ModelOptions, Precision, Provider, Scene,
    SceneOptions, StepInput, StepPath,
};

const WARM_UP: usize = 10;
/// Steps of the rollout that is compared with the CPU's.
const ROLLOUT: usize = 40;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [provider, steps, scenes, bundles @ ..] = arguments.as_slice() else {
        return Err("usage: gpu-measure PROVIDER STEPS SCENES BUNDLE...".into());
    };
    use Provider::{Cpu, Cuda, TensorRt, TensorRtRtx};
    let provider = [Cpu, Cuda, TensorRt, TensorRtRtx]
        .into_iter()
        .find(|known| known.name() == provider)
        .ok_or("PROVIDER must be cpu, cuda, tensorrt or tensorrt-rtx")?;
    let scenes: Vec<usize> = scenes
        .split(',')
        .map(str::parse)
        .collect::<Result<_, _>>()?;
    let steps = steps.parse()?;
    for bundle in bundles {
        let reference = Model::open(bundle.as_ref(), &ModelOptions::default())?;
        let plain = rollout(&reference, StepPath::Split)?;
        for (name, options, path) in variants(provider) {
            let rows = Model::open(bundle.as_ref(), &options).and_then(|model| {
                let deviation = deviation(&plain, &rollout(&model, path)?);
                for surface in [false, true] {
                    for &count in &scenes {
                        let mut row = timed(&model, path, surface, count, steps)?;
                        if count == 1 {
                            let scene = Scene::new(Arc::clone(&model), &scene_options(path))?;
                            push(
                                &scene,
                                &patch(&model),
                                0,
                                &mut vec![0.0; 3 * scene.node_count()],
                            )?;
                            let cost = cost::Cost::of(bundle.as_ref(), &model)?;
                            row["flops_and_bytes"] = json!(cost.of_step(&scene, None));
                        }
                        row["deviation_from_cpu_f32"] = json!(deviation);
                        row["nodes"] = json!(if surface { "surface" } else { "all" });
                        print(row, &reference, name, provider, count);
                    }
                }
                Ok(())
            });
            explain(rows, &reference, name, provider);
        }
        let name = "ONNX Runtime, the paper's split";
        let rows = papers(bundle.as_ref(), &reference, provider, steps);
        let rows = rows.map(|row| {
            row.into_iter()
                .for_each(|row| print(row, &reference, name, provider, 1));
        });
        explain(rows, &reference, name, provider);
    }
    Ok(())
}

/// Ways to run a bundle.
fn variants(provider: Provider) -> Vec<(&'static str, ModelOptions, StepPath)> {
    let plain = ModelOptions {
        providers: vec![provider],
        no_fallback: true,
        ..ModelOptions::default()
    };
    let (mut f16, mut graph, mut tf32) = (plain.clone(), plain.clone(), plain.clone());
    f16.precision = Some(Precision::F16);
    (graph.cuda_graph, tf32.allow_tf32) = (true, true);
    let mut all = vec![
        ("split", plain.clone(), StepPath::Split),
        ("whole step", plain.clone(), StepPath::Whole),
        ("as chosen", plain, StepPath::Auto),
        ("as chosen, float16", f16, StepPath::Auto),
        ("as chosen, CUDA graph", graph, StepPath::Auto),
        ("as chosen, TF32", tf32, StepPath::Auto),
    ];
    all.truncate(match provider {
        Provider::Cpu => 4,
        Provider::Cuda => 6,
        Provider::TensorRt | Provider::TensorRtRtx => 5,
    });
    all
}

fn print(mut row: Value, model: &Model, variant: &str, provider: Provider, scenes: usize) {
    row["bundle"] = json!(model.manifest.name);
    row["node_count"] = json!(model.info().node_count);
    row["variant"] = json!(variant);
    row["provider"] = json!(provider.name());
    row["scenes"] = json!(scenes);
    println!("{row}");
}

fn explain(outcome: upt::Result<()>, model: &Model, variant: &str, provider: Provider) {
    if let Err(error) = outcome {
        let what = format!("{}, {variant}, {}", model.manifest.name, provider.name());
        println!(
            "{}",
            json!({"not_measured": what, "why": error.to_string()})
        );
    }
}

fn scene_options(path: StepPath) -> SceneOptions {
    SceneOptions {
        step_path: path,
        corrections: Corrections::None,
        guard_policy: GuardPolicy::Report,
        no_sleep: true,
        ..SceneOptions::default()
    }
}

/// Nodes of the domain within 8 mm of its middle one.
fn patch(model: &Model) -> Vec<u32> {
    let domain = model.indices(IndexSet::DomainNodes);
    let position = |node: u32| &model.positions()[3 * node as usize..3 * node as usize + 3];
    let centre = position(domain[domain.len() / 2]);
    let near = |&node: &u32| {
        let apart = position(node)
            .iter()
            .zip(centre)
            .map(|(a, b)| (a - b).powi(2));
        apart.sum::<f32>() < 64.0
    };
    domain.iter().copied().filter(near).collect()
}

fn pushed(nodes: &[u32], t: usize) -> Vec<f32> {
    [0.0, 0.0, -5.0 + 0.1 * (t % 7) as f32].repeat(nodes.len())
}

fn push(scene: &Scene, nodes: &[u32], t: usize, out: &mut [f32]) -> upt::Result<()> {
    let vectors = &pushed(nodes, t);
    let (displacement, contact) = (None, Contact::Sparse { nodes, vectors });
    let input = StepInput {
        displacement,
        contact,
    };
    scene.step(input, Some(out))
}

fn rollout(model: &Arc<Model>, path: StepPath) -> upt::Result<Vec<f32>> {
    let scene = Scene::new(Arc::clone(model), &scene_options(path))?;
    let (nodes, mut frames) = (patch(model), Vec::new());
    let mut out = vec![0.0; 3 * scene.node_count()];
    for t in 0..ROLLOUT {
        push(&scene, &nodes, t, &mut out)?;
        frames.extend_from_slice(&out);
    }
    Ok(frames)
}

/// Largest difference over the largest displacement of a rollout.
fn deviation(plain: &[f32], found: &[f32]) -> f32 {
    let largest = plain.iter().fold(1e-6f32, |a, x| a.max(x.abs()));
    let differences = plain.iter().zip(found).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f32::max) / largest
}

/// Steps of `count` scenes at once, a thread each; percentiles over all of them, means of a step's parts.
fn timed(
    model: &Arc<Model>,
    path: StepPath,
    surface: bool,
    count: usize,
    steps: usize,
) -> upt::Result<Value> {
    let (nodes, start_line) = (&patch(model), &Barrier::new(count));
    let scene = || {
        let scene = Scene::new(Arc::clone(model), &scene_options(path))?;
        scene.set_region(surface.then(|| model.indices(IndexSet::SurfaceNodes)))?;
        Ok(scene)
    };
    let made = (0..count)
        .map(|_| scene())
        .collect::<upt::Result<Vec<Scene>>>()?;
    let run = |scene: &Scene| -> upt::Result<Vec<[f64; 4]>> {
        let mut out = vec![0.0; 3 * scene.region_count()];
        (0..WARM_UP).try_for_each(|t| push(scene, nodes, t, &mut out))?;
        start_line.wait();
        let mut times = Vec::with_capacity(steps);
        for t in 0..steps {
            let start = Instant::now();
            push(scene, nodes, t, &mut out)?;
            let ms = start.elapsed().as_secs_f64() * 1e3;
            let s = scene.stats();
            let compute = s.latent_ms + s.decode_ms - s.upload_ms - s.download_ms;
            times.push([ms, s.upload_ms, compute, s.download_ms]);
        }
        Ok(times)
    };
    let times: upt::Result<Vec<_>> = std::thread::scope(|scope| {
        let threads: Vec<_> = made
            .iter()
            .map(|scene| scope.spawn(|| run(scene)))
            .collect();
        let panicked = |_| Err(upt::Error::State("a scene's thread panicked".into()));
        threads
            .into_iter()
            .map(|thread| thread.join().unwrap_or_else(panicked))
            .collect()
    });
    let times = times?.concat();
    let mean = |part: usize| times.iter().map(|t| t[part]).sum::<f64>() / times.len() as f64;
    let mut row = percentiles(times.iter().map(|t| t[0]).collect());
    row["upload_ms"] = json!(mean(1));
    row["compute_ms"] = json!(mean(2));
    row["download_ms"] = json!(mean(3));
    let taken = made[0].stats();
    row["step_path"] = json!(format!("{:?}", taken.step_path).to_lowercase());
    row["kernel"] = json!(format!("{:?}", taken.kernel).to_lowercase());
    row["precision"] = json!(format!("{:?}", taken.precision).to_lowercase());
    row["ran_on"] = json!(taken.provider.name());
    Ok(row)
}

/// The paper's two graphs in ONNX Runtime alone; none for another kind of bundle.
fn papers(
    bundle: &Path,
    reference: &Arc<Model>,
    provider: Provider,
    steps: usize,
) -> upt::Result<Option<Value>> {
    let KindModel::Upt(kind) = &reference.kind else {
        return Ok(None);
    };
    let plan = ProviderPlan::new(&variants(provider)[0].1);
    let mut split = split::Split::new(bundle, reference, kind, 1, plan)?;
    let nodes = patch(reference);
    split.set_contact(kind, &nodes, &pushed(&nodes, 0));
    let mut times = Vec::new();
    for _ in 0..steps + WARM_UP {
        let start = Instant::now();
        split.run()?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    if split.displacement().iter().any(|u| !u.is_finite()) {
        return Err(upt::Error::State("the paper's split gave NaN".into()));
    }
    Ok(Some(percentiles(times.split_off(WARM_UP))))
}

fn percentiles(mut times: Vec<f64>) -> Value {
    times.sort_by(f64::total_cmp);
    let at = |percent: usize| times[(times.len() * percent).div_ceil(100).max(1) - 1];
    json!({"p50_ms": at(50), "p95_ms": at(95), "p99_ms": at(99), "steps": times.len()})
}
