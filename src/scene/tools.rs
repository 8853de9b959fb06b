//! What instruments and haptics of a scene keep between calls, made at the first use, so that a scene without them pays
//! nothing.

use ::contact::Tie;

use super::elastic::Haptics;
use super::followed_surface::Followed;
use super::point_force::PointForce;
use super::presenter::Presenters;
use crate::contact::Tool;
use crate::instrument::{Instrument, InstrumentContacts};
use std::sync::Mutex;

/// The contacts that a host asks for, and what it asked last: the same question of the same state has the same answer.
pub(super) struct Asked {
    pub contacts: InstrumentContacts,
    pub instruments: Vec<Instrument>,
    pub step: Option<u64>,
}

/// What of a host's input is read into lists.
#[derive(Default)]
pub struct Lists {
    pub(crate) tools: Vec<Tool>,
    pub(crate) ties: Vec<Tie>,
    pub(crate) point_forces: Vec<PointForce>,
}

/// What the first use makes.
#[derive(Default)]
pub struct Tools {
    pub(super) contacts: Mutex<Option<Asked>>,
    pub(super) presenters: Mutex<Presenters>,
    pub(super) surface: Mutex<Option<Followed>>,
    /// The instruments, ties and forces at points of a step are read into these lists, so that a call allocates nothing.
    pub(super) lists: Mutex<Lists>,
    /// Those of a frame between steps: another thread may present while one steps.
    pub(super) frame_lists: Mutex<Lists>,
    /// Those whose contacts a host asks for.
    pub(super) asked_list: Mutex<Vec<Instrument>>,
    pub(super) forces: Mutex<Option<Haptics>>,
    /// The contact forces of the last call that asked for them.
    pub(super) reaction: Mutex<Vec<f32>>,
}

impl Tools {
    /// Forgets which nodes instruments touch.
    pub fn reset(&self) {
        if let Ok(mut contacts) = self.contacts.lock()
            && let Some(contacts) = contacts.as_mut()
        {
            contacts.contacts.reset();
            contacts.step = None;
        }
    }
}
