//! A scene's corrections: its velocities, its L-BFGS memory, and the iterations of a step.
//!
//! REQ-082: Corrected steps follow the reference solver, and more corrections follow it closer.

use super::balance::Balance;
use super::fields::Fields;
use super::history::{History, Pair};
use super::input::SolverContext;
use super::local::{Course, LocalSolver};
use super::memory::Memory;
use super::motion::Motion;
use super::oscillators::Oscillators;
use super::precondition::Preconditioner;
use super::relaxing::Relaxing;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// A state whose smallest det F falls below this is not accepted: nearer to zero an element's law
/// says little, and below zero nothing (docs/decisions/039-sound-states.md).
pub const SMALLEST_DET: f32 = 0.02;
/// A load whose guess halves the smallest det F is taken in at most this many parts: 1, 2, 4, 8,
/// 16.
pub(super) const MOST_PARTS: u32 = 16;

/// A scene's own part.
#[derive(HeldBytes)]
pub struct ImplicitSolver {
    /// `P`, for the prescribed nodes of the step and the length of its steps.
    pub(super) preconditioner: Preconditioner,
    /// What is out of balance in a state.
    pub(super) balance: Balance,
    /// Room of the step being made.
    pub(super) fields: Fields,
    /// The pairs of L-BFGS over the whole field: of prescribed contact and free steps.
    pub(super) memory: Memory,
    /// Made at the first step that tools drive.
    pub(super) local: Option<Box<LocalSolver>>,
    /// Past of the last published state, and of the one being made.
    pub motion: Motion,
    /// What [`ImplicitSolver::finish`] has made of the state being made; becomes `motion` in [`ImplicitSolver::commit`], and only there.
    pub(super) next: Motion,
    /// The natural modes of a free step, in closed form.
    pub(super) free: Oscillators,
    /// Which support groups are let go; a change makes the pairs those of another boundary.
    pub(super) groups: LetGo,
    /// Of tissue that relaxes.
    pub(super) relaxing: Option<Box<Relaxing>>,
}

/// The support groups that are let go, a bit each.
#[derive(HeldBytes)]
pub(super) struct LetGo {
    /// In the step being made.
    pub now: u64,
    /// In the last published state, of which the pairs are.
    pub before: u64,
}

impl LetGo {
    /// What is near is that of a boundary of which these groups are let go.
    pub(super) fn stand_on(&mut self, let_go: u64, local: &mut Option<Box<LocalSolver>>) {
        if self.now != let_go
            && let Some(local) = local
        {
            local.leave_boundary();
        }
        self.now = let_go;
    }
}

impl ImplicitSolver {
    /// Buffers of a scene at rest.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(context: SolverContext<'_>) -> Result<ImplicitSolver> {
        let env = context.env();
        let len = 3 * env.body.mass.len();
        Ok(ImplicitSolver {
            preconditioner: Preconditioner::new(env)?,
            memory: Memory::new(len)?,
            balance: Balance::new(context)?,
            fields: Fields::new(len)?,
            motion: Motion::at_rest(len)?,
            next: Motion::at_rest(len)?,
            local: None,
            free: Oscillators::default(),
            groups: LetGo {
                now: context.held.let_go,
                before: context.held.let_go,
            },
            relaxing: Relaxing::new(context)?,
        })
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.motion.clear();
        if let Some(relaxing) = &mut self.relaxing {
            relaxing.clear();
        }
        self.clear_pairs();
        if let Some(local) = &mut self.local {
            local.coming.clear();
        }
        self.commit_pairs();
    }

    /// Forgets the pairs, in the step being made.
    pub(super) fn clear_pairs(&mut self) {
        self.memory.clear();
        if let Some(local) = &mut self.local {
            local.pairs.clear();
            local.coming.clear_tangent();
        }
    }

    /// Back to the pairs of the last published state.
    pub(super) fn begin_pairs(&mut self) {
        self.memory.begin();
        if let Some(local) = &mut self.local {
            local.pairs.begin();
            local.coming.begin();
        }
    }

    /// Back to the pairs of whole steps, none of them known to the tangent; what is near stays.
    pub(super) fn end_substeps(&mut self) {
        self.memory.begin();
        if let Some(local) = &mut self.local {
            local.pairs.begin();
            local.coming.clear_tangent();
        }
    }

    /// The pairs of the state being made become those of the published one, to which a refused step goes back.
    fn commit_pairs(&mut self) {
        self.memory.commit();
        if let Some(local) = &mut self.local {
            local.pairs.commit();
            local.coming.commit();
        }
    }

    /// The state being made becomes the last.
    /// Nothing here allocates or fails: a step that has been made can always be published.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.motion, &mut self.next);
        self.groups.before = self.groups.now;
        if let Some(relaxing) = &mut self.relaxing {
            relaxing.commit();
        }
        self.commit_pairs();
    }

    /// A copy of what is remembered, with the forces at `contacts` nodes.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    /// It is what a snapshot needs to go on with the same bits: motion, pairs, the course of the
    /// near sets, and remembered stresses. Factors and layouts follow from these.
    pub fn history(&self, contacts: usize) -> Result<History> {
        let mut motion = self.motion.copy()?;
        // The guard may have dropped the contact that they belonged to.
        let missing = (3 * contacts).saturating_sub(motion.reaction.len());
        memory::reserve(&mut motion.reaction, missing, "contact forces")?;
        motion.reaction.resize(3 * contacts, 0.0);
        Ok(History {
            motion,
            pairs: self.memory.pairs()?,
            local: match &self.local {
                Some(local) => local.pairs.copy()?,
                None => Vec::new(),
            },
            course: match &self.local {
                Some(local) => local.coming.copy()?,
                None => Course::default(),
            },
            relaxing: match &self.relaxing {
                Some(relaxing) => Some(relaxing.remembered()?),
                None => None,
            },
        })
    }

    /// Takes what was remembered.
    ///
    /// # Errors
    /// [`crate::Error::Snapshot`] for pairs of another body, a panic on another thread of the pool.
    pub fn restore(&mut self, context: SolverContext<'_>, history: &History) -> Result<()> {
        let History {
            motion,
            pairs,
            local,
            course,
            relaxing,
        } = history;
        let corrections = context.corrections;
        // Checked as a whole before anything of this solver is changed.
        let sizes = [corrections.body.mass.len(), corrections.space.count()];
        local.iter().try_for_each(|record| record.check(sizes))?;
        self.motion.take(motion)?;
        self.groups.stand_on(context.held.let_go, &mut self.local);
        self.groups.before = self.groups.now;
        match (&mut self.relaxing, relaxing) {
            (Some(own), Some(remembered)) => own.restore(remembered),
            (Some(own), None) => own.clear(),
            (None, _) => {}
        }
        self.clear_pairs();
        if let Some(local) = &mut self.local {
            local.coming.clear();
        }
        self.commit_pairs();
        for Pair { step, change } in pairs {
            // Stored one after another as a scene does, which makes their products anew in the same
            // order.
            self.memory.store(context.env(), step, 1.0, change)?;
        }
        self.memory.commit();
        if local.is_empty() && !course.is_any() {
            return Ok(());
        }
        let solver = LocalSolver::made(&mut self.local, context)?;
        solver.coming.restore(course)?;
        solver.pairs.restore(local)
    }
}
