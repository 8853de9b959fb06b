//! What holds the body in a step: which nodes are held, and where they end. By default the bundle's held nodes, at rest.

use super::group::GroupModes;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the boundary of the corrections";

/// The held nodes of a step.
#[derive(Default, HeldBytes)]
pub struct Held {
    /// By node `[K]`.
    pub is: Vec<bool>,
    /// The same as a list, ascending.
    pub nodes: Vec<u32>,
    /// Displacement of `nodes` at the end of the step `[n,3]`, mm; empty: zero.
    pub places: Vec<f32>,
    /// Support groups that have been let go, a bit each.
    pub let_go: u64,
    /// What those groups' nodes do, made when they are let go.
    pub modes: GroupModes,
}

impl Held {
    /// A body of `count` nodes, of which these are held at rest.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(count: usize, nodes: impl Iterator<Item = u32>) -> Result<Held> {
        let mut is = memory::filled(count, false, WHAT)?;
        nodes.for_each(|node| is[node as usize] = true);
        let ascending = (0..count as u32).filter(|node| is[*node as usize]);
        Ok(Held {
            nodes: memory::collected(count, ascending, WHAT)?,
            is,
            ..Held::default()
        })
    }

    /// The held nodes of a state go where the step ends.
    pub(super) fn put(&self, u: &mut [f32]) {
        let rows = u.as_chunks_mut::<3>().0;
        let mut places = self.places.as_chunks::<3>().0.iter();
        for &node in &self.nodes {
            rows[node as usize] = places.next().copied().unwrap_or([0.0; 3]);
        }
    }

    /// Whether all of what is held is where it was in `u [K,3]`.
    pub fn stands(&self, u: &[f32]) -> bool {
        let rows = u.as_chunks::<3>().0;
        let mut held = self.nodes.iter().enumerate();
        held.all(|(index, node)| rows[*node as usize] == self.place(index))
    }

    /// Where the node at `index` of `nodes` ends.
    pub(super) fn place(&self, index: usize) -> [f32; 3] {
        let places = self.places.as_chunks::<3>().0;
        places.get(index).copied().unwrap_or([0.0; 3])
    }
}
