//! Products and sums of a step, and the bytes that it must touch. GELU, softmax and norms are not counted. Bytes are
//! tables, weights and results, each once.

use std::path::Path;

use serde::Deserialize;
use upt::kernels::rows::Stored;
use upt::model::{KindModel, ReducedModel, UptModel};
use upt::prior::PriorTable;
use upt::{Model, Scene};

/// What of `bundle.json` says how large the network between the native parts is.
#[derive(Deserialize)]
struct Architecture {
    encoder_depth: usize,
    latent: usize,
    approximator_depth: usize,
    mlp_ratio: usize,
}

#[derive(Default)]
pub struct Cost {
    flops: f64,
    bytes: f64,
    flops_a_node: f64,
    bytes_a_node: f64,
    /// Of the nodes that the network decodes: the anchors where the bundle has them.
    flops_a_network_node: f64,
    bytes_a_network_node: f64,
    flops_a_contact: f64,
    bytes_a_contact: f64,
    known: bool,
}

impl Cost {
    pub fn of(path: &Path, model: &Model) -> upt::Result<Cost> {
        let latent = path.join("latent.onnx");
        let latent = std::fs::metadata(&latent).map_or(0.0, |file| file.len() as f64);
        let mut cost = Cost {
            bytes: latent,
            // The state is written once.
            bytes_a_node: 12.0,
            known: true,
            ..Cost::default()
        };
        match &model.kind {
            KindModel::Upt(kind) => cost.add_network(path, kind),
            KindModel::Reduced(kind) => cost.add_correction(model, kind, latent),
        }
        if let Some(table) = &model.prior {
            cost.add_prior(table, model.info().node_count as f64);
        }
        Ok(cost)
    }

    fn add_network(&mut self, path: &Path, kind: &UptModel) {
        let (dims, tables) = (&kind.entry.dims, &kind.tables);
        let f = kind.entry.feature_width() as f64;
        let (n, d) = (tables.graph.supernodes.len() as f64, dims.encoder as f64);
        let edges = tables.graph.neighbours.len() as f64;
        // Encoder: the low-rank update of each edge's source row and each target row, add, accumulate.
        self.flops += (edges + n) * 2.0 * f * d + 2.0 * edges * d;
        self.bytes += 4.0 * (tables.encode_nodes.len() as f64 + n) * (d + f);
        let Some(a) = architecture(path) else {
            self.known = false;
            return;
        };
        let (l, w) = (dims.latent_tokens as f64, a.latent as f64);
        let (h, r) = (dims.decoder as f64, a.mlp_ratio as f64);
        let block = |n: f64, d: f64| n * (8.0 + 4.0 * r) * d * d + 4.0 * n * n * d;
        self.flops += 2.0 * n * d * d + a.encoder_depth as f64 * block(n, d);
        self.flops += 4.0 * n * d * w + l * (4.0 + 4.0 * r) * w * w + 4.0 * l * n * w;
        self.flops += a.approximator_depth as f64 * block(l, w) + 4.0 * l * w * h;
        self.flops_a_network_node += kind.decoder.flops(dims.latent_tokens) as f64;
        self.bytes_a_network_node += 4.0 * dims.query as f64;
    }

    /// The network's weights are used once each; the residual modes are added to the coordinates.
    fn add_correction(&mut self, model: &Model, kind: &ReducedModel, latent: f64) {
        let width = model.prior.as_ref().map_or(0, |table| table.width());
        let modes = kind.learned.as_ref().map_or(0, |map| map.entry.modes);
        self.flops += latent / 2.0 + 2.0 * (modes * width) as f64;
        self.bytes += 4.0 * (modes * width) as f64;
    }

    /// Forces by the kept factor, rows of the response, rows of the basis.
    fn add_prior(&mut self, table: &PriorTable, nodes: f64) {
        let (basis, basis_size) = size(&table.basis().basis);
        let (response, response_size) = size(&table.response.stored());
        let response = response / table.contact_nodes.len() as f64;
        self.flops_a_node += 2.0 * basis / nodes;
        self.bytes_a_node += basis * basis_size / nodes;
        self.flops_a_contact += 2.0 * response;
        self.bytes_a_contact += response * response_size;
    }

    /// FLOP and bytes of the last step of a scene that shows `region`; `None` where bundle.json has no
    /// `provenance.architecture`.
    pub fn of_step(&self, scene: &Scene, region: Option<&[u32]>) -> Option<[f64; 2]> {
        let stats = scene.stats();
        let (nodes, contacts) = (stats.decoded_node_count as f64, stats.contact_count as f64);
        let network = network_nodes(scene.model(), region).unwrap_or(nodes);
        let sum = |fixed, a_node, a_network_node, a_contact| {
            fixed + nodes * a_node + network * a_network_node + contacts * a_contact
        };
        self.known.then_some([
            sum(
                self.flops,
                self.flops_a_node,
                self.flops_a_network_node,
                self.flops_a_contact,
            ),
            sum(
                self.bytes,
                self.bytes_a_node,
                self.bytes_a_network_node,
                self.bytes_a_contact,
            ),
        ])
    }
}

/// Anchors that the nodes of a region, or all, follow; `None` for a bundle that decodes every node.
fn network_nodes(model: &Model, region: Option<&[u32]>) -> Option<f64> {
    let KindModel::Upt(kind) = &model.kind else {
        return None;
    };
    let anchors = kind.tables.anchors.as_ref()?;
    let Some(region) = region else {
        return Some(anchors.nodes().len() as f64);
    };
    let mut used = vec![false; model.mesh.node_count()];
    for &node in region {
        for &anchor in anchors.of(node).0 {
            used[anchor as usize] = true;
        }
    }
    Some(used.into_iter().filter(|&used| used).count() as f64)
}

fn architecture(path: &Path) -> Option<Architecture> {
    let text = std::fs::read_to_string(path.join("bundle.json")).ok()?;
    let manifest: serde_json::Value = serde_json::from_str(&text).ok()?;
    serde_json::from_value(manifest["provenance"]["architecture"].clone()).ok()
}

/// How many numbers, and the bytes of one.
fn size(numbers: &Stored) -> (f64, f64) {
    match numbers {
        Stored::F32(values) => (values.len() as f64, 4.0),
        Stored::F16(values) => (values.len() as f64, 2.0),
    }
}
