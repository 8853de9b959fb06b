//! Which cells are joined, and where nodes part.
//!
//! Two cells are joined over a face of the mesh where no stroke passes between them and their parts of the face overlap. A node is there once for each
//! group of living cells around it that are joined by faces that have the node.

use std::collections::BTreeMap;

use crate::TopologyError;
use crate::body::{Body, Cell, Change};
use crate::polygon;
use crate::polytope::{Side, Weights};
use crate::rest::{FACES, OUTSIDE};
use crate::room::{collected, push};

/// Parts of a face that overlap by less, of its area, do not: neighbours that only share an edge
/// have that much in common by rounding.
const LEAST_OVERLAP: f64 = 1e-9;

/// A cell's part of a face of the mesh, in barycentric coordinates of the two later of its nodes, ascending.
pub(crate) fn on_face(mesh: [u32; 4], cell: &Cell, face: usize) -> Option<Vec<[f64; 2]>> {
    // Both neighbours order the face's corners by mesh node: so they speak of the same coordinates,
    // though each has an order of its own.
    let mut corners = FACES[face];
    corners.sort_unstable_by_key(|corner| mesh[*corner]);
    let flat = |at: &Weights| [at[corners[1]], at[corners[2]]];
    let mut points: Vec<[f64; 2]> = match &cell.polytope {
        None => vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
        Some(polytope) => {
            let mut faces = polytope.faces.iter();
            let (_, points) = faces.find(|(side, _)| *side == Side::Face(face as u8))?;
            points.iter().map(flat).collect()
        }
    };
    // `common` clips by edges that have the inside on their left.
    if polygon::double_area(&points) < 0.0 {
        points.reverse();
    }
    Some(points)
}

/// What two convex polygons of a face, left round, have in common.
pub(crate) fn common(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut rest = a.to_vec();
    for (at, from) in b.iter().enumerate() {
        let to = b[(at + 1) % b.len()];
        let way = [to[0] - from[0], to[1] - from[1]];
        rest = polygon::clip(&rest, |point| {
            let value = way[0] * (point[1] - from[1]) - way[1] * (point[0] - from[0]);
            // Parts of one face often share a whole edge: what rounding puts beside it lies on it.
            if value.abs() < 1e-12 { 0.0 } else { value }
        });
        if rest.len() < 3 {
            return Vec::new();
        }
    }
    match polygon::double_area(&rest) > LEAST_OVERLAP {
        true => rest,
        false => Vec::new(),
    }
}

/// Sets that join.
/// Disjoint sets as a forest (Tarjan 1975): each member names one that is nearer to the root.
pub(crate) struct Groups(Vec<u32>);

impl Groups {
    /// Each number a set of its own.
    pub fn new(count: usize) -> Result<Groups, TopologyError> {
        Ok(Groups(collected(count, 0..count as u32)?))
    }

    /// The number of a member's set.
    pub fn of(&mut self, mut at: u32) -> u32 {
        while self.0[at as usize] != at {
            // Path halving: the next search has half as far to go.
            let up = self.0[self.0[at as usize] as usize];
            self.0[at as usize] = up;
            at = up;
        }
        at
    }

    /// The smaller number stands for both.
    /// So the number of a set is its smallest member and does not hang on the order of the joins:
    /// copies of nodes get the same numbers on every machine.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.of(a), self.of(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

impl Body {
    /// Whether two living cells of neighbours, over the given face of the first, are joined.
    pub(crate) fn is_joined(
        &self,
        (a, cell): (u32, &Cell),
        face: usize,
        b: u32,
        other: &Cell,
    ) -> bool {
        if !cell.is_alive || !other.is_alive || cell.is_parted_from(other) {
            return false;
        }
        // Two whole elements have the whole face in common.
        if cell.polytope.is_none() && other.polytope.is_none() {
            return true;
        }
        let back = self.mesh().neighbours(b).iter().position(|over| *over == a);
        let own = on_face(self.mesh().tet(a), cell, face);
        let others = back.and_then(|back| on_face(self.mesh().tet(b), other, back));
        match (own, others) {
            (Some(own), Some(others)) => !common(&own, &others).is_empty(),
            _ => false,
        }
    }

    /// Gives each group of joined cells around the nodes of changed elements its own nodes.
    /// Cells that meet only along an edge or at a point do not hold together. The caller works on a
    /// copy of the body, which it drops where this fails.
    pub(crate) fn part_nodes(&mut self, change: &mut Change) -> Result<(), TopologyError> {
        // Around all other mesh nodes the cells are what they were, so nothing parts there.
        let corners = (change.elements.iter()).flat_map(|element| self.mesh().tet(*element));
        let mut nodes = collected(4 * change.elements.len(), corners)?;
        nodes.sort_unstable();
        nodes.dedup();
        let before = self.node_count();
        let mut elements = std::mem::take(&mut change.elements);
        for node in nodes {
            self.part_node(node, change, &mut elements)?;
            if self.node_count() > self.most_nodes {
                return Err(TopologyError::Room {
                    nodes: self.node_count(),
                    most: self.most_nodes,
                });
            }
        }
        // A copy is as far from a blade that goes on as the node that it comes from.
        for distances in self.strokes.values_mut() {
            for (at, source) in change.copied.iter().enumerate() {
                if let Some(&distance) = distances.get(source) {
                    distances.insert((before + at) as u32, distance);
                }
            }
        }
        elements.sort_unstable();
        elements.dedup();
        change.elements = elements;
        Ok(())
    }

    /// One mesh node at a time: of each node that stands for it now, one group of cells keeps the
    /// number and the others get copies.
    fn part_node(
        &mut self,
        node: u32,
        change: &mut Change,
        elements: &mut Vec<u32>,
    ) -> Result<(), TopologyError> {
        let around = self.mesh().around(node).to_vec();
        // The cells around the node, and where those of each element start.
        let lists: Vec<_> = around.iter().map(|element| self.cells(*element)).collect();
        let mut starts = vec![0u32];
        for list in &lists {
            starts.push(starts[starts.len() - 1] + list.len() as u32);
        }
        let mut groups = Groups::new(starts[lists.len()] as usize)?;
        for (at, &element) in around.iter().enumerate() {
            let own = self.mesh().tet(element);
            for (face, &over) in self.mesh().neighbours(element).iter().enumerate() {
                // A face has the number of the corner opposite to it: it has the node unless that
                // corner is the node.
                let has_node = own[face] != node;
                let Ok(other) = around.binary_search(&over) else {
                    continue;
                };
                if over == OUTSIDE || over < element || !has_node {
                    continue;
                }
                for (a, cell) in lists[at].iter().enumerate() {
                    for (b, next) in lists[other].iter().enumerate() {
                        if self.is_joined((element, cell), face, over, next) {
                            groups.join(starts[at] + a as u32, starts[other] + b as u32);
                        }
                    }
                }
            }
        }
        // By old node: the groups that had it, with their volume and whether the node's own material is theirs.
        let mut had: BTreeMap<u32, BTreeMap<u32, (bool, f64)>> = BTreeMap::new();
        let corner_of = |element: u32| {
            let own = self.mesh().tet(element);
            own.iter().position(|corner| *corner == node).unwrap_or(0)
        };
        for (at, list) in lists.iter().enumerate() {
            let corner = corner_of(around[at]);
            let volume = self.mesh().volume(around[at]);
            for (a, cell) in list.iter().enumerate().filter(|(_, cell)| cell.is_alive) {
                let group = groups.of(starts[at] + a as u32);
                let all = had.entry(cell.nodes[corner]).or_default();
                let entry = all.entry(group).or_insert((false, 0.0));
                entry.0 |= (cell.polytope.as_ref()).is_none_or(|own| own.has_corner(corner));
                entry.1 += cell.share * volume;
            }
        }
        let mut renamed: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        let mut parents = Vec::new();
        for (old, all) in had {
            // The group that has the node's own material keeps the number, and of several the
            // largest: what a host knows of the node stays with the tissue that lies there.
            let better = |a: &(bool, f64), b: &(bool, f64)| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1));
            // Of equals the first stays.
            let keeper = all.iter().rev().max_by(|a, b| better(a.1, b.1));
            let keeper = keeper.map(|(group, _)| *group);
            for group in all.into_keys().filter(|group| Some(*group) != keeper) {
                renamed.insert((old, group), (self.node_count() + parents.len()) as u32);
                parents.push(node);
                push(&mut change.copied, old)?;
            }
        }
        if renamed.is_empty() {
            return Ok(());
        }
        // Nodes are renamed after all groups are known: `groups` was made of the cells as they
        // were.
        let mut moved = Vec::new();
        for (at, list) in lists.iter().enumerate() {
            let corner = corner_of(around[at]);
            for (a, cell) in list.iter().enumerate().filter(|(_, cell)| cell.is_alive) {
                let key = (cell.nodes[corner], groups.of(starts[at] + a as u32));
                if let Some(&new) = renamed.get(&key) {
                    moved.push((around[at], a, corner, new));
                }
            }
        }
        drop(lists);
        self.parents.extend(parents);
        for (element, at, corner, new) in moved {
            self.cells_mut(element)[at].nodes[corner] = new;
            push(elements, element)?;
        }
        Ok(())
    }
}
