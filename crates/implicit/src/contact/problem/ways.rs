//! The tools of a step and their ways: from where each was at its start to where the host has put it, in parts.
//!
//! Broad tools that go on into tissue which they push are followed as far as a step can follow: a blade of 3 mm that leaps 9 mm would be behind the samples
//! that it pushed, where nothing finds them. It stops on its way, and the rest is the next step's.

use ::contact::{Pose, Vector, pose};

use super::surface::Surface;
use super::work::Work;
use crate::contact::buried::Buried;
use crate::contact::past::{Force, Past};
use crate::contact::rows::{OPEN_MM, WHAT};
use crate::contact::solid::Solid;
use crate::contact::state::State;
use crate::contact::tool::{MAX_TOOLS, Tool};
use crate::contact::tool_use::ToolUse;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// Parts of a step's way at most.
const MOST_PARTS: f32 = 80.0;

/// See the module. All lists have a place for each tool, in the host's order.
#[derive(HeldBytes)]
pub struct ToolWays {
    /// Tools of the step being made, by the host's list: the place in it is a tool's identity from step to step.
    pub tools: Vec<Tool>,
    /// Where each tool was when the step began.
    pub before: Vec<Pose>,
    /// Where the host has put each: a broad one that thrusts may stop on its way there.
    pub(super) goals: Vec<Pose>,
    /// Which of them were put there in this step.
    pub(super) put: Vec<bool>,
    /// One of those was elsewhere before: it was put where it is without a way.
    pub has_leapt: bool,
    /// Which of them are so quick or thin that they could pass a sample between two searches: samples are searched along their whole way.
    pub(super) swept: Vec<bool>,
    /// Which of those were clear of the tissue when the step began: their contact may be lost by the iterations.
    pub(super) may_lose: Vec<bool>,
    /// For each that lay in the tissue when the step began, the shortest way out.
    pub(super) buried: Vec<Option<Buried>>,
    /// A tool lay in the tissue when the step, or a part of it, began.
    pub lay_in_tissue: bool,
    /// Where the tools came from, while they take another way.
    kept: Vec<(Pose, bool, Option<Buried>)>,
}

impl ToolWays {
    /// Without tools.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub(super) fn new() -> Result<ToolWays> {
        Ok(ToolWays {
            tools: memory::room(MAX_TOOLS, WHAT)?,
            before: memory::room(MAX_TOOLS, WHAT)?,
            goals: memory::room(MAX_TOOLS, WHAT)?,
            put: memory::room(MAX_TOOLS, WHAT)?,
            has_leapt: false,
            swept: memory::room(MAX_TOOLS, WHAT)?,
            may_lose: memory::room(MAX_TOOLS, WHAT)?,
            buried: memory::room(MAX_TOOLS, WHAT)?,
            lay_in_tissue: false,
            kept: memory::room(MAX_TOOLS, WHAT)?,
        })
    }

    /// No tools; what is said of the step so far stays.
    pub(super) fn clear(&mut self) {
        self.tools.clear();
        self.before.clear();
        self.goals.clear();
        self.put.clear();
        self.swept.clear();
        self.may_lose.clear();
        self.buried.clear();
    }

    /// Where a tool is at part `part` of its way.
    pub(super) fn pose(&self, index: usize, part: f32) -> Pose {
        pose::between(&self.before[index], &self.tools[index].pose, part)
    }

    /// The longest way of a point of a tool, mm.
    pub fn longest(&self) -> f32 {
        let ways = self.tools.iter().zip(&self.before);
        let longest = ways.map(|(tool, before)| tool.body.motion(before, &tool.pose));
        longest.fold(0.0, f32::max)
    }

    /// Whether a tool is so quick or thin that this step may lose its contact.
    pub fn may_lose(&self) -> bool {
        self.may_lose.contains(&true)
    }

    /// In how many parts the tools' ways are taken: no tool may pass a sample between two looks, and none may push it over its own
    /// edge.
    pub fn parts(&self, work: &Work) -> u32 {
        if work.is_spent() {
            return work.least_parts();
        }
        let parts = self.tools.iter().zip(&self.before).map(|(tool, from)| {
            // In a part no point of the tool goes farther than half its radius: a sample before it cannot come out behind it.
            let most = (0.5 * tool.body.radius()).clamp(0.5, 2.0);
            (tool.body.motion(from, &tool.pose) / most).ceil()
        });
        parts.fold(1.0, f32::max).min(MOST_PARTS) as u32
    }

    /// Size, speed and number of the tools that push in the step `next`, which takes `step_s`; a count of 0 where none pushes.
    pub fn used(&self, next: &Past, step_s: f32) -> ToolUse {
        let mut used = ToolUse {
            size_mm: [f32::INFINITY, 0.0],
            speed_mm_s: 0.0,
            count: 0,
        };
        let each = self.tools.iter().zip(&self.before).zip(&next.tools);
        for ((tool, from), _) in each.filter(|(_, held)| held.reading.contacts > 0) {
            let size = tool.body.size();
            used.size_mm = [used.size_mm[0].min(size), used.size_mm[1].max(size)];
            let speed = tool.body.motion(from, &tool.pose) / step_s;
            used.speed_mm_s = used.speed_mm_s.max(speed);
            used.count += 1;
        }
        used
    }

    /// Whether the contact of a broad tool was lost that goes quickly on into tissue which it pushed when the step began: it touches nothing any more, or the
    /// step `fell_back`, which beside a tool that was put elsewhere says nothing of it. `past` and `next` are the ends of the last step and of this one.
    pub fn has_passed(&self, past: &Past, next: &Past, fell_back: bool) -> bool {
        let fell_back = fell_back && !self.has_leapt;
        let pushes = |index: usize| {
            let mut forces = next.forces.iter();
            forces.any(|force| force.tool == index as u32)
        };
        let mut tools = 0..self.tools.len();
        tools.any(|index| self.thrusts(index, past) && (fell_back || !pushes(index)))
    }

    /// Whether a broad tool goes quickly on into tissue that it pushed when the step began.
    fn thrusts(&self, index: usize, past: &Past) -> bool {
        if !self.swept[index] || !self.tools[index].body.is_broad() {
            return false;
        }
        let own = |force: &&Force| force.tool == index as u32;
        let pushed: Vector = (past.forces.iter().filter(own))
            .map(|force| force.force)
            .sum();
        let way = self.goals[index].translation - self.before[index].translation;
        way.dot(pushed) > 0.0
    }

    /// Tools that thrust stop after so many of their half thicknesses.
    pub fn stop_after(&mut self, past: &Past, next: &mut Past, thicknesses: f32) {
        for index in 0..self.tools.len() {
            if self.thrusts(index, past) {
                let body = &self.tools[index].body;
                let motion = body.motion(&self.before[index], &self.goals[index]);
                let part = (thicknesses * body.size() / motion).min(0.5);
                let at = pose::between(&self.before[index], &self.goals[index], part);
                self.tools[index].pose = at;
                next.tools[index].pose = at;
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
    pub fn tell_lag(&self, next: &mut Past) {
        let tools = self.tools.iter().zip(&self.goals);
        for (held, (tool, goal)) in next.tools.iter_mut().zip(tools) {
            if held.pose != *goal {
                held.reading.penetration_mm += tool.body.motion(&held.pose, goal);
            }
        }
    }

    /// Each tool starts outside of tissue at rest: back where it came from, against its push, or where it
    /// comes out by the shortest way. Until [`ToolWays::return_to`] that is the tools' way.
    pub(super) fn come_from_outside(&mut self, surface: &mut Surface, past: &Past, rest: &[f32]) {
        self.kept.clear();
        let ways = self.before.iter().zip(&self.put).zip(&self.buried);
        self.kept
            .extend(ways.map(|((before, put), buried)| (*before, *put, *buried)));
        let state = State {
            rest,
            u: &[],
            start: &[],
        };
        for (index, tool) in self.tools.iter().enumerate() {
            let found = surface.buried(&tool.body, &tool.pose, state);
            // Out by its whole size, so that it comes back in from outside of all samples.
            let clear = tool.body.size() + OPEN_MM;
            let came = self.before[index].translation - tool.pose.translation;
            let own = past.forces.iter();
            let own = own.filter(|force| force.tool == index as u32);
            let pushed: Vector = own.map(|force| -force.force).sum();
            // A tool that is held still has come from nowhere: then the push it feels tells which side it is on.
            let came = if came.length() > OPEN_MM {
                came
            } else {
                pushed
            };
            let way = found.map_or(Vector::ZERO, |buried| {
                let back = came.try_normalize();
                let solid = Solid::of(&surface.mesh, state, &mut surface.sides);
                let back = back.and_then(|back| buried.way_along(back, solid));
                let way = back.unwrap_or(buried.out * buried.depth);
                way + way.normalize_or_zero() * clear
            });
            self.before[index] = Pose::from_parts(tool.pose.translation + way, tool.pose.rotation);
            self.put[index] = false;
            self.buried[index] = None;
        }
    }

    /// The tools' ways are again those of the step.
    pub fn return_to(&mut self) {
        for (index, (before, put, buried)) in self.kept.drain(..).enumerate() {
            self.before[index] = before;
            self.put[index] = put;
            self.buried[index] = buried;
        }
    }
}
