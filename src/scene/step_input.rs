//! What a step gets, and what has become of it.

use crate::contact::Tool;
use crate::error::Result;
use crate::field::ContactSet;

/// The collision field `c` of a step: what the instruments impose at its end.
#[derive(Debug, Clone, Copy)]
pub enum Contact<'a> {
    /// No contact.
    None,
    /// `[K,3]`, mm, zero but at nodes in contact.
    Dense(&'a [f32]),
    /// Nodes in contact and their displacement.
    Sparse {
        /// Node indices, each at most once, in any order.
        nodes: &'a [u32],
        /// `[m,3]`, mm.
        vectors: &'a [f32],
    },
    /// Rigid tools where they are at the end of the step; their contact is solved.
    Tools(&'a [Tool]),
}

impl Contact<'_> {
    /// As a set over a mesh of `node_count` nodes; that of tools is solved later.
    ///
    /// # Errors
    /// What [`ContactSet::take_dense`] and [`ContactSet::take_sparse`] say.
    pub(crate) fn gather(self, set: &mut ContactSet, node_count: usize) -> Result<()> {
        match self {
            Contact::None => set.clear(),
            Contact::Tools(_) => set.clear(),
            Contact::Dense(field) => set.take_dense(field, node_count)?,
            Contact::Sparse { nodes, vectors } => set.take_sparse(nodes, vectors, node_count)?,
        }
        Ok(())
    }
}

/// Inputs of a step.
#[derive(Debug, Clone, Copy)]
pub struct StepInput<'a> {
    /// Current displacement `[K,3]`, mm; `None` takes the scene's own state. A field that equals the scene's last
    /// state at its decoded nodes is taken as that state.
    pub displacement: Option<&'a [f32]>,
    /// Collision field. A node that the boundary condition holds stays held.
    pub contact: Contact<'a>,
}

/// What has become of a submitted step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// It has finished, or nothing was submitted since the last one finished.
    Done,
    /// It has not finished.
    Pending,
}
