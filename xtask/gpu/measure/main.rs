//! Times of bundles on one execution provider, for `xtask/gpu/run.sh`:
//!
//! `gpu-measure PROVIDER STEPS SCENES BUNDLE...`, with SCENES such as `1,2,4,8`, prints a JSON object a line: p50, p95 and
//! p99 of a step, the copies to the card and back, the deviation of a rollout from the CPU's float32 path, FLOP and bytes.
//! What the provider refuses is a line with `not_measured` and `why`. `tests/gpu_package.rs` rehearses it on
//! the CPU.

#[path = "../../../benches/step/cost.rs"]
mod cost;
#[path = "../../../benches/step/pushes.rs"]
mod pushes;
#[path = "../../../benches/step/split.rs"]
mod split;

use std::path::Path;
use std::sync::{Arc, Barrier};
use std::time::Instant;

use serde_json::{Value, json};
use upt::model::KindModel;
use upt::onnx::ProviderPlan;
use upt::{
    Corrections, Error, GuardPolicy, IndexSet, Model, ModelOptions, Precision, Provider, Result,
    Scene, SceneOptions, StepPath,
};

const WARM_UP: usize = 10;
/// Steps of the rollout that is compared with the CPU's, and of one of a mesh that takes the CPU seconds a step.
const ROLLOUT: usize = 40;
const SHORT_ROLLOUT: usize = 4;
const LARGE: usize = 100_000;

fn main() -> std::result::Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [provider, steps, scenes, bundles @ ..] = arguments.as_slice() else {
        return Err("usage: gpu-measure PROVIDER STEPS SCENES BUNDLE...".into());
    };
    use Provider::{Cpu, Cuda, TensorRt, TensorRtRtx};
    let provider = [Cpu, Cuda, TensorRt, TensorRtRtx]
        .into_iter()
        .find(|known| known.name() == provider)
        .ok_or("PROVIDER must be cpu, cuda, tensorrt or tensorrt-rtx")?;
    let steps = steps.parse()?;
    let scenes: std::result::Result<Vec<usize>, _> = scenes.split(',').map(str::parse).collect();
    let scenes = scenes?;
    for bundle in bundles {
        let path = Path::new(bundle);
        let reference = Way::open(path, &ModelOptions::default(), StepPath::Split)?;
        let plain = reference.rollout()?;
        for (name, options, step_path) in variants(provider) {
            let way = Way::open(path, &options, step_path);
            let rows = way.and_then(|way| way.rows(&plain, &scenes, steps));
            print(&reference.model, name, provider, rows);
        }
        let rows = papers(path, &reference, provider, steps);
        let name = "ONNX Runtime, the paper's split";
        print(&reference.model, name, provider, rows);
    }
    Ok(())
}

/// Ways to run a bundle.
fn variants(provider: Provider) -> Vec<(&'static str, ModelOptions, StepPath)> {
    let plain = ModelOptions {
        providers: vec![provider],
        fallback: false,
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

/// A line for each row, or for why there is none.
fn print(model: &Model, variant: &str, provider: Provider, rows: Result<Vec<Value>>) {
    let (bundle, card) = (&model.manifest.name, provider.name());
    match rows {
        Ok(rows) => rows.into_iter().for_each(|mut row| {
            row["bundle"] = json!(bundle);
            row["node_count"] = json!(model.info().node_count);
            row["variant"] = json!(variant);
            row["provider"] = json!(card);
            println!("{row}");
        }),
        Err(error) => {
            let what = format!("{bundle}, {variant}, {card}");
            let line = json!({"not_measured": what, "why": error.to_string()});
            println!("{line}");
        }
    }
}

/// A way to run a bundle.
struct Way {
    model: Arc<Model>,
    cost: cost::Cost,
    step_path: StepPath,
}

impl Way {
    fn open(path: &Path, options: &ModelOptions, step_path: StepPath) -> Result<Way> {
        let model = Model::open(path, options)?;
        let cost = cost::Cost::of(path, &model)?;
        Ok(Way {
            model,
            cost,
            step_path,
        })
    }

    fn scene(&self) -> Result<Scene> {
        let options = SceneOptions {
            step_path: self.step_path,
            corrections: Corrections::None,
            guard_policy: GuardPolicy::Report,
            sleep: false,
            ..SceneOptions::default()
        };
        Scene::new(Arc::clone(&self.model), &options)
    }

    /// Nodes in the middle of the domain.
    fn patch(&self) -> Vec<u32> {
        let mesh = &self.model.mesh;
        pushes::patch(mesh, mesh.domain.nodes.len() / 2)
    }

    fn rollout(&self) -> Result<Vec<f32>> {
        let (scene, nodes) = (self.scene()?, self.patch());
        let (mut frames, mut out) = (Vec::new(), vec![0.0; 3 * scene.node_count()]);
        let large = scene.node_count() > LARGE;
        for t in 0..if large { SHORT_ROLLOUT } else { ROLLOUT } {
            pushes::push(&scene, &nodes, t, Some(&mut out))?;
            frames.extend_from_slice(&out);
        }
        Ok(frames)
    }

    /// All nodes and the surface, and each number of scenes.
    fn rows(&self, plain: &[f32], scenes: &[usize], steps: usize) -> Result<Vec<Value>> {
        let found = self.rollout()?;
        let largest = plain.iter().fold(1e-6f32, |a, x| a.max(x.abs()));
        let differences = plain.iter().zip(&found).map(|(a, b)| (a - b).abs());
        let deviation = differences.fold(0.0, f32::max) / largest;
        let mut rows = Vec::new();
        for surface in [false, true] {
            for &count in scenes {
                let mut row = self.timed(surface, count, steps)?;
                row["deviation_from_cpu_f32"] = json!(deviation);
                row["nodes"] = json!(if surface { "surface" } else { "all" });
                row["scenes"] = json!(count);
                rows.push(row);
            }
        }
        Ok(rows)
    }

    /// Steps of `count` scenes at once, a thread each; percentiles over all of them, means of a step's parts.
    fn timed(&self, surface: bool, count: usize, steps: usize) -> Result<Value> {
        let (nodes, start_line) = (&self.patch(), &Barrier::new(count));
        let region = surface.then(|| self.model.indices(IndexSet::SurfaceNodes));
        let made = (0..count).map(|_| {
            let scene = self.scene()?;
            scene.set_region(region)?;
            Ok(scene)
        });
        let made = made.collect::<Result<Vec<Scene>>>()?;
        let run = |scene: &Scene| -> Result<Vec<[f64; 4]>> {
            let mut out = vec![0.0; 3 * scene.region_count()];
            (0..WARM_UP).try_for_each(|t| pushes::push(scene, nodes, t, Some(&mut out)))?;
            start_line.wait();
            let timed = (0..steps).map(|t| {
                let start = Instant::now();
                pushes::push(scene, nodes, t, Some(&mut out))?;
                let ms = start.elapsed().as_secs_f64() * 1e3;
                let s = scene.timing();
                let compute = s.latent_ms + s.decode_ms - s.upload_ms - s.download_ms;
                Ok([ms, s.upload_ms, compute, s.download_ms])
            });
            timed.collect()
        };
        let times: Vec<[f64; 4]> = std::thread::scope(|scope| {
            let start = |scene| scope.spawn(move || run(scene));
            let threads: Vec<_> = made.iter().map(start).collect();
            let panicked = |_| Err(Error::State("a scene's thread panicked".into()));
            let ends = threads.into_iter();
            let times = ends.map(|thread| thread.join().unwrap_or_else(panicked));
            times.collect::<Result<Vec<_>>>().map(|all| all.concat())
        })?;
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
        if count == 1 {
            row["flops_and_bytes"] = json!(self.cost.of_step(&made[0], region));
        }
        Ok(row)
    }
}

/// The paper's two graphs in ONNX Runtime alone; none for another kind of bundle.
fn papers(bundle: &Path, reference: &Way, provider: Provider, steps: usize) -> Result<Vec<Value>> {
    let KindModel::Upt(kind) = &reference.model.kind else {
        return Ok(Vec::new());
    };
    let plan = ProviderPlan::new(&variants(provider)[0].1);
    let mut split = split::Split::new(bundle, &reference.model, kind, 1, plan)?;
    let nodes = reference.patch();
    split.set_contact(kind, &nodes, &pushes::pushed(&nodes, 0), &[]);
    let mut times = Vec::new();
    for _ in 0..steps + WARM_UP {
        let start = Instant::now();
        split.run()?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    if split.displacement().iter().any(|u| !u.is_finite()) {
        return Err(Error::State("the paper's split gave NaN".into()));
    }
    let mut row = percentiles(times.split_off(WARM_UP));
    row["scenes"] = json!(1);
    Ok(vec![row])
}

fn percentiles(times: Vec<f64>) -> Value {
    let times = gauge::Sorted::of(times);
    let at = |share| times.quantile(share);
    json!({"p50_ms": times.median(), "p95_ms": at(0.95), "p99_ms": at(0.99), "steps": times.len()})
}
