//! Corrections of a step that tools drive: their contact forces are loads, solved for again inside of each iteration.
//!
//! With `F(u) = f_int(u) + M (a + alpha v)` on the free nodes, `B` the rows of the samples and `A_k` the compliance of `K + kappa M`:
//!
//! ```text
//! u <- u_n - N diag(1 / (w² + kappa)) N^T [I_{n+1}(u_n) - I_n]        free motion of the natural modes
//! contact(u, f):  f' such that the gaps at u + A_k B^T (f' - f) obey Signorini's and Coulomb's laws
//! (u, f) <- contact(u, f_n)
//! k times:  d = -LBFGS(P) [F(u) - B^T f];  (u', f') <- contact(u + d, f);  u <- u + t (u' - u)
//! ```
//!
//! The pairs hold `F` without the loads: they survive any change of contact.
//!
//! The guess stays in the block coordinates until the elements ask for it: its contact is solved where the tissue would be at the nodes of
//! the domain. The iterations are local ([`super::local`]), in rounds that each begin with an evaluation of all elements.

mod fall_back;
mod freely;
mod recover;
mod remake;
mod rounds;
mod thrown;
mod whole;

pub(super) use remake::make_loaded;

use super::input::{Input, Report, SolverContext};
use super::passes;
use super::precondition::{Env, Preconditioner, mask_held};
use super::solver::{ImplicitSolver, SMALLEST_DET};
use crate::contact::{Compliance, ContactProblem, State};
use crate::corrections::gravity_columns::add_gravity;
use crate::corrections::lift::lift;
use crate::error::Result;

/// A step that leaves tissue deeper inside of a tool than this has lost the contact, mm.
pub(super) const SUNK_MM: f32 = 0.9;
/// An iteration may leave it so deep, mm.
const KEPT_MM: f32 = 0.5 * SUNK_MM;
/// Tools that go less far in a step are followed in one part from the last state, mm.
const LEAST_WAY_MM: f32 = 0.3;
/// The response of linear elasticity is not shown where it goes farther than this, mm.
const FARTHEST_MM: f32 = 30.0;
/// How often the contact on the linear response is solved again where the tissue has not come out of the tools.
const MORE_PRESSES: u32 = 6;

/// Evaluations of the element forces that a step may take beyond [`EVALUATIONS`] for each of its iterations.
const MORE_EVALUATIONS: u32 = 6;
const EVALUATIONS: u32 = 2;

/// Work of an evaluation for each node, in multiplications of contact solves.
const EVALUATION_WORK: u64 = 200;

/// Of a contact solve on the linear response besides the solve, for each node that tools may touch: its field there, and what the forces change.
const PRESS_WORK: u64 = 250;

/// Parts of the tools' way after which a guess that inverts elements is improved by an iteration, at most.
const MOST_PARTS: u32 = 4;

/// The state of an iteration.
struct Iterate<'a> {
    /// The state `[K,3]`, mm.
    u: &'a mut Vec<f32>,
    /// `F(u)`, µN.
    g: &'a mut Vec<f32>,
    /// Smallest det F.
    det: f32,
}

/// A step that tools drive, while it is made.
///
/// The solver's last motion and the problem's `past` are those of the last published state, and do not change; `report` is that of the last attempt.
struct ToolStep<'a> {
    solver: &'a mut ImplicitSolver,
    context: SolverContext<'a>,
    input: &'a Input<'a>,
    /// Tools and ties with their forces: `past` of the last step, `next` of this one.
    problem: &'a mut ContactProblem,
    /// The guess is linear elasticity from rest: falling back to that would make it a second time.
    guessed_from_rest: bool,
    report: Report,
}

impl ToolStep<'_> {
    /// One attempt at the step with the tools where they are now, from the pairs of the last published state or from those that there are; ties may break.
    ///
    /// It leaves the problem's `past` and the solver's `motion` as they were: those of the last published step.
    fn balance_loaded(
        &mut self,
        next: &mut [f32],
        from_published: bool,
        breaks: bool,
    ) -> Result<()> {
        if from_published {
            self.solver.begin_pairs();
        }
        self.solver.balance.nodes.clear();
        self.problem.tied.step_s = self.context.time_step.integrator.step_s as f32;
        // Contact is a load here, and nothing is prescribed: the pairs of the whole field hold at every node.
        self.solver.memory.mask(&[]);
        self.solver.expect(self.context, self.input)?;
        self.solver.prepare(self.context, self.input)?;
        self.report = Report {
            extent: (self.solver.motion).reach(self.context.moves_all(self.input)),
            ..Report::default()
        };
        // Out of the solver while they are iterated on; the host's field gets the state only once it is whole.
        let mut u = std::mem::take(&mut self.solver.fields.u);
        let mut g = std::mem::take(&mut self.solver.fields.g);
        let mut at = Iterate {
            u: &mut u,
            g: &mut g,
            det: 1.0,
        };
        let result = self
            .iterate_loaded(&mut at)
            .and_then(|()| self.solver.finish(self.context, self.input, at.u));
        if result.is_ok() {
            next.copy_from_slice(&u);
        }
        // Back before anything else can fail: a solver without them could make no further step.
        (self.solver.fields.u, self.solver.fields.g) = (u, g);
        let went = result?;
        // What fell back is a linear response, too, or no answer to the tools at all.
        let is_uncorrected = self.report.effort.iterations == 0 || self.report.fell_back;
        let uncorrected = is_uncorrected.then_some(went);
        self.solver.next.extent = self.report.extent;
        self.solver.end(&mut self.report, uncorrected)?;
        self.problem.finish(state(self.input, next), breaks);
        Ok(())
    }

    /// Guess, iterations, and what takes their place where they lost the contact or inverted elements; on return `at` is the state of the step.
    fn iterate_loaded(&mut self, at: &mut Iterate<'_>) -> Result<()> {
        let _span = tracing::trace_span!("guess").entered();
        self.guess_loaded(at)?;
        if self.context.held.let_go != 0 && at.det > SMALLEST_DET {
            // No mode of the bundle moves what the group held, and from where it has gone iterations find the rest.
            self.move_whole(at, 0.0)?;
        }
        // `fall_back` and `recover` come back to it.
        self.solver.fields.guess.copy_from_slice(at.u);
        self.problem.kept.keep_guess(&self.problem.next)?;
        let has_begun_again = self.leave_thrown_guess(at)?;
        let mut size = self.improve_loaded(at)?;
        if !is_sound(size, at.det) {
            size = self.recover(at)?;
        }
        // A state in balance may still have lost the tool: a thin one has gone through the surface.
        let mut left = sunk(self.input, self.problem, at.u, 1.0);
        let is_sunk = left > SUNK_MM && is_sound(size, at.det);
        if is_sunk && !has_begun_again && self.may_begin_again() {
            // The guess has lost it: tissue that swings goes on past a small tool.
            self.problem.work.attempt(false);
            self.begin_again(at)?;
            if self.problem.ways.longest() > LEAST_WAY_MM {
                // The whole way may lose them again.
                self.begin_round(at)?;
                self.improve_at(at, 0.5)?;
                self.end_round(at)?;
                self.evaluate(at)?;
            }
            size = self.improve_loaded(at)?;
            left = sunk(self.input, self.problem, at.u, 1.0);
        }
        if !is_sound(size, at.det) || left > SUNK_MM {
            self.fall_back(at, left)?;
        }
        self.report.min_det = at.det;
        Ok(())
    }

    /// The state of the step before, with the forces that it had.
    fn stay(&mut self, at: &mut Iterate<'_>) -> Result<()> {
        self.problem.stay();
        at.u.copy_from_slice(self.input.last);
        self.evaluate(at)
    }

    /// `F(u)` and det F of a state that no iteration led to.
    fn evaluate(&mut self, at: &mut Iterate<'_>) -> Result<()> {
        let nodes = at.u.len() as u64 / 3;
        self.problem.work.take_whole(EVALUATION_WORK * nodes);
        let states = [self.input.last, at.u, at.u];
        let balance = &mut self.solver.balance;
        (at.det, _) = balance.residual(self.context, states, at.g, &mut self.report)?;
        Ok(())
    }

    /// The first guess: the last state, the free motion of the natural modes, and the linear response to the tools, in parts of
    /// their way; in so many that the first of them does not halve the smallest det F, with an iteration each.
    fn guess_loaded(&mut self, at: &mut Iterate<'_>) -> Result<()> {
        let env = self.context.env();
        self.guessed_from_rest = self.solver.motion.min_det < SMALLEST_DET && !self.input.still;
        if self.guessed_from_rest {
            return self.respond_from_rest(at);
        }
        // Held tissue beside a cut: the linear response of the intact body would tear at what is no longer there.
        if self.problem.next.has_grasp() && !self.context.corrections.changed.is_empty() {
            return self.guess_freely(at);
        }
        // The guess is made again in twice as many parts, with an iteration after each, until it does not halve the smallest det F.
        let least = SMALLEST_DET.max(0.5 * self.solver.motion.min_det.min(1.0));
        let ways = self.problem.ways.parts(&self.problem.work);
        let mut iterated = 1;
        loop {
            // Each attempt begins with the forces of the last step: they belong to `input.last`.
            self.problem.restart();
            at.u.copy_from_slice(self.input.last);
            add_gravity(self.context, self.input, at.u)?;
            lift(self.context, self.input, Some(self.input.last), at.u)?;
            self.solver.move_freely(env)?;
            // Parts of the tools' way, for no tool may pass a sample between two looks; and of the load, where its response inverts elements.
            let parts = ways.max(iterated);
            let mut part = 0;
            while part < parts {
                let last = part;
                part = self.problem.work.next_part(part, parts);
                let way = part as f32 / parts as f32;
                self.press(self.input.last, way, at.u)?;
                // An iteration after each of `iterated` parts of the load but the last.
                let due = part * iterated / parts > last * iterated / parts;
                let work = &self.problem.work;
                let spent = work.is_spent() || work.is_half_over() || work.is_short();
                let spent = spent || is_spent(self.input, self.problem, &self.report, 1);
                if due && part < parts && !spent {
                    self.solver.settle(env, at.u)?;
                    self.evaluate(at)?;
                    if at.det > SMALLEST_DET {
                        self.begin_round(at)?;
                        self.improve_at(at, way)?;
                        self.end_round(at)?;
                    }
                    self.solver.preconditioner.coordinates.fill(0.0);
                }
            }
            self.solver.settle(env, at.u)?;
            self.press_on(KEPT_MM, at.u)?;
            self.evaluate(at)?;
            self.report.parts = parts;
            if at.det > least
                || iterated >= MOST_PARTS
                || self.problem.work.is_spent()
                || self.problem.work.is_short()
                || is_spent(self.input, self.problem, &self.report, 1)
            {
                return Ok(());
            }
            iterated *= 2;
        }
    }

    /// Solves the contact on the linear response again, each time about where the tissue has come to, until it lies no deeper in the tools than
    /// `most_mm`. Gives how deep it lies then, mm.
    fn press_on(&mut self, most_mm: f32, u: &mut [f32]) -> Result<f32> {
        let mut left = lost_by(self.input, self.problem, u);
        for _ in 0..MORE_PRESSES {
            if left <= most_mm || left == f32::MAX || self.problem.work.is_spent() {
                break;
            }
            self.solver.preconditioner.coordinates.fill(0.0);
            self.press(self.input.last, 1.0, u)?;
            self.solver.settle(self.context.env(), u)?;
            left = lost_by(self.input, self.problem, u);
        }
        Ok(left)
    }

    /// Contact where the tissue is with the coordinates' field on `u`, the tools at part `way` of their way; the
    /// coordinates take on `A_k B^T (f' - f)`. Slips are counted from `start`.
    fn press(&mut self, start: &[f32], way: f32, u: &[f32]) -> Result<()> {
        let env = self.context.env();
        let touched = self.solver.preconditioner.basis.domain_nodes.len() as u64;
        self.problem.work.take_whole(PRESS_WORK * touched);
        self.solver
            .preconditioner
            .decode_domain(env, &mut self.solver.fields.touched)?;
        for &node in &self.solver.preconditioner.basis.domain_nodes {
            let range = 3 * node as usize..3 * node as usize + 3;
            let base = &u[range.clone()];
            let touched = &mut self.solver.fields.touched[range];
            // The coordinates' field knows nothing of held nodes.
            match env.held.is[node as usize] {
                true => touched.copy_from_slice(base),
                false => touched.iter_mut().zip(base).for_each(|(t, u)| *t += u),
            }
        }
        let state = State {
            rest: self.input.rest,
            u: &self.solver.fields.touched,
            start,
        };
        let compliance = compliance(self.context, &self.solver.preconditioner);
        // The response to the change alone: the coordinates hold that of the forces before.
        let change = self.problem.solve(compliance, state, way)?;
        self.solver
            .preconditioner
            .add_load(env, change.dofs, change.forces)
    }
}

impl ImplicitSolver {
    /// The coordinates become `-N diag(1 / (m (w² + kappa))) N^T [I_{n+1}(u_n) - I_n]`: what the natural modes do by themselves.
    pub(super) fn move_freely(&mut self, env: Env<'_>) -> Result<()> {
        // What BDF2 takes from the past, less the inertia that the last state had: the modes answer to the difference alone.
        passes::difference(
            env,
            &self.balance.drift,
            &self.motion.inertia,
            &mut self.fields.q,
        )?;
        mask_held(&env.held.is, &mut self.fields.q);
        self.preconditioner.move_natural(env, &self.fields.q)
    }

    /// `u` and what the coordinates hold become one.
    pub(super) fn settle(&mut self, env: Env<'_>, u: &mut [f32]) -> Result<()> {
        self.preconditioner.decode(env, &mut self.fields.q)?;
        passes::add(env, &mut self.fields.q, u)
    }
}

/// Whether a step whose contact may be lost has taken its evaluations, of which it leaves those of its iterations but for `iterations` of
/// them.
pub(super) fn is_spent(
    input: &Input<'_>,
    problem: &ContactProblem,
    report: &Report,
    iterations: u32,
) -> bool {
    if !problem.ways.may_lose() {
        return false;
    }
    let most = input.enough.iterations + iterations * (EVALUATIONS - 1) + MORE_EVALUATIONS;
    report.effort.evaluations >= most
}

/// Tissue `u` in the step.
fn state<'a>(input: &Input<'a>, u: &'a [f32]) -> State<'a> {
    State {
        rest: input.rest,
        u,
        start: input.last,
    }
}

/// How deep tissue `u` and the tools lie in each other, at part `way` of their way, mm; without bounds where forces are no contact.
fn sunk(input: &Input<'_>, problem: &mut ContactProblem, u: &[f32], way: f32) -> f32 {
    match problem.next.is_wedged(&problem.past) {
        true => f32::MAX,
        false => problem.depths().sunk(state(input, u), way),
    }
}

/// How deep tools and tissue lie in each other in a state of linear elasticity; without bounds where that goes too far.
fn lost_by(input: &Input<'_>, problem: &mut ContactProblem, u: &[f32]) -> f32 {
    let near = |u: &[f32; 3]| u.iter().map(|x| x * x).sum::<f32>() <= FARTHEST_MM * FARTHEST_MM;
    match u.as_chunks::<3>().0.iter().all(near) {
        true => sunk(input, problem, u, 1.0),
        false => f32::MAX,
    }
}

/// Whether the elements can go on from a state.
fn is_sound(unbalanced: f64, min_det: f32) -> bool {
    unbalanced.is_finite() && min_det >= SMALLEST_DET
}

/// `A_k` of the body at rest: the bundle's columns less what inertia holds back in a step of this length.
fn compliance<'a>(
    context: SolverContext<'a>,
    preconditioner: &'a Preconditioner,
) -> Compliance<'a> {
    Compliance::at_rest(
        context.prior,
        &context.held.is,
        Some((
            &context.corrections.space,
            preconditioner.inertial_compliance(),
        )),
    )
}
