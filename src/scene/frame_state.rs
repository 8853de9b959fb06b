//! What a published step leaves for frames after it.

use super::supports::{self, GroupState};
use crate::contact::Past;
use crate::error::Result;
use crate::memory;

/// Velocities, tools, support groups and forces of a published step.
#[derive(Debug, Default)]
pub struct FrameState {
    /// `[K,3]`, mm/s.
    pub velocity: Vec<f32>,
    /// Where the tools were, and their forces; of the step that is being made until it is published.
    pub past: Past,
    pub next: Past,
    /// Support groups, likewise.
    pub groups: Vec<GroupState>,
    pub next_groups: Vec<GroupState>,
    /// Nodes in contact, ascending, and the forces on them, mN `[m,3]`; none where tools push.
    pub nodes: Vec<u32>,
    pub forces: Vec<f32>,
    /// Steps made, by which a new one is known.
    pub step: u64,
    /// The moment of the last one on the host's clock, s.
    pub time_s: f64,
}

impl FrameState {
    /// Takes what contact remembers of a step that is about to be published, and makes room for forces at `nodes` nodes.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`]; what is published stays.
    pub fn prepare(
        &mut self,
        past: Option<&Past>,
        groups: &[GroupState],
        nodes: usize,
    ) -> Result<()> {
        const WHAT: &str = "the present state of a scene";
        memory::fit(&mut self.nodes, nodes, WHAT)?;
        memory::fit(&mut self.forces, 3 * nodes, WHAT)?;
        supports::copy(groups, &mut self.next_groups)?;
        match past {
            Some(past) => self.next.take(past),
            None => {
                self.next.clear();
                Ok(())
            }
        }
    }
}
