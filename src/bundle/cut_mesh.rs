//! The mesh of a body that has been cut.

use topology::Body;

use super::mesh::{Mesh, unique};
use crate::error::Result;
use crate::memory;

const WHAT: &str = "the mesh of a cut body";

impl Mesh {
    /// This mesh as a body that was made of it is now: copies of nodes behind the mesh's own, elements by their cells. Nodes that nothing is
    /// left around are held. Boundary triangles, their areas and the hash stay those of the intact mesh.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn cut(&self, body: &Body) -> Result<Mesh> {
        let count = body.node_count();
        let nodes = 0..count as u32;
        let places = nodes
            .clone()
            .flat_map(|node| self.position(body.parent(node)));
        let (mut tets, mut stiffness, mut shares) = (Vec::new(), Vec::new(), Vec::new());
        let mut is_left = memory::filled(count, false, WHAT)?;
        for element in body.elements() {
            let own = self.stiffness.get(element.parent as usize).copied();
            let share = element.share as f32;
            memory::reserve(&mut tets, 4, WHAT)?;
            tets.extend(element.nodes);
            memory::push(
                &mut stiffness,
                own.unwrap_or(1.0) * element.stiffness * share,
                WHAT,
            )?;
            memory::push(&mut shares, share, WHAT)?;
            for node in element.nodes {
                is_left[node as usize] = true;
            }
        }
        let mut domain = memory::room(self.domain_faces.len() / 3, WHAT)?;
        for face in self.domain_faces.as_chunks::<3>().0 {
            let mut corners = *face;
            corners.sort_unstable();
            domain.push(corners);
        }
        domain.sort_unstable();
        let faces = body.touchable(|corners| domain.binary_search(&corners).is_ok())?;
        let domain_faces = memory::copied(faces.as_flattened(), WHAT)?;
        let held = nodes.filter(|node| {
            let is_held = self.held_nodes.binary_search(&body.parent(*node)).is_ok();
            is_held || !is_left[*node as usize]
        });
        let mut node_area = memory::copied(&self.node_area, WHAT)?;
        memory::reserve(&mut node_area, count - self.node_count(), WHAT)?;
        node_area.resize(count, 0.0);
        Ok(Mesh {
            positions: memory::collected(3 * count, places, WHAT)?,
            tets,
            stiffness,
            shares,
            surface_faces: memory::copied(&self.surface_faces, WHAT)?,
            domain_nodes: unique(memory::copied(&domain_faces, WHAT)?),
            domain_faces,
            surface_nodes: memory::copied(&self.surface_nodes, WHAT)?,
            held_nodes: memory::collected(count, held, WHAT)?,
            node_area,
            sha256: self.sha256.clone(),
        })
    }
}
