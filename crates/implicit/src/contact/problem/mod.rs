//! One contact problem: the samples near the tools, their gaps and slips at a state of the tissue, and the forces that leave no
//! penetration, obey Coulomb's law and hold what is grasped.
//!
//! A step solves it several times, as the tissue's state gets better; each solve goes on from the forces of the one before, since
//! the state that it is given is the tissue under those.

mod depth;
mod forces;
mod gauge;
mod loads;
mod look;
mod pace;
mod prescribed;
mod solution;
mod solve;
mod surface;
mod tie_set;
mod ways;
mod work;

use std::sync::Arc;
use std::time::Duration;

use ::contact::grasp::REACH_MM;
use ::contact::{Placed as PlacedTool, Samples};

pub use pace::bound_work;
pub use solution::Change;

use super::past::{Held, Past};
use super::rows::{MOST_ROWS, WHAT};
use super::state::State;
use super::ties::{Placed, tie_of};
use super::tool::{MAX_TOOLS, Mode, PUT_MM, Tool, ToolReading};
use crate::bundle::Mesh;
use crate::error::{Error, Result};
use crate::kernels::Isa;
use crate::memory::{self, HeldBytes};
use depth::Depths;
use forces::KeptForces;
use look::{Look, NearRows};
use prescribed::Prescribed;
use solution::Solution;
use surface::Surface;
use tie_set::TieSet;
use ways::ToolWays;
pub(crate) use work::Work;

/// A tool that goes farther in a step is quick, mm.
const QUICK_MM: f32 = 0.5;
/// Tissue no deeper than this in a tool is clear of it, mm.
const RESTING_MM: f32 = 0.9;

/// The contact of one scene.
#[derive(HeldBytes)]
pub struct ContactProblem {
    pub surface: Surface,
    pub ways: ToolWays,
    /// Ties of the step, beside the tools.
    pub tied: TieSet,
    /// At the end of the last published step.
    pub past: Past,
    /// Of the step being made.
    pub next: Past,
    pub near: NearRows,
    pub solution: Solution,
    pub kept: KeptForces,
    /// What the step may still cost.
    pub work: Work,
    prescribed: Prescribed,
}

impl ContactProblem {
    /// A scene without tools.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(samples: Arc<Samples>, mesh: Arc<Mesh>, isa: Isa) -> Result<ContactProblem> {
        Ok(ContactProblem {
            surface: Surface::new(samples, mesh, isa)?,
            ways: ToolWays::new()?,
            tied: TieSet::default(),
            past: Past::with_room(2 * MOST_ROWS)?,
            next: Past::with_room(2 * MOST_ROWS)?,
            near: NearRows::new()?,
            solution: Solution::new(MAX_TOOLS, isa)?,
            kept: KeptForces::new()?,
            work: Work::new(),
            prescribed: Prescribed::new()?,
        })
    }

    /// Back to a scene that has had no tools: forgets those of this step and what the last step left.
    pub fn reset(&mut self) {
        self.forget_tools();
        self.past.clear();
    }

    /// A step without tools and ties. What the last step left stays in `past` until this one is published, in case it is refused.
    pub fn forget_tools(&mut self) {
        self.ways.clear();
        self.tied.clear();
        self.next.clear();
    }

    /// Takes the tools and ties of a step that begins at `start`. The place of each in its list is its identity from step to step.
    ///
    /// # Errors
    /// [`Error::Argument`] for friction, tear-off force or number, [`Error::OutOfMemory`]; the past stays.
    pub fn begin(
        &mut self,
        tools: &[Tool],
        ties: &[Placed],
        rest: &[f32],
        start: &[f32],
    ) -> Result<()> {
        self.solution.spent = Duration::ZERO;
        self.solution.unsolved_mm = 0.0;
        self.ways.lay_in_tissue = false;
        // Budgets come after it: how much a step may cost depends on whether a tool may lose its contact.
        self.enter(tools, ties, rest, start)?;
        let nodes = start.len() / 3;
        self.work = Work::of(nodes, self.ways.may_lose(), self.tied.work());
        Ok(())
    }

    /// Begins a frame after the last step, whose ties go on.
    ///
    /// # Errors
    /// As [`ContactProblem::begin`].
    pub fn begin_frame(&mut self, tools: &[Tool], rest: &[f32], start: &[f32]) -> Result<()> {
        // Out of the problem while it takes them; the list and its room come back whatever that gives.
        let mut ties = std::mem::take(&mut self.tied.given);
        ties.clear();
        let begun = memory::fit(&mut ties, self.past.ties.len(), WHAT).and_then(|()| {
            ties.extend(self.past.ties.iter().map(|held| held.placed));
            self.begin(tools, &ties, rest, start)
        });
        self.tied.given = ties;
        begun
    }

    /// Takes the tools and ties of a substep that begins at `start`. The step's budgets of time and work go on.
    ///
    /// # Errors
    /// As [`ContactProblem::begin`].
    pub fn enter(
        &mut self,
        tools: &[Tool],
        ties: &[Placed],
        rest: &[f32],
        start: &[f32],
    ) -> Result<()> {
        if tools.len() > MAX_TOOLS {
            return Err(Error::Argument(format!(
                "{} instruments; at most {MAX_TOOLS} are allowed at once",
                tools.len()
            )));
        }
        (tools.iter().enumerate()).try_for_each(|(index, tool)| tool.check(index))?;
        let ContactProblem {
            surface,
            ways,
            tied,
            past,
            next,
            near,
            ..
        } = self;
        // From here on `next` has the forces, grasps and ties of the last published step, and a step that fails leaves `past` as it was.
        next.take(past)?;
        // Rows are of the samples of their step.
        near.rows.clear();
        // Ties are told from those of the last step by what they join: a tie that goes on stays broken if it broke.
        tied.take(ties, next)?;
        next.tools.truncate(tools.len());
        memory::fit(&mut next.tools, tools.len(), WHAT)?;
        ways.clear();
        ways.tools.extend_from_slice(tools);
        let state = State {
            rest,
            u: start,
            start,
        };
        // Where the host wants them; a tool that thrusts through may be stopped on its way there.
        ways.goals.extend(tools.iter().map(|tool| tool.pose));
        ways.has_leapt = false;
        for (index, tool) in tools.iter().enumerate() {
            // A tool is known by its place in the list, in each step the same.
            let known = past.tools.get(index).map(|held| held.pose);
            // Farther than that no hand goes in a step: it is another place, and there was no way there.
            let moved = known.filter(|from| tool.body.motion(from, &tool.pose) <= PUT_MM);
            let from = moved.unwrap_or(tool.pose);
            ways.before.push(from);
            ways.put.push(moved.is_none());
            ways.has_leapt |= known.is_some() && moved.is_none();
            ways.buried.push(surface.buried(&tool.body, &from, state));
            let is_quick = tool.body.motion(&from, &tool.pose) > QUICK_MM;
            let is_broad = tool.body.is_broad();
            // A broad tool that moves slowly is looked for at its place alone: its samples cannot get behind it.
            ways.swept.push(!is_broad || (is_quick && moved.is_some()));
            ways.may_lose.push(false);
            if next.tools.len() <= index {
                next.tools.push(Held::default());
            }
            let held = &mut next.tools[index];
            held.pose = tool.pose;
            held.reading = ToolReading::default();
            // What is put elsewhere takes nothing along.
            if known.is_some() && moved.is_none() && !held.grasp.anchors().is_empty() {
                held.grasp.open();
                held.reading.torn = true;
            }
            // What is between the jaws when they close stays in them until they open.
            let closes = tool.mode == Mode::Grasp;
            if closes && !held.closed {
                let position = |node| state.position(node);
                let closed =
                    (held.grasp).close(&surface.samples, &tool.body, &from, REACH_MM, position);
                memory::tried(closed, WHAT)?;
            } else if !closes {
                held.grasp.open();
            }
            held.closed = closes;
        }
        for (index, tool) in tools.iter().enumerate() {
            // Samples inside of a thick tool come out of it as they are.
            let is_broad = tool.body.is_broad();
            let placed = PlacedTool {
                body: &tool.body,
                pose: self.ways.before[index],
                skin: 0.0,
            };
            if is_broad && self.surface.is_in(placed, state) {
                self.ways.buried[index] = None;
            }
            self.ways.lay_in_tissue |= self.ways.buried[index].is_some();
            self.ways.may_lose[index] = self.ways.swept[index]
                && (!is_broad || self.depths().depth(index, state, 0.0) <= RESTING_MM);
        }
        Ok(())
    }

    /// Whether a tool is near enough to touch the tissue in this step, or pushed it in the last, or there are ties.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn is_near(&mut self, state: State<'_>) -> Result<bool> {
        if self.next.has_forces() || self.next.has_grasp() || self.tied.has_any() {
            return Ok(true);
        }
        let look = Look {
            part: 1.0,
            wide: true,
            most: MOST_ROWS,
        };
        let held = (&self.tied, &self.next);
        (self.near).look(&mut self.surface, &mut self.ways, held, state, look)?;
        Ok(!self.near.rows.is_empty())
    }

    /// Back to the forces at the start of the step, those of the last published one. Readings and grasps stay.
    pub fn restart(&mut self) {
        self.next.forces.clear();
        self.next.forces.extend_from_slice(&self.past.forces);
    }

    /// As [`ContactProblem::restart`], without the forces of tools that are no longer in the list: the step keeps the last state.
    pub fn stay(&mut self) {
        self.restart();
        let (count, ties) = (self.ways.tools.len(), self.tied.list.len());
        self.next.forces.retain(|force| match tie_of(force.sample) {
            Some(index) => index < ties,
            None => (force.tool as usize) < count,
        });
    }

    /// The tissue starts from rest and without forces, and each tool outside of it, until the ways `return_to` those of the step.
    pub fn start_from_rest(&mut self, rest: &[f32]) {
        self.next.forces.clear();
        let (surface, past) = (&mut self.surface, &self.past);
        self.ways.come_from_outside(surface, past, rest);
    }

    /// Measures how deep tools and tissue lie in each other.
    pub fn depths(&mut self) -> Depths<'_> {
        Depths {
            surface: &mut self.surface,
            ways: &self.ways,
            tied: &self.tied,
            next: &self.next,
        }
    }

    /// Whether the tissue lies inside of a tool deeper than `depth_mm` anywhere on the tools' ways.
    pub fn is_penetrated(&mut self, state: State<'_>, depth_mm: f32) -> bool {
        let parts = self.ways.parts(&self.work);
        let mut depths = self.depths();
        (0..depths.ways.tools.len()).any(|index| {
            let mut ways = (1..=parts).rev().map(|part| part as f32 / parts as f32);
            ways.any(|way| depths.deepest(index, state, way) > depth_mm)
        })
    }

    /// The step being made becomes the last.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.past, &mut self.next);
    }
}
