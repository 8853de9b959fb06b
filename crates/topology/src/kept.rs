//! What of a body lasts beside its mesh: for snapshots.
//!
//! The mesh is not part of it: whoever restores it has that. Lists are in order (`BTreeMap`), so
//! that equal bodies have equal bytes.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::body::{Body, Cell};
use crate::{RestMesh, TopologyError};

/// All that operations have made of a mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    /// Of the elements that are no longer whole.
    cells: BTreeMap<u32, Vec<Cell>>,
    /// Of each copy of a node: the mesh node that it stems from.
    parents: Vec<u32>,
    /// By stroke of a blade: how far each node that it knows lies from it, mm.
    strokes: BTreeMap<u32, BTreeMap<u32, f64>>,
    /// By stroke: the area that it has opened in each element, mm².
    opened: BTreeMap<u32, BTreeMap<u32, f64>>,
    /// By element: its stiffness over that of the mesh, where it has changed.
    stiffness: BTreeMap<u32, f32>,
}

impl Body {
    /// A copy of what lasts.
    pub fn kept(&self) -> Kept {
        Kept {
            cells: self.cells.clone(),
            parents: self.parents.clone(),
            strokes: self.strokes.clone(),
            opened: self.opened.clone(),
            stiffness: self.stiffness.clone(),
        }
    }

    /// The body that this was kept of.
    ///
    /// # Errors
    /// [`TopologyError::Kept`] where no operations on the mesh lead there.
    pub fn of_kept(mesh: Arc<RestMesh>, kept: Kept) -> Result<Body, TopologyError> {
        let mut body = Body::new(mesh);
        let (own, count) = (body.mesh().node_count(), body.mesh().element_count());
        let nodes = own + kept.parents.len();
        let is_node = |node: &u32| (*node as usize) < nodes;
        let is_element = |element: &u32| (*element as usize) < count;
        // Rounding takes a weight of a cut's corner below nothing.
        let is_part = |part: f64| (-1e-6..=1.0 + 1e-6).contains(&part);
        let parent = |node: u32| match (node as usize).checked_sub(own) {
            Some(copy) => kept.parents[copy],
            None => node,
        };
        // A snapshot may have been altered: everything that indexes a list or divides a volume is
        // checked before any of it is used.
        let is_sound = |element: u32, cell: &Cell| {
            let corners = cell.polytope.iter().flat_map(|own| own.points());
            cell.nodes.iter().all(is_node)
                && cell.nodes.map(parent) == body.mesh().tet(element)
                && is_part(cell.share)
                // Of a half the points that are left may be more than their part: its material alone is at most the element's.
                && cell.kept >= 0.0
                && is_part(cell.share * cell.kept)
                && corners.flatten().all(|weight| is_part(*weight))
        };
        let fine = kept.parents.iter().all(|node| (*node as usize) < own)
            && kept.cells.keys().all(is_element)
            && kept.stiffness.keys().all(is_element)
            && (kept.cells.iter()).all(|(element, cells)| {
                !cells.is_empty() && cells.iter().all(|cell| is_sound(*element, cell))
            })
            && kept
                .stiffness
                .values()
                .all(|factor| (1e-3..=1e3).contains(factor))
            && (kept.strokes.values().flatten()).all(|(node, d)| is_node(node) && d.is_finite())
            && (kept.opened.values().flatten())
                .all(|(element, area)| is_element(element) && area.is_finite() && *area >= 0.0);
        if !fine {
            return Err(TopologyError::Kept);
        }
        body.cells = kept.cells;
        body.parents = kept.parents;
        body.strokes = kept.strokes;
        body.opened = kept.opened;
        body.stiffness = kept.stiffness;
        Ok(body)
    }
}
