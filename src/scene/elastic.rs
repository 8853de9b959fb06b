//! The elastic force of the elements around the contact nodes, for scenes without a prior.

use std::sync::RwLock;

use super::core::Core;
use super::published::Published;
use super::published::lock_read;
use crate::bundle::Mesh;
use crate::error::Result;
use crate::forces::ReactionForces;
use crate::memory;
use crate::model::Model;

const WHAT: &str = "the elements' forces";

/// The elements' forces of a scene without a prior.
pub struct Haptics {
    forces: ReactionForces,
    /// The contact nodes, nodes around them, and the field they are decoded into.
    nodes: Vec<u32>,
    around: Vec<u32>,
    /// Of the nodes around the contact `[n,3]`, mm.
    decoded: Vec<f32>,
    /// `[K,3]`, mm: true at the nodes around the contact of the last call, and read there alone.
    field: Vec<f32>,
}

impl Haptics {
    /// For a mesh with the moduli of the bundle's material; one list of elements by node is made here, so that a call looks
    /// at those around the contact alone.
    pub(super) fn new(mesh: &Mesh, model: &Model) -> Result<Haptics> {
        let material = &model.manifest.material;
        Ok(Haptics {
            forces: ReactionForces::new(mesh.tetrahedra(), &mesh.surface.nodes, material.moduli())?,
            nodes: Vec::new(),
            around: Vec::new(),
            decoded: Vec::new(),
            field: memory::zeros(mesh.positions.len(), WHAT)?,
        })
    }

    /// Elastic forces at the contact nodes of the last published state, in their order, mN, into `out [3n]`. Where the
    /// scene has a region, the nodes around the contact are decoded first: the published field holds the region alone.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`](crate::Error::OutOfMemory), and those of a decoding.
    pub(super) fn reaction(
        &mut self,
        core: &mut Core,
        published: &RwLock<Published>,
        out: &mut [f32],
    ) -> Result<()> {
        let shared = lock_read(published);
        if shared.region.is_none() {
            let (field, nodes) = (&shared.last.field, &shared.contact.nodes);
            return self.forces.reaction(field, nodes, out).map(|_| ());
        }
        memory::replace(&mut self.nodes, &shared.contact.nodes, WHAT)?;
        drop(shared);
        self.around.clear();
        (self.forces).neighbourhood(&self.nodes, &mut self.around)?;
        let floats = 3 * self.around.len();
        memory::fit(&mut self.decoded, floats, WHAT)?;
        self.decoded.resize(floats, 0.0);
        if !self.around.is_empty() {
            core.decode(
                published,
                Some(&self.around),
                self.decoded.as_mut_slice().into(),
            )?;
        }
        for (&node, u) in self.around.iter().zip(self.decoded.chunks_exact(3)) {
            self.field[3 * node as usize..][..3].copy_from_slice(u);
        }
        let forces = self.forces.reaction(&self.field, &self.nodes, out);
        forces.map(|_| ())
    }
}
