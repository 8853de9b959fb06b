//! What takes the place of a step that lost the contact or inverted elements: its first guess, linear elasticity from rest, or the state before it
//! (`docs/decisions/018-swept-contact.md`).
//!
//! `fields.guess` and the problem's kept forces belong together here: whatever is written to one is
//! written to the other, so that the state that is taken in the end has the forces that it had.

use super::{Iterate, SUNK_MM, ToolStep, lost_by};
use crate::corrections::lift::lift;
use crate::corrections::solver::SMALLEST_DET;
use crate::error::Result;

impl ToolStep<'_> {
    /// The first of the three in which the contact holds, or that in which it is lost by least.
    pub(super) fn fall_back(&mut self, at: &mut Iterate<'_>, found_left: f32) -> Result<()> {
        self.report.fell_back = true;
        self.solver.clear_pairs();
        // A state whose elements are sound though its contact is lost.
        let found_sound = at.det >= SMALLEST_DET;
        // `d` is scratch here: no direction is asked for any more.
        self.solver.fields.d.copy_from_slice(at.u);
        self.problem.kept.keep_sound(&self.problem.next)?;
        self.problem.kept.take_guess(&mut self.problem.next);
        at.u.copy_from_slice(&self.solver.fields.guess);
        // First candidate: the guess, pressed on until the tissue is out of the tools.
        let mut left = self.press_on(SUNK_MM, at.u)?;
        // It stands if nothing better is found.
        self.solver.fields.guess.copy_from_slice(at.u);
        self.problem.kept.keep_guess(&self.problem.next)?;
        // Second: linear elasticity from rest, with no history but the tools' places; a guess that inverts elements makes the next step begin there.
        let has_time = !self.problem.work.is_late();
        if left > SUNK_MM && has_time && !self.guessed_from_rest {
            self.respond_from_rest(at)?;
            let from_rest = self.press_on(SUNK_MM, at.u)?;
            // No force at all: the tool lies where samples cannot see it, and the tissue is where no tool pushed it.
            let is_lost = self.problem.past.tools_push() && !self.problem.next.tools_push();
            if from_rest < left && !is_lost {
                left = from_rest;
                self.solver.fields.guess.copy_from_slice(at.u);
                self.problem.kept.keep_guess(&self.problem.next)?;
            }
        }
        if left > SUNK_MM {
            // As it was, under the forces that held it there.
            self.problem.stay();
            let stayed = lost_by(self.input, self.problem, self.input.last);
            if found_sound && found_left < left.min(stayed) {
                return self.take_found(at);
            }
            if stayed <= left {
                return self.stay(at);
            }
        }
        self.problem.kept.take_guess(&mut self.problem.next);
        at.u.copy_from_slice(&self.solver.fields.guess);
        self.evaluate(at)?;
        // What a linear response turns inside out is no tissue: a tool that has lost the contact there pushes its way in from a sound state, in the steps that
        // follow.
        let found = at.det;
        let is_cut = !self.context.corrections.changed.is_empty();
        let must_be_sound = is_cut || self.must_be_sound();
        if found >= SMALLEST_DET || !must_be_sound {
            return Ok(());
        }
        if found_sound {
            self.take_found(at)?;
        } else if !self.input.still {
            self.stay(at)?;
        }
        if at.det > found {
            return Ok(());
        }
        self.problem.kept.take_guess(&mut self.problem.next);
        at.u.copy_from_slice(&self.solver.fields.guess);
        self.evaluate(at)
    }

    /// The state that the iterations had come to.
    fn take_found(&mut self, at: &mut Iterate<'_>) -> Result<()> {
        self.problem.kept.take_sound(&mut self.problem.next);
        at.u.copy_from_slice(&self.solver.fields.d);
        self.evaluate(at)
    }

    /// Linear elasticity from rest, with the tools where they are.
    pub(super) fn respond_from_rest(&mut self, at: &mut Iterate<'_>) -> Result<()> {
        // From rest the tools come from outside: their way out of the tissue of the last state means nothing there.
        self.problem.start_from_rest(self.input.rest);
        at.u.fill(0.0);
        lift(self.context, self.input, None, at.u)?;
        self.solver.preconditioner.coordinates.fill(0.0);
        let parts = self.problem.ways.parts(&self.problem.work);
        let mut part = 0;
        while part < parts {
            part = self.problem.work.next_part(part, parts);
            let way = part as f32 / parts as f32;
            self.press(&[], way, at.u)?;
        }
        self.problem.ways.return_to();
        self.solver.settle(self.context.env(), at.u)?;
        self.report.parts = parts;
        self.evaluate(at)
    }
}
