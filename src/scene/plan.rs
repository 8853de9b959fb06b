//! Which nodes a step decodes: the host's region, the attached points' tetrahedra, and what the recurrence needs.
//!
//! What a step costs beyond its latent state is the nodes that are decoded, so a host that shows a
//! part of the organ names it. A field `[K,3]` then holds the planned nodes only, and the others'
//! rows are whatever was left there: nothing may read them.

use crate::error::Result;
use crate::kernels::rows::RowPlan;
use crate::memory::{self, HeldBytes};
use crate::prior::PriorTable;

const WHAT: &str = "a plan of decoded nodes";

/// Nodes to decode, ascending, and where the prior's rows of them lie.
#[derive(Debug, Clone, HeldBytes)]
pub struct NodePlan {
    nodes: Vec<u32>,
    rows: RowPlan,
}

impl NodePlan {
    /// The union of node lists over a mesh of `node_count` nodes.
    pub fn new(
        lists: &[&[u32]],
        node_count: usize,
        table: Option<&PriorTable>,
    ) -> Result<NodePlan> {
        // Marks instead of sorting: lists overlap, and the order has to be ascending for the rows
        // of the tables to be read from front to back.
        let mut wanted = memory::filled(node_count, false, WHAT)?;
        for &node in lists.iter().copied().flatten() {
            wanted[node as usize] = true;
        }
        let count = wanted.iter().filter(|&&wanted| wanted).count();
        let nodes = (0..node_count as u32).filter(|&node| wanted[node as usize]);
        NodePlan::of(memory::collected(count, nodes, WHAT)?, table)
    }

    /// Of nodes that are ascending and each once.
    fn of(nodes: Vec<u32>, table: Option<&PriorTable>) -> Result<NodePlan> {
        let rows = table.map(|table| RowPlan::try_region(&table.basis(), &nodes, false));
        Ok(NodePlan {
            rows: rows.transpose()?.unwrap_or_default(),
            nodes,
        })
    }

    /// Every node.
    pub fn all(node_count: usize, table: Option<&PriorTable>) -> Result<NodePlan> {
        NodePlan::of(
            memory::collected(node_count, 0..node_count as u32, WHAT)?,
            table,
        )
    }

    /// The nodes, ascending.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// The linear response's rows of the nodes; none where the engine has no linear response.
    pub fn rows(&self) -> &RowPlan {
        &self.rows
    }
}
