//! Decoder anchors (`anchors.safetensors` of `docs/reference/formats.md`): the correction of a `upt` bundle is smooth, so it is
//! decoded at a part of the nodes and interpolated to the others.

use crate::bundle::TensorFile;
use crate::error::Result;
use crate::memory::HeldBytes;

/// Largest difference of a node's sum of weights from one.
const SUM_TOLERANCE: f32 = 1e-3;

/// Nodes that are decoded, and how the others follow.
#[derive(Debug, HeldBytes)]
pub struct Anchors {
    nodes: Vec<u32>,
    /// Nodes of the mesh `[K,n]`.
    neighbours: Vec<u32>,
    weights: Vec<f32>,
    per_node: usize,
}

impl Anchors {
    /// Reads and checks the tables for a mesh: `nodes [M]` ascending, `neighbours [K,n]` places in `nodes`,
    /// `weights [K,n]`, of which a node's add up to one.
    ///
    /// # Errors
    /// A bundle error that names tensor and element.
    pub fn parse(file: &TensorFile, node_count: usize) -> Result<Anchors> {
        let nodes = file.ascending("nodes", node_count)?;
        let shape = [Some(node_count), None];
        let mut neighbours = file.indices("neighbours", &shape, nodes.len())?;
        let weights = file.f32("weights", &shape)?;
        let per_node = neighbours.len() / node_count;
        if per_node == 0 || weights.len() != neighbours.len() {
            return Err(file.bad(
                "weights",
                "must have the shape of `neighbours`, [K,n], n > 0",
            ));
        }
        let wrong = |w: &[f32]| (w.iter().sum::<f32>() - 1.0).abs() > SUM_TOLERANCE;
        if let Some(node) = weights.chunks_exact(per_node).position(wrong) {
            return Err(file.bad(
                "weights",
                format!("those of node {node} do not add up to 1"),
            ));
        }
        for neighbour in &mut neighbours {
            *neighbour = nodes[*neighbour as usize];
        }
        Ok(Anchors {
            nodes,
            neighbours,
            weights,
            per_node,
        })
    }

    /// The nodes that are decoded `[M]`, ascending.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// The anchors that a node follows, as nodes of the mesh, and their weights.
    pub fn of(&self, node: u32) -> (&[u32], &[f32]) {
        let row = node as usize * self.per_node..(node as usize + 1) * self.per_node;
        (&self.neighbours[row.clone()], &self.weights[row])
    }
}
