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
use crate::contact::{MAX_TOOLS, Told, Tool};
#[cfg(feature = "contact")]
use crate::error::Result;
#[cfg(feature = "contact")]
use crate::instrument::{Instrument, InstrumentContacts};
#[cfg(feature = "contact")]
use crate::memory;
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
    /// The same of contacts that a host asks for.
    #[cfg(feature = "contact")]
    asked_list: Mutex<Vec<Instrument>>,
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

    /// A list for instruments whose contacts are asked for.
    ///
    /// # Errors
    /// [`Error::Busy`].
    pub fn instrument_list(&self) -> Result<MutexGuard<'_, Vec<Instrument>>> {
        lock(&self.tools.asked_list)
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
    /// [`Error::Argument`] for more than [`MAX_TOOLS`](crate::contact::MAX_TOOLS), [`Error::Busy`], [`Error::OutOfMemory`], and what `take`
    /// gives.
    #[cfg(feature = "contact")]
    pub fn contacts_from_instruments<T>(
        &self,
        instruments: &[Instrument],
        take: impl FnOnce(&[u32], &[f32]) -> Result<T>,
    ) -> Result<T> {
        let mut contacts = lock(&self.tools.contacts)?;
        let mesh = &self.mesh;
        let asked = match &mut *contacts {
            Some(asked) => asked,
            none => none.insert(Asked {
                contacts: InstrumentContacts::new(
                    &mesh.positions,
                    &mesh.surface_faces,
                    &mesh.held_nodes,
                )?,
                instruments: memory::room(MAX_TOOLS, "the instruments' contacts")?,
                step: None,
            }),
        };
        let published = lock_read(&self.shared.published);
        let step = Some(published.stats.step_count);
        let mut pairs = asked.instruments.iter().zip(instruments);
        let same = asked.instruments.len() == instruments.len() && pairs.all(|(a, b)| a.is_same(b));
        if asked.step != step || !same {
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
