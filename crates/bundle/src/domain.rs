//! What tools may touch of a body: whole faces, and on a cut body what a blade has laid open.
//!
//! The bundle names faces of the boundary. A cut leaves some of them whole, others in part, and
//! adds walls; what is not a whole face any more is given as pieces, whose corners are weighted
//! sums of nodes and not nodes. Lists that a cut has to look up again and again are kept in the
//! intact mesh from the first cut on.

use std::sync::OnceLock;

use super::node_set::unique;
use field::error::Result;
use field::memory::{self, HeldBytes};

const WHAT: &str = "a mesh";

/// The part of the surface that tools may touch.
#[derive(Debug, HeldBytes)]
pub struct Domain {
    /// Triangles `[D,3]`, outward; of a cut body those that are whole.
    pub faces: Vec<u32>,
    /// Nodes of these triangles, and of what has been laid open, ascending.
    pub nodes: Vec<u32>,
    /// What a blade has laid open.
    pub opened: Opened,
}

impl Domain {
    /// That of an intact body.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub(super) fn of(faces: Vec<u32>) -> Result<Domain> {
        Ok(Domain {
            nodes: unique(memory::copied(&faces, WHAT)?),
            faces,
            opened: Opened::default(),
        })
    }
}

/// What of a cut body's domain is not whole faces ([`topology::Touchable`]), and what a cut looks at.
#[derive(Debug, Default, HeldBytes)]
pub struct Opened {
    /// The domain's triangles as faces of elements, from the first cut on.
    #[held(skip)]
    pub(super) domain_sides: OnceLock<Vec<(u32, u8)>>,
    /// Corners of the pieces: nodes and weights.
    pub corners: Vec<([u32; 4], [f32; 4])>,
    /// Triangles, outward.
    pub pieces: Vec<[u32; 3]>,
    /// Those from here on are walls: a blade has gone through elements there.
    pub first_wall: usize,
    /// The mesh's border as faces of elements, likewise.
    #[held(skip)]
    pub(super) border: OnceLock<Vec<(u32, u8)>>,
    /// The whole skin of the cut body, the domain and what is beside it.
    pub bounds: Bounds,
}

/// All that bounds the tissue of a cut body ([`topology::Bounds`]); none where nothing has been cut: the boundary triangles do.
#[derive(Debug, Default, HeldBytes)]
pub struct Bounds {
    /// Nodes of the faces, ascending.
    pub nodes: Vec<u32>,
    /// Whole triangles of nodes, outward.
    pub faces: Vec<[u32; 3]>,
    /// Nodes and weights.
    pub corners: Vec<([u32; 4], [f32; 4])>,
    /// Triangles of corners.
    pub pieces: Vec<[u32; 3]>,
}
