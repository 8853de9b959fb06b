//! A part of what holds the body is let go. What moves or holds it from then on are prescribed nodes, in each frame.

use super::{Solver, SolverError};

impl Solver {
    /// Lets nodes go that the boundary holds: from the next frame on they are free, and may be prescribed ([`Solver::step_frame`]), which is how a support group moves
    /// against others, and is held again. A later [`Solver::reset`] leaves it so.
    ///
    /// # Errors
    /// [`SolverError::Load`] for a node that the mesh does not have or the boundary does not hold, and with a support that moves; nothing has changed.
    pub fn let_go(&mut self, nodes: &[u32]) -> Result<(), SolverError> {
        let fail = |reason: String| {
            Err(SolverError::Load {
                field: "nodes".into(),
                reason,
            })
        };
        if (self.load.as_ref()).is_some_and(|load| load.support.is_some()) {
            return fail("belong to a support that moves as a whole".into());
        }
        for &node in nodes {
            let slot = self.partition.slot_of_node.get(node as usize);
            match slot.and_then(|slot| self.held.get(*slot as usize)) {
                None => return fail(format!("name node {node}, which the mesh does not have")),
                Some(false) => return fail(format!("name node {node}, which is not held")),
                Some(true) => {}
            }
        }
        for &node in nodes {
            self.held[self.partition.slot_of_node[node as usize] as usize] = false;
        }
        (self.topology.held_nodes).retain(|node| !nodes.contains(node));
        Ok(())
    }
}
