//! The response of the body at rest to gravity, for the guess of a step in which gravity turns.
//!
//! `(K + kappa M) w = M e` for each axis `e`, less what the natural modes have of it, which a guess moves by themselves. Gravity acts on all of the
//! body at once, and what of its response is no mode (where the body is held above all) takes the iterations of a step too long: without it a
//! body that turns by 90 degrees in two seconds is ten times as far off.

use std::sync::Arc;

use super::Corrections;
use super::gravity::GravityResponse;
use super::input::{Enough, Input, Report, SolverContext};
use super::precondition::mask_held;
use super::relax::FieldStep;
use super::solver::ImplicitSolver;
use crate::error::Result;
use crate::field::ContactSet;
use crate::memory;

/// Iterations on each axis: the fourth digit does not move any more.
const ITERATIONS: u32 = 24;
/// The acceleration that is solved for, mm/s²: so little that the elements are linear, so much that rounding is not seen.
const TRIAL: f32 = 100.0;
const WHAT: &str = "the response to gravity";

impl GravityResponse {
    /// Solves for it, with the bundle's length of step: the same for every scene of a model.
    fn new(context: SolverContext<'_>) -> Result<GravityResponse> {
        let context = SolverContext {
            time_step: &context.corrections.time_step,
            held: &context.corrections.body.held,
            ..context
        };
        let env = context.env();
        let len = env.body.mass_of_dof.len();
        let mut solver = ImplicitSolver::new(context)?;
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
        // One for each axis: a gravity in any direction is a sum of the three.
        let mut columns = [Vec::new(), Vec::new(), Vec::new()];
        solver.preconditioner.prescribe(env, &[])?;
        solver.preconditioner.expect_load(env, true)?;
        solver.memory.mask(&[]);
        for (axis, column) in columns.iter_mut().enumerate() {
            let mut u = memory::zeros(len, WHAT)?;
            let mut g = memory::zeros(len, WHAT)?;
            for (at, (drift, mass)) in solver
                .balance
                .drift
                .iter_mut()
                .zip(&env.body.mass_of_dof)
                .enumerate()
            {
                *drift = if at % 3 == axis { -TRIAL * mass } else { 0.0 };
            }
            solver.memory.clear();
            let mut report = Report::default();
            let (det, _) =
                solver
                    .balance
                    .residual(context, [&zero, &u, &u], &mut g, &mut report)?;
            // At rest and with no displacement the residual is the drift: `-M e`, times [`TRIAL`].
            g.copy_from_slice(&solver.balance.drift);
            mask_held(&env.held.is, &mut g);
            solver.preconditioner.move_natural(env, &g)?;
            let mut by_modes = memory::zeros(len, WHAT)?;
            solver.preconditioner.decode(env, &mut by_modes)?;
            mask_held(&env.held.is, &mut by_modes);
            FieldStep {
                solver: &mut solver,
                context,
                input: &input,
                report,
            }
            .relax(det, &mut u, &mut g)?;
            for (u, by_modes) in u.iter_mut().zip(&by_modes) {
                // Per mm/s². The modes are moved by the guess itself, with the inertia of the step: here they would count twice.
                *u = (*u - by_modes) / TRIAL;
            }
            *column = u;
        }
        Ok(GravityResponse {
            columns: Arc::new(columns),
            parents: Vec::new(),
        })
    }
}

/// Adds to a guess what the change of gravity over the step moves beside the natural modes.
pub(super) fn add_gravity(
    context: SolverContext<'_>,
    input: &Input<'_>,
    u: &mut [f32],
) -> Result<()> {
    // The change alone: what gravity did before is in the last state.
    let Some(change) = input.load.and_then(|load| load.turned_by()) else {
        return Ok(());
    };
    let response = context.corrections.gravity_response(context)?;
    for (column, change) in response.columns.iter().zip(change) {
        if change == 0.0 {
            continue;
        }
        u.iter_mut().zip(column).for_each(|(u, w)| *u += change * w);
        // Nodes that cuts have added move as those that they are copies of.
        let copies = u[column.len()..].as_chunks_mut::<3>().0.iter_mut();
        for (u, parent) in copies.zip(&response.parents) {
            let from = &column[3 * *parent as usize..][..3];
            u.iter_mut().zip(from).for_each(|(u, w)| *u += change * w);
        }
    }
    // What is held stays where it is led, whatever the columns say there.
    context.held.put(u);
    Ok(())
}

impl Corrections {
    /// What the body does, made when it is first asked for.
    fn gravity_response(&self, context: SolverContext<'_>) -> Result<&GravityResponse> {
        if let Some(response) = self.gravity.get() {
            return Ok(response);
        }
        // Two scenes may make it at once; the first to be done is kept, and both have the same
        // bits.
        let made = GravityResponse::new(context)?;
        Ok(self.gravity.get_or_init(|| made))
    }

    /// The intact body's answer to gravity is that of this one, which it has been cut to; `context` is of the intact one.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    /// Large fields are shared, not copied; copies of nodes are named by their parents.
    pub fn follow_gravity(&self, context: SolverContext<'_>, parents: &[u32]) -> Result<()> {
        if self.gravity.get().is_some() {
            return Ok(());
        }
        let whole = context.corrections.gravity_response(context)?;
        let parents = memory::copied(parents, WHAT)?;
        self.gravity.get_or_init(|| GravityResponse {
            columns: Arc::clone(&whole.columns),
            parents,
        });
        Ok(())
    }
}
