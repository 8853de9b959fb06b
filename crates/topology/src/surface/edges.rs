//! Corners that lie on an edge of another polygon become corners of that one, too: the surface is closed vertex by vertex.
//!
//! Polygons of neighbouring cells share edges but not always corners: where a cut crosses one cell
//! and not the other, a corner lies in the middle of the other's edge. Drawn so, the two sides come
//! apart there as soon as the corner moves (a T-junction). A corner is a weighted sum of nodes, so
//! "on the edge" is asked in weights, which do not depend on how the tissue is deformed.

use std::collections::{BTreeMap, BTreeSet};

use super::{NONE, Piece, SAME, Surface};
use crate::TopologyError;
use crate::body::Body;
use crate::rest::{FACES, OUTSIDE};
use crate::room::push;

impl Surface {
    /// Splits edges at corners of others that lie on them. Gives the triangles of the mesh's own border, by element and face, that became pieces for that.
    pub(super) fn split_edges(
        &self,
        body: &Body,
        pieces: &mut Vec<Piece>,
    ) -> Result<BTreeSet<(u32, u8)>, TopologyError> {
        // All corners of pieces by the nodes that they lie on. Ordered, so that the same body gives
        // the same surface.
        let mut used: BTreeMap<[u32; 4], BTreeSet<u32>> = BTreeMap::new();
        for corner in pieces.iter().flat_map(|piece| &piece.corners) {
            let nodes = self.vertices[*corner as usize].nodes;
            used.entry(nodes).or_default().insert(*corner);
        }
        // Before edges are split: the faces that this adds have edges with corners, too.
        let split = self.touched_border(body, &used, pieces)?;
        for piece in pieces {
            let mut corners = Vec::with_capacity(piece.corners.len());
            for (at, &a) in piece.corners.iter().enumerate() {
                let b = piece.corners[(at + 1) % piece.corners.len()];
                corners.push(a);
                corners.extend(self.between(a, b, &used));
            }
            piece.corners = corners;
        }
        Ok(split)
    }

    /// Untouched elements' faces at the border with a corner on an edge.
    /// A cut that ends on such an edge puts a corner there. The whole face beside it would leave a
    /// gap as soon as that corner moves, so it becomes a piece, too, and gets the corner.
    fn touched_border(
        &self,
        body: &Body,
        used: &BTreeMap<[u32; 4], BTreeSet<u32>>,
        pieces: &mut Vec<Piece>,
    ) -> Result<BTreeSet<(u32, u8)>, TopologyError> {
        let mesh = body.mesh();
        let mut split = BTreeSet::new();
        for nodes in used.keys() {
            let [a, b, NONE, NONE] = *nodes else {
                continue;
            };
            if b == NONE || b as usize >= mesh.node_count() {
                continue;
            }
            for &element in mesh.around(a) {
                let tet = mesh.tet(element);
                if !tet.contains(&b) || body.cells.contains_key(&element) {
                    continue;
                }
                for (face, &over) in mesh.neighbours(element).iter().enumerate() {
                    let corners = FACES[face].map(|corner| tet[corner]);
                    let is_on = over == OUTSIDE && corners.contains(&a) && corners.contains(&b);
                    if is_on && split.insert((element, face as u8)) {
                        let piece = Piece {
                            border: Some((element, face as u8)),
                            is_cut: false,
                            corners: corners.to_vec(),
                        };
                        push(pieces, piece)?;
                    }
                }
            }
        }
        Ok(split)
    }

    /// Corners strictly between two, in order.
    /// A corner on the line between two lies on nodes of theirs alone. So all sets of those nodes
    /// are looked up, in place of a search through all corners.
    fn between(&self, a: u32, b: u32, used: &BTreeMap<[u32; 4], BTreeSet<u32>>) -> Vec<u32> {
        let mut nodes: Vec<u32> = [a, b]
            .iter()
            .flat_map(|corner| self.vertices[*corner as usize].nodes)
            .filter(|node| *node != NONE)
            .collect();
        // The corners of a piece are of one cell: these are four nodes at most, and at most fifteen
        // sets.
        nodes.sort_unstable();
        nodes.dedup();
        let weights = |corner: u32| -> Vec<f64> {
            let own = &self.vertices[corner as usize];
            let weight = |node| own.nodes.iter().position(|of| of == node);
            let all = nodes.iter().map(weight);
            all.map(|at| at.map_or(0.0, |at| own.weights[at])).collect()
        };
        let from = weights(a);
        let way: Vec<f64> = weights(b).iter().zip(&from).map(|(b, a)| b - a).collect();
        let square: f64 = way.iter().map(|x| x * x).sum();
        let mut found = Vec::new();
        for subset in 1u32..1 << nodes.len() {
            let mut key = [NONE; 4];
            let chosen = (0..nodes.len()).filter(|at| subset & (1 << at) != 0);
            for (k, at) in chosen.enumerate().take(4) {
                key[k] = nodes[at];
            }
            for &corner in used.get(&key).into_iter().flatten() {
                if corner == a || corner == b {
                    continue;
                }
                let off: Vec<f64> = weights(corner)
                    .iter()
                    .zip(&from)
                    .map(|(c, a)| c - a)
                    .collect();
                let part = off.iter().zip(&way).map(|(o, w)| o * w).sum::<f64>() / square;
                let beside = off.iter().zip(&way).map(|(o, w)| (o - part * w).abs());
                // `part` is where its foot lies between the two, `beside` how far it is off, both
                // in weights.
                if beside.fold(0.0, f64::max) < 2.0 * SAME && part > 0.0 && part < 1.0 {
                    found.push((part, corner));
                }
            }
        }
        // By the way from the first corner; at equal places by number, so that the order is one.
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.into_iter().map(|(_, corner)| corner).collect()
    }
}
