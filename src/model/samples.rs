//! Where tools touch a mesh's domain: whole faces, and what a blade has laid open.

use ::contact::{Pieces, SPACING_MM, Samples};

use crate::bundle::Mesh;
use crate::error::Result;
use crate::memory;

/// # Errors
/// [`crate::Error::OutOfMemory`].
pub fn of(mesh: &Mesh) -> Result<Samples> {
    let opened = &mesh.domain.opened;
    let pieces = Pieces {
        corners: &opened.corners,
        triangles: &opened.pieces,
        first_wall: opened.first_wall,
    };
    let (positions, faces) = (&mesh.positions, &mesh.domain.faces);
    let (positions, faces) = (positions.as_chunks().0, faces.as_chunks().0);
    let made = Samples::with_pieces(positions, faces, pieces, &mesh.held_nodes, SPACING_MM);
    memory::tried(made, "the samples of the surface")
}
