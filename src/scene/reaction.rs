//! The reaction at the contact nodes of the last state, for haptics.
//!
//! Where the scene has a linear response, the reaction is that of its contact solve, `-f`, `f = A_CC^-1 c` of the last
//! published contact ([`ContactResponse::reaction`]): a smooth function of what the instruments impose. A predicted state is
//! no such function: at a Poisson ratio of 0.49 its small errors of volume are large pressures. Without a prior the reaction
//! is the elastic force of the elements around the contact nodes at that state all the same ([`crate::forces`]).
//!
//! [`ContactResponse::reaction`]: crate::prior::ContactResponse::reaction

use std::sync::RwLock;

use super::Scene;
use super::core::Core;
use super::elastic::Haptics;
use super::maker::StepMaker;
use super::published::Published;
use super::shared::lock;
use crate::error::{Error, Result};
use crate::kernels::FlushToZero;
use crate::memory;
use crate::output::Output;

impl Scene {
    /// Force of the tissue on the instruments at the last step's contact nodes, in their order: `out [m,3]`, mN.
    ///
    /// [`SceneStats::prior_forces`] says which: the contact forces of the linear response (zero at a node that is held or
    /// far from the domain), or the elastic force of the elements around the node; nodes around it that the region left out
    /// are then decoded. No allocation after the first call of a contact's size. After a refused step the last good one counts.
    ///
    /// [`SceneStats::prior_forces`]: crate::SceneStats::prior_forces
    ///
    /// # Errors
    /// [`Error::Argument`] for a wrong length, [`Error::Busy`].
    pub fn contact_force(&self, out: &mut [f32]) -> Result<()> {
        self.contact_force_to(out.into())
    }

    /// [`Scene::contact_force`] into memory that need not be initialised; a failed call leaves it as it is.
    pub(crate) fn contact_force_to(&self, out: Output<'_, f32>) -> Result<()> {
        self.core()?.call(|core, published| {
            let want = 3 * core.maker.states.contact.len();
            if out.len() != want {
                return Err(Error::Argument(format!(
                    "out has {} floats, must have {want}: 3 for each contact node of the last step",
                    out.len()
                )));
            }
            let mut reaction = lock(&self.tools.reaction)?;
            reaction.clear();
            memory::reserve(&mut reaction, want, "the contact forces")?;
            reaction.resize(want, 0.0);
            self.react(core, published, &mut reaction)?;
            out.copy_from(&reaction);
            Ok(())
        })
    }

    /// The reaction of corrections, of the linear response, or of the elements: of the first that there is.
    fn react(&self, core: &mut Core, published: &RwLock<Published>, out: &mut [f32]) -> Result<()> {
        if core.maker.corrected_reaction(out) || prior_reaction(&mut core.maker, out)? {
            return Ok(());
        }
        core.maker.body.check_intact("contact_force")?;
        let mut haptics = lock(&self.tools.forces)?;
        let haptics = match &mut *haptics {
            Some(made) => made,
            none => none.insert(Haptics::new(&self.mesh, &self.model)?),
        };
        haptics.reaction(core, published, out)
    }
}

/// The reaction of the linear response to the last published contact, mN in the host's order; false where the scene has none.
fn prior_reaction(maker: &mut StepMaker, out: &mut [f32]) -> Result<bool> {
    let Some(linear) = maker.engine.linear_mut() else {
        return Ok(false);
    };
    let isa = maker.machine.isa;
    let _mode = FlushToZero::of(isa);
    let (contact, held) = (&maker.states.contact, &maker.body.held);
    // The last solve may be of a contact that the guard refused, or, after a restore, of another time. The factor is
    // kept where the nodes are the same.
    linear.solve_contact(isa, held, contact)?;
    let table = &linear.table;
    linear
        .solve
        .reaction(table, held, &contact.nodes, &contact.order, out);
    Ok(true)
}
