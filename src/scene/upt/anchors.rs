//! Decoding at anchors: which of them some nodes need, and the interpolation.

use crate::error::Result;
use crate::kernels::Pool;
use crate::kernels::parts::Parts;
use crate::memory::{self, HeldBytes};
use crate::model::Anchors;

/// Nodes a chunk of the interpolation.
const CHUNK: usize = 1024;

/// The anchors of the nodes that were asked for last, and a field for them.
#[derive(Debug, Default, HeldBytes)]
pub struct AnchorField {
    asked: Vec<u32>,
    anchors: Vec<u32>,
    used: Vec<bool>,
    field: Vec<f32>,
}

impl AnchorField {
    /// Room for a mesh of `node_count` nodes.
    pub fn new(anchors: &Anchors, node_count: usize) -> Result<AnchorField> {
        const WHAT: &str = "a scene's anchors";
        Ok(AnchorField {
            asked: memory::room(node_count, WHAT)?,
            anchors: memory::room(anchors.nodes().len(), WHAT)?,
            used: memory::filled(node_count, false, WHAT)?,
            field: memory::zeros(3 * node_count, WHAT)?,
        })
    }

    /// The nodes to decode, so that `nodes` can be interpolated, ascending, and the field `[K,3]` for them.
    pub fn needed(&mut self, table: &Anchors, nodes: &[u32]) -> (&[u32], &mut [f32]) {
        if self.asked != nodes {
            self.asked.clear();
            self.asked.extend_from_slice(nodes);
            self.used.fill(false);
            for &anchor in nodes.iter().flat_map(|&node| table.of(node).0) {
                self.used[anchor as usize] = true;
            }
            self.anchors.clear();
            let used = table
                .nodes()
                .iter()
                .filter(|&&node| self.used[node as usize]);
            self.anchors.extend(used);
        }
        (&self.anchors, &mut self.field)
    }

    /// Rows `nodes` of `out [K,3]` from the anchors' rows. What a node gets depends on nothing but its anchors.
    ///
    /// # Errors
    /// [`crate::Error::Panic`] where a node lies outside of `out`.
    pub fn interpolate(
        &self,
        pool: &Pool,
        table: &Anchors,
        nodes: &[u32],
        out: &mut [f32],
    ) -> Result<()> {
        let parts = Parts::new(out);
        pool.run(nodes.len().div_ceil(CHUNK), &|chunk, _| {
            let end = ((chunk + 1) * CHUNK).min(nodes.len());
            for &node in &nodes[chunk * CHUNK..end] {
                let (anchors, weights) = table.of(node);
                let mut sum = [0.0f32; 3];
                for (&anchor, &weight) in anchors.iter().zip(weights) {
                    let at = 3 * anchor as usize;
                    for (sum, value) in sum.iter_mut().zip(&self.field[at..at + 3]) {
                        *sum += weight * value;
                    }
                }
                // SAFETY: no node is in the list twice, so its row belongs to this chunk alone.
                unsafe { parts.part(3 * node as usize, 3) }.copy_from_slice(&sum);
            }
        })?;
        Ok(())
    }
}
