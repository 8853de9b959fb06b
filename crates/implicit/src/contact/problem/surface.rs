//! The surface that tools may touch: its samples, the search for those near a tool, and the solid beneath it.

use std::sync::Arc;

use ::contact::{Body, Placed, Pose, Samples, Search};

use crate::bundle::Mesh;
use crate::contact::buried::{Buried, Sides};
use crate::contact::rows::WHAT;
use crate::contact::state::State;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// See the module. The samples and the mesh are the model's; the rest is room for what is looked for.
#[derive(HeldBytes)]
pub struct Surface {
    #[held(skip)]
    pub samples: Arc<Samples>,
    #[held(skip)]
    pub(super) mesh: Arc<Mesh>,
    /// Finds the samples near a tool, with room for what a look finds.
    pub(super) search: Search,
    /// Room for rays through the surface.
    pub(super) sides: Sides,
}

impl Surface {
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(samples: Arc<Samples>, mesh: Arc<Mesh>) -> Result<Surface> {
        Ok(Surface {
            search: memory::tried(Search::with_room(&samples), WHAT)?,
            sides: Sides::new(mesh.node_count())?,
            samples,
            mesh,
        })
    }

    /// Where a tool in the tissue comes out; none where it does not lie in it.
    pub(super) fn buried(&mut self, body: &Body, pose: &Pose, state: State<'_>) -> Option<Buried> {
        let (samples, mesh, sides) = (&self.samples, &self.mesh, &mut self.sides);
        Buried::find(body, pose, samples, mesh, state, sides)
    }

    /// Whether a sample lies inside of a tool where it is placed.
    pub(super) fn is_in(&mut self, placed: Placed<'_>, state: State<'_>) -> bool {
        let position = |node| state.position(node);
        let found = self.search.find(&self.samples, &[placed], position);
        !found.is_empty()
    }
}
