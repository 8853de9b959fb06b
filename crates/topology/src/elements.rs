//! What a solver takes of a body: an element a living cell, with the share of volume by which its forces and its mass count.

use crate::TopologyError;
use crate::body::{Body, Cell};
use crate::room::push;

/// No cell of a cut element has less of it, in stiffness and mass alike: lighter ones blow up what iterates on them.
pub const LEAST_SHARE: f64 = 0.1;

/// An element of the body as it is now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element {
    /// Its corners; at rest they lie where those of its parent do.
    pub nodes: [u32; 4],
    /// The mesh element whose rest shape it has.
    pub parent: u32,
    /// Part of its parent's volume.
    pub share: f64,
    /// Factor of its parent's stiffness.
    pub stiffness: f32,
}

/// What of the mesh is not as it was.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes {
    /// Elements with other cells or another stiffness, ascending.
    pub gone: Vec<u32>,
    /// What is there in their place, in their order.
    pub new: Vec<Element>,
}

/// The place of what an element stems from among the elements of the body before an operation, ascending by parent: of those of the same mesh element the one
/// on the nodes that its own were copied from (`source`). None where that mesh element is not in the list.
pub fn origin(element: &Element, before: &[Element], source: impl Fn(u32) -> u32) -> Option<usize> {
    let corners = element.nodes.map(source);
    let first = before.partition_point(|other| other.parent < element.parent);
    let end = before.partition_point(|other| other.parent <= element.parent);
    let shared = |other: &Element| {
        let pairs = other.nodes.iter().zip(&corners);
        pairs.filter(|(a, b)| a == b).count()
    };
    // Of equals the first.
    (first..end)
        .rev()
        .max_by_key(|place| shared(&before[*place]))
}

impl Body {
    /// What is not as in the mesh.
    ///
    /// # Errors
    /// No memory.
    pub fn changes(&self) -> Result<Changes, TopologyError> {
        let mut changes = Changes::default();
        for element in self.changed_elements() {
            push(&mut changes.gone, element)?;
            for own in self.elements_of(element) {
                push(&mut changes.new, own)?;
            }
        }
        Ok(changes)
    }

    /// All living elements: those that nothing has touched in the mesh's order, each where it was, and the cells of each touched one together.
    pub fn elements(&self) -> impl Iterator<Item = Element> + '_ {
        (0..self.mesh().element_count() as u32).flat_map(|parent| self.elements_of(parent))
    }

    /// The living elements of one mesh element. What a cut takes from a heavy cell to give a light one [`LEAST_SHARE`] leaves their sum as it was; cells on the
    /// same nodes are one.
    pub fn elements_of(&self, parent: u32) -> Vec<Element> {
        let stiffness = self.stiffness(parent);
        let Some(cells) = self.cells.get(&parent) else {
            return vec![Element {
                nodes: self.mesh().tet(parent),
                parent,
                share: 1.0,
                stiffness,
            }];
        };
        let mut found: Vec<Element> = Vec::with_capacity(cells.len());
        for (cell, share) in cells.iter().zip(filled(cells)) {
            if !cell.is_alive {
                continue;
            }
            match found.iter_mut().find(|other| other.nodes == cell.nodes) {
                Some(other) => other.share += share,
                None => found.push(Element {
                    nodes: cell.nodes,
                    parent,
                    share,
                    stiffness,
                }),
            }
        }
        found
    }

    /// Volume of the living elements, mm³.
    pub fn volume(&self) -> f64 {
        (0..self.mesh().element_count() as u32)
            .map(|parent| self.volume_of(parent))
            .sum()
    }

    /// That of the living cells of one mesh element.
    pub(crate) fn volume_of(&self, parent: u32) -> f64 {
        let own = self.mesh().volume(parent);
        match self.cells.get(&parent) {
            None => own,
            Some(cells) => {
                let living = cells
                    .iter()
                    .zip(filled(cells))
                    .filter(|(cell, _)| cell.is_alive);
                own * living.map(|(_, share)| share).sum::<f64>()
            }
        }
    }
}

/// What is left of the living cells of an element as parts of its volume. A light cell gets up to [`LEAST_SHARE`] of what it may have left from the
/// heavy ones: the sum is that of the cells' own.
pub(crate) fn filled(cells: &[Cell]) -> Vec<f64> {
    // More than ten cells cannot all have a tenth.
    let least = LEAST_SHARE.min(1.0 / cells.len() as f64);
    let own = |cell: &Cell| match cell.is_alive {
        true => cell.share * cell.kept,
        false => 0.0,
    };
    let lacks = |cell: &Cell| match cell.is_alive {
        true => (least * cell.kept - own(cell)).max(0.0),
        false => 0.0,
    };
    let spares = |cell: &Cell| (own(cell) - least * cell.kept).max(0.0);
    let raised: f64 = cells.iter().map(lacks).sum();
    let spare: f64 = cells.iter().map(spares).sum();
    if raised == 0.0 || spare == 0.0 {
        return cells.iter().map(own).collect();
    }
    // What is given is what is taken, `given raised = taken spare`, so the volume stays.
    let (given, taken) = ((spare / raised).min(1.0), (raised / spare).min(1.0));
    let fill = |cell| own(cell) + given * lacks(cell) - taken * spares(cell);
    cells.iter().map(fill).collect()
}
