//! What the scene's end of a hand holds.

use std::sync::Arc;

use ::contact::Pose;
use exchange::{Reader, Writer};

use super::leaving::Leaving;
use super::motion::{Carried, ModalRoom};
use super::near::{FeltTool, NearSamples};
use super::softened::Softened;
use super::tied::OwnTies;
use crate::contact::Delassus;
use crate::haptics::ends::Ends;
use crate::haptics::snapshot::ContactSnapshot;
use crate::memory::HeldBytes;

/// A tool of a scene that a hand feels. The scene's thread alone has it; the hand's thread has [`super::Haptics`].
#[derive(HeldBytes)]
pub struct Link {
    pub(super) tool: FeltTool,
    pub(super) line: HandLine,
    pub(super) near: NearSamples,
    /// `W` of the published samples within [`super::AT_ONCE_S`]: natural modes are too slow to take part, and go on in the hand's thread.
    pub(super) delassus: Delassus,
    /// What a cut makes softer.
    pub(super) softened: Softened,
    /// What inertia takes off the compliance of each natural mode within [`super::AT_ONCE_S`], one number a mode.
    pub(super) inertial_compliance: Vec<f32>,
    pub(super) modal: ModalRoom,
    /// How support groups carry the nodes of the last step.
    pub(super) carried: Carried,
    /// The ties that end on this tool: they are published as samples are.
    pub(super) ties: OwnTies,
    /// What the tool pushes does not fly off it.
    pub(super) leaving: Leaving,
}

/// What goes to the hand's thread and comes from it. Neither end ever waits for the other ([`exchange`]).
#[derive(HeldBytes)]
pub(super) struct HandLine {
    #[held(skip)]
    pub(super) out: Writer<ContactSnapshot>,
    /// Where the hand is now; it may move on while it is read.
    #[held(skip)]
    pub(super) pose: Reader<Pose>,
    /// Bytes of one of the three buffers that the two threads exchange.
    pub(super) snapshot_bytes: usize,
    /// Says to each end that the other has gone.
    #[held(skip)]
    pub(super) ends: Arc<Ends>,
    /// How many states were published: the hand sees by it how many it missed.
    pub(super) number: u64,
    /// Age of a state when the hand gets it, s; the time that the step took where the host gave none.
    pub(super) latency_s: Option<f64>,
    /// Where the hand was when the last state was published.
    pub(super) last_pose: Option<Pose>,
}
