//! Modes of the whole body, and of what a support group held, in a step that tools drive.
//!
//! Local iterations span neither. So they move once a round, after the iterations, by what the
//! residual of the base, less the tools' loads, has of them.

use super::thrown::take_loads;
use super::{Iterate, ToolStep};
use crate::corrections::fields::Fields;
use crate::corrections::solver::{ImplicitSolver, SMALLEST_DET};
use crate::error::Result;

impl ToolStep<'_> {
    /// Asks the whole modes what they make of the base's residual less the tools' loads, for the decoding at the end of a round; says how far that moves the
    /// tissue, mm: without bounds where that is not known.
    pub(super) fn ask_whole(&mut self, at: &Iterate<'_>) -> Result<f32> {
        let (solver, env) = (&mut *self.solver, self.context.env());
        let problem = &*self.problem;
        let Some(local) = &mut solver.local else {
            // Not known: the caller then measures the move before it lets it stand.
            return Ok(f32::INFINITY);
        };
        let Some(on_modes) = local.base_on_modes(env, problem) else {
            return Ok(f32::INFINITY);
        };
        let each_load = |take: &mut dyn FnMut(u32, [f32; 3])| {
            problem.each_load(|node, force| take(node, force.to_array()));
        };
        // The residual is that of the base, since only it is known at all nodes until the round
        // ends.
        let base = (at.g.as_slice(), on_modes);
        let own = &mut solver.preconditioner;
        let room = (
            &own.basis.plan,
            own.coordinates.as_mut_slice(),
            solver.fields.q.as_mut_slice(),
        );
        let asked = own.whole.ask(env, base, each_load, room)?;
        // A bundle without whole modes has nothing to move.
        Ok(asked.unwrap_or(0.0))
    }

    /// Moves the whole modes by what is out of balance on them. A move of more than `unchecked_mm` is taken back unless it leaves less of that: a tool that has
    /// lost the balance pushes with more than the body's softest modes bear.
    pub(super) fn move_whole(&mut self, at: &mut Iterate<'_>, unchecked_mm: f32) -> Result<()> {
        let ToolStep {
            solver,
            context,
            input,
            problem,
            report,
            ..
        } = self;
        let env = context.env();
        let unbalanced = |g: &[f32], to: &mut Vec<f32>| take_loads(problem, &env.held.is, g, to);
        let ImplicitSolver {
            preconditioner,
            balance,
            fields:
                Fields {
                    d: from,
                    q: scratch,
                    g_new: left,
                    ..
                },
            ..
        } = &mut **solver;
        from.copy_from_slice(at.u);
        unbalanced(at.g, left);
        preconditioner.move_whole(env, left, scratch, at.u)?;
        let moves =
            at.u.iter()
                .zip(&*from)
                .map(|(now, from)| (now - from).abs());
        if moves.fold(0.0, f32::max) <= unchecked_mm {
            return Ok(());
        }
        // A large move is worth an evaluation of all elements: it stands only if less is out of balance than before.
        let before = balance.size(env, left)?;
        (at.det, _) = balance.residual(*context, [input.last, at.u, at.u], at.g, report)?;
        unbalanced(at.g, left);
        let after = balance.size(env, left)?;
        if at.det > SMALLEST_DET && after < before {
            return Ok(());
        }
        at.u.copy_from_slice(from);
        (at.det, _) = balance.residual(*context, [input.last, at.u, at.u], at.g, report)?;
        Ok(())
    }
}
