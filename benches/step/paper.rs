//! ONNX Runtime with the paper's split (messages per edge, mean on the host, the rest in one graph over all nodes),
//! taking turns with a scene: the same weights, input and threads.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use upt::bundle::Feature;
use upt::model::UptModel;
use upt::onnx::{ProviderPlan, Runtime, Stage, StageOptions};
use upt::{Model, Scene, SceneOptions};

use super::measure::{Row, median, quick, relative_error};
use super::{options, patch, push, pushed};

/// The two graphs and the edges between them.
struct Split {
    encoder: Stage,
    decoder: Stage,
    offsets: Vec<u32>,
    width: usize,
}

impl Split {
    fn new(path: &Path, model: &Model, kind: &UptModel, threads: usize) -> upt::Result<Split> {
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
        let read = |file: &str| {
            std::fs::read(path.join(file)).map_err(|error| upt::Error::State(error.to_string()))
        };
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
        Ok(Split {
            encoder,
            decoder,
            offsets: graph.offsets.clone(),
            width: d,
        })
    }

    /// Features of rest with a contact.
    fn set_contact(&mut self, kind: &UptModel, nodes: &[u32], vectors: &[f32]) {
        let (f, norm) = (kind.entry.feature_width(), &kind.entry.normalisation);
        let features = self.encoder.input(0);
        let mut column = 0;
        for feature in &kind.entry.features {
            let width = feature.width();
            let scaled = |x: f32, axis: usize| {
                if width == 3 {
                    (x - norm.mean[axis]) / norm.std[axis]
                } else {
                    x
                }
            };
            for row in features.chunks_exact_mut(f) {
                (0..width).for_each(|axis| row[column + axis] = scaled(0.0, axis));
            }
            for (&node, c) in nodes.iter().zip(vectors.chunks_exact(3)) {
                let row = &mut features[node as usize * f + column..][..width];
                match feature {
                    Feature::Collision => (0..3).for_each(|axis| row[axis] = scaled(c[axis], axis)),
                    Feature::Contact => row[0] = 1.0,
                    _ => {}
                }
            }
            column += width;
        }
    }

    fn run(&mut self) -> upt::Result<()> {
        self.encoder.run()?;
        let (d, messages) = (self.width, self.encoder.output(0));
        for (row, sum) in self.decoder.input(0).chunks_exact_mut(d).enumerate() {
            let edges = self.offsets[row] as usize..self.offsets[row + 1] as usize;
            let degree = edges.len() as f32;
            sum.fill(0.0);
            for message in messages[edges.start * d..edges.end * d].chunks_exact(d) {
                for (s, m) in sum.iter_mut().zip(message) {
                    *s += m;
                }
            }
            sum.iter_mut().for_each(|s| *s /= degree);
        }
        self.decoder.run()
    }
}

pub fn against_split(
    path: &Path,
    model: &Arc<Model>,
    kind: &UptModel,
    name: &str,
) -> upt::Result<()> {
    let nodes = patch(&model.mesh, 300);
    for threads in [1, 2] {
        let mut split = Split::new(path, model, kind, threads)?;
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
        for _ in 0..if quick() { 5 } else { 41 } {
            let start = Instant::now();
            split.run()?;
            theirs.push(start.elapsed().as_secs_f64() * 1e3);
            scene.reset()?;
            let start = Instant::now();
            push(&scene, &nodes, 0, Some(&mut out))?;
            ours.push(start.elapsed().as_secs_f64() * 1e3);
        }
        let error = relative_error(&out, split.decoder.output(0));
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
            error,
            "of the largest",
        )
        .limits(Some(1e-6), None)
        .print();
    }
    Ok(())
}
