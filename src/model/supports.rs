//! A model names its support groups.

use super::Model;

impl Model {
    /// The bundle's support groups: name and nodes, ascending.
    pub fn supports(&self) -> impl Iterator<Item = (&str, &[u32])> {
        let groups = self.mesh.supports.iter();
        groups.map(|group| (group.name.as_str(), group.nodes.as_slice()))
    }
}
