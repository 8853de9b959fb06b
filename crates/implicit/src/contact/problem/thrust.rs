//! Broad tools that go on into tissue which they push, faster than a step can follow: a blade of 3 mm that leaps 9 mm would be behind the samples
//! that it pushed, where nothing finds them. It is followed as far as it can be, and the rest of its way is the next step's.

use ::contact::{Vector, pose};

use super::ContactProblem;
use crate::contact::past::Force;

impl ContactProblem {
    /// Whether the contact of a broad tool was lost that goes quickly on into tissue which it pushed when the step began: it touches nothing any more, or the
    /// step `fell_back`, which beside a tool that was put elsewhere says nothing of it.
    pub fn has_passed(&self, fell_back: bool) -> bool {
        let fell_back = fell_back && !self.has_leapt;
        (0..self.tools.len()).any(|index| self.thrusts(index) && (fell_back || !self.pushes(index)))
    }

    fn pushes(&self, index: usize) -> bool {
        let mut forces = self.next.forces.iter();
        forces.any(|force| force.tool == index as u32)
    }

    /// Whether a broad tool goes quickly on into tissue that it pushed when the step began.
    fn thrusts(&self, index: usize) -> bool {
        if !self.swept[index] || !self.tools[index].body.is_broad() {
            return false;
        }
        let own = |force: &&Force| force.tool == index as u32;
        let pushed: Vector = (self.past.forces.iter().filter(own))
            .map(|force| force.force)
            .sum();
        let way = self.goals[index].translation - self.before[index].translation;
        way.dot(pushed) > 0.0
    }

    /// Such tools stop after so many of their half thicknesses.
    pub fn stop_after(&mut self, thicknesses: f32) {
        for index in 0..self.tools.len() {
            if self.thrusts(index) {
                let body = &self.tools[index].body;
                let motion = body.motion(&self.before[index], &self.goals[index]);
                let part = (thicknesses * body.size() / motion).min(0.5);
                let at = pose::between(&self.before[index], &self.goals[index], part);
                self.tools[index].pose = at;
                self.next.tools[index].pose = at;
            }
        }
    }

    /// All tools are where the host has put them, for a step that is made anew.
    pub fn aim(&mut self) {
        for (tool, goal) in self.tools.iter_mut().zip(&self.goals) {
            tool.pose = *goal;
        }
    }

    /// A tool that has stopped on its way lies so much deeper in the tissue where the host has it.
    pub fn tell_lag(&mut self) {
        let tools = self.tools.iter().zip(&self.goals);
        for (held, (tool, goal)) in self.next.tools.iter_mut().zip(tools) {
            if held.pose != *goal {
                held.reading.penetration_mm += tool.body.motion(&held.pose, goal);
            }
        }
    }
}
