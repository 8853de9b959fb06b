//! A scene's corrections: its velocities, its L-BFGS memory, and the iterations of a step.
//!
//! REQ-082: Corrected steps follow the reference solver, and more corrections follow it closer.

use super::history::{History, PAIRS, Pair};
use super::input::{Report, SolverContext};
use super::local::{Linearisation, LocalSolver};
use super::memory::Memory;
use super::motion::Motion;
use super::oscillators::Oscillators;
use super::passes;
use super::precondition::{Env, Preconditioner, mask};
use super::relaxing::Relaxing;
use crate::error::{Error, Result};
use crate::kernels::vectors::PartialSums;
use crate::memory::{self, HeldBytes};

/// A state whose smallest det F falls below this is not accepted.
pub const SMALLEST_DET: f32 = 0.02;
/// A load whose guess halves the smallest det F is taken in at most this many parts.
pub(super) const MOST_PARTS: u32 = 16;

/// A scene's own part.
#[derive(HeldBytes)]
pub struct ImplicitSolver {
    /// `P`, for the prescribed nodes of the step and the length of its steps.
    pub(super) preconditioner: Preconditioner,
    /// The pairs of L-BFGS over the whole field: of prescribed contact and free steps.
    pub(super) memory: Memory,
    /// Room of the elements, and the smallest det F of each chunk at the last evaluation.
    pub(super) scratch: elements::Scratch,
    /// Past of the last published state, and of the one being made.
    pub motion: Motion,
    /// What [`ImplicitSolver::finish`] has made of the state being made; becomes `motion` in [`ImplicitSolver::commit`], and only there.
    pub(super) next: Motion,
    /// Nodes in contact whose place is prescribed and that nothing holds, ascending; none where tools drive.
    pub(super) nodes: Vec<u32>,
    /// `r` at `nodes`, of the last evaluation and of the state that stands.
    pub(super) at_nodes: [Vec<f32>; 2],
    /// The residual `F(u)` of the state that stands, and of the one tried `[K,3]`, µN. Zero at held and prescribed nodes.
    pub(super) g: Vec<f32>,
    pub(super) g_new: Vec<f32>,
    /// The direction, mm; a field of scratch while there is none.
    pub(super) d: Vec<f32>,
    /// Scratch `[K,3]`: the state tried, then the change of the residual.
    pub(super) q: Vec<f32>,
    /// The state being made, mm: the host's field changes only when it is done.
    pub(super) u: Vec<f32>,
    /// The first guess of a step that tools drive.
    pub(super) guess: Vec<f32>,
    /// `M p`: inertia of the step at the last displacement, less the loads, µN.
    pub(super) drift: Vec<f32>,
    /// Loads beside contact at the end of the step `[K,3]`, µN; empty where there are none.
    pub(super) load: Vec<f32>,
    /// Sums of the pieces of a field, added in their order whatever the threads did: the same bits for any number of them.
    pub(super) partial: PartialSums,
    /// Where the tissue would be, at the nodes of the domain.
    pub(super) touched: Vec<f32>,
    /// Made at the first step that tools drive.
    pub(super) local: Option<Box<LocalSolver>>,
    /// The natural modes of a free step, in closed form.
    pub(super) free: Oscillators,
    /// The support groups that are let go in the step being made, and in the last published state, of which the pairs are.
    pub(super) let_go: u64,
    pub(super) let_go_before: u64,
    /// Of tissue that relaxes.
    pub(super) relaxing: Option<Box<Relaxing>>,
}

impl ImplicitSolver {
    /// Buffers of a scene at rest.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(context: SolverContext<'_>) -> Result<ImplicitSolver> {
        let env = context.env();
        let len = 3 * env.body.mass.len();
        let field = || memory::zeros(len, "the corrections of a scene");
        Ok(ImplicitSolver {
            preconditioner: Preconditioner::new(env)?,
            memory: Memory::new(len)?,
            scratch: (env.body.forces.scratch(context.pool.threads())).map_err(|_| {
                Error::OutOfMemory("no memory for the element forces of a scene".into())
            })?,
            motion: Motion::at_rest(len)?,
            next: Motion::at_rest(len)?,
            nodes: memory::room(len / 3, "the corrections of a scene")?,
            at_nodes: [
                memory::room(len, "contact forces")?,
                memory::room(len, "contact forces")?,
            ],
            g: field()?,
            g_new: field()?,
            d: field()?,
            q: field()?,
            u: field()?,
            guess: field()?,
            drift: field()?,
            load: Vec::new(),
            partial: PartialSums::with_room(len, PAIRS)?,
            touched: field()?,
            local: None,
            free: Oscillators::default(),
            let_go: context.held.let_go,
            let_go_before: context.held.let_go,
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
        self.commit_pairs();
    }

    /// What is near is that of a boundary of which these groups are let go.
    pub(super) fn stand_on(&mut self, let_go: u64) {
        if self.let_go != let_go
            && let Some(local) = &mut self.local
        {
            local.leave_boundary();
        }
        self.let_go = let_go;
    }

    /// Forgets the pairs, in the step being made.
    pub(super) fn clear_pairs(&mut self) {
        self.memory.clear();
        if let Some(local) = &mut self.local {
            local.pairs.clear();
            local.factor.clear();
        }
    }

    /// Back to the pairs of the last published state.
    pub(super) fn begin_pairs(&mut self) {
        self.memory.begin();
        if let Some(local) = &mut self.local {
            local.pairs.begin();
            local.factor.begin();
        }
    }

    fn commit_pairs(&mut self) {
        self.memory.commit();
        if let Some(local) = &mut self.local {
            local.pairs.commit();
            local.factor.commit();
        }
    }

    /// The state being made becomes the last.
    pub fn commit(&mut self) {
        self.leave_level();
        std::mem::swap(&mut self.motion, &mut self.next);
        self.let_go_before = self.let_go;
        if let Some(relaxing) = &mut self.relaxing {
            relaxing.commit();
        }
        self.commit_pairs();
    }

    /// Where the next step reaches farther, or no longer as far, the local pairs are of no use: what they know of a narrower set is linear where the
    /// wider one is not.
    pub(super) fn leave_level(&mut self) {
        if let Some(local) = &mut self.local
            && self.next.level != self.motion.level
        {
            local.pairs.clear();
        }
    }

    /// A copy of what is remembered, with the forces at `contacts` nodes.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
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
            linearisation: match &self.local {
                Some(local) => local.factor.copy()?,
                None => Linearisation::default(),
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
    /// [`Error::Snapshot`] for pairs of another body, a panic on another thread of the pool.
    pub fn restore(&mut self, context: SolverContext<'_>, history: &History) -> Result<()> {
        let History {
            motion,
            pairs,
            local,
            linearisation,
            relaxing,
        } = history;
        let corrections = context.corrections;
        let sizes = [corrections.body.mass.len(), corrections.space.count()];
        local.iter().try_for_each(|record| record.check(sizes))?;
        self.motion.take(motion)?;
        self.stand_on(context.held.let_go);
        self.let_go_before = self.let_go;
        match (&mut self.relaxing, relaxing) {
            (Some(own), Some(remembered)) => own.restore(remembered),
            (Some(own), None) => own.clear(),
            (None, _) => {}
        }
        self.clear_pairs();
        self.commit_pairs();
        for Pair { step, change } in pairs {
            self.memory.store(context.env(), step, 1.0, change)?;
        }
        self.memory.commit();
        if local.is_empty() && linearisation.u.is_empty() {
            return Ok(());
        }
        let solver = LocalSolver::made(&mut self.local, context)?;
        solver.factor.restore(linearisation)?;
        solver.pairs.restore(local)
    }

    /// `r(u)` to `out`, zero at held and prescribed nodes; returns the smallest det F and `r . d` with a field that is zero there.
    pub(super) fn residual(
        &mut self,
        context: SolverContext<'_>,
        [last, u, d]: [&[f32]; 3],
        out: &mut [f32],
        report: &mut Report,
    ) -> Result<(f32, f64)> {
        let env = context.env();
        let failed = std::sync::Mutex::new(None);
        let det = env
            .body
            .forces
            .evaluate(u, &mut self.scratch, out, &|count, task| {
                if let Err(error) = context.pool.run(count, task) {
                    *failed
                        .lock()
                        .unwrap_or_else(std::sync::PoisonError::into_inner) = Some(error);
                }
            });
        let failed = failed.into_inner();
        if let Some(error) = failed.unwrap_or_else(std::sync::PoisonError::into_inner) {
            return Err(error.into());
        }
        let kappa = context.time_step.integrator.kappa() as f32;
        let fields = [self.drift.as_slice(), u, last, d];
        let slope = passes::inertia(env, kappa, fields, out, &mut self.partial)?;
        self.at_nodes[0].clear();
        for &node in &self.nodes {
            let at = 3 * node as usize;
            self.at_nodes[0].extend_from_slice(&out[at..at + 3]);
        }
        mask(&self.nodes, out);
        report.evaluations += 1;
        Ok((det, slope))
    }

    /// `|a|`.
    pub(super) fn size(&mut self, env: Env<'_>, a: &[f32]) -> Result<f64> {
        Ok(passes::square(env, a, &mut self.partial)?.sqrt())
    }

    /// The state of the last evaluation is the one that stands.
    pub(super) fn stand(&mut self) {
        // Only a state that was accepted has forces: one that the line search tried and left must not be felt.
        let [last, stands] = &mut self.at_nodes;
        std::mem::swap(last, stands);
    }
}
