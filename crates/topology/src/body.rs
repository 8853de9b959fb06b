//! The body as it is now: cells, copies of nodes, stiffness.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};

use crate::polytope::{Polytope, Weights};
use crate::push::Push;
use crate::{Point, RestMesh, TopologyError};

/// Part of an element, with nodes of its own.
/// Its forces are those of the whole element's shape on these nodes, times the share: a cut never
/// makes a shape that is too thin to compute with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    /// One a corner of the element.
    pub nodes: [u32; 4],
    /// Strokes that have passed the element, and on whose positive side the cell is.
    pub sides: Vec<(u32, bool)>,
    /// Its material; `None` for the whole element.
    /// Shared, because operations work on a copy of the body.
    pub polytope: Option<Arc<Polytope>>,
    /// Part of the element's volume.
    pub share: f64,
    /// Fixed points of the element that lie in the cell, and those that have been removed (`remove.rs`).
    /// One bit for each of 64.
    pub points: u64,
    pub gone: u64,
    /// The part of its material that has not been removed.
    pub kept: f64,
    pub is_alive: bool,
}

impl Cell {
    /// An element that nothing has touched.
    pub fn whole(nodes: [u32; 4]) -> Cell {
        Cell {
            nodes,
            sides: Vec::new(),
            polytope: None,
            share: 1.0,
            points: u64::MAX,
            gone: 0,
            kept: 1.0,
            is_alive: true,
        }
    }

    /// Its material.
    pub fn material(&self) -> &Polytope {
        static WHOLE: OnceLock<Polytope> = OnceLock::new();
        match &self.polytope {
            Some(polytope) => polytope,
            None => WHOLE.get_or_init(Polytope::whole),
        }
    }

    /// How many of its points are left.
    pub fn points_left(&self) -> u32 {
        (self.points & !self.gone).count_ones()
    }

    /// On which side of a stroke it is.
    pub fn side_of(&self, stroke: u32) -> Option<bool> {
        let mut sides = self.sides.iter();
        (sides.find(|(own, _)| *own == stroke)).map(|(_, positive)| *positive)
    }

    /// Whether a stroke passes between two cells.
    /// A stroke that has passed only one of the two parts nothing: the sides of both must be known
    /// and differ.
    pub fn is_parted_from(&self, other: &Cell) -> bool {
        let parted = |(stroke, positive): &(u32, bool)| other.side_of(*stroke) == Some(!positive);
        self.sides.iter().any(parted)
    }
}

/// What an operation did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Change {
    /// Of each new node, in the order of their numbers: the node that it is a copy of, which may itself be new. It takes that one's state.
    pub copied: Vec<u32>,
    /// Elements with other cells, nodes, shares or stiffness than before, ascending.
    pub elements: Vec<u32>,
    /// New area of a cut, mm².
    pub area_mm2: f64,
    /// What a blade with a fracture energy does to the tissue; none of one without.
    pub pushes: Vec<Push>,
    /// Volume that the body has lost, mm³.
    pub removed_mm3: f64,
}

/// A body of tetrahedra that can be cut. Operations are whole or not at all.
#[derive(Clone, Debug)]
pub struct Body {
    mesh: Arc<RestMesh>,
    /// Elements that something has touched; all others are whole cells on the mesh's own nodes.
    /// In the order of elements, so that sums over them are the same on every machine.
    pub(crate) cells: BTreeMap<u32, Vec<Cell>>,
    /// Of each copy: the mesh node that it stems from.
    pub(crate) parents: Vec<u32>,
    /// Of each stroke: distances from the blade at the nodes that it passed, fixed once used.
    /// In mm, positive on the positive side of the stroke, and 0 on the blade.
    pub(crate) strokes: BTreeMap<u32, BTreeMap<u32, f64>>,
    /// Of each stroke: the area that it has laid open in each element that it has met, mm².
    pub(crate) opened: BTreeMap<u32, BTreeMap<u32, f64>>,
    /// Factors of stiffness other than 1.
    pub(crate) stiffness: BTreeMap<u32, f32>,
    /// Nodes at most.
    /// An operation that would need more is an error and changes nothing.
    pub(crate) most_nodes: usize,
}

impl Body {
    /// The uncut body.
    pub fn new(mesh: Arc<RestMesh>) -> Body {
        Body {
            mesh,
            cells: BTreeMap::new(),
            parents: Vec::new(),
            strokes: BTreeMap::new(),
            opened: BTreeMap::new(),
            stiffness: BTreeMap::new(),
            most_nodes: u32::MAX as usize,
        }
    }

    /// The same with room for so many copies of nodes.
    #[must_use]
    pub fn with_room(mut self, copies: usize) -> Body {
        self.most_nodes = self.mesh.node_count() + copies;
        self
    }

    /// The mesh.
    pub fn mesh(&self) -> &RestMesh {
        &self.mesh
    }

    /// The mesh, for another body of it.
    pub fn shared_mesh(&self) -> Arc<RestMesh> {
        Arc::clone(&self.mesh)
    }

    /// Nodes with copies.
    pub fn node_count(&self) -> usize {
        self.mesh.node_count() + self.parents.len()
    }

    /// The mesh node that a node is, or stems from.
    pub fn parent(&self, node: u32) -> u32 {
        match (node as usize).checked_sub(self.mesh.node_count()) {
            Some(copy) => self.parents[copy],
            None => node,
        }
    }

    /// Whether nothing has been done to it.
    pub fn is_intact(&self) -> bool {
        self.cells.is_empty() && self.stiffness.is_empty()
    }

    /// Elements with other cells or another stiffness than the mesh's, ascending.
    pub fn changed_elements(&self) -> impl Iterator<Item = u32> + '_ {
        let mut cut = self.cells.keys().copied().peekable();
        let mut stiff = self.stiffness.keys().copied().peekable();
        std::iter::from_fn(move || {
            let next = match (cut.peek(), stiff.peek()) {
                (Some(a), Some(b)) => *a.min(b),
                (Some(next), None) | (None, Some(next)) => *next,
                (None, None) => return None,
            };
            cut.next_if_eq(&next);
            stiff.next_if_eq(&next);
            Some(next)
        })
    }

    /// Of each copy of a node: the mesh node that it stems from.
    pub fn parents(&self) -> &[u32] {
        &self.parents
    }

    /// Bytes of the heap that it holds, nearly.
    pub fn heap_bytes(&self) -> usize {
        let corners = |cell: &Cell| cell.polytope.as_ref().map_or(0, |own| own.points().count());
        let cells = self.cells.values().flatten();
        let cells: usize = cells
            .map(|cell| size_of::<Cell>() + 40 * corners(cell))
            .sum();
        let strokes = self.strokes.values().chain(self.opened.values());
        let distances: usize = strokes.map(|own| 16 * own.len()).sum();
        self.mesh.heap_bytes() + cells + distances + 4 * self.parents.len()
    }

    /// Bytes of small parts that an operation makes at most beside lists as long as the mesh, nearly: a copy of the body, and as much again for what it
    /// becomes.
    pub fn most_bytes(&self) -> usize {
        let copy = self.heap_bytes() - self.mesh().heap_bytes();
        4 * copy + 64 * self.mesh().element_count()
    }

    /// Cells of an element.
    pub fn cells(&self, element: u32) -> std::borrow::Cow<'_, [Cell]> {
        match self.cells.get(&element) {
            Some(cells) => cells.as_slice().into(),
            None => vec![Cell::whole(self.mesh.tet(element))].into(),
        }
    }

    /// The nodes that a point of an element follows, given by its weights on the element's corners: those of the living cell in which it lies, or of
    /// the nearest one; the element's own where nothing of it is left.
    pub fn nodes_at(&self, element: u32, at: &Weights) -> [u32; 4] {
        let Some(cells) = self.cells.get(&element) else {
            return self.mesh.tet(element);
        };
        let mut found = (f64::MIN, self.mesh.tet(element));
        for cell in cells.iter().filter(|cell| cell.is_alive) {
            let depth = cell.material().depth(at);
            if depth > found.0 {
                found = (depth, cell.nodes);
            }
        }
        found.1
    }

    /// The nodes of the cell in which a point of an element lies, given by its weights on the element's corners; none where that has been removed.
    pub fn tissue_at(&self, element: u32, at: &Weights) -> Option<[u32; 4]> {
        let Some(cells) = self.cells.get(&element) else {
            return Some(self.mesh.tet(element));
        };
        let depth = |cell: &&Cell| cell.material().depth(at);
        let own = cells.iter().max_by(|a, b| depth(a).total_cmp(&depth(b)))?;
        own.is_alive.then_some(own.nodes)
    }

    /// Factor of an element's stiffness.
    pub fn stiffness(&self, element: u32) -> f32 {
        self.stiffness.get(&element).copied().unwrap_or(1.0)
    }

    /// Multiplies the stiffness of elements.
    ///
    /// # Errors
    /// A factor that no tissue has, an element that the mesh does not have; nothing has then changed.
    pub fn scale_stiffness(
        &mut self,
        elements: &[u32],
        factor: f32,
    ) -> Result<Change, TopologyError> {
        if !(1e-3..=1e3).contains(&factor) {
            return Err(TopologyError::Factor { factor });
        }
        let count = self.mesh.element_count();
        if let Some(index) = (elements.iter()).position(|element| *element as usize >= count) {
            return Err(TopologyError::Index {
                field: "elements",
                index,
                found: elements[index],
                count,
            });
        }
        let mut changed = crate::room::copied(elements)?;
        changed.sort_unstable();
        changed.dedup();
        // All products are looked at before the first is stored.
        let products = changed
            .iter()
            .map(|element| self.stiffness(*element) * factor);
        if let Some(factor) = { products }.find(|product| !(1e-3..=1e3).contains(product)) {
            return Err(TopologyError::Factor { factor });
        }
        for element in &changed {
            *self.stiffness.entry(*element).or_insert(1.0) *= factor;
        }
        Ok(Change {
            elements: changed,
            ..Change::default()
        })
    }

    /// Whether these are positions of the nodes.
    pub(crate) fn check(&self, positions: &[Point]) -> Result<(), TopologyError> {
        if positions.len() != self.node_count() {
            return Err(TopologyError::Positions {
                found: positions.len(),
                nodes: self.node_count(),
            });
        }
        match (positions.iter()).position(|at| !at.iter().all(|x| x.is_finite())) {
            None => Ok(()),
            Some(index) => Err(TopologyError::NotFinite {
                field: "positions",
                index,
            }),
        }
    }

    /// The cells of an element, to be changed.
    pub(crate) fn cells_mut(&mut self, element: u32) -> &mut Vec<Cell> {
        let mesh = &self.mesh;
        let cells = self.cells.entry(element);
        cells.or_insert_with(|| vec![Cell::whole(mesh.tet(element))])
    }
}

/// Where a point of an element is, by where the nodes of a cell are.
pub(crate) fn place(at: &Weights, corners: &[Point; 4]) -> Point {
    [0, 1, 2].map(|k| (0..4).map(|c| at[c] * corners[c][k]).sum())
}
