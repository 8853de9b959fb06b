//! The paper's own split through ONNX Runtime, same weights: the rival that the library is measured against.
//!
//! `paper_encoder.onnx` (features -> one message an edge), the mean over each supernode's edges on the
//! host, `paper_decoder.onnx` (mean messages and positions -> displacement of all nodes). Positions and
//! the graph are inputs of every call, as in the paper; nothing static is kept between steps.

use anyhow::{Context, Result, bail};
use ort::session::Session;
use ort::value::TensorRef;
use tissue::mesh::{Boundary, Mesh};
use upt::bundle::Graph;
use upt::graph::SupernodeGraph;

use yardstick::bundle_folder::BundleFolder;

/// The node features that this rival can fill.
#[derive(Clone, Copy, PartialEq)]
enum Feature {
    Displacement,
    PreviousDisplacement,
    Collision,
    Contact,
}

pub struct PaperSplit {
    encoder: Session,
    decoder: Session,
    features: Vec<Feature>,
    mean: [f32; 3],
    deviation: [f32; 3],
    /// The prediction is an increment on the displacement.
    increment: bool,
    positions: Vec<f32>,
    held: Vec<u32>,
    edge_source: Vec<i64>,
    edge_target: Vec<i64>,
    supernodes: usize,
    state: Vec<[f32; 3]>,
    previous: Vec<[f32; 3]>,
    input: Vec<f32>,
    messages: Vec<f32>,
}

/// Whether the bundle carries the paper's split.
pub fn available(bundle: &BundleFolder) -> bool {
    bundle.path.join("paper_encoder.onnx").is_file()
        && bundle.path.join("paper_decoder.onnx").is_file()
}

impl PaperSplit {
    pub fn new(bundle: &BundleFolder, threads: u32) -> Result<Self> {
        let manifest: serde_json::Value =
            serde_json::from_slice(&std::fs::read(bundle.path.join("bundle.json"))?)?;
        let part = &manifest["upt"];
        let features = part["features"]
            .as_array()
            .context("bundle.json: field `upt.features` is missing")?
            .iter()
            .map(|name| match name.as_str() {
                Some("displacement") => Ok(Feature::Displacement),
                Some("previous_displacement") => Ok(Feature::PreviousDisplacement),
                Some("collision") => Ok(Feature::Collision),
                Some("contact") => Ok(Feature::Contact),
                other => bail!(
                    "{}: the paper's split has no feature {other:?}",
                    bundle.name
                ),
            })
            .collect::<Result<Vec<Feature>>>()?;
        let increment = match part["base"].as_str() {
            Some("none") | None => false,
            Some("displacement") => true,
            Some(other) => bail!(
                "{}: the paper's split cannot add the base `{other}`",
                bundle.name
            ),
        };
        let three = |name: &str| -> Result<[f32; 3]> {
            serde_json::from_value(part["normalisation"][name].clone())
                .with_context(|| format!("bundle.json: field `upt.normalisation.{name}`"))
        };
        let settings: Graph = serde_json::from_value(part["graph"].clone())
            .context("bundle.json: field `upt.graph`")?;
        let mesh = Mesh::read(&bundle.mesh_file)?;
        let boundary: Boundary = bundle.boundary.parse().map_err(anyhow::Error::msg)?;
        let mut domain: Vec<u32> = mesh
            .domain
            .iter()
            .flat_map(|face| mesh.surface[*face as usize])
            .collect();
        domain.sort_unstable();
        domain.dedup();
        let graph = SupernodeGraph::new(mesh.positions.as_flattened(), &domain, &settings)?;
        let mut edge_target = Vec::with_capacity(graph.neighbours.len());
        for (row, supernode) in graph.supernodes.iter().enumerate() {
            let degree = graph.offsets[row + 1] - graph.offsets[row];
            edge_target.extend(std::iter::repeat_n(i64::from(*supernode), degree as usize));
        }
        let session = |file: &str| -> Result<Session> {
            let runtime = upt::onnx::Runtime::get(None)?;
            let failed = |error: String| anyhow::anyhow!("{file}: {error}");
            let mut builder = Session::builder(runtime.environment())
                .map_err(|error| failed(error.to_string()))?
                .with_intra_threads(threads as usize)
                .map_err(|error| failed(error.to_string()))?
                .with_config_entry("session.force_spinning_stop", "1")
                .map_err(|error| failed(error.to_string()))?;
            builder
                .commit_from_file(bundle.path.join(file))
                .map_err(|error| failed(error.to_string()))
        };
        Ok(Self {
            encoder: session("paper_encoder.onnx")?,
            decoder: session("paper_decoder.onnx")?,
            features,
            mean: three("mean")?,
            deviation: three("std")?,
            increment,
            held: mesh.held_nodes(boundary),
            edge_source: graph
                .neighbours
                .iter()
                .map(|node| i64::from(*node))
                .collect(),
            edge_target,
            supernodes: graph.supernodes.len(),
            state: vec![[0.0; 3]; mesh.node_count()],
            previous: vec![[0.0; 3]; mesh.node_count()],
            input: Vec::new(),
            messages: Vec::new(),
            positions: mesh.positions.as_flattened().to_vec(),
        })
    }

    pub fn reset(&mut self) {
        self.state.fill([0.0; 3]);
        self.previous.fill([0.0; 3]);
    }

    fn fill_input(&mut self, nodes: &[u32], vectors: &[[f32; 3]]) -> usize {
        let width: usize = self
            .features
            .iter()
            .map(|feature| if *feature == Feature::Contact { 1 } else { 3 })
            .sum();
        self.input.resize(width * self.state.len(), 0.0);
        let normalised =
            |value: [f32; 3]| [0, 1, 2].map(|k| (value[k] - self.mean[k]) / self.deviation[k]);
        let mut at = 0;
        for feature in &self.features {
            for node in 0..self.state.len() {
                let row = &mut self.input[node * width + at..];
                match feature {
                    Feature::Displacement => {
                        row[..3].copy_from_slice(&normalised(self.state[node]))
                    }
                    Feature::PreviousDisplacement => {
                        row[..3].copy_from_slice(&normalised(self.previous[node]))
                    }
                    Feature::Collision => row[..3].copy_from_slice(&normalised([0.0; 3])),
                    Feature::Contact => row[0] = 0.0,
                }
            }
            for (node, vector) in nodes.iter().zip(vectors) {
                let row = &mut self.input[*node as usize * width + at..];
                match feature {
                    Feature::Collision => row[..3].copy_from_slice(&normalised(*vector)),
                    Feature::Contact => row[0] = 1.0,
                    _ => {}
                }
            }
            at += if *feature == Feature::Contact { 1 } else { 3 };
        }
        width
    }

    /// One step from the rival's own state; `out` `[K][3]`, mm.
    pub fn step(
        &mut self,
        nodes: &[u32],
        vectors: &[[f32; 3]],
        out: &mut [[f32; 3]],
    ) -> Result<()> {
        let count = self.state.len();
        let width = self.fill_input(nodes, vectors);
        let edges = self.edge_source.len();
        let messages = self.encoder.run(ort::inputs![
            "features" => TensorRef::from_array_view(([count, width], self.input.as_slice()))?,
            "positions" => TensorRef::from_array_view(([count, 3], self.positions.as_slice()))?,
            "edge_source" => TensorRef::from_array_view(([edges], self.edge_source.as_slice()))?,
            "edge_target" => TensorRef::from_array_view(([edges], self.edge_target.as_slice()))?,
        ])?;
        let (_, values) = messages["messages"].try_extract_tensor::<f32>()?;
        let depth = values.len() / edges;
        self.messages.clear();
        self.messages.resize(self.supernodes * depth, 0.0);
        // Edges come supernode after supernode.
        let mut start = 0;
        for row in 0..self.supernodes {
            let target = self.edge_target[start];
            let end = start
                + self.edge_target[start..]
                    .iter()
                    .take_while(|other| **other == target)
                    .count();
            let mean = &mut self.messages[row * depth..(row + 1) * depth];
            for edge in start..end {
                for (sum, value) in mean
                    .iter_mut()
                    .zip(&values[edge * depth..(edge + 1) * depth])
                {
                    *sum += value;
                }
            }
            mean.iter_mut().for_each(|sum| *sum /= (end - start) as f32);
            start = end;
        }
        drop(messages);
        let decoded = self.decoder.run(ort::inputs![
            "supernodes" => TensorRef::from_array_view(([self.supernodes, depth], self.messages.as_slice()))?,
            "positions" => TensorRef::from_array_view(([count, 3], self.positions.as_slice()))?,
        ])?;
        let (_, field) = decoded["displacement"].try_extract_tensor::<f32>()?;
        for (node, row) in out.iter_mut().enumerate() {
            let base = if self.increment {
                self.state[node]
            } else {
                [0.0; 3]
            };
            *row = [0, 1, 2].map(|k| base[k] + field[3 * node + k]);
        }
        for node in &self.held {
            out[*node as usize] = [0.0; 3];
        }
        for (node, vector) in nodes.iter().zip(vectors) {
            out[*node as usize] = *vector;
        }
        std::mem::swap(&mut self.previous, &mut self.state);
        self.state.copy_from_slice(out);
        Ok(())
    }
}
