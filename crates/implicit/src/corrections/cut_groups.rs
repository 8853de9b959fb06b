//! Support groups of a body that has been cut. Its answer to their motion is the intact body's, in which a copy of a node goes as the node that it stems from:
//! exact where a group carries the body along, and a guess beyond the cut, which the iterations of a step correct.

use std::sync::Arc;

use super::Corrections;
use super::group::Lift;
use super::input::SolverContext;
use crate::error::Result;
use crate::memory;

const WHAT: &str = "the support groups of a cut body";

impl Corrections {
    /// Takes the answers of the intact body, which this one has been cut to; `context` and positions are of the intact one, `parents` of the copies.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    /// A group that has answers already keeps them.
    pub fn follow_groups(
        &self,
        context: SolverContext<'_>,
        rest: &[f32],
        parents: &[u32],
    ) -> Result<()> {
        let first = rest.len() / 3;
        for (own, whole) in self.groups.iter().zip(&context.corrections.groups) {
            if own.has_lift() {
                continue;
            }
            let lift = whole.lift(context, rest)?;
            let parent = |node: u32| match (node as usize).checked_sub(first) {
                Some(copy) => parents[copy],
                None => node,
            };
            let mut functions = memory::room(lift.functions.len(), WHAT)?;
            for function in &lift.functions {
                let values = own.nodes.iter().map(|node| {
                    let row = whole.nodes.binary_search(&parent(*node));
                    row.map_or(0.0, |row| function[row])
                });
                functions.push(memory::collected(own.nodes.len(), values, WHAT)?);
            }
            let followed = Lift {
                functions,
                columns: Arc::clone(&lift.columns),
                parents: memory::copied(parents, WHAT)?,
            };
            own.lift.get_or_init(|| followed);
        }
        Ok(())
    }
}
