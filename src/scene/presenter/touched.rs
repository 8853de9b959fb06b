//! Where the tissue that tools may touch is in a frame: whether a quick or thin tool has lost its contact there.

use crate::contact::ContactProblem;
use crate::contact::State;
use crate::error::Result;
use crate::kernels::rows::{RowPlan, decode_rows};
use crate::kernels::{Isa, Pool};
use crate::memory::{self, HeldBytes};
use crate::prior::PriorTable;

const WHAT: &str = "the present state of a scene";
/// Tissue that lies deeper in a tool has lost the contact, mm.
const KEPT_MM: f32 = 0.45;
/// Contact that takes a node this much farther than a tool has gone has flung it, mm.
const FLUNG_MM: f32 = 10.0;

/// The tissue of a frame.
#[derive(HeldBytes)]
pub(super) struct ShownTissue {
    /// At the moment asked for, before contact has moved it, `[K,3]`.
    pub free: Vec<f32>,
    /// Where it would be at the samples' nodes, once contact has.
    pub touched: TouchedTissue,
    /// Which of the solves was shown last.
    pub solve: Option<usize>,
}

/// The surface that tools may touch.
#[derive(HeldBytes)]
pub(super) struct TouchedTissue {
    /// Rows of the response at its nodes, and what the contact moves there, `[n,3]`.
    plan: RowPlan,
    moved: Vec<f32>,
    /// Its displacement `[K,3]`, known at its nodes.
    u: Vec<f32>,
}

impl TouchedTissue {
    /// Of nodes of a body of `count`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(prior: &PriorTable, nodes: &[u32], count: usize) -> Result<TouchedTissue> {
        Ok(TouchedTissue {
            plan: RowPlan::try_region(&prior.basis(), nodes, true)?,
            moved: memory::zeros(3 * nodes.len(), WHAT)?,
            u: memory::zeros(3 * count, WHAT)?,
        })
    }

    /// The surface is where it goes without contact, `free [K,3]`, and where what contact moves takes it; held nodes stay.
    ///
    /// # Errors
    /// A panic on another thread of the pool.
    pub fn place(
        &mut self,
        (isa, pool, prior): (Isa, &Pool, &PriorTable),
        (nodes, held): (&[u32], &[bool]),
        free: &[f32],
        q: Option<&[f32]>,
    ) -> Result<()> {
        match q {
            Some(q) => decode_rows(isa, pool, &prior.basis(), &self.plan, q, &mut self.moved)?,
            None => self.moved.fill(0.0),
        }
        for (&node, moved) in nodes.iter().zip(self.moved.as_chunks::<3>().0) {
            let at = 3 * node as usize;
            let part = if held[node as usize] { 0.0 } else { 1.0 };
            let to = self.u[at..at + 3].iter_mut();
            for ((to, free), moved) in to.zip(&free[at..at + 3]).zip(moved) {
                *to = free + part * moved;
            }
        }
        Ok(())
    }

    /// Some nodes are elsewhere, `[n,3]`.
    pub fn replace(&mut self, nodes: &[u32], u: &[f32]) {
        for (&node, u) in nodes.iter().zip(u.as_chunks::<3>().0) {
            self.u[3 * node as usize..][..3].copy_from_slice(u);
        }
    }

    /// Whether a quick or thin tool of the problem has lost the contact; the frame is of a step with state `last`.
    pub fn has_lost(&self, problem: &mut ContactProblem, rest: &[f32], last: &[f32]) -> bool {
        let u = &self.u;
        let state = State {
            rest,
            u,
            start: last,
        };
        problem.ways.may_lose() && problem.depths().sunk(state, 1.0) > KEPT_MM
    }

    /// Whether contact takes a node much farther than any tool goes in the frame: a thin tool among folds found a way out that leads elsewhere.
    pub fn has_flung(&self, problem: &ContactProblem) -> bool {
        let squares = (self.moved.as_chunks::<3>().0.iter()).map(|u| u.map(|x| x * x));
        let farthest = squares
            .map(|u| u.iter().sum())
            .fold(0.0f32, f32::max)
            .sqrt();
        farthest > FLUNG_MM + problem.ways.longest()
    }

    /// The surface's displacement.
    pub fn displacement(&self) -> &[f32] {
        &self.u
    }
}
