//! The instruments' part of a state.

use std::sync::Arc;

use crate::contact::{ContactProblem, MAX_TOOLS, Past};
use crate::error::Result;
use crate::features::Proven;
use crate::scene::core::Core;

pub type Tools = Past;

impl Core {
    /// A copy of what contact of instruments remembers.
    pub(super) fn tools(&self) -> Result<Option<Tools>> {
        match &self.problem {
            Some(problem) if !problem.past.is_empty() => problem.past.copy().map(Some),
            _ => Ok(None),
        }
    }

    pub(super) fn admit_tools(&self, tools: &mut Tools) -> Result<()> {
        tools.check(&*self.model.samples()?, self.mesh.node_count())
    }

    pub(in crate::scene) fn put_tools(&mut self, tools: Option<Tools>) -> Result<()> {
        match (&mut self.problem, tools) {
            (Some(problem), Some(past)) => problem.past = past,
            (Some(problem), None) => problem.past.clear(),
            (none @ None, Some(past)) => {
                let make = || ContactProblem::new(self.model.samples()?, Arc::clone(&self.mesh));
                none.insert(Proven::new(make, "the contact of instruments")?)
                    .past = past;
            }
            (None, None) => {}
        }
        Ok(())
    }

    /// Bytes of them at most.
    pub(super) fn tool_bytes(&self) -> usize {
        // A sample may be pushed and held by each of the tools; more than all samples once is never seen.
        let faces = self.mesh.domain_faces.len() / 3;
        let ties = (self.problem.as_ref()).map_or(0, |problem| problem.past.ties.len());
        64 * MAX_TOOLS + 4096 + 16 * 64 * faces + 160 * ties
    }
}
