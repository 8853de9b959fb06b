//! What pressure acts on: the boundary triangles of the mesh; of a body that has been cut what is left of them, and the walls of cuts and cavities.

use ::topology::rest::FACES;
use topology::Body;

use super::load_limits::WHAT;
use crate::bundle::Mesh;
use crate::corrections::LoadPoint;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// See the module. A wall has the row after the last boundary triangle.
#[derive(HeldBytes)]
pub(super) struct Pressed {
    /// The boundary triangle of the intact mesh that a triangle is a part of, and its corners: nodes, and from `K` on `points`.
    pub triangles: Vec<(u32, [u32; 3])>,
    pub points: Vec<LoadPoint>,
}

/// The corners of a face in ascending order: two elements that share it have it in different ones.
fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

impl Pressed {
    /// Of a mesh as a body that was made of it is now.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(mesh: &Mesh, body: Option<&Body>) -> Result<Pressed> {
        let faces = mesh.surface.faces.as_chunks::<3>().0;
        let numbered = || faces.iter().copied().enumerate();
        let Some(body) = body else {
            let all = numbered().map(|(row, face)| (row as u32, face));
            return Ok(Pressed {
                triangles: memory::collected(faces.len(), all, WHAT)?,
                points: Vec::new(),
            });
        };
        let rows = numbered().map(|(row, face)| (sorted(face), row as u32));
        let mut rows = memory::collected(faces.len(), rows, WHAT)?;
        // Looked up by corners, since the skin names faces by element and the mesh's boundary by
        // nodes.
        rows.sort_unstable();
        let row_of = |(element, face): (u32, u8)| {
            let tet = body.mesh().tet(element);
            let corners = sorted(FACES[usize::from(face)].map(|corner| tet[corner]));
            let at = rows.binary_search_by_key(&corners, |own| own.0).ok()?;
            Some(rows[at].1)
        };
        // A boundary triangle of a touched element is left out as a whole; the skin has what is
        // left of it, in parts.
        let mut is_whole = memory::filled(faces.len(), true, WHAT)?;
        for element in body.changed_elements().filter(|own| body.is_touched(*own)) {
            for row in (0..4).filter_map(|face| row_of((element, face))) {
                is_whole[row as usize] = false;
            }
        }
        let skin = body.skin()?;
        let mut triangles = memory::room(faces.len() + skin.triangles.len(), WHAT)?;
        triangles.extend(
            numbered()
                .filter(|(row, _)| is_whole[*row])
                .map(|(row, face)| (row as u32, face)),
        );
        // Corners from `K` on are points of the skin, each on up to four nodes.
        let first = mesh.node_count() as u32;
        for triangle in &skin.triangles {
            let row = match triangle.border {
                Some(own) => row_of(own),
                None => Some(faces.len() as u32),
            };
            triangles.extend(row.map(|row| (row, triangle.corners.map(|corner| first + corner))));
        }
        let points = skin.vertices.iter().map(|vertex| LoadPoint {
            nodes: vertex.nodes.map(|node| match node {
                // Any node will do, because its weight is 0.
                topology::surface::NONE => 0,
                node => node,
            }),
            weights: vertex.weights.map(|weight| weight as f32),
        });
        Ok(Pressed {
            points: memory::collected(skin.vertices.len(), points, WHAT)?,
            triangles,
        })
    }
}
