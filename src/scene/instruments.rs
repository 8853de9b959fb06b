//! Instruments: lists that a host's are read into, steps that they drive, what they were told, and poses to contacts.

use std::sync::MutexGuard;

use super::Scene;
use super::published::lock_read;
use super::shared::lock;
use super::tools::{Asked, Lists};
use crate::contact::{ContactReport, MAX_TOOLS};
use crate::error::Result;
use crate::instrument::{Instrument, InstrumentContacts};
use crate::memory;

impl Scene {
    /// Lists for the tools and ties of a step, kept from call to call.
    ///
    /// # Errors
    /// [`Error::Busy`](crate::Error::Busy).
    pub(crate) fn lists(&self) -> Result<MutexGuard<'_, Lists>> {
        lock(&self.tools.lists)
    }

    /// Lists for those of a frame between steps.
    ///
    /// # Errors
    /// [`Error::Busy`](crate::Error::Busy).
    pub(crate) fn frame_lists(&self) -> Result<MutexGuard<'_, Lists>> {
        lock(&self.tools.frame_lists)
    }

    /// A list for instruments whose contacts are asked for.
    ///
    /// # Errors
    /// [`Error::Busy`](crate::Error::Busy).
    pub(crate) fn instrument_list(&self) -> Result<MutexGuard<'_, Vec<Instrument>>> {
        lock(&self.tools.asked_list)
    }

    /// Reads what the tools of the last step were told, and the samples that push them.
    pub fn with_contact_report<T>(&self, read: impl FnOnce(&ContactReport) -> T) -> T {
        read(&lock_read(&self.shared.published).tools)
    }

    /// The contacts of instruments with the tissue in its last state: `take(nodes, vectors)` gets the
    /// nodes, ascending, and `[m,3]` mm, the input of the next step.
    ///
    /// The scene remembers what is touched between calls ([`crate::instrument`]); [`Scene::reset`] forgets it.
    /// With a region, surface nodes outside of it are taken where they last were.
    ///
    /// # Errors
    /// [`Error::Argument`](crate::Error::Argument) for more than [`MAX_TOOLS`], [`Error::Busy`](crate::Error::Busy), [`Error::OutOfMemory`](crate::Error::OutOfMemory), and what `take`
    /// gives.
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
                    &mesh.surface.faces,
                    &mesh.held_nodes,
                )?,
                instruments: memory::room(MAX_TOOLS, "the instruments' contacts")?,
                step: None,
            }),
        };
        let published = lock_read(&self.shared.published);
        if published.body.cut.is_some() {
            return Err(super::body::refused("contacts from instruments"));
        }
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
