//! Whole steps of a trained bundle against its network split as in the paper (`python -m upt_training.paper_split`).
//!
//! The split gets linear elasticity's answer free of charge: its time is the network's alone. libupt's includes it, and the
//! interpolation where a bundle decodes only its anchors. The error is libupt's from the split with that answer added.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use upt::kernels::rows::{RowPlan, decode_rows};
use upt::kernels::{Isa, Pool};
use upt::model::UptModel;
use upt::onnx::ProviderPlan;
use upt::prior::ContactResponse;
use upt::{Model, Scene, SceneOptions};

use super::measure::{Row, relative_l2};
use super::options;
use super::paper::in_turns;
use super::pushes::{patch, pushed};
use super::split::Split;

/// The folder with the two graphs of this bundle: `NAME.split` where the bundles with random weights are.
pub fn graphs(name: &str) -> Option<PathBuf> {
    let folder =
        PathBuf::from(std::env::var_os("UPT_BENCH_BUNDLES")?).join(format!("{name}.split"));
    folder.join("paper_decoder.onnx").exists().then_some(folder)
}

pub fn against_split(
    graphs: &Path,
    model: &Arc<Model>,
    kind: &UptModel,
    name: &str,
) -> upt::Result<()> {
    let nodes = patch(&model.mesh, 0);
    let vectors = pushed(&nodes, 0);
    let linear = linear_elasticity(model, &nodes, &vectors)?;
    for threads in [1, 2] {
        let mut split = Split::new(graphs, model, kind, threads, ProviderPlan::cpu())?;
        split.set_contact(kind, &nodes, &vectors, &linear);
        let free = SceneOptions {
            boundary: false,
            ..options(threads)
        };
        let scene = Scene::new(Arc::clone(model), &free)?;
        let mut out = vec![0.0; 3 * scene.node_count()];
        let (ours, theirs) = in_turns(&mut split, &scene, &nodes, &vectors, &mut out)?;
        println!(
            "{name}, {threads} threads: {ours:.1} ms, its network split as in the paper {theirs:.1} ms"
        );
        let sum = |(a, b): (&f32, &f32)| a + b;
        let want: Vec<f32> = split.displacement().iter().zip(&linear).map(sum).collect();
        Row::new(
            format!("{name}/against the paper's split/{threads} threads"),
            theirs / ours,
            "times",
        )
        .against(
            format!("ONNX Runtime, paper's split, {theirs:.0} ms"),
            theirs / ours,
        )
        .error(relative_l2(&out, &want))
        .limits(Some(2.0), Some(3.0))
        .print();
    }
    Ok(())
}

/// What the bundle's tables of linear elasticity answer to the contact, `[K,3]`, mm.
fn linear_elasticity(model: &Model, nodes: &[u32], vectors: &[f32]) -> upt::Result<Vec<f32>> {
    let missing = || upt::Error::State("a split of a bundle without linear elasticity".into());
    let table = model.prior.as_ref().ok_or_else(missing)?;
    let (isa, pool) = (Isa::detect(), Pool::new(1)?);
    let mut held = vec![false; model.mesh.node_count()];
    let mut coordinates = vec![0.0; table.width()];
    let mut field = vec![0.0; 3 * held.len()];
    for &node in &model.mesh.held_nodes {
        held[node as usize] = true;
    }
    let mut response = ContactResponse::new(table)?;
    response.solve(isa, table, &held, nodes, vectors)?;
    response.field(isa, &pool, table, &mut coordinates)?;
    let (basis, rows) = (table.basis(), RowPlan::full(&table.basis()));
    decode_rows(isa, &pool, &basis, &rows, &coordinates, &mut field)?;
    Ok(field)
}
