//! A model names its support groups, and the regions of its surface.

use super::Model;
use crate::bundle::NodeSet;

fn named(sets: &[NodeSet]) -> impl Iterator<Item = (&str, &[u32])> {
    let sets = sets.iter();
    sets.map(|set| (set.name.as_str(), set.nodes.as_slice()))
}

impl Model {
    /// The bundle's support groups: name and nodes, ascending.
    pub fn supports(&self) -> impl Iterator<Item = (&str, &[u32])> {
        named(&self.mesh.supports)
    }

    /// The bundle's named regions of the surface: name and nodes, ascending. [`Pressure::nodes`](crate::Pressure::nodes) takes one's nodes.
    pub fn regions(&self) -> impl Iterator<Item = (&str, &[u32])> {
        named(&self.mesh.regions)
    }
}
