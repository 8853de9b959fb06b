//! A step whose contact is prescribed: where the nodes in contact end is known, and the rest of the field follows.
//!
//! 1. The guess: the last state and the response of `K + kappa M` that takes the contact to its
//!    place, in as many parts as keep the elements sound.
//! 2. Iterations over the whole field with the contact nodes held ([`super::relax`]).
//! 3. The forces that hold them there, from the residual of the state that stands.

use super::gravity_columns::add_gravity;
use super::input::{Input, Report, SolverContext};
use super::lift::lift;
use super::relax::FieldStep;
use super::solver::{ImplicitSolver, MOST_PARTS, SMALLEST_DET};
use crate::error::Result;
use crate::field::ContactSet;
use crate::memory;

impl ImplicitSolver {
    /// Corrects `next`, which holds the model's prediction with the boundary conditions on it.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`], a panic on another thread of the pool; the past of the solver stays.
    pub fn correct(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        next: &mut [f32],
    ) -> Result<Report> {
        let _awake = context.pool.keep_awake();
        if let Some(relaxing) = &mut self.relaxing {
            relaxing.remember(context, input, false, &mut self.balance.scratch)?;
        }
        FieldStep {
            solver: self,
            context,
            input,
            report: Report::default(),
        }
        .hold_contact(next)
    }

    /// Force of the tissue on the instruments at the contact nodes of the last published state, in the host's order, mN.
    pub fn reaction(&self, contact: &ContactSet, out: &mut [f32]) {
        let rows = self.motion.reaction.as_chunks::<3>().0;
        for (&place, row) in contact.order.iter().zip(rows) {
            let at = 3 * place as usize;
            out[at..at + 3].copy_from_slice(&row.map(|force| -1e-3 * force));
        }
    }
}

impl FieldStep<'_> {
    /// The step with the contact nodes where the host holds them.
    fn hold_contact(&mut self, next: &mut [f32]) -> Result<Report> {
        let (context, input) = (self.context, self.input);
        let env = context.env();
        let held = &env.held.is;
        // All room is asked for before the step begins: what follows fails by a panic of a worker alone.
        let forces = 3 * input.contact.len();
        memory::fit(&mut self.solver.next.reaction, forces, "contact forces")?;
        self.solver.balance.nodes.clear();
        let nodes = input.contact.nodes.iter();
        self.solver
            .balance
            .nodes
            .extend(nodes.filter(|&&node| !held[node as usize]));
        // A node that is held stays held in contact: it is neither prescribed nor has it a force.
        self.solver
            .preconditioner
            .prescribe(env, &self.solver.balance.nodes)?;
        self.solver.expect(context, input)?;
        self.solver.memory.begin();
        // Pairs of the step before hold at the nodes that are free now; where a node is prescribed they count as zero.
        self.solver.memory.mask(&self.solver.balance.nodes);
        self.solver.prepare(context, input)?;

        // The fields are out of the solver while its methods run, and come back whatever they give, before anything else can fail: a solver without them could make no further step.
        let mut u = std::mem::take(&mut self.solver.fields.u);
        let mut g = std::mem::take(&mut self.solver.fields.g);
        // Forces are those of the state that stands, of which `g` is the residual.
        let result = self
            .iterate(&mut u, &mut g)
            .and_then(|()| self.solver.finish(context, input, &u))
            .and_then(|_| self.take_reaction(&g));
        if result.is_ok() {
            next.copy_from_slice(&u);
        }
        (self.solver.fields.u, self.solver.fields.g) = (u, g);
        result?;
        self.solver.end(&mut self.report, None)?;
        Ok(self.report)
    }

    /// Takes `u` to where the contact is after `part` of this step, by the response of `K + kappa M`; returns the smallest det F, with the
    /// residual in `g`.
    pub(super) fn lead(&mut self, part: f32, u: &mut [f32], g: &mut [f32]) -> Result<f32> {
        let (context, input) = (self.context, self.input);
        let env = context.env();
        // The contact goes straight from the last state to what the host asks: `u_n + part (c - u_n)`.
        let target = |index: usize| {
            let node = self.solver.balance.nodes[index];
            let c = input.contact.at(node).unwrap_or_default();
            let at = 3 * node as usize;
            [0, 1, 2].map(|k| input.last[at + k] + part * (c[k] - input.last[at + k]))
        };
        self.solver
            .preconditioner
            .respond(env, target, &mut self.solver.fields.d, u)?;
        // The response has them there but for rounding; exactly there is what the host prescribed.
        for index in 0..self.solver.balance.nodes.len() {
            let at = 3 * self.solver.balance.nodes[index] as usize;
            u[at..at + 3].copy_from_slice(&target(index));
        }
        env.held.put(u);
        let (det, _) =
            self.solver
                .balance
                .residual(context, [input.last, u, u], g, &mut self.report)?;
        // Forces are known of this state even if no iteration comes.
        self.solver.balance.stand();
        Ok(det)
    }

    /// Contact forces of the state that stands, `L_C^T r`: the virtual work of the whole residual on the response to each contact.
    fn take_reaction(&mut self, g: &[f32]) -> Result<()> {
        let (context, contact) = (self.context, self.input.contact);
        let env = context.env();
        let held = &env.held.is;
        let reaction = &mut self.solver.next.reaction;
        // What is out of balance at the contact nodes themselves, µN; `reaction` adds what the free nodes leave, which is little once the iterations end.
        let mut rows = self.solver.balance.at_nodes[1].as_chunks::<3>().0.iter();
        for &node in &contact.nodes {
            let row = match held[node as usize] {
                true => None,
                false => rows.next(),
            };
            reaction.extend(row.copied().unwrap_or_default());
        }
        self.solver.preconditioner.reaction(env, g, |node, force| {
            if let Ok(i) = contact.nodes.binary_search(&node) {
                for (sum, force) in reaction[3 * i..3 * i + 3].iter_mut().zip(force) {
                    *sum += force;
                }
            }
        })
    }

    /// The first guess: the last state and the response to what the contact did since, in so many parts that the first of them does not
    /// halve the smallest det F; all parts but the last get an iteration each.
    fn guess(&mut self, u: &mut [f32], g: &mut [f32]) -> Result<f32> {
        let input = self.input;
        // From an inverted state no path leads back but the one from rest.
        let lost = self.solver.motion.min_det < SMALLEST_DET && !input.still;
        // Half of what the last state had: a guess that takes more than that in one go is linear where the law is not.
        let least = SMALLEST_DET.max(0.5 * self.solver.motion.min_det.min(1.0));
        let mut parts = 1;
        let mut det = loop {
            if lost {
                u.fill(0.0);
                lift(self.context, input, None, u)?;
            } else {
                u.copy_from_slice(input.last);
                add_gravity(self.context, input, u)?;
                lift(self.context, input, Some(input.last), u)?;
            }
            // Halved until the first part is gentle: what the iterations start from must not be inverted.
            let part = 1.0 / parts as f32;
            let det = self.lead(part, u, g)?;
            if det > least || parts == MOST_PARTS {
                break det;
            }
            parts *= 2;
        };
        // Invariant: `u` has its contact at `part - 1` of the way, `g` is its residual and `det` its smallest det F.
        for part in 2..=parts {
            if det > SMALLEST_DET {
                // One iteration between two parts: the next is linear about a state in balance, not about another guess.
                self.improve(u, g, det)?;
            }
            det = self.lead(part as f32 / parts as f32, u, g)?;
        }
        self.report.parts = parts;
        Ok(det)
    }

    /// A guess that has the contact where the host asks for it, and the iterations about it; on return `g` is the residual of `u`.
    fn iterate(&mut self, u: &mut [f32], g: &mut [f32]) -> Result<()> {
        let det = self.guess(u, g)?;
        self.relax(det, u, g)
    }
}
