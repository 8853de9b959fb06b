//! ONNX Runtime with the paper's split: messages per edge, mean on the host, the rest in one graph over all nodes.

use std::path::Path;

use upt::Model;
use upt::bundle::Feature;
use upt::model::UptModel;
use upt::onnx::{ProviderPlan, Runtime, Stage, StageOptions, Tensors};

/// The two graphs and the edges between them.
pub struct Split {
    encoder: Stage,
    decoder: Stage,
    offsets: Vec<u32>,
    width: usize,
}

impl Split {
    /// Sessions of the graphs in the bundle's folder.
    pub fn new(
        path: &Path,
        model: &Model,
        kind: &UptModel,
        threads: usize,
        plan: ProviderPlan,
    ) -> upt::Result<Split> {
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
        let stage = StageOptions { threads, plan };
        let encoder = Stage::with_constants(
            runtime,
            "paper_encoder.onnx",
            &read("paper_encoder.onnx")?,
            &Tensors {
                inputs: &[("features", &[count, f])],
                constants: &[("positions", &[count, 3], model.positions())],
                indices: &[
                    ("edge_source", &[source.len()], &source),
                    ("edge_target", &[target.len()], &target),
                ],
                outputs: &[("messages", &[source.len(), d])],
            },
            &stage,
        )?;
        let decoder = Stage::with_constants(
            runtime,
            "paper_decoder.onnx",
            &read("paper_decoder.onnx")?,
            &Tensors {
                inputs: &[("supernodes", &[rows, d])],
                constants: &[("positions", &[count, 3], model.positions())],
                outputs: &[("displacement", &[count, 3])],
                ..Tensors::default()
            },
            &stage,
        )?;
        Ok(Split {
            encoder,
            decoder,
            offsets: graph.offsets.clone(),
            width: d,
        })
    }

    /// Features of rest with a contact, and what linear elasticity answers to it (`[K,3]`, empty where no feature asks).
    pub fn set_contact(&mut self, kind: &UptModel, nodes: &[u32], vectors: &[f32], linear: &[f32]) {
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
            if *feature == Feature::Prior {
                for (row, p) in features.chunks_exact_mut(f).zip(linear.chunks_exact(3)) {
                    (0..3).for_each(|axis| row[column + axis] = scaled(p[axis], axis));
                }
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

    /// One step without boundary conditions.
    pub fn run(&mut self) -> upt::Result<()> {
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

    /// `[K,3]`, mm, of the last run.
    pub fn displacement(&self) -> &[f32] {
        self.decoder.output(0)
    }
}
