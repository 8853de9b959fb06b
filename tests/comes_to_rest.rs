//! Every bundle that ships falls asleep after a push, wherever and however it was pushed: an idle scene costs nothing.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use upt::kernels::Isa;
use upt::{Contact, IndexSet, Model, ModelOptions, Scene, SceneOptions, StepInput};

/// Bytes of the network.
fn network(bundle: &Path) -> u64 {
    std::fs::metadata(bundle.join("latent.onnx")).map_or(0, |file| file.len())
}

/// Pushes of each bundle, with `UPT_NIGHTLY=1` three times as many. There are fewer where a step takes ten times as long or more: without
/// vector instructions, and through a network of more than three megabytes.
fn pushes(bundle: &Path) -> u64 {
    let nightly = std::env::var_os("UPT_NIGHTLY").is_some_and(|value| value == "1");
    let times = if nightly { 3 } else { 1 };
    match Isa::detect() {
        Isa::Scalar => 6 * times,
        _ if network(bundle) > 3_000_000 => 6 * times,
        _ => 36 * times,
    }
}

/// Steps without contact in which a scene must have fallen asleep: 20 s of tissue.
const PATIENCE: usize = 400;

/// The slowest first, so that none of them is left alone at the end.
fn shipped() -> Vec<PathBuf> {
    let folder = fixture::root().join("onnx");
    let mut found: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.join("bundle.json").is_file())
        .collect();
    found.sort_by_key(|path| (std::cmp::Reverse(network(path)), path.clone()));
    found
}

/// splitmix64, as a number in `[0, 1)`.
fn random(state: &mut u64) -> f32 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let x = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((x ^ (x >> 31)) >> 40) as f32 / (1 << 24) as f32
}

/// A patch of the domain and a push into the body, of up to the trained length.
fn push(model: &Model, seed: u64) -> (Vec<u32>, [f32; 3]) {
    let mut state = seed;
    let (positions, domain) = (model.positions(), model.indices(IndexSet::DomainNodes));
    let place = |node: u32| [0, 1, 2].map(|axis| positions[3 * node as usize + axis]);
    let centre = place(domain[(random(&mut state) * domain.len() as f32) as usize]);
    let distance = |a: [f32; 3]| {
        (0..3)
            .map(|k| (a[k] - centre[k]).powi(2))
            .sum::<f32>()
            .sqrt()
    };
    let near = domain
        .iter()
        .copied()
        .filter(|&node| distance(place(node)) < 7.0);
    let count = positions.len() as f32 / 3.0;
    let middle = [0, 1, 2].map(|axis| positions.iter().skip(axis).step_by(3).sum::<f32>() / count);
    let mut inward = [0, 1, 2].map(|k| middle[k] - centre[k]);
    let size = inward.iter().map(|x| x * x).sum::<f32>().sqrt();
    let depth = (0.2 + 0.8 * random(&mut state)) * model.info().max_push_mm;
    inward = inward.map(|x| depth * (x / size + 0.6 * (random(&mut state) - 0.5)));
    (near.collect(), inward)
}

/// Verifies REQ-034.
#[test]
fn shipped_bundles_fall_asleep_after_random_pushes() {
    fixture::find_runtime();
    let (bundles, next) = (shipped(), AtomicUsize::new(0));
    let work = || {
        while let Some(path) = bundles.get(next.fetch_add(1, Ordering::Relaxed)) {
            falls_asleep(path);
        }
    };
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers.min(bundles.len()) {
            scope.spawn(work);
        }
    });
}

fn falls_asleep(path: &Path) {
    let options = ModelOptions {
        threads: 1,
        ..ModelOptions::default()
    };
    let model = Model::open(path, &options).unwrap();
    let scene = Scene::new(model.clone(), &SceneOptions::default()).unwrap();
    let mut longest = 0;
    for seed in 0..pushes(path) {
        scene.reset().unwrap();
        let (nodes, end) = push(&model, seed);
        let steps = 1 + seed as usize % 6;
        for t in 1..=steps {
            let now = end.map(|x| x * t as f32 / steps as f32);
            let vectors = now.repeat(nodes.len());
            let contact = Contact::Sparse {
                nodes: &nodes,
                vectors: &vectors,
            };
            // The guard may refuse a push; the tissue comes back from what there was.
            let _ = scene.step(contact, None);
        }
        let free = StepInput::from(Contact::None);
        let asleep = (1..=PATIENCE).find(|_| {
            scene.step(free, None).unwrap();
            scene.stats().sleeping
        });
        let stats = scene.stats();
        let asleep = asleep.unwrap_or_else(|| {
            panic!(
                "{}: push {seed} is {} mm from rest and awake",
                path.display(),
                stats.max_displacement_mm
            )
        });
        longest = longest.max(asleep);
    }
    println!("{}: asleep after at most {longest} steps", path.display());
}
