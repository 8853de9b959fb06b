//! One contact problem: the samples near the tools, their gaps and slips at a state of the tissue, and the forces that leave no
//! penetration, obey Coulomb's law and hold what is grasped.
//!
//! A step solves it several times, as the tissue's state gets better; each solve goes on from the forces of the one before, since
//! the state that it is given is the tissue under those.

mod loads;
mod look;
mod solve;

use std::sync::Arc;
use std::time::Duration;

use ::contact::grasp::REACH_MM;
use ::contact::{Contact, Pose, Sample, Samples, Search, Sweeps, Vector};

pub use solve::Change;

use super::compliance::Delassus;
use super::held_back::HeldBack;
use super::past::{Force, Held, Past};
use super::rows::{Row, State};
use super::tool::{MAX_TOOLS, Mode, Reading, Tool};
use crate::error::{Error, Result};
use crate::memory;
use look::MOST_ROWS;

/// A tool that moves farther in a step was put there, not moved, mm.
const PUT_MM: f32 = 40.0;
const WHAT: &str = "the contact of instruments";
/// Parts of a step's way at most.
const MOST_PARTS: f32 = 16.0;

/// The contact of one scene.
pub struct Problem {
    samples: Arc<Samples>,
    tools: Vec<Tool>,
    /// Where each tool was when the step began.
    before: Vec<Pose>,
    /// Which of them were put there in this step.
    put: Vec<bool>,
    /// At the end of the last published step.
    pub past: Past,
    /// Of the step being made.
    pub next: Past,
    search: Search,
    sweeps: Sweeps,
    delassus: Delassus,
    held_back: HeldBack,
    rows: Vec<Row>,
    contacts: Vec<Contact>,
    forces: Vec<Vector>,
    /// Forces before the last solve, to go part of the way.
    kept: Vec<Force>,
    /// What the solves of this step took.
    spent: Duration,
    columns: Vec<u32>,
    change: Vec<f32>,
    nodes: Vec<u32>,
    vectors: Vec<f32>,
}

impl Problem {
    /// A scene without tools.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(samples: Arc<Samples>) -> Result<Problem> {
        let mut sweeps = Sweeps::default();
        memory::tried(sweeps.reserve(MOST_ROWS), WHAT)?;
        // Those of a solve and of the one before it, each with the nodes of its sample and their three axes.
        let (room, nodes, dofs) = (2 * MOST_ROWS, 6 * MOST_ROWS, 18 * MOST_ROWS);
        Ok(Problem {
            tools: memory::room(MAX_TOOLS, WHAT)?,
            before: memory::room(MAX_TOOLS, WHAT)?,
            put: memory::room(MAX_TOOLS, WHAT)?,
            past: Past::with_room(room)?,
            next: Past::with_room(room)?,
            search: memory::tried(Search::with_room(&samples), WHAT)?,
            sweeps,
            delassus: Delassus::default(),
            held_back: HeldBack::default(),
            rows: memory::room(room, WHAT)?,
            contacts: memory::room(room, WHAT)?,
            forces: memory::room(room, WHAT)?,
            kept: memory::room(room, WHAT)?,
            spent: Duration::ZERO,
            columns: memory::room(dofs, WHAT)?,
            change: memory::room(dofs, WHAT)?,
            nodes: memory::room(nodes, WHAT)?,
            vectors: memory::room(3 * nodes, WHAT)?,
            samples,
        })
    }

    /// No tool has ever been.
    pub fn reset(&mut self) {
        self.leave();
        self.past.clear();
    }

    /// A step without tools: they are forgotten once it is published.
    pub fn leave(&mut self) {
        self.tools.clear();
        self.before.clear();
        self.put.clear();
        self.next.clear();
    }

    /// Wall time of the step's solves, ms.
    pub fn spent_ms(&self) -> f64 {
        1e3 * self.spent.as_secs_f64()
    }

    /// Takes other responses, and gives its own: they hold what steps of one length leave of the compliance.
    pub(crate) fn exchange(&mut self, responses: &mut Delassus) {
        std::mem::swap(&mut self.delassus, responses);
    }

    /// The tools of this step.
    pub fn tools(&self) -> &[Tool] {
        &self.tools
    }

    /// Where each of them was when the step began.
    pub fn before(&self) -> &[Pose] {
        &self.before
    }

    /// Takes the tools of a step that begins at `start`. A tool's place in the list is its identity from step to step.
    ///
    /// # Errors
    /// [`Error::Argument`] for friction, tear-off force or number, [`Error::OutOfMemory`]; the past stays.
    pub fn begin(&mut self, tools: &[Tool], rest: &[f32], start: &[f32]) -> Result<()> {
        self.spent = Duration::ZERO;
        self.enter(tools, rest, start)
    }

    /// The same in the middle of a step.
    ///
    /// # Errors
    /// As [`Problem::begin`].
    pub fn enter(&mut self, tools: &[Tool], rest: &[f32], start: &[f32]) -> Result<()> {
        if tools.len() > MAX_TOOLS {
            return Err(Error::Argument(format!(
                "{} instruments; at most {MAX_TOOLS} are allowed at once",
                tools.len()
            )));
        }
        for (index, tool) in tools.iter().enumerate() {
            tool.check(index)?;
        }
        self.tools.clear();
        self.tools.extend_from_slice(tools);
        self.next.take(&self.past)?;
        self.next.tools.truncate(tools.len());
        memory::fit(&mut self.next.tools, tools.len(), WHAT)?;
        let state = State {
            rest,
            u: start,
            start,
        };
        self.before.clear();
        self.put.clear();
        for (index, tool) in tools.iter().enumerate() {
            let known = self.past.tools.get(index).map(|held| held.pose);
            let moved = known.filter(|from| tool.body.motion(from, &tool.pose) <= PUT_MM);
            let from = moved.unwrap_or(tool.pose);
            self.before.push(from);
            self.put.push(moved.is_none());
            if self.next.tools.len() <= index {
                self.next.tools.push(Held::default());
            }
            let held = &mut self.next.tools[index];
            held.pose = tool.pose;
            held.reading = Reading::default();
            let closes = tool.mode == Mode::Grasp;
            if closes && !held.closed {
                let position = |node| state.position(node);
                let closed =
                    (held.grasp).close(&self.samples, &tool.body, &from, REACH_MM, position);
                memory::tried(closed, WHAT)?;
            } else if !closes {
                held.grasp.open();
            }
            held.closed = closes;
        }
        Ok(())
    }

    /// Whether a tool is near enough to touch the tissue in this step, or pushed it in the last.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn is_near(&mut self, state: State<'_>) -> Result<bool> {
        if !self.next.forces.is_empty() || self.holds() {
            return Ok(true);
        }
        self.look(state, 1.0, true)?;
        Ok(!self.rows.is_empty())
    }

    /// Whether forces were at work at the end of the last step.
    pub fn pushed(&self) -> bool {
        !self.past.forces.is_empty()
    }

    /// Whether forces are at work in the step being made.
    pub fn pushes(&self) -> bool {
        !self.next.forces.is_empty()
    }

    /// Whether the tissue lies inside of a tool deeper than `depth_mm`, tools at their ends.
    pub fn intrudes(&mut self, state: State<'_>, depth_mm: f32) -> bool {
        (0..self.tools.len()).any(|index| self.deepest(index, state) > depth_mm)
    }

    /// Whether a grasper holds a sample.
    pub fn holds(&self) -> bool {
        let holds = |held: &Held| !held.grasp.anchors().is_empty();
        self.next.tools.iter().any(holds)
    }

    /// In how many parts the tools' ways are taken: no tool may pass a sample between two looks, and none may push it over its own
    /// edge.
    pub fn parts(&self) -> u32 {
        let parts = self.tools.iter().zip(&self.before).map(|(tool, from)| {
            let most = (0.5 * tool.body.radius()).clamp(0.5, 2.0);
            (tool.body.motion(from, &tool.pose) / most).ceil()
        });
        parts.fold(1.0, f32::max).min(MOST_PARTS) as u32
    }

    /// Back to the forces at the start of the step.
    pub fn restart(&mut self) {
        self.next.forces.clear();
        self.next.forces.extend_from_slice(&self.past.forces);
    }

    /// Back to the forces at the start of the step, without those of tools that are gone.
    pub fn stay(&mut self) {
        self.restart();
        let count = self.tools.len();
        let there = |force: &Force| (force.tool as usize) < count;
        self.next.forces.retain(there);
    }

    /// Gives up all forces: the tissue starts from rest.
    pub fn let_go(&mut self) {
        self.next.forces.clear();
    }

    /// Nodes of the surface that tools may touch, all that a solve asks of a state of the tissue.
    pub fn nodes(&self) -> &[u32] {
        self.samples.nodes()
    }

    /// The sample of a force.
    pub fn sample(&self, row: u32) -> Sample {
        self.samples.rows()[row as usize]
    }

    /// The step being made becomes the last.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.past, &mut self.next);
    }

    /// Bytes held; the samples are the model's.
    pub fn memory_bytes(&self) -> usize {
        size_of::<Row>() * self.rows.capacity()
            + size_of::<Contact>() * self.contacts.capacity()
            + size_of::<Vector>() * self.forces.capacity()
            + size_of::<Force>() * self.kept.capacity()
            + 4 * (self.columns.capacity() + self.change.capacity())
            + 4 * (self.nodes.capacity() + self.vectors.capacity())
            + self.past.memory_bytes()
            + self.next.memory_bytes()
            + self.search.memory_bytes()
            + self.sweeps.memory_bytes()
            + self.delassus.memory_bytes()
            + self.held_back.memory_bytes()
    }
}
