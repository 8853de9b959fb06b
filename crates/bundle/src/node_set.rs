//! Nodes that a bundle names.

use serde::Deserialize;

use field::error::Result;
use field::memory::{self, HeldBytes};

const WHAT: &str = "a mesh";

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

/// Ascending and each once.
pub(super) fn unique(mut nodes: Vec<u32>) -> Vec<u32> {
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}

/// Ascending and each once, of nodes below `count`: without sorting them, where they are many.
pub(super) fn unique_below(count: usize, nodes: &[u32]) -> Result<Vec<u32>> {
    let mut is_there = memory::filled(count, false, WHAT)?;
    for &node in nodes {
        is_there[node as usize] = true;
    }
    let mut found = memory::room(nodes.len().min(count), WHAT)?;
    found.extend(
        (0u32..)
            .zip(&is_there)
            .filter_map(|(node, is)| is.then_some(node)),
    );
    Ok(found)
}
