//! What local iterations hold of a state: how it has moved from the base, its residual, and how far they reach.
//!
//! The base is a state whose residual is known at every node. Since then the near nodes have moved by `t + Phi c`; all that is
//! linear in that move is carried along with it, so that a state along the direction costs the near elements alone.

use super::columns::NearColumns;
use super::linear::WHAT;
use super::near::NearSet;
use super::pairs::Room;
use super::step::{Change, Step, resize};
use crate::corrections::extent::Extent;
use crate::corrections::precondition::Env;
use crate::error::Result;
use crate::kernels::vectors::PartialSums;
use crate::memory::{self, HeldBytes};

/// A move of the near nodes, and what is linear in it: since the base, or of a direction.
#[derive(HeldBytes)]
pub(in crate::corrections) struct Moved {
    /// `t` and `c`.
    pub step: Step,
    /// `Phi c` at the near nodes `[.., 3]`, by place, mm.
    pub modes: Vec<f32>,
    /// What of the near elements' forces is linear in `c` `[3 free]`, µN.
    pub linear: Vec<f32>,
    /// `G c` `[r]`.
    pub stiff: Vec<f32>,
}

impl Moved {
    /// No move of `count` modes.
    pub fn with_modes(count: usize) -> Result<Moved> {
        Ok(Moved {
            step: Step::with_modes(count)?,
            modes: Vec::new(),
            linear: Vec::new(),
            stiff: memory::zeros(count, WHAT)?,
        })
    }

    /// No move, in the places of a near set.
    pub fn clear(&mut self, near: &NearSet) -> Result<()> {
        self.step.clear(near)?;
        resize(&mut self.linear, 3 * near.places.free)?;
        resize(&mut self.modes, 3 * near.places.nodes.len())?;
        self.stiff.fill(0.0);
        Ok(())
    }
}

/// The residual of the state that stands, of the next one, and of the base.
#[derive(HeldBytes)]
pub(in crate::corrections) struct Residuals {
    /// Of the state that stands: at the inside nodes, and `Phi^T` of it at all nodes.
    pub residual: Change,
    /// Of the next state.
    pub next: Change,
    /// The residual without the loads, as the first recursion changes it; then what an accepted step has changed.
    pub reduced: Change,
    /// Forces of the near elements at the free nodes, inertia with them at the inside ones `[3 free]`, µN: at the base and of the next state.
    pub base: Vec<f32>,
    pub inner: Vec<f32>,
    /// `Phi^T r` at the base `[r]`.
    pub base_modes: Vec<f32>,
    /// Where the tissue would be in the next state `[K,3]`, mm; at nodes that are not near, the base.
    pub trial: Vec<f32>,
}

impl Residuals {
    /// Of a body of so many nodes and modes.
    pub fn new(nodes: usize, modes: usize) -> Result<Residuals> {
        Ok(Residuals {
            residual: Change::with_modes(modes)?,
            next: Change::with_modes(modes)?,
            reduced: Change::with_modes(modes)?,
            base: Vec::new(),
            inner: Vec::new(),
            base_modes: memory::zeros(modes, WHAT)?,
            trial: memory::zeros(3 * nodes, WHAT)?,
        })
    }
}

/// What iterations measure of the states that they make.
#[derive(HeldBytes)]
pub(in crate::corrections) struct Measured {
    /// Mass of the whole body, g.
    pub mass_g: f64,
    /// Smallest det F of the far elements at the base.
    pub far_det: f32,
    /// Smallest det F of the state that stands.
    pub det: f32,
    /// Root mean square that the last direction moves, mm.
    pub moved_mm: f32,
    /// Root mean square over the nodes that the last smoothing of the far ones moved, mm.
    pub far_mm: f32,
    /// Farthest that a far node has gone since the base, mm.
    pub far_moved_mm: f32,
    /// Work since it was asked for, in multiplications of contact solves.
    pub work: u64,
}

impl Measured {
    /// Of a body at rest.
    pub fn new(env: Env<'_>) -> Measured {
        Measured {
            mass_g: env.body.mass.iter().map(|&mass| f64::from(mass)).sum(),
            far_det: 1.0,
            det: 1.0,
            moved_mm: 0.0,
            far_mm: 0.0,
            far_moved_mm: 0.0,
            work: 0,
        }
    }
}

/// About which nodes, and how far from them, iterations are made.
#[derive(HeldBytes)]
pub(in crate::corrections) struct Reach {
    /// Nodes that the tools touch, thinned out: what the pairs are about.
    pub about: Vec<u32>,
    /// Nodes that the tools touch, while a round begins.
    pub touched: Vec<u32>,
    /// How far the next round reaches.
    #[held(skip)]
    pub extent: Extent,
}

impl Reach {
    /// Nothing is touched.
    pub fn new() -> Result<Reach> {
        Ok(Reach {
            about: memory::room(64, WHAT)?,
            touched: memory::room(256, WHAT)?,
            extent: Extent::default(),
        })
    }
}

/// Room that no state is kept in.
#[derive(HeldBytes)]
pub(in crate::corrections) struct Spare {
    pub room: Room,
    /// What contact has asked of the factor so far.
    pub(super) columns: NearColumns,
    /// Amplitudes of the modes `[r]`.
    pub on_modes: Vec<f32>,
    pub more_on_modes: Vec<f32>,
    pub solved: Vec<f32>,
    /// Sums of the pieces of a pass.
    pub partial: PartialSums,
    /// What the last contact solve has changed, by degrees of freedom of the prior, mN.
    pub loads: Vec<(u32, f32)>,
}

impl Spare {
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(env: Env<'_>) -> Result<Spare> {
        let count = env.space.count();
        let modes = || memory::zeros(count, WHAT);
        let columns = (3 * env.prior.contact_nodes.len()).min(768);
        Ok(Spare {
            room: Room {
                q: memory::zeros(env.prior.width(), WHAT)?,
                ..Room::default()
            },
            columns: NearColumns::default(),
            on_modes: modes()?,
            more_on_modes: modes()?,
            solved: modes()?,
            partial: PartialSums::with_room(3 * env.body.mass.len(), 1)?,
            loads: memory::room(columns, WHAT)?,
        })
    }
}
