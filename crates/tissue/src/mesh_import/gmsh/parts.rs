//! What a file of Gmsh holds: nodes and elements by tag.

use super::groups::Groups;
use crate::mesh_import::error::{Fault, fault};
use crate::mesh_import::labels::{Labels, Part};
use std::collections::HashMap;

/// What an element is, by its type in Gmsh.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// A point or a line, or a face of more than three corners.
    Other,
    Triangle,
    Tetrahedron,
}

/// The shape and the number of nodes of a type.
pub(super) fn shape(kind: i64, element: usize) -> Result<(Shape, usize), Fault> {
    Ok(match kind {
        2 => (Shape::Triangle, 3),
        9 => (Shape::Triangle, 6),
        20 => (Shape::Triangle, 9),
        21 => (Shape::Triangle, 10),
        22 => (Shape::Triangle, 12),
        23 | 24 => (Shape::Triangle, 15),
        25 => (Shape::Triangle, 21),
        4 => (Shape::Tetrahedron, 4),
        11 => (Shape::Tetrahedron, 10),
        29 => (Shape::Tetrahedron, 20),
        30 => (Shape::Tetrahedron, 35),
        31 => (Shape::Tetrahedron, 56),
        15 => (Shape::Other, 1),
        1 => (Shape::Other, 2),
        8 => (Shape::Other, 3),
        26 => (Shape::Other, 4),
        27 => (Shape::Other, 5),
        28 => (Shape::Other, 6),
        3 => (Shape::Other, 4),
        10 => (Shape::Other, 9),
        16 => (Shape::Other, 8),
        _ => {
            let kind = format!("Gmsh element type {kind}");
            return Err(Fault::Kind { element, kind });
        }
    })
}

/// What the sections give: coordinates by order of appearance, and their tags.
#[derive(Default)]
pub(super) struct Parts {
    pub(super) positions: Vec<[f64; 3]>,
    pub(super) node_of_tag: HashMap<u64, u32>,
    /// Node tags of each tetrahedron.
    pub(super) tets: Vec<Vec<u64>>,
    pub(super) groups: Groups,
}

impl Parts {
    pub(super) fn node(&mut self, tag: u64, point: [f64; 3]) -> Result<(), Fault> {
        let node = self.positions.len() as u32;
        if self.node_of_tag.insert(tag, node).is_some() {
            return fault(format!("node tag {tag} appears twice"));
        }
        self.positions.push(point);
        Ok(())
    }

    /// An element by its node tags; `physical` is a list of [`Groups`].
    pub(super) fn element(&mut self, shape: Shape, nodes: Vec<u64>, physical: usize) {
        match shape {
            Shape::Other => {}
            Shape::Triangle => self.groups.add(&nodes[..3], physical),
            Shape::Tetrahedron => {
                self.groups.add(&nodes[..4], physical);
                self.tets.push(nodes);
            }
        }
    }
}

/// Names of the triangles and tetrahedra that are in groups.
pub(super) fn labels(parts: Parts, bytes: usize) -> Result<Labels, Fault> {
    let mut labels = Labels::of_file(bytes);
    labels.positions = parts.positions;
    for (tags, list) in &parts.groups.elements {
        let nodes: Option<Vec<u32>> = tags
            .iter()
            .map(|tag| parts.node_of_tag.get(tag).copied())
            .collect();
        let (part, dimension) = match nodes.as_deref() {
            Some(&[a, b, c]) => {
                labels.faces.push([a, b, c]);
                (Part::Face(labels.faces.len() - 1), 2)
            }
            Some(&[a, b, c, d]) => {
                labels.tets.push([a, b, c, d]);
                (Part::Tet(labels.tets.len() - 1), 3)
            }
            _ => continue,
        };
        for &group in &parts.groups.lists[*list] {
            for word in parts.groups.words(dimension, group) {
                let name = labels.name(&word);
                labels.add(name, part)?;
            }
        }
    }
    Ok(labels)
}
