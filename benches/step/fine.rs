//! A finer mesh against the bundle's own, the same number of surface nodes decoded: what is static is free, so the time
//! should hardly grow with K. Bundles without a prior can run on another mesh; the file is `UPT_FINE_MESH`.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use gauge::resident_bytes;
use upt::bundle::Mesh;
use upt::{Model, Scene, SceneOptions};

use super::measure::{Row, quick};
use super::{options, patch, push};

pub fn against_bundle_mesh(model: &Arc<Model>, name: &str) -> upt::Result<()> {
    if model.prior.is_some() {
        return Ok(());
    }
    let Some(path) = std::env::var_os("UPT_FINE_MESH").map(PathBuf::from) else {
        println!(
            "{name}: left out: steps on a finer mesh; UPT_FINE_MESH names none (python -m upt_training.anatomy --nodes 151201 --out FILE)"
        );
        return Ok(());
    };
    let own = Scene::new(Arc::clone(model), &options(1))?;
    // What ONNX Runtime keeps from a first run is the own scene's, not the fine one's.
    push(&own, &patch(own.mesh(), 300), 0, None)?;
    let before = resident_bytes();
    let fine = Scene::new(
        Arc::clone(model),
        &SceneOptions {
            mesh_path: Some(path),
            ..options(1)
        },
    )?;
    let count = own.mesh().surface.nodes.len();
    let scenes = [&own, &fine];
    let patches = scenes.map(|scene| patch(scene.mesh(), 300));
    for scene in scenes {
        scene.set_region(Some(&spread(scene.mesh(), count)))?;
    }
    let mut out = vec![0.0; 3 * count];
    let mut times = [Vec::new(), Vec::new()];
    for t in 0..if quick() { 15 } else { 101 } {
        for ((scene, nodes), times) in scenes.iter().zip(&patches).zip(&mut times) {
            let start = Instant::now();
            push(scene, nodes, t, Some(&mut out))?;
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    if let (Some(before), Some(after)) = (before, resident_bytes()) {
        let memory = after.saturating_sub(before) as f64 / 1e6;
        Row::new(
            format!(
                "{name}/scene on a mesh of its own, K = {}/resident memory",
                fine.node_count()
            ),
            memory,
            "MB",
        )
        .limits(Some(300.0), Some(150.0))
        .print();
    }
    let [own_ms, fine_ms] = times.map(gauge::median);
    println!(
        "{name}, {count} surface nodes, 1 thread: K = {} {own_ms:.2} ms, K = {} {fine_ms:.2} ms",
        own.node_count(),
        fine.node_count()
    );
    Row::new(
        format!(
            "{name}/step at K = {} over step at K = {}, {count} surface nodes",
            fine.node_count(),
            own.node_count()
        ),
        fine_ms / own_ms,
        "",
    )
    .limits(Some(2.0), Some(1.3))
    .print();
    Ok(())
}

/// `count` surface nodes, evenly through the mesh's list.
fn spread(mesh: &Mesh, count: usize) -> Vec<u32> {
    let nodes = &mesh.surface.nodes;
    (0..count).map(|i| nodes[i * nodes.len() / count]).collect()
}
