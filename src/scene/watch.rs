//! What watches the steps of a scene: the envelope of what the bundle was measured with, the elements at the contact, and
//! which flags the log has.

use super::body::SceneBody;
use super::inversion::ContactElements;
use super::shown::Shown;
use super::step_states::StepStates;
use crate::contact::ToolUse;
use crate::envelope::EnvelopeCheck;
use crate::error::Result;
use crate::memory::HeldBytes;
use crate::stats::{SceneStats, flag};

/// See the module. Nothing of it changes a state; the guard ([`crate::guard`]) does that.
#[derive(HeldBytes)]
pub struct Watch {
    pub envelope: EnvelopeCheck,
    /// Made at the first contact.
    contact_elements: Option<ContactElements>,
    /// Flags of the last step, which the log has.
    pub logged_flags: u32,
}

impl Watch {
    /// Nothing seen yet.
    pub fn new(envelope: EnvelopeCheck) -> Watch {
        Watch {
            envelope,
            contact_elements: None,
            logged_flags: 0,
        }
    }

    /// Compares the contact of a step with what the bundle was measured with: that of tools where `used` says what they did.
    pub fn compare(
        &mut self,
        body: &SceneBody,
        states: &StepStates,
        used: Option<ToolUse>,
        stats: &mut SceneStats,
    ) {
        let limits = &body.model.manifest.envelope;
        let found = match (used, &limits.tools) {
            (Some(used), Some(tools)) => self.envelope.check_tools(tools, &used, &states.incoming),
            _ => self.envelope.check(
                &body.mesh,
                limits,
                &states.incoming,
                &states.contact,
                (body.step_s() / body.model.manifest.dt_s) as f32,
            ),
        };
        stats.flags |= found.flags;
        stats.indicator = found.ratio;
    }

    /// Raises [`flag::INVERTED`] where an element at the contact is inside out; refuses nothing. A region leaves out nodes that this
    /// needs: then only corrected steps are looked at.
    pub fn look_at_contact(
        &mut self,
        body: &SceneBody,
        (states, shown): (&StepStates, &Shown),
        stats: &mut SceneStats,
    ) -> Result<()> {
        let contact = &states.incoming;
        if stats.min_det == 0.0 && !contact.is_empty() && shown.has_all(&body.mesh) {
            let elements = match &mut self.contact_elements {
                Some(elements) => elements,
                none => none.insert(ContactElements::new(&body.mesh)?),
            };
            stats.min_det = elements.smallest_det(&body.mesh, &contact.nodes, &states.next.field);
        }
        if stats.min_det < 0.0 || stats.min_det.is_nan() {
            stats.flags |= flag::INVERTED;
        }
        Ok(())
    }

    /// One line of the log for the flags that this step has and the last one had not; none while they stay.
    pub fn tell(&mut self, step: u64, stats: &SceneStats) {
        let risen = stats.flags & !self.logged_flags;
        self.logged_flags = stats.flags;
        if risen != 0 {
            tracing::warn!(
                step,
                indicator = stats.indicator,
                largest_mm = stats.max_displacement_mm,
                "{}",
                flag::names(risen)
            );
        }
    }
}
