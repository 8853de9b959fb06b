//! What each node of a body bears of a host's forces, which are given by nodes and points of the intact mesh.
//!
//! A host knows the intact mesh alone. After a cut the tissue at a node's place may belong to one
//! of its copies or to several; each takes its part by volume, and the parts of one node add up to
//! 1, so that the whole force stays the host's.

use topology::Body;

use super::load_limits::WHAT;
use super::point_force::{Bearer, PointForce};
use crate::bundle::Mesh;
use crate::error::{Error, Result};
use crate::memory::{self, HeldBytes};

/// See the module.
#[derive(HeldBytes)]
pub struct NodeForces {
    /// Nodes of the intact mesh.
    count: usize,
    /// Of each copy of a node: the node of the intact mesh that it stems from.
    parents: Vec<u32>,
    /// By node: its part of the force on the node of the intact mesh that it is or stems from; empty for an intact body.
    takes: Vec<f32>,
    /// Of forces at points the sum at each node of the body, mN; empty without any.
    at_points: Vec<f32>,
}

impl NodeForces {
    /// For a mesh as a body that was made of it is now.
    pub(super) fn new(mesh: &Mesh, body: Option<&Body>) -> Result<NodeForces> {
        let parents = memory::copied(body.map_or(&[], Body::parents), WHAT)?;
        let count = mesh.node_count() - parents.len();
        // In a cut body a node of an element that has changed may hold no tissue any more: what acts on it goes to the copies that carry its tissue.
        let mut takes = Vec::new();
        if let Some(body) = body {
            takes = memory::filled(mesh.node_count(), 1.0, WHAT)?;
            takes[count..].fill(0.0);
            let mut parts = Vec::new();
            let changed = body.changed_elements();
            for node in changed.flat_map(|element| body.mesh().tet(element)) {
                body.carriers(node, &mut parts)?;
                // Stays zero unless the node is among its own carriers: then no tissue is left at
                // it.
                takes[node as usize] = 0.0;
                for (node, part) in &parts {
                    takes[*node as usize] = *part as f32;
                }
            }
        }
        Ok(NodeForces {
            count,
            parents,
            takes,
            at_points: Vec::new(),
        })
    }

    /// Nodes of the intact mesh.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// The node of the intact mesh that a node is or stems from.
    pub(super) fn parent(&self, node: usize) -> usize {
        match node.checked_sub(self.count) {
            Some(copy) => self.parents[copy] as usize,
            None => node,
        }
    }

    /// Takes the forces at points of a step; `body` is the one that it was made with.
    ///
    /// # Errors
    /// [`Error::Argument`] for one at tissue that has been removed, [`Error::OutOfMemory`].
    pub(super) fn take(&mut self, forces: &[PointForce], body: Option<&Body>) -> Result<()> {
        self.at_points.clear();
        if forces.is_empty() {
            return Ok(());
        }
        let len = 3 * (self.count + self.parents.len());
        memory::fit(&mut self.at_points, len, WHAT)?;
        self.at_points.resize(len, 0.0);
        let acting = forces.iter().enumerate();
        for (index, force) in acting.filter(|(_, force)| force.force != [0.0; 3]) {
            let is_borne = match body.map(|body| force.bearer(body)) {
                None => {
                    (force.shares()).for_each(|share| self.add(share, force.force));
                    true
                }
                Some(Bearer::Piece(shares)) => {
                    (shares.into_iter()).for_each(|share| self.add(share, force.force));
                    true
                }
                Some(Bearer::Nodes) => {
                    (force.shares()).all(|share| self.spread(share, force.force))
                }
                Some(Bearer::Gone) => false,
            };
            if !is_borne {
                return Err(Error::Argument(format!(
                    "point_forces[{index}]: of the tissue at its nodes {:?} the body has nothing left; give it a force of 0",
                    force.nodes
                )));
            }
        }
        Ok(())
    }

    /// A node takes a share of a force.
    fn add(&mut self, (node, weight): (u32, f32), force: [f32; 3]) {
        let own = &mut self.at_points[3 * node as usize..][..3];
        (own.iter_mut().zip(force)).for_each(|(own, force)| *own += weight * force);
    }

    /// The tissue at the place of a node of the intact mesh takes a share; says whether there is any.
    fn spread(&mut self, (node, weight): (u32, f32), force: [f32; 3]) -> bool {
        let mut is_borne = false;
        for own in 0..self.count + self.parents.len() {
            let part = self.takes.get(own).unwrap_or(&1.0) * weight;
            if self.parent(own) == node as usize && part != 0.0 {
                self.add((own as u32, part), force);
                is_borne = true;
            }
        }
        is_borne
    }

    /// The force on a node, mN: its part of those of `on_nodes` `[count,3]`, and that at points.
    pub(super) fn on(&self, node: usize, on_nodes: Option<&[f32]>) -> [f32; 3] {
        let (from, part) = (self.parent(node), self.takes.get(node).unwrap_or(&1.0));
        [0, 1, 2].map(|axis| {
            let own = on_nodes.map_or(0.0, |forces| forces[3 * from + axis]);
            part * own + self.at_points.get(3 * node + axis).unwrap_or(&0.0)
        })
    }
}
