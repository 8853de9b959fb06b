//! Where tools may touch: faces of elements, by the nodes of their cells.
//!
//! The lips of a cut run through elements, the faces do not: a face of which more than half is bare counts, and of the cells that share a face of the mesh's border the
//! one with the largest part.

use crate::TopologyError;
use crate::body::{Body, Cell};
use crate::connect::{common, on_face};
use crate::polygon::double_area;
use crate::rest::{FACES, OUTSIDE};
use crate::room::{push, room};

/// Of a whole face in barycentric coordinates, twice: a face of which less is bare does not count.
const MOSTLY: f64 = 0.5;

impl Body {
    /// Faces `[.., 3]`, outward: those of the mesh's border for which `is_wanted` says so, by their mesh nodes in ascending order, where tissue is left behind
    /// them, then those that have been laid bare.
    pub fn touchable(
        &self,
        is_wanted: impl Fn([u32; 3]) -> bool,
    ) -> Result<Vec<[u32; 3]>, TopologyError> {
        self.touchable_of(&self.mesh().border(is_wanted)?)
    }

    /// The same for faces of the mesh's border, an element and a face each ([`crate::RestMesh::border`]).
    pub fn touchable_of(&self, border: &[(u32, u8)]) -> Result<Vec<[u32; 3]>, TopologyError> {
        let mesh = self.mesh();
        let nodes = |cell: &Cell, face: usize| FACES[face].map(|corner| cell.nodes[corner]);
        let mut faces = room(border.len())?;
        for &(element, face) in border {
            let (own, face) = (mesh.tet(element), usize::from(face));
            let Some(cells) = self.cells.get(&element) else {
                push(&mut faces, FACES[face].map(|corner| own[corner]))?;
                continue;
            };
            let living = cells.iter().filter(|cell| cell.is_alive);
            let part = |cell: &Cell| on_face(own, cell, face).map_or(0.0, |p| double_area(&p));
            let largest = living.max_by(|a, b| part(a).total_cmp(&part(b)));
            if let Some(cell) = largest.filter(|cell| part(cell) > 0.0) {
                push(&mut faces, nodes(cell, face))?;
            }
        }
        for &element in self.cells.keys() {
            for (face, &over) in mesh.neighbours(element).iter().enumerate() {
                if over == OUTSIDE {
                    continue;
                }
                for cell in self.cells(element).iter().filter(|cell| cell.is_alive) {
                    if self.is_bare((element, cell), face, over) {
                        push(&mut faces, nodes(cell, face))?;
                    }
                }
                let back = mesh.neighbours(over).iter().position(|own| *own == element);
                if let (false, Some(back)) = (self.cells.contains_key(&over), back) {
                    let whole = Cell::whole(mesh.tet(over));
                    if self.is_bare((over, &whole), back, element) {
                        push(&mut faces, nodes(&whole, back))?;
                    }
                }
            }
        }
        Ok(faces)
    }

    fn is_bare(&self, (element, cell): (u32, &Cell), face: usize, over: u32) -> bool {
        let mesh = self.mesh();
        let back = mesh.neighbours(over).iter().position(|own| *own == element);
        let own = on_face(mesh.tet(element), cell, face);
        let (Some(back), Some(own)) = (back, own) else {
            return false;
        };
        let cells = self.cells(over);
        let parted =
            (cells.iter()).filter(|next| !self.is_joined((element, cell), face, over, next));
        let bare = parted.filter_map(|next| on_face(mesh.tet(over), next, back));
        let area = bare.map(|other| match common(&own, &other) {
            points if points.is_empty() => 0.0,
            points => double_area(&points),
        });
        area.sum::<f64>() > MOSTLY
    }
}
