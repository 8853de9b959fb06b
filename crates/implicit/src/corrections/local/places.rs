//! The near nodes and their numbers.
//!
//! A *place* is the position of a node in [`Places::nodes`]: first the free nodes all of whose elements are near ([`Places::inside`] of them, `S` in
//! the formulas), then the other free ones, then those that are held.

use super::linear::WHAT;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// A node that is not near.
const NONE: u32 = u32::MAX;

/// See the module. Core, inside and free places are ranges that begin at 0, each within the next.
#[derive(HeldBytes)]
pub(in crate::corrections) struct Places {
    pub nodes: Vec<u32>,
    /// Inside places that lie closest to the centres: the first ones.
    pub core: usize,
    /// Places that are inside, and those that are free.
    pub inside: usize,
    pub free: usize,
    /// By node; [`NONE`] elsewhere.
    of_node: Vec<u32>,
}

impl Places {
    /// Of none of `count` nodes.
    pub fn new(count: usize) -> Result<Places> {
        Ok(Places {
            nodes: Vec::new(),
            core: 0,
            inside: 0,
            free: 0,
            of_node: memory::filled(count, NONE, WHAT)?,
        })
    }

    /// Nodes of the body, near or not.
    pub fn node_count(&self) -> usize {
        self.of_node.len()
    }

    /// The place of a node, where it has one.
    pub fn of(&self, node: u32) -> Option<usize> {
        let place = self.of_node[node as usize];
        (place != NONE).then_some(place as usize)
    }

    /// The place of a node that is free.
    pub fn free_of(&self, node: u32) -> Option<u32> {
        let place = self.of_node[node as usize];
        ((place as usize) < self.free).then_some(place)
    }

    /// Places by node; those of nodes that are not near are beyond all others.
    pub fn by_node(&self) -> &[u32] {
        &self.of_node
    }

    /// Whether all of the body is near.
    pub fn is_all(&self) -> bool {
        self.nodes.len() == self.of_node.len()
    }

    /// Whether a free node is inside.
    pub fn holds(&self, node: u32) -> bool {
        (self.of_node[node as usize] as usize) < self.inside
    }

    /// Takes their places from the nodes; `nodes` may then be filled with others.
    pub fn forget(&mut self) {
        for &node in &self.nodes {
            self.of_node[node as usize] = NONE;
        }
    }

    /// Gives the nodes their places. Of each node `rank` tells whether it is held, whether some of its elements are far, and whether it is not of the core.
    pub fn order(&mut self, rank: impl Fn(usize) -> (bool, bool, bool)) {
        // Core, inside, free with elements that are far, held.
        (self.nodes).sort_unstable_by_key(|node| (rank(*node as usize), *node));
        (self.inside, self.free, self.core) = (0, 0, 0);
        for (place, &node) in self.nodes.iter().enumerate() {
            let (is_held, is_cut, is_outer) = rank(node as usize);
            self.of_node[node as usize] = place as u32;
            self.free += usize::from(!is_held);
            self.inside += usize::from(!is_held && !is_cut);
            self.core += usize::from(!is_held && !is_cut && !is_outer);
        }
    }
}
