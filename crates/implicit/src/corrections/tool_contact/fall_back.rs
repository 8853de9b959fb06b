//! What takes the place of a step that lost the contact or inverted elements: its first guess, linear elasticity from rest, or the state before it
//! (`docs/decisions/018-swept-contact.md`).

use super::{Iterate, SUNK_MM, lost_by};
use crate::contact::ContactProblem;
use crate::corrections::input::{Input, Report, SolverContext};
use crate::corrections::solver::{ImplicitSolver, SMALLEST_DET};
use crate::error::Result;

impl ImplicitSolver {
    /// The first of the three in which the contact holds, or that in which it is lost by least.
    pub(super) fn fall_back(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        problem: &mut ContactProblem,
        at: &mut Iterate<'_>,
        report: &mut Report,
    ) -> Result<()> {
        report.fell_back = true;
        self.clear_pairs();
        // A state whose elements are sound though its contact is lost.
        let found_sound = at.det >= SMALLEST_DET;
        // `d` is scratch here: no direction is asked for any more.
        self.d.copy_from_slice(at.u);
        problem.kept.keep_sound(&problem.next)?;
        problem.kept.take_guess(&mut problem.next);
        at.u.copy_from_slice(&self.guess);
        let mut left = self.press_on(context, input, problem, SUNK_MM, at.u)?;
        self.keep(problem, at)?;
        if left > SUNK_MM {
            self.respond_from_rest(context, input, problem, at, report)?;
            let from_rest = self.press_on(context, input, problem, SUNK_MM, at.u)?;
            // No force at all: the tool lies where samples cannot see it, and the tissue is where no tool pushed it.
            let is_lost = problem.past.tools_push() && !problem.next.tools_push();
            if from_rest < left && !is_lost {
                left = from_rest;
                self.keep(problem, at)?;
            }
        }
        if left > SUNK_MM {
            // As it was, under the forces that held it there.
            problem.stay();
            if lost_by(input, problem, input.last) <= left {
                return self.stay(context, input, problem, at, report);
            }
        }
        problem.kept.take_guess(&mut problem.next);
        at.u.copy_from_slice(&self.guess);
        self.evaluate(context, input, at, report)?;
        // What a linear response turns inside out is no tissue: a tool that has lost the contact there pushes its way in from a sound state, in the steps that
        // follow.
        let found = at.det;
        let is_cut = !context.corrections.changed.is_empty();
        let must_be_sound = is_cut || Self::must_be_sound(context, input, problem);
        if found >= SMALLEST_DET || !must_be_sound {
            return Ok(());
        }
        if found_sound {
            problem.kept.take_sound(&mut problem.next);
            at.u.copy_from_slice(&self.d);
            self.evaluate(context, input, at, report)?;
        } else if !input.still {
            self.stay(context, input, problem, at, report)?;
        }
        if at.det > found {
            return Ok(());
        }
        problem.kept.take_guess(&mut problem.next);
        at.u.copy_from_slice(&self.guess);
        self.evaluate(context, input, at, report)
    }

    /// What stands if nothing better is found.
    fn keep(&mut self, problem: &mut ContactProblem, at: &Iterate<'_>) -> Result<()> {
        self.guess.copy_from_slice(at.u);
        problem.kept.keep_guess(&problem.next)
    }

    /// Linear elasticity from rest, with the tools where they are.
    pub(super) fn respond_from_rest(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        problem: &mut ContactProblem,
        at: &mut Iterate<'_>,
        report: &mut Report,
    ) -> Result<()> {
        // From rest the tools come from outside: their way out of the tissue of the last state means nothing there.
        problem.start_from_rest(input.rest);
        at.u.fill(0.0);
        self.lift(context, input, None, at.u)?;
        self.preconditioner.coordinates.fill(0.0);
        let from_rest = Input {
            last: &[],
            ..*input
        };
        let parts = problem.ways.parts(&problem.work);
        let mut part = 0;
        while part < parts {
            part = problem.work.next_part(part, parts);
            let way = part as f32 / parts as f32;
            self.press(context, &from_rest, problem, way, at.u)?;
        }
        problem.ways.return_to();
        self.settle(context.env(), at.u)?;
        report.parts = parts;
        self.evaluate(context, input, at, report)
    }
}
