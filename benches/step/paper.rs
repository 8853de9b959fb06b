//! The paper's split in ONNX Runtime, taking turns with a scene: the same weights, input and threads.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use upt::model::UptModel;
use upt::onnx::ProviderPlan;
use upt::{Model, Scene, SceneOptions};

use super::measure::{Row, budget, median, quick, relative_error, relative_l2};
use super::split::Split;
use super::{options, patch, push, pushed};

pub fn against_split(
    path: &Path,
    model: &Arc<Model>,
    kind: &UptModel,
    name: &str,
) -> upt::Result<()> {
    let nodes = patch(&model.mesh, 300);
    for threads in [1, 2] {
        let mut split = Split::new(path, model, kind, threads, ProviderPlan::cpu())?;
        split.set_contact(kind, &nodes, &pushed(&nodes, 0));
        let scene = Scene::new(
            Arc::clone(model),
            &SceneOptions {
                free_boundary: true,
                ..options(threads)
            },
        )?;
        let mut out = vec![0.0; 3 * scene.node_count()];
        let (mut theirs, mut ours) = (Vec::new(), Vec::new());
        let started = Instant::now();
        for turn in 0..if quick() { 5 } else { 41 } {
            if turn >= 5 && started.elapsed() > budget() {
                break;
            }
            let start = Instant::now();
            split.run()?;
            theirs.push(start.elapsed().as_secs_f64() * 1e3);
            scene.reset()?;
            let start = Instant::now();
            push(&scene, &nodes, 0, Some(&mut out))?;
            ours.push(start.elapsed().as_secs_f64() * 1e3);
        }
        let error = relative_error(&out, split.displacement());
        let l2 = relative_l2(&out, split.displacement());
        let (ours, theirs) = (median(&mut ours), median(&mut theirs));
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
        .error(error)
        .limits(Some(1.6), Some(3.0))
        .print();
        Row::new(
            format!("{name}/error against the paper's split/{threads} threads"),
            l2,
            "relative L2",
        )
        .limits(Some(1e-6), None)
        .print();
        Row::new(
            format!("{name}/largest difference from the paper's split/{threads} threads"),
            error,
            "of the largest",
        )
        .limits(Some(1e-6), None)
        .print();
    }
    Ok(())
}
