//! Whole steps: the table of `docs/results/speed.md`.
//!
//! `cargo bench --bench step` runs every bundle in `onnx/` and in the folder that `UPT_BENCH_BUNDLES` names. A bundle that
//! carries `paper_encoder.onnx` and `paper_decoder.onnx` is also run through ONNX Runtime as the paper splits it, with
//! the same weights and threads; so is one whose two graphs are in the folder `NAME.split` next to the random bundles.
//! `cargo bench --bench step -- reduced` runs the bundles with that name only. `UPT_FINE_MESH=FILE` adds steps on that mesh
//! for bundles without a prior; those with one have bundles of their own there (`training/scripts/large_mesh.sh WORK ...`, then `UPT_LARGE_BUNDLES=WORK`).

mod bare;
mod cost;
mod crew;
mod fine;
mod floor;
#[path = "../measure/mod.rs"]
mod measure;
mod paper;
mod pushes;
mod reduced;
mod sleeping;
mod split;
mod steady;
mod tail;
mod trained;
mod windows;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use measure::Row;
use pushes::{patch, push, pushed};
use upt::model::KindModel;
use upt::{
    Contact, Corrections, GuardPolicy, IndexSet, Kind, Loads, Model, ModelOptions, Scene,
    SceneOptions, StepInput,
};

fn main() {
    measure::init_library();
    let machine = floor::Machine::measure();
    for bundle in measure::bundles() {
        let name = bundle.file_name().unwrap_or_default().to_string_lossy();
        if !measure::wanted(&name) {
            continue;
        }
        if let Err(error) = run(&bundle, &machine) {
            eprintln!("{}: {error}", bundle.display());
            std::process::exit(1);
        }
    }
}

fn run(path: &Path, machine: &floor::Machine) -> upt::Result<()> {
    let start = Instant::now();
    let model = Model::open(path, &ModelOptions::default())?;
    let scene = Scene::new(Arc::clone(&model), &options(1))?;
    scene.step(FREE, None)?;
    let opened = start.elapsed().as_secs_f64();
    drop(scene);
    let name = model.manifest.name.clone();
    let info = model.info();
    println!("{name}: K = {}, {:?}", info.node_count, info.kind);
    let small = info.node_count < LARGE;
    Row::new(format!("{name}/open to first step"), opened, "s")
        .limits(small.then_some(2.0), small.then_some(0.5))
        .print();
    let cost = cost::Cost::of(path, &model)?;
    for threads in [1, 2] {
        for surface in [false, true] {
            let scene = Scene::new(Arc::clone(&model), &options(threads))?;
            let region = surface.then(|| model.indices(IndexSet::SurfaceNodes));
            scene.set_region(region)?;
            let part = if surface { "surface" } else { "all" };
            let row = format!("{name}/{part}/{threads} threads");
            let ms = steady::measure(
                &scene,
                region,
                &cost,
                &row,
                limits(&model, threads, surface),
            )?;
            machine.print_floor(&cost, &scene, region, &row, ms);
        }
    }
    if info.kind == Kind::Reduced {
        reduced::site_change(&model, &name)?;
    }
    sleeping::measure(&model, &name)?;
    if let KindModel::Upt(kind) = &model.kind {
        if path.join("paper_encoder.onnx").exists() {
            paper::against_split(path, &model, kind, &name)?;
        } else if let Some(graphs) = trained::graphs(&name) {
            trained::against_split(&graphs, &model, kind, &name)?;
        }
        fine::against_bundle_mesh(&model, &name)?;
    }
    Ok(())
}

/// Nodes from which a mesh counts as the large one (150,140 nodes, `training/scripts/large_mesh.sh`).
const LARGE: u64 = 100_000;

/// Whether a bundle is one of `onnx/` for real time: trained, of a mesh that is not the large one, and not of the
/// paper's size, which is measured against the paper's split.
fn ships(model: &Model) -> bool {
    let paper_size =
        matches!(&model.kind, KindModel::Upt(kind) if kind.entry.dims.latent_tokens >= 256);
    model.manifest.name.starts_with("brain-") && model.info().node_count < LARGE && !paper_size
}

/// Bar and goal of a step, ms, for trained weights. Random ones have neither.
fn limits(model: &Model, threads: usize, surface: bool) -> (Option<f64>, Option<f64>) {
    if threads == 1 || !model.manifest.name.starts_with("brain-") {
        return (None, None);
    }
    let info = model.info();
    if !ships(model) {
        return match (info.kind, surface) {
            (Kind::Reduced, true) => (Some(6.0), Some(2.0)),
            _ => (None, None),
        };
    }
    match (info.kind, surface) {
        (Kind::Reduced, false) => (Some(3.0), Some(1.0)),
        (Kind::Reduced, true) => (Some(1.5), Some(0.4)),
        (Kind::Upt, false) => (Some(10.0), Some(5.0)),
        (Kind::Upt, true) => (Some(6.0), Some(3.0)),
    }
}

const FREE: StepInput<'static> = StepInput {
    displacement: None,
    contact: Contact::None,
    loads: Loads::NONE,
    time_s: 0.0,
};

fn options(threads: usize) -> SceneOptions {
    SceneOptions {
        threads,
        guard_policy: GuardPolicy::Report,
        sleep: false,
        // What the learned part costs; corrections are measured by training/scripts/corrections_table.py.
        corrections: Corrections::None,
        ..SceneOptions::default()
    }
}
