//! The surface that tools may touch: its samples, the search for those near a tool, and the solid beneath it.

use std::sync::Arc;

use ::contact::{Body, Placed, Pose, SKIN_MM, Samples, Search};

use crate::bundle::Mesh;
use crate::contact::buried::Buried;
use crate::contact::rows::WHAT;
use crate::contact::solid::{Sides, Solid};
use crate::contact::state::State;
use crate::contact::tool::Tool;
use crate::error::Result;
use crate::kernels::Isa;
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
    #[held(skip)]
    isa: Isa,
}

impl Surface {
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(samples: Arc<Samples>, mesh: Arc<Mesh>, isa: Isa) -> Result<Surface> {
        Ok(Surface {
            search: memory::tried(Search::with_room(&samples), WHAT)?,
            sides: Sides::of(&mesh)?,
            samples,
            mesh,
            isa,
        })
    }

    /// Where a tool in the tissue comes out; none where it does not lie in it.
    pub(super) fn buried(&mut self, body: &Body, pose: &Pose, state: State<'_>) -> Option<Buried> {
        let solid = Solid::of(&self.mesh, state, &mut self.sides);
        Buried::find((body, pose), &self.samples, solid, self.isa)
    }

    /// Where the tip of a thin tool has pierced the surface.
    pub(super) fn tip(&mut self, body: &Body, pose: &Pose, state: State<'_>) -> Option<Buried> {
        let samples = &self.samples;
        let mut solid = Solid::of(&self.mesh, state, &mut self.sides);
        Buried::tip((body, pose), samples, state, self.isa, |point| {
            solid.is_inside(point)
        })
    }

    /// Whether a tool touches the tissue where it ends, or lies in it.
    pub(super) fn is_reached(&mut self, tool: &Tool, state: State<'_>) -> bool {
        let placed = Placed {
            body: &tool.body,
            pose: tool.pose,
            skin: SKIN_MM,
        };
        self.is_in(placed, state) || self.buried(&tool.body, &tool.pose, state).is_some()
    }

    /// Whether a sample lies inside of a tool where it is placed, or within its skin.
    pub(super) fn is_in(&mut self, placed: Placed<'_>, state: State<'_>) -> bool {
        let position = |node| state.position(node);
        let found = self.search.find(&self.samples, &[placed], position);
        !found.is_empty()
    }
}
