//! Nodes that a bundle names.

use serde::Deserialize;

use field::memory::HeldBytes;

/// Nodes with a name: a support group, held nodes that move as one, apart from the others; or a region of the surface.
#[derive(Debug, Clone, Deserialize, HeldBytes)]
pub struct NodeSet {
    /// Its name.
    #[held(skip)]
    pub name: String,
    /// Ascending; of a support group held, and none of another's.
    pub nodes: Vec<u32>,
    /// Of a body that has been cut: which of the intact body's nodes in the set each one is, or stems from. Empty: all in their places.
    #[serde(skip)]
    pub rows: Vec<u32>,
}

impl NodeSet {
    /// Which of the intact body's nodes in the set the node in this place is.
    pub fn row(&self, index: usize) -> usize {
        self.rows.get(index).map_or(index, |row| *row as usize)
    }

    /// Names, and how many nodes each has.
    pub fn listed(sets: &[NodeSet]) -> Vec<serde_json::Value> {
        let one = |set: &NodeSet| serde_json::json!({"name": set.name, "nodes": set.nodes.len()});
        sets.iter().map(one).collect()
    }
}
