//! Instruments and haptics of a scene: poses to contacts, the last state to forces. Both are made at
//! their first use, so that a scene without them pays nothing.

use super::Scene;
#[cfg(feature = "forces")]
use super::core::Core;
#[cfg(any(feature = "contact", feature = "forces"))]
use super::core::lock_read;
#[cfg(feature = "forces")]
use super::published::Published;
#[cfg(any(feature = "contact", feature = "forces"))]
use crate::error::{Error, Result};
#[cfg(feature = "forces")]
use crate::forces::{Moduli, ReactionForces};
#[cfg(feature = "contact")]
use crate::instrument::{Instrument, InstrumentContacts};
#[cfg(any(feature = "contact", feature = "forces"))]
use std::sync::{Mutex, MutexGuard, TryLockError};

/// What the first use makes.
#[derive(Default)]
pub struct Tools {
    #[cfg(feature = "contact")]
    contacts: Mutex<Option<InstrumentContacts>>,
    #[cfg(feature = "forces")]
    forces: Mutex<Option<Haptics>>,
}

#[cfg(feature = "forces")]
struct Haptics {
    forces: ReactionForces,
    /// Nodes around the contact nodes, and the field they are decoded into.
    around: Vec<u32>,
    decoded: Vec<f32>,
    field: Vec<f32>,
}

impl Tools {
    /// Forgets which nodes instruments touch.
    pub fn reset(&self) {
        #[cfg(feature = "contact")]
        if let Ok(mut contacts) = self.contacts.lock()
            && let Some(contacts) = contacts.as_mut()
        {
            contacts.reset();
        }
    }
}

#[cfg(any(feature = "contact", feature = "forces"))]
fn lock<T>(mutex: &Mutex<T>) -> Result<MutexGuard<'_, T>> {
    match mutex.try_lock() {
        Ok(guard) => Ok(guard),
        Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
        Err(TryLockError::WouldBlock) => {
            Err(Error::Busy("another thread is using the scene".into()))
        }
    }
}

impl Scene {
    /// The contacts of instruments with the tissue in its last state: `take(nodes, vectors)` gets the
    /// nodes, ascending, and `[m,3]` mm, the input of the next step.
    ///
    /// The scene remembers what is touched between calls ([`crate::instrument`]); [`Scene::reset`] forgets it.
    /// With a region, surface nodes outside of it are taken where they last were.
    ///
    /// # Errors
    /// [`Error::Argument`], [`Error::NonFinite`] for an instrument, [`Error::Busy`], and what `take` gives.
    #[cfg(feature = "contact")]
    pub fn contacts_from_instruments<T>(
        &self,
        instruments: &[Instrument],
        take: impl FnOnce(&[u32], &[f32]) -> Result<T>,
    ) -> Result<T> {
        let mut contacts = lock(&self.tools.contacts)?;
        let mesh = &self.mesh;
        let contacts = contacts.get_or_insert_with(|| {
            InstrumentContacts::new(&mesh.positions, &mesh.surface_faces, &mesh.held_nodes)
        });
        let published = lock_read(&self.shared.published);
        let (nodes, vectors) = contacts.find(instruments, &published.last.field)?;
        take(nodes, vectors)
    }

    /// Force of the tissue on the instruments at the last step's contact nodes, in their order:
    /// `out [m,3]`, mN ([`crate::forces`]). Nodes around them that the region left out are decoded.
    ///
    /// # Errors
    /// [`Error::State`] before the first step, [`Error::Argument`] for a wrong length, [`Error::Busy`].
    #[cfg(feature = "forces")]
    pub fn contact_force(&self, out: &mut [f32]) -> Result<()> {
        let mut haptics = lock(&self.tools.forces)?;
        self.with(|core, published| {
            let haptics = haptics.get_or_insert_with(|| {
                let (mesh, material) = (&self.mesh, &self.model.manifest.material);
                let moduli = Moduli::from_young(material.young_pa, material.poisson);
                Haptics {
                    forces: ReactionForces::new(
                        &mesh.positions,
                        &mesh.tets,
                        &mesh.stiffness,
                        &mesh.surface_nodes,
                        moduli,
                    ),
                    around: Vec::new(),
                    decoded: Vec::new(),
                    field: vec![0.0; mesh.positions.len()],
                }
            });
            haptics.reaction(core, published, out)
        })
    }
}

#[cfg(feature = "forces")]
impl Haptics {
    fn reaction(
        &mut self,
        core: &mut Core,
        published: &std::sync::RwLock<Published>,
        out: &mut [f32],
    ) -> Result<()> {
        let shared = lock_read(published);
        if shared.region.is_none() {
            let (field, nodes) = (&shared.last.field, &shared.contact_nodes);
            return self.forces.reaction(field, nodes, out).map(|_| ());
        }
        let nodes = shared.contact_nodes.clone();
        drop(shared);
        self.around.clear();
        self.forces.neighbourhood(&nodes, &mut self.around);
        self.decoded.resize(3 * self.around.len(), 0.0);
        if !self.around.is_empty() {
            core.decode(published, &self.around, &mut self.decoded)?;
        }
        for (&node, u) in self.around.iter().zip(self.decoded.chunks_exact(3)) {
            self.field[3 * node as usize..][..3].copy_from_slice(u);
        }
        self.forces.reaction(&self.field, &nodes, out).map(|_| ())
    }
}
