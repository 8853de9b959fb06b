//! What pressure from outside acts on where the surface is not the mesh's own.

use super::{Surface, Vertex, cancel};
use crate::TopologyError;
use crate::body::Body;
use crate::room::push;

/// A triangle of a [`Skin`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinTriangle {
    /// Of the skin's vertices; outward.
    pub corners: [u32; 3],
    /// Element and face of the mesh's border that it is a part of; none on the walls of cuts and cavities.
    pub border: Option<(u32, u8)>,
    /// A blade has gone through an element here.
    pub is_cut: bool,
}

/// The surface at elements that something has touched; all else is the mesh's border.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skin {
    pub vertices: Vec<Vertex>,
    pub triangles: Vec<SkinTriangle>,
}

impl Body {
    /// The surface at the elements that cuts and removal have touched. Lips that have not come apart are left out where they have the same corners,
    /// and balance each other where not.
    ///
    /// # Errors
    /// No memory.
    pub fn skin(&self) -> Result<Skin, TopologyError> {
        // A surface without the mesh's own border: `pieces` makes what is at touched elements, and
        // here no slots are kept from before.
        let mut surface = Surface {
            vertices: Vec::new(),
            triangles: Vec::new(),
            inside: Vec::new(),
            by_nodes: Default::default(),
            border: Vec::new(),
            hidden: Vec::new(),
        };
        let mut pieces = surface.pieces(self)?;
        cancel(&mut pieces);
        let mut triangles = Vec::new();
        for piece in pieces {
            let mut found = Vec::with_capacity(piece.corners.len());
            surface.fill(&piece, &mut |corners, _| found.push(corners))?;
            for corners in found {
                let triangle = SkinTriangle {
                    corners,
                    border: piece.border,
                    is_cut: piece.is_cut,
                };
                push(&mut triangles, triangle)?;
            }
        }
        Ok(Skin {
            vertices: surface.vertices,
            triangles,
        })
    }

    /// Whether a cut or a removal has touched an element.
    pub fn is_touched(&self, element: u32) -> bool {
        self.cells.contains_key(&element)
    }
}
