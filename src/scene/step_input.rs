//! What a step gets, and what has become of it.

use super::loads::Loads;
use super::supports::GroupMotion;
use crate::contact::Tool;
use crate::error::{Error, Result};
use crate::field::ContactSet;

/// The collision field `c` of a step: what the instruments impose at its end.
#[derive(Debug, Clone, Copy, Default)]
pub enum Contact<'a> {
    /// No contact.
    #[default]
    None,
    /// `[K,3]` of the intact mesh, mm, zero but at nodes in contact.
    Dense(&'a [f32]),
    /// Nodes in contact and their displacement.
    Sparse {
        /// Node indices, each at most once, in any order; of a body that has been cut they may name copies.
        nodes: &'a [u32],
        /// `[m,3]`, mm.
        vectors: &'a [f32],
    },
    /// Rigid tools where they are at the end of the step; their contact is solved.
    Tools(&'a [Tool]),
}

impl Contact<'_> {
    /// As a set over a body whose intact mesh has `mesh` nodes and which has `now`; that of tools is solved later.
    ///
    /// # Errors
    /// What [`ContactSet::take_dense`] and [`ContactSet::take_sparse`] say.
    pub(crate) fn gather(self, set: &mut ContactSet, [mesh, now]: [usize; 2]) -> Result<()> {
        match self {
            Contact::None => set.clear(),
            Contact::Tools(_) => set.clear(),
            Contact::Dense(field) => set.take_dense(field, mesh)?,
            Contact::Sparse { nodes, vectors } => set.take_sparse(nodes, vectors, now)?,
        }
        Ok(())
    }
}

/// The input of a step, submitted or not, and of a frame between steps. By default nothing happens: the tissue moves on by itself.
#[derive(Debug, Clone, Copy, Default)]
pub struct StepInput<'a> {
    /// Current displacement `[K,3]`, mm; `None` takes the scene's own state. A field that equals the scene's last
    /// state at its decoded nodes is taken as that state. Not with tools, and not for a frame.
    pub displacement: Option<&'a [f32]>,
    /// What drives the step. A node that the boundary condition holds stays held.
    pub contact: Contact<'a>,
    /// What acts on the body beside contact. A frame goes on from the loads of its step, and asks for none of these but `supports`.
    pub loads: Loads<'a>,
    /// The moment of the end of the step on the host's clock, s, from which [`Scene::present`](crate::Scene::present) counts; 0 for hosts
    /// that keep none. Not for a frame.
    pub time_s: f64,
}

impl<'a> From<Contact<'a>> for StepInput<'a> {
    fn from(contact: Contact<'a>) -> StepInput<'a> {
        StepInput {
            contact,
            ..StepInput::default()
        }
    }
}

impl StepInput<'_> {
    /// # Errors
    /// [`Error::NonFinite`], and [`Error::Argument`] for fields that exclude each other.
    pub(crate) fn check(&self) -> Result<()> {
        if !self.time_s.is_finite() {
            return Err(Error::NonFinite(format!("time_s is {}", self.time_s)));
        }
        if matches!(self.contact, Contact::Tools(_)) && self.displacement.is_some() {
            return Err(Error::Argument(
                "displacement and instruments are both set; instruments drive the scene's own state".into(),
            ));
        }
        let ties = !self.loads.ties.is_empty();
        if ties && self.displacement.is_some() {
            return Err(Error::Argument(
                "displacement and ties are both set; ties pull on the scene's own state".into(),
            ));
        }
        if ties && matches!(self.contact, Contact::Dense(_) | Contact::Sparse { .. }) {
            return Err(Error::Argument(
                "ties and prescribed nodes are both set; ties pull beside instruments, or alone"
                    .into(),
            ));
        }
        Ok(())
    }

    /// As [`StepInput::check`], for a frame between steps.
    pub(crate) fn check_of_frame(&self) -> Result<()> {
        self.check()?;
        if self.displacement.is_some() {
            return Err(Error::Argument(
                "displacement is set; a frame shows the scene's own state".into(),
            ));
        }
        if self.time_s != 0.0 {
            return Err(Error::Argument(format!(
                "time_s is {}; the moment of a frame is when",
                self.time_s
            )));
        }
        Ok(())
    }
}

/// What drives a frame.
#[derive(Clone, Copy)]
pub struct FrameInput<'a> {
    pub contact: Contact<'a>,
    /// Where support groups are; none: they go on as they went.
    pub supports: &'a [GroupMotion<'a>],
}

/// What has become of a submitted step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// It has finished, or nothing was submitted since the last one finished.
    Done,
    /// It has not finished.
    Pending,
}
