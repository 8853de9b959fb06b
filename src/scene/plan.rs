//! Which nodes a step decodes: the host's region, the attached points' tetrahedra, and what the recurrence needs.

use crate::kernels::rows::RowPlan;
use crate::prior::PriorTable;

/// Nodes to decode, ascending, and where the prior's rows of them lie.
#[derive(Debug, Clone)]
pub struct NodePlan {
    nodes: Vec<u32>,
    rows: Option<RowPlan>,
}

impl NodePlan {
    /// The union of node lists over a mesh of `node_count` nodes.
    pub fn new(lists: &[&[u32]], node_count: usize, table: Option<&PriorTable>) -> NodePlan {
        let mut wanted = vec![false; node_count];
        for &node in lists.iter().copied().flatten() {
            wanted[node as usize] = true;
        }
        let nodes: Vec<u32> = (0..node_count as u32)
            .filter(|&node| wanted[node as usize])
            .collect();
        let rows = table.map(|table| RowPlan::region(&table.basis(), &nodes, false));
        NodePlan { nodes, rows }
    }

    /// Every node.
    pub fn all(node_count: usize, table: Option<&PriorTable>) -> NodePlan {
        NodePlan {
            nodes: (0..node_count as u32).collect(),
            rows: table.map(|table| RowPlan::full(&table.basis())),
        }
    }

    /// The nodes, ascending.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// The prior's rows of the nodes, where the bundle has a prior.
    pub fn rows(&self) -> Option<&RowPlan> {
        self.rows.as_ref()
    }
}
