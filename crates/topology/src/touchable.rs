//! Where tools may touch: faces of elements, and where a blade has gone through elements, or something has left, the surface there.

use crate::TopologyError;
use crate::body::Body;
use crate::polygon::normal;
use crate::rest::{FACES, dot};
use crate::room::{copied, push, room};
use crate::surface::{NONE, Skin, SkinTriangle, Vertex};

/// Nodes of one element and weights; places that are not needed repeat the first node with weight 0.
pub type Corner = ([u32; 4], [f32; 4]);

/// Triangles smaller than this take no force, mm²: half a square of the distance between samples. What holds one of them by its corners would throw the nodes
/// of its element, which lie far outside of it.
const SMALLEST_MM2: f64 = 1.0;

/// See the module.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Touchable {
    /// Of elements that nothing has touched, by their nodes, outward.
    pub faces: Vec<[u32; 3]>,
    pub corners: Vec<Corner>,
    /// At the others: corners of triangles, outward. The largest come first, of what was the mesh's border, of faces that have been laid bare, and of walls.
    pub pieces: Vec<[u32; 3]>,
    /// Pieces from here on are walls: a blade has gone through elements there.
    pub first_wall: usize,
}

/// All that bounds the tissue of a body: faces of elements that nothing has touched, by their nodes, and triangles of corners, outward.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bounds {
    pub faces: Vec<[u32; 3]>,
    pub corners: Vec<Corner>,
    pub pieces: Vec<[u32; 3]>,
}

impl Touchable {
    /// Nodes of all of it, in no order and more than once.
    pub fn nodes(&self) -> impl Iterator<Item = u32> {
        let corners = self.corners.iter().flat_map(|corner| corner.0);
        self.faces.as_flattened().iter().copied().chain(corners)
    }
}

impl Body {
    /// Of the mesh's border the faces for which `is_wanted` says so, by their mesh nodes in ascending order, where tissue is left behind them, and what has been
    /// laid bare.
    ///
    /// # Errors
    /// No memory.
    pub fn touchable(
        &self,
        is_wanted: impl Fn([u32; 3]) -> bool,
    ) -> Result<Touchable, TopologyError> {
        self.touchable_of(&self.mesh().border(is_wanted)?, &self.skin()?)
    }

    /// All that bounds the tissue, of the mesh's whole border and the body's skin.
    ///
    /// # Errors
    /// No memory.
    pub fn bounds(&self, border: &[(u32, u8)], skin: &Skin) -> Result<Bounds, TopologyError> {
        let mut corners = room(skin.vertices.len())?;
        corners.extend(skin.vertices.iter().map(corner_of));
        let mut pieces = room(skin.triangles.len())?;
        pieces.extend(skin.triangles.iter().map(|triangle| triangle.corners));
        Ok(Bounds {
            faces: self.whole_faces(border)?,
            corners,
            pieces,
        })
    }

    /// Those faces of the mesh's border, by their nodes, whose elements nothing has touched.
    fn whole_faces(&self, border: &[(u32, u8)]) -> Result<Vec<[u32; 3]>, TopologyError> {
        let mut faces = room(border.len())?;
        for &(element, face) in border {
            if !self.cells.contains_key(&element) {
                let own = self.mesh().tet(element);
                faces.push(FACES[usize::from(face)].map(|corner| own[corner]));
            }
        }
        Ok(faces)
    }

    /// The same as [`Body::touchable`] for faces of the mesh's border, an element and a face each ([`crate::RestMesh::border`]), and the body's skin.
    ///
    /// # Errors
    /// No memory.
    pub fn touchable_of(
        &self,
        border: &[(u32, u8)],
        skin: &Skin,
    ) -> Result<Touchable, TopologyError> {
        let faces = self.whole_faces(border)?;
        let mut wanted = copied(border)?;
        wanted.sort_unstable();
        let corner_at = |corner: &u32| {
            let vertex = &skin.vertices[*corner as usize];
            self.rest_of(vertex)
        };
        let mut rated = room(skin.triangles.len())?;
        for (at, triangle) in skin.triangles.iter().enumerate() {
            let SkinTriangle {
                corners,
                border,
                is_cut,
            } = triangle;
            let is_there = border.is_none_or(|own| wanted.binary_search(&own).is_ok());
            let [a, b, c] = [0, 1, 2].map(|k| corner_at(&corners[k]));
            let area = dot(normal(&[a, b, c]), normal(&[a, b, c])).sqrt();
            if is_there && area >= SMALLEST_MM2 {
                rated.push(((border.is_none(), *is_cut), area, at));
            }
        }
        // Corners and edges belong to the first triangle that has them: its normal is the surest.
        rated.sort_unstable_by(|a, b| {
            let order = a.0.cmp(&b.0).then(b.1.total_cmp(&a.1));
            order.then(a.2.cmp(&b.2))
        });
        // Sorted by kind first, so walls are what is left at the end.
        let first_wall = rated.partition_point(|rated| !rated.0.1);
        // By vertex of the skin: its number among the corners that are kept, [`NONE`] until a piece
        // asks for it.
        let mut places = room(skin.vertices.len())?;
        places.resize(skin.vertices.len(), NONE);
        let (mut corners, mut pieces) = (Vec::new(), room(rated.len())?);
        for (_, _, at) in rated {
            let mut piece = skin.triangles[at].corners;
            for corner in &mut piece {
                let place = &mut places[*corner as usize];
                if *place == NONE {
                    *place = corners.len() as u32;
                    push(&mut corners, corner_of(&skin.vertices[*corner as usize]))?;
                }
                *corner = *place;
            }
            pieces.push(piece);
        }
        Ok(Touchable {
            faces,
            corners,
            pieces,
            first_wall,
        })
    }

    /// Where a vertex is in the intact body.
    /// A copy of a node lies where its mesh node does, so both lips of a cut have the same place.
    fn rest_of(&self, vertex: &Vertex) -> crate::Point {
        let mut at = [0.0; 3];
        for (node, weight) in vertex.nodes.into_iter().zip(vertex.weights) {
            if node != NONE {
                let corner = self.mesh().position(self.parent(node));
                at = [0, 1, 2].map(|k| at[k] + weight * corner[k]);
            }
        }
        at
    }
}

fn corner_of(vertex: &Vertex) -> Corner {
    let first = vertex.nodes[0];
    let nodes = vertex
        .nodes
        .map(|node| if node == NONE { first } else { node });
    (nodes, vertex.weights.map(|weight| weight as f32))
}
