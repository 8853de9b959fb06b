//! A solver takes ties: checked, and put where the inner steps find them.

use super::ties::Ties;
use super::{Solver, SolverError};
use contact::{End, Tie, Vector};
use elements::PADDING;

impl Solver {
    /// Gives the solver the ties of the frames to come; a cut takes them off. A tie's place in the list is its identity: it stays broken there until it has
    /// no stiffness, and its far end goes on a line to where it is now within the next frame, unless it is in another frame or on another tool.
    ///
    /// # Errors
    /// [`SolverError::Tie`] for one that there cannot be; nothing has changed.
    pub fn set_ties(&mut self, ties: &[Tie]) -> Result<(), SolverError> {
        for (index, tie) in ties.iter().enumerate() {
            self.check_tie(tie)
                .map_err(|reason| SolverError::Tie { index, reason })?;
        }
        let before = self.ties.take().unwrap_or_default();
        if !ties.is_empty() {
            let (slots, positions) = (&self.partition.slot_of_node, &self.positions);
            let node = |node: u32| (slots[node as usize], Vector::from(positions[node as usize]));
            self.ties = Some(Ties::following(before, ties, node));
        }
        Ok(())
    }

    fn check_tie(&self, tie: &Tie) -> Result<(), String> {
        tie.check()?;
        let tools = self.touch.as_ref().map_or(0, |touch| touch.tool_count());
        if let End::Tool { tool, .. } = tie.end
            && tool as usize >= tools
        {
            return Err(format!("is tied to tool {tool} of {tools}"));
        }
        let far = match tie.end {
            End::Tissue(sample) => sample.nodes,
            _ => tie.point.nodes,
        };
        for node in tie.point.nodes.into_iter().chain(far) {
            if self
                .partition
                .slot_of_node
                .get(node as usize)
                .is_none_or(|slot| *slot == PADDING)
            {
                return Err(format!("node {node} is none of the body"));
            }
        }
        Ok(())
    }
}
