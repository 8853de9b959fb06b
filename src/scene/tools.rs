//! What instruments and haptics of a scene keep between calls, made at the first use, so that a scene without them pays
//! nothing; and the instruments: poses to contacts.

use super::Scene;
#[cfg(feature = "contact")]
use super::core::lock_read;
#[cfg(feature = "forces")]
use super::reaction::Haptics;
#[cfg(feature = "contact")]
use super::shared::lock;
#[cfg(feature = "contact")]
use crate::contact::{Told, Tool};
#[cfg(feature = "contact")]
use crate::error::Result;
#[cfg(feature = "contact")]
use crate::instrument::{Instrument, InstrumentContacts};
#[cfg(any(feature = "contact", feature = "forces"))]
use std::sync::Mutex;
#[cfg(feature = "contact")]
use std::sync::MutexGuard;

/// The contacts that a host asks for, and what it asked last: the same question of the same state has the same answer.
#[cfg(feature = "contact")]
struct Asked {
    contacts: InstrumentContacts,
    instruments: Vec<Instrument>,
    step: Option<u64>,
}

/// What the first use makes.
#[derive(Default)]
pub struct Tools {
    #[cfg(feature = "contact")]
    contacts: Mutex<Option<Asked>>,
    #[cfg(feature = "contact")]
    pub(super) presenters: Mutex<super::presenter::Presenters>,
    /// What a host's instruments are read into.
    #[cfg(feature = "contact")]
    list: Mutex<Vec<Tool>>,
    /// The same of a frame between steps.
    #[cfg(feature = "contact")]
    frame_list: Mutex<Vec<Tool>>,
    #[cfg(feature = "forces")]
    pub(super) forces: Mutex<Option<Haptics>>,
    /// The contact forces of the last call that asked for them.
    #[cfg(feature = "forces")]
    pub(super) reaction: Mutex<Vec<f32>>,
}

impl Tools {
    /// Forgets which nodes instruments touch.
    pub fn reset(&self) {
        #[cfg(feature = "contact")]
        if let Ok(mut contacts) = self.contacts.lock()
            && let Some(contacts) = contacts.as_mut()
        {
            contacts.contacts.reset();
            contacts.step = None;
        }
    }
}

#[cfg(feature = "contact")]
impl Scene {
    /// A list for the tools of a step, kept from call to call.
    ///
    /// # Errors
    /// [`Error::Busy`].
    pub fn tool_list(&self) -> Result<MutexGuard<'_, Vec<Tool>>> {
        lock(&self.tools.list)
    }

    /// A list for the tools of a frame between steps.
    ///
    /// # Errors
    /// [`Error::Busy`].
    pub fn frame_tools(&self) -> Result<MutexGuard<'_, Vec<Tool>>> {
        lock(&self.tools.frame_list)
    }

    /// Starts a step that tools drive on the scene's worker.
    ///
    /// # Errors
    /// As [`Scene::submit`], and what [`Tool::check`] says.
    pub fn submit_tools(&self, tools: &[Tool]) -> Result<()> {
        self.worker.submit_tools(&self.shared, tools)
    }

    /// Reads what the tools of the last step were told, and the samples that push them.
    pub fn with_told<T>(&self, read: impl FnOnce(&Told) -> T) -> T {
        read(&lock_read(&self.shared.published).tools)
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
        if contacts.is_none() {
            // Made of many lists: what they take together is asked for first.
            let bytes = 64 * mesh.surface_nodes.len() + 24 * mesh.surface_faces.len();
            crate::memory::probe(
                bytes + 4 * mesh.positions.len(),
                "the instruments' contacts",
            )?;
        }
        let asked = contacts.get_or_insert_with(|| Asked {
            contacts: InstrumentContacts::new(
                &mesh.positions,
                &mesh.surface_faces,
                &mesh.held_nodes,
            ),
            instruments: Vec::new(),
            step: None,
        });
        let published = lock_read(&self.shared.published);
        let step = Some(published.stats.step_count);
        if asked.step != step || asked.instruments != instruments {
            asked.step = None;
            asked.contacts.find(instruments, &published.last.field)?;
            asked.instruments.clear();
            asked.instruments.extend_from_slice(instruments);
            asked.step = step;
        }
        let (nodes, vectors) = asked.contacts.found();
        take(nodes, vectors)
    }
}
