//! The rows of one bundle on one provider.

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

use super::Wanted;
use super::cost::Cost;
use super::split::Split;

const WARM_UP: usize = 10;
/// Steps of the rollout that is compared with the CPU's.
const ROLLOUT: usize = 40;

/// A way to run a bundle.
struct Variant {
    name: &'static str,
    options: ModelOptions,
    path: StepPath,
}

fn variants(provider: Provider) -> Vec<Variant> {
    let plain = ModelOptions {
        providers: vec![provider],
        no_fallback: true,
        ..ModelOptions::default()
    };
    let with = |name, path, options| Variant {
        name,
        options,
        path,
    };
    let mut all = vec![
        with("split", StepPath::Split, plain.clone()),
        with("whole step", StepPath::Whole, plain.clone()),
        with("as chosen", StepPath::Auto, plain.clone()),
    ];
    let f16 = ModelOptions {
        precision: Some(Precision::F16),
        ..plain.clone()
    };
    all.push(with("as chosen, float16", StepPath::Auto, f16));
    if provider != Provider::Cpu {
        let graph = ModelOptions {
            cuda_graph: true,
            ..plain.clone()
        };
        all.push(with("as chosen, CUDA graph", StepPath::Auto, graph));
    }
    if provider == Provider::Cuda {
        let tf32 = ModelOptions {
            allow_tf32: true,
            ..plain
        };
        all.push(with("as chosen, TF32", StepPath::Auto, tf32));
    }
    all
}

pub fn measure(
    wanted: &Wanted,
    bundle: &Path,
    rows: &mut Vec<Value>,
    missing: &mut Vec<Value>,
) -> upt::Result<()> {
    let reference = Model::open(bundle, &ModelOptions::default())?;
    let name = reference.manifest.name.clone();
    let provider = wanted.provider.name();
    let plain = rollout(&reference, StepPath::Split)?;
    for variant in variants(wanted.provider) {
        let mut skip = |error: upt::Error| {
            let what = format!("{name}, {}, {provider}", variant.name);
            missing.push(json!({"what": what, "why": error.to_string()}));
        };
        let model = match Model::open(bundle, &variant.options) {
            Ok(model) => model,
            Err(error) => {
                skip(error);
                continue;
            }
        };
        let deviation = match rollout(&model, variant.path) {
            Ok(found) => deviation(&plain, &found),
            Err(error) => {
                skip(error);
                continue;
            }
        };
        for surface in [false, true] {
            for &count in &wanted.scenes {
                let mut row = scenes(&model, variant.path, surface, count, wanted.steps)?;
                row["bundle"] = json!(name);
                row["variant"] = json!(variant.name);
                row["provider"] = json!(provider);
                row["nodes"] = json!(if surface { "surface" } else { "all" });
                row["scenes"] = json!(count);
                row["node_count"] = json!(model.info().node_count);
                row["deviation_from_cpu_f32"] = json!(deviation);
                let work = if count == 1 {
                    of_step(bundle, &model, variant.path)?
                } else {
                    None
                };
                if let Some([flops, bytes]) = work {
                    row["flops"] = json!(flops);
                    row["bytes"] = json!(bytes);
                }
                rows.push(row);
            }
        }
    }
    let KindModel::Upt(kind) = &reference.kind else {
        return Ok(());
    };
    let what = format!("{name}, the paper's split, {provider}");
    if !bundle.join("paper_encoder.onnx").exists() {
        missing.push(json!({"what": what, "why": "the bundle has no paper_encoder.onnx"}));
        return Ok(());
    }
    let plan = ProviderPlan::new(&variants(wanted.provider)[0].options);
    match Split::new(bundle, &reference, kind, 1, plan) {
        Ok(mut split) => {
            let nodes = patch(&reference);
            split.set_contact(kind, &nodes, &pushed(&nodes, 0));
            let mut times = Vec::new();
            for t in 0..wanted.steps + WARM_UP {
                let start = Instant::now();
                split.run()?;
                if t >= WARM_UP {
                    times.push(start.elapsed().as_secs_f64() * 1e3);
                }
            }
            if split.displacement().iter().any(|u| !u.is_finite()) {
                return Err(upt::Error::State("the paper's split gave NaN".into()));
            }
            let mut row = percentiles(times);
            row["bundle"] = json!(name);
            row["variant"] = json!("ONNX Runtime, the paper's split");
            row["provider"] = json!(provider);
            row["nodes"] = json!("all");
            row["scenes"] = json!(1);
            row["node_count"] = json!(reference.info().node_count);
            rows.push(row);
        }
        Err(error) => missing.push(json!({"what": what, "why": error.to_string()})),
    }
    Ok(())
}

fn options(path: StepPath) -> SceneOptions {
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
        let p = position(node);
        (0..3).map(|a| (p[a] - centre[a]).powi(2)).sum::<f32>() < 64.0
    };
    domain.iter().copied().filter(near).collect()
}

fn pushed(nodes: &[u32], t: usize) -> Vec<f32> {
    let depth = -5.0 + 0.1 * (t % 7) as f32;
    nodes.iter().flat_map(|_| [0.0, 0.0, depth]).collect()
}

fn step(scene: &Scene, nodes: &[u32], t: usize, out: &mut [f32]) -> upt::Result<()> {
    let vectors = pushed(nodes, t);
    let contact = Contact::Sparse {
        nodes,
        vectors: &vectors,
    };
    let displacement = None;
    scene.step(
        StepInput {
            displacement,
            contact,
        },
        Some(out),
    )
}

fn rollout(model: &Arc<Model>, path: StepPath) -> upt::Result<Vec<f32>> {
    let scene = Scene::new(Arc::clone(model), &options(path))?;
    let nodes = patch(model);
    let mut frames = Vec::new();
    let mut out = vec![0.0; 3 * scene.node_count()];
    for t in 0..ROLLOUT {
        step(&scene, &nodes, t, &mut out)?;
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

fn of_step(bundle: &Path, model: &Arc<Model>, path: StepPath) -> upt::Result<Option<[f64; 2]>> {
    let scene = Scene::new(Arc::clone(model), &options(path))?;
    let mut out = vec![0.0; 3 * scene.node_count()];
    step(&scene, &patch(model), 0, &mut out)?;
    Ok(Cost::of(bundle, model)?.of_step(&scene, None))
}

/// Steps of `count` scenes at once, a thread each; percentiles over all of them.
fn scenes(
    model: &Arc<Model>,
    path: StepPath,
    surface: bool,
    count: usize,
    steps: usize,
) -> upt::Result<Value> {
    let made: Vec<Scene> = (0..count)
        .map(|_| {
            let scene = Scene::new(Arc::clone(model), &options(path))?;
            if surface {
                scene.set_region(Some(model.indices(IndexSet::SurfaceNodes)))?;
            }
            Ok(scene)
        })
        .collect::<upt::Result<_>>()?;
    let start_line = Barrier::new(count);
    let (nodes, start_line) = (&patch(model), &start_line);
    let finished: Vec<upt::Result<(Vec<f64>, [f64; 3])>> = std::thread::scope(|scope| {
        let run = |scene: Scene| {
            move || {
                let mut out = vec![0.0; 3 * scene.region_count()];
                let (mut times, mut parts) = (Vec::new(), [0.0; 3]);
                for t in 0..WARM_UP {
                    step(&scene, nodes, t, &mut out)?;
                }
                start_line.wait();
                for t in 0..steps {
                    let start = Instant::now();
                    step(&scene, nodes, t, &mut out)?;
                    times.push(start.elapsed().as_secs_f64() * 1e3);
                    let s = scene.stats();
                    parts[0] += s.upload_ms / steps as f64;
                    parts[1] += s.download_ms / steps as f64;
                    parts[2] +=
                        (s.latent_ms + s.decode_ms - s.upload_ms - s.download_ms) / steps as f64;
                }
                Ok((times, parts))
            }
        };
        let threads: Vec<_> = made
            .into_iter()
            .map(|scene| scope.spawn(run(scene)))
            .collect();
        threads
            .into_iter()
            .map(|thread| {
                thread
                    .join()
                    .unwrap_or_else(|_| Err(upt::Error::State("a scene's thread panicked".into())))
            })
            .collect()
    });
    let (mut times, mut parts) = (Vec::new(), [0.0; 3]);
    for scene in finished {
        let (own, own_parts) = scene?;
        times.extend(own);
        for (sum, part) in parts.iter_mut().zip(own_parts) {
            *sum += part / count as f64;
        }
    }
    let mut row = percentiles(times);
    let [upload, download, compute] = parts;
    row["upload_ms"] = json!(upload);
    row["compute_ms"] = json!(compute);
    row["download_ms"] = json!(download);
    let taken = Scene::new(Arc::clone(model), &options(path))?.stats();
    row["step_path"] = json!(format!("{:?}", taken.step_path).to_lowercase());
    row["kernel"] = json!(format!("{:?}", taken.kernel).to_lowercase());
    row["ran_on"] = json!(taken.provider.name());
    row["precision"] = json!(format!("{:?}", taken.precision).to_lowercase());
    Ok(row)
}

fn percentiles(mut times: Vec<f64>) -> Value {
    times.sort_by(f64::total_cmp);
    let at = |percent: usize| times[(times.len() * percent).div_ceil(100).max(1) - 1];
    json!({"p50_ms": at(50), "p95_ms": at(95), "p99_ms": at(99), "steps": times.len()})
}
