//! The paper's split in ONNX Runtime, taking turns with a scene: the same weights, input and threads; and how far both are
//! from the same step in float64, `reference.safetensors` of the bundle.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use gauge::median;
use upt::bundle::TensorFile;
use upt::model::UptModel;
use upt::onnx::ProviderPlan;
use upt::{Contact, Error, Model, Scene, SceneOptions, StepInput};

use super::measure::{Row, budget, quick, relative_error, relative_l2};
use super::options;
use super::split::Split;

/// A step from rest in float64 (`python -m upt_training.random_bundle --paper-split`).
struct Reference {
    nodes: Vec<u32>,
    vectors: Vec<f32>,
    /// `[K,3]`, mm, rounded to float32 once.
    displacement: Vec<f32>,
}

impl Reference {
    fn read(path: &Path, count: usize) -> upt::Result<Reference> {
        let file = path.join("reference.safetensors");
        let bytes = std::fs::read(&file).map_err(|error| {
            Error::State(format!(
                "{}: {error}; make it again with --paper-split",
                file.display()
            ))
        })?;
        let tensors = TensorFile::parse("reference.safetensors", bytes)?;
        let nodes = tensors.indices("contact_nodes", &[None], count)?;
        Ok(Reference {
            vectors: tensors.f32("contact_vectors", &[Some(nodes.len()), Some(3)])?,
            displacement: tensors.f32("displacement", &[Some(count), Some(3)])?,
            nodes,
        })
    }
}

pub fn against_split(
    path: &Path,
    model: &Arc<Model>,
    kind: &UptModel,
    name: &str,
) -> upt::Result<()> {
    let exact = Reference::read(path, model.mesh.node_count())?;
    for threads in [1, 2] {
        let mut split = Split::new(path, model, kind, threads, ProviderPlan::cpu())?;
        split.set_contact(kind, &exact.nodes, &exact.vectors, &[]);
        let scene = Scene::new(
            Arc::clone(model),
            &SceneOptions {
                boundary: false,
                ..options(threads)
            },
        )?;
        let mut out = vec![0.0; 3 * scene.node_count()];
        let (ours, theirs) = in_turns(&mut split, &scene, &exact.nodes, &exact.vectors, &mut out)?;
        println!(
            "{name}, {threads} threads: {ours:.1} ms, the paper's split in ONNX Runtime {theirs:.1} ms"
        );
        let rival = format!("ONNX Runtime, paper's split, {theirs:.0} ms");
        Row::new(
            format!("{name}/against the paper's split/{threads} threads"),
            theirs / ours,
            "times",
        )
        .against(rival, theirs / ours)
        .error(relative_error(&out, &exact.displacement))
        .limits(Some(2.0), Some(3.0))
        .print();
        let found = [
            (
                "libupt from float64",
                &out[..],
                &exact.displacement[..],
                Some(1e-6),
            ),
            (
                "the paper's split from float64",
                split.displacement(),
                &exact.displacement,
                None,
            ),
            (
                "libupt from the paper's split",
                &out,
                split.displacement(),
                None,
            ),
        ];
        for (pair, got, want, bar) in found {
            let row = format!("{name}/error of {pair}/{threads} threads");
            Row::new(row, relative_l2(got, want), "relative L2")
                .error(relative_error(got, want))
                .limits(bar, None)
                .print();
        }
    }
    Ok(())
}

/// Median times of a step from rest with this contact and of the split, ms, taking turns.
pub fn in_turns(
    split: &mut Split,
    scene: &Scene,
    nodes: &[u32],
    vectors: &[f32],
    out: &mut [f32],
) -> upt::Result<(f64, f64)> {
    let (mut theirs, mut ours) = (Vec::new(), Vec::new());
    let started = Instant::now();
    for turn in 0..if quick() { 5 } else { 41 } {
        if turn >= 5 && started.elapsed() > 4 * budget() {
            break;
        }
        let start = Instant::now();
        split.run()?;
        theirs.push(start.elapsed().as_secs_f64() * 1e3);
        scene.reset()?;
        let start = Instant::now();
        let contact = Contact::Sparse { nodes, vectors };
        let displacement = None;
        scene.step(
            StepInput {
                displacement,
                contact,
                ..StepInput::default()
            },
            Some(out),
        )?;
        ours.push(start.elapsed().as_secs_f64() * 1e3);
    }
    Ok((median(ours), median(theirs)))
}
