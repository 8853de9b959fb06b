//! Nodes that contact reaches: those on which its forces act, or where a scene without corrections prescribes displacements.

use crate::contact::rows::{MOST_ROWS, WHAT};
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// Room for one of the two lists at a time.
#[derive(HeldBytes)]
pub struct Prescribed {
    /// Ascending.
    pub nodes: Vec<u32>,
    /// The contact as a collision field, `[m,3]`, mm.
    pub vectors: Vec<f32>,
}

impl Prescribed {
    /// Room for the nodes of two solves' samples.
    pub fn new() -> Result<Prescribed> {
        let nodes = 8 * MOST_ROWS;
        Ok(Prescribed {
            nodes: memory::room(nodes, WHAT)?,
            vectors: memory::room(3 * nodes, WHAT)?,
        })
    }

    /// Room for the nodes of so many forces.
    pub fn fit(&mut self, forces: usize) -> Result<()> {
        memory::fit(&mut self.nodes, 4 * forces, WHAT)?;
        memory::fit(&mut self.vectors, 12 * forces, WHAT)
    }

    /// Each node once, ascending.
    pub fn sorted(&mut self) -> &[u32] {
        self.nodes.sort_unstable();
        self.nodes.dedup();
        &self.nodes
    }
}
