//! Forces at points of the tissue, which the nodes around them share.

use topology::Body;

use super::load_limits::{LARGEST_FORCE, WHAT, check_size};
use super::points::AttachedPoints;
use crate::error::{Error, Result};
use crate::memory;
use crate::model::Model;

/// Forces at points of a step at most.
pub const MAX_POINT_FORCES: usize = 256;
/// How far the weights of a point may be from a sum of 1.
const ROUNDING: f32 = 1e-3;

/// A force at a point of the tissue's surface or inside of it; [`PointForce::at`] finds the point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointForce {
    /// Nodes of the intact mesh around the point, ...
    pub nodes: [u32; 4],
    /// ... and their weights, 0 or more, with the sum 1; all zero: the first node alone.
    pub weights: [f32; 4],
    /// mN, in the mesh's frame.
    pub force: [f32; 3],
}

/// What bears a force in a body that has been cut.
pub(super) enum Bearer {
    /// The nodes of the piece of an element in which the point lies, each with its share.
    Piece([(u32, f32); 4]),
    /// The tissue at the place of each of its nodes: it is one node, or its nodes are not of one element.
    Nodes,
    /// The tissue at the point has been removed.
    Gone,
}

impl PointForce {
    /// Forces of zero at places of the intact mesh, rest mm, for a host to set: each in the tetrahedron that holds it, or at the closest point of the mesh. Takes some
    /// milliseconds for a large mesh: find a place once, not in every step.
    ///
    /// # Errors
    /// [`Error::NonFinite`]; [`Error::Argument`] for a place 25 mm or more outside of the mesh.
    pub fn at(model: &Model, places: &[[f32; 3]]) -> Result<Vec<PointForce>> {
        let found = AttachedPoints::new(&model.mesh, places.as_flattened())?;
        let forces = found.corners().map(|(nodes, weights)| PointForce {
            nodes,
            weights,
            force: [0.0; 3],
        });
        memory::collected(places.len(), forces, WHAT)
    }

    /// The nodes that bear it, each with its share.
    pub(super) fn shares(&self) -> impl Iterator<Item = (u32, f32)> {
        let weights = match self.weights == [0.0; 4] {
            true => [1.0, 0.0, 0.0, 0.0],
            false => self.weights,
        };
        let all = self.nodes.into_iter().zip(weights);
        all.filter(|(_, weight)| *weight != 0.0)
    }

    /// What bears it in a body that has been cut: the side on which its point lies.
    pub(super) fn bearer(&self, body: &Body) -> Bearer {
        let mut shares = self.shares();
        let first = match (shares.next(), shares.next()) {
            (Some((node, _)), Some(_)) => node,
            _ => return Bearer::Nodes,
        };
        let mut is_of_one = false;
        for element in body.mesh().around(first) {
            let tet = body.mesh().tet(*element);
            let corner_of = |node| tet.iter().position(|corner| *corner == node);
            if self.shares().any(|(node, _)| corner_of(node).is_none()) {
                continue;
            }
            is_of_one = true;
            let at = tet.map(|corner| {
                let own = self.shares().filter(|(node, _)| *node == corner);
                own.map(|(_, weight)| weight).sum::<f32>()
            });
            // A point of a face is of two elements: one of them may have been removed.
            if let Some(nodes) = body.tissue_at(*element, &at.map(f64::from)) {
                return Bearer::Piece([0, 1, 2, 3].map(|corner| (nodes[corner], at[corner])));
            }
        }
        match is_of_one {
            true => Bearer::Gone,
            false => Bearer::Nodes,
        }
    }

    fn check(&self, index: usize, count: usize) -> Result<()> {
        for (axis, value) in self.force.into_iter().enumerate() {
            check_size(value, LARGEST_FORCE, "mN", || {
                format!("point_forces[{index}].force[{axis}]")
            })?;
        }
        for (at, weight) in self.weights.into_iter().enumerate() {
            if !weight.is_finite() {
                return Err(Error::NonFinite(format!(
                    "point_forces[{index}].weights[{at}] is {weight}"
                )));
            }
        }
        let fail = |what: String| Err(Error::Argument(format!("point_forces[{index}]: {what}")));
        if let Some((node, _)) = self.shares().find(|(node, _)| *node as usize >= count) {
            return fail(format!("node {node} is beyond the mesh's {count} nodes"));
        }
        let sum: f32 = self.shares().map(|(_, weight)| weight).sum();
        if (sum - 1.0).abs() > ROUNDING || self.weights.iter().any(|weight| *weight < 0.0) {
            return fail(format!(
                "the weights are {:?}, must be 0 or more with the sum 1",
                self.weights
            ));
        }
        Ok(())
    }
}

/// Checks forces on a body whose intact mesh has `count` nodes.
///
/// # Errors
/// [`Error::NonFinite`] and [`Error::Argument`], with the entry.
pub(super) fn check(forces: &[PointForce], count: usize) -> Result<()> {
    if forces.len() > MAX_POINT_FORCES {
        return Err(Error::Argument(format!(
            "point_forces has {} entries, must have at most {MAX_POINT_FORCES}",
            forces.len()
        )));
    }
    let mut all = forces.iter().enumerate();
    all.try_for_each(|(index, force)| force.check(index, count))
}
