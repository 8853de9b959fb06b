//! What the body does where a support group moves against the others, or has been let go.
//!
//! A group's nodes `B` at rest span `b_j`: one, and their coordinates, orthonormal over the nodes. For each `b_j` along each axis the column `w` is the
//! body's answer, `(K + kappa M) w = 0` at the free nodes, `w = b_j e` on `B`, zero at what else is held; solved for once a model, by iterations. A motion
//! of the group changes its displacement by `delta`, of which a rigid motion leaves nothing outside of that span, however large, so that
//!
//! ```text
//! u <- u + sum_j w_j (1/n) sum_B b_j delta        then B itself to where it ends
//! ```
//!
//! is the first guess of a step. Let go, a group is free as all other nodes, and the same columns are modes beside those of the bundle, which are zero on it.

use std::sync::Arc;

use super::boundary::Held;
use super::group::{Group, GroupModes, Lift};
use super::input::{Enough, Input, Report, SolverContext};
use super::relax::FieldStep;
use super::solver::ImplicitSolver;
use super::whole::WholeModes;
use crate::error::Result;
use crate::field::ContactSet;
use crate::memory;

const WHAT: &str = "the response to a support";
/// Iterations for each column, made once a model: what they leave unbalanced is in the guess of
/// every step in which the group moves.
const ITERATIONS: u32 = 30;
/// The displacement that is solved for, mm: so little that the elements are linear, so much that rounding is not seen.
const TRIAL_MM: f32 = 0.02;
/// A coordinate in which the nodes spread by less than this part of the widest is left out: a group
/// in a plane has no third coordinate to speak of, and dividing by its rounding would make one up.
const FLAT: f64 = 1e-3;

impl Group {
    /// Made when it is first asked for.
    pub(super) fn lift(&self, context: SolverContext<'_>, rest: &[f32]) -> Result<&Lift> {
        if let Some(made) = self.lift.get() {
            return Ok(made);
        }
        let made = Lift::new(context, rest, &self.nodes)?;
        Ok(self.lift.get_or_init(|| made))
    }
}

/// `b_j` of nodes at rest.
/// `[1..=4][n]`: orthogonal, of mean square one.
fn functions(rest: &[f32], nodes: &[u32]) -> Result<Vec<Vec<f32>>> {
    let mut made: Vec<Vec<f64>> = memory::room(4, WHAT)?;
    made.push(memory::filled(nodes.len(), 1.0, WHAT)?);
    let spread = |own: &[f64]| {
        (own.iter().map(|value| value * value).sum::<f64>() / own.len() as f64).sqrt()
    };
    let mut widest = 0.0f64;
    for axis in 0..3 {
        let along = nodes
            .iter()
            .map(|node| f64::from(rest[3 * *node as usize + axis]));
        let mut own: Vec<f64> = memory::collected(nodes.len(), along, WHAT)?;
        // Gram and Schmidt over the nodes: a group that lies in a plane, or is one node, has fewer functions.
        for other in &made {
            // Both over `n` nodes: the functions have the mean square one.
            let part: f64 = own.iter().zip(other).map(|(a, b)| a * b).sum();
            let part = part / nodes.len() as f64;
            own.iter_mut().zip(other).for_each(|(a, b)| *a -= part * b);
        }
        let size = spread(&own);
        widest = widest.max(size);
        if size > FLAT * widest.max(1.0) {
            own.iter_mut().for_each(|value| *value /= size);
            made.push(own);
        }
    }
    let narrow = |own: Vec<f64>| -> Result<Vec<f32>> {
        let values = own.iter().map(|value| *value as f32);
        memory::collected(own.len(), values, WHAT)
    };
    made.into_iter().map(narrow).collect()
}

impl Lift {
    /// With the bundle's length of step and all groups held: the same for every scene of a model.
    fn new(context: SolverContext<'_>, rest: &[f32], nodes: &[u32]) -> Result<Lift> {
        let body = &context.corrections.body;
        let len = 3 * body.mass.len();
        // Another boundary than any scene's: all groups held, this one led by a function at a time.
        let mut held = Held::new(body.mass.len(), body.held.nodes.iter().copied())?;
        // Zero but for the group that is asked: the others stay at rest.
        held.places = memory::zeros(3 * held.nodes.len(), WHAT)?;
        let zero = memory::zeros(len, WHAT)?;
        let input = Input {
            rest: &zero,
            contact: &ContactSet::default(),
            last: &zero,
            before: &zero,
            still: true,
            load: None,
            way: [0.0, 1.0],
            enough: Enough {
                iterations: ITERATIONS,
                error_mm: 0.0,
                until: None,
            },
        };
        let functions = functions(rest, nodes)?;
        let own = SolverContext {
            time_step: &context.corrections.time_step,
            held: &held,
            ..context
        };
        let mut solver = ImplicitSolver::new(own)?;
        let mut columns = memory::room(3 * functions.len(), WHAT)?;
        for function in &functions {
            for axis in 0..3 {
                held.places.fill(0.0);
                for (node, value) in nodes.iter().zip(function) {
                    if let Ok(at) = held.nodes.binary_search(node) {
                        held.places[3 * at + axis] = TRIAL_MM * value;
                    }
                }
                let own = SolverContext {
                    time_step: &context.corrections.time_step,
                    held: &held,
                    ..context
                };
                let mut trial = FieldStep {
                    solver: &mut solver,
                    context: own,
                    input: &input,
                    report: Report::default(),
                };
                columns.push(trial.answer()?);
            }
        }
        Ok(Lift {
            functions,
            columns: Arc::new(columns),
            parents: Vec::new(),
        })
    }
}

impl FieldStep<'_> {
    /// Where the body comes to rest in a step with the boundary of `context`, over [`TRIAL_MM`].
    fn answer(&mut self) -> Result<Vec<f32>> {
        let (context, input) = (self.context, self.input);
        let env = context.env();
        self.solver.balance.nodes.clear();
        self.solver.preconditioner.prescribe(env, &[])?;
        self.solver.expect(context, input)?;
        self.solver.memory.mask(&[]);
        self.solver.memory.clear();
        self.solver.balance.drift.fill(0.0);
        let mut u = memory::zeros(input.last.len(), WHAT)?;
        let mut g = memory::zeros(input.last.len(), WHAT)?;
        // Only the group is displaced at first; the iterations find what the body does between it and what is held.
        context.held.put(&mut u);
        let (det, _) = self.solver.balance.residual(
            context,
            [input.last, &u, &u],
            &mut g,
            &mut self.report,
        )?;
        self.relax(det, &mut u, &mut g)?;
        u.iter_mut().for_each(|value| *value /= TRIAL_MM);
        Ok(u)
    }
}

impl ImplicitSolver {
    /// What loads and what is held ask of a step, before it begins.
    pub(super) fn expect(&mut self, context: SolverContext<'_>, input: &Input<'_>) -> Result<()> {
        self.groups.stand_on(context.held.let_go, &mut self.local);
        if self.groups.before != self.groups.now {
            // The pairs are those of another boundary, also where the step is made again.
            self.clear_pairs();
        }
        let has_load = input.load.is_some() || context.held.let_go != 0;
        self.preconditioner.expect_load(context.env(), has_load)
    }
}

/// Adds to a guess that starts from `from`, or from rest, what the motion of the groups does in it; held nodes end where they are led.
pub(super) fn lift(
    context: SolverContext<'_>,
    input: &Input<'_>,
    from: Option<&[f32]>,
    u: &mut [f32],
) -> Result<()> {
    let held = context.held;
    for (at, group) in context.corrections.groups.iter().enumerate() {
        if held.let_go >> at & 1 != 0 {
            continue;
        }
        // How far a node of the group goes in the step, mm: from `from`, or from rest.
        let change = |node: u32| {
            let index = held.nodes.binary_search(&node).unwrap_or(usize::MAX);
            let (to, at) = (held.place(index), 3 * node as usize);
            [0, 1, 2].map(|axis| to[axis] - from.map_or(0.0, |from| from[at + axis]))
        };
        // A group that stays has no part in the guess, and its columns need not be made for it.
        if group.nodes.iter().all(|node| change(*node) == [0.0; 3]) {
            continue;
        }
        let lift = group.lift(context, input.rest)?;
        let amounts = lift.amounts(|at| change(group.nodes[at]));
        for (amount, column) in amounts.into_iter().zip(&*lift.columns) {
            lift.add((column, amount), u);
        }
    }
    // The columns take the group to where it goes but for rounding; exactly there are its nodes now.
    held.put(u);
    Ok(())
}

/// Gives `held` what the groups do that it has let go; `rest [K,3]`.
///
/// # Errors
/// [`crate::Error::OutOfMemory`].
pub fn let_go(context: SolverContext<'_>, rest: &[f32], held: &mut Held) -> Result<()> {
    let mut fields: Vec<(&Lift, &[f32])> = Vec::new();
    let asked = SolverContext { held, ..context };
    for group in asked.let_go_groups() {
        let lift = group.lift(context, rest)?;
        let columns = lift.columns.iter();
        memory::reserve(&mut fields, Group::MOST_COLUMNS, WHAT)?;
        fields.extend(columns.map(|column| (lift, column.as_slice())));
    }
    if fields.is_empty() {
        held.modes = GroupModes::default();
        return Ok(());
    }
    let own = SolverContext {
        time_step: &context.corrections.time_step,
        held,
        ..context
    };
    let mut solver = ImplicitSolver::new(own)?;
    let whole = context.corrections.whole.get().and_then(Option::as_ref);
    let modes = modes_of(&mut solver, own, &fields, whole)?;
    held.modes = GroupModes(Some(Arc::new(modes)));
    Ok(())
}

/// Fields as whole modes, behind those of the bundle.
fn modes_of(
    solver: &mut ImplicitSolver,
    context: SolverContext<'_>,
    fields: &[(&Lift, &[f32])],
    whole: Option<&WholeModes>,
) -> Result<WholeModes> {
    let env = context.env();
    let (len, coarse) = (env.body.mass_of_dof.len(), env.space.count());
    // The bundle's own come first, those of the groups behind them: a number of a mode does not change when a group is let go.
    let known = whole.map_or(0, WholeModes::count);
    let mut joined = WholeModes::with_room(len, coarse, known + fields.len(), whole)?;
    let kappa = context.time_step.integrator.kappa() as f32;
    let zero = memory::zeros(len, WHAT)?;
    let mut u = memory::zeros(len, WHAT)?;
    let mut products = [memory::zeros(len, WHAT)?, memory::zeros(len, WHAT)?];
    let mut on_modes = memory::zeros(coarse, WHAT)?;
    solver.balance.nodes.clear();
    solver.balance.drift.fill(0.0);
    for (at, (lift, field)) in fields.iter().enumerate() {
        for (node, own) in u.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let part = if env.held.is[node] { 0.0 } else { TRIAL_MM };
            *own = lift.row(field, node).map(|w| part * w);
        }
        let [stiff, heavy] = &mut products;
        // Over so little the residual is linear: it is `(K + kappa M) u`, and the mass's part comes off below.
        solver
            .balance
            .residual(context, [&zero, &u, &u], stiff, &mut Report::default())?;
        for (i, (stiff, heavy)) in stiff.iter_mut().zip(&mut *heavy).enumerate() {
            *heavy = env.body.mass_of_dof[i] * u[i] / TRIAL_MM;
            *stiff = *stiff / TRIAL_MM - kappa * *heavy;
        }
        u.iter_mut().for_each(|value| *value /= TRIAL_MM);
        joined.push(&u);
        for (table, product) in products.iter().enumerate() {
            solver
                .preconditioner
                .on_natural(env, product, &mut on_modes)?;
            joined.take_products(table, known + at, product, &on_modes);
        }
    }
    Ok(joined)
}
