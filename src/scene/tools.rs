//! What instruments and haptics of a scene keep between calls, made at the first use, so that a scene without them pays
//! nothing.

#[cfg(feature = "forces")]
use super::elastic::Haptics;
#[cfg(feature = "contact")]
use super::presenter::Presenters;
#[cfg(feature = "contact")]
use crate::contact::Tool;
#[cfg(feature = "contact")]
use crate::instrument::{Instrument, InstrumentContacts};
#[cfg(any(feature = "contact", feature = "forces"))]
use std::sync::Mutex;

/// The contacts that a host asks for, and what it asked last: the same question of the same state has the same answer.
#[cfg(feature = "contact")]
pub(super) struct Asked {
    pub contacts: InstrumentContacts,
    pub instruments: Vec<Instrument>,
    pub step: Option<u64>,
}

/// What the first use makes.
#[derive(Default)]
pub struct Tools {
    #[cfg(feature = "contact")]
    pub(super) contacts: Mutex<Option<Asked>>,
    #[cfg(feature = "contact")]
    pub(super) presenters: Mutex<Presenters>,
    /// What a host's instruments are read into.
    #[cfg(feature = "contact")]
    pub(super) list: Mutex<Vec<Tool>>,
    /// The same of a frame between steps.
    #[cfg(feature = "contact")]
    pub(super) frame_list: Mutex<Vec<Tool>>,
    /// The same of contacts that a host asks for.
    #[cfg(feature = "contact")]
    pub(super) asked_list: Mutex<Vec<Instrument>>,
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
