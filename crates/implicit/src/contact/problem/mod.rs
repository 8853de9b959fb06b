//! One contact problem: the samples near the tools, their gaps and slips at a state of the tissue, and the forces that leave no
//! penetration, obey Coulomb's law and hold what is grasped.
//!
//! A step solves it several times, as the tissue's state gets better; each solve goes on from the forces of the one before, since
//! the state that it is given is the tissue under those.

mod depth;
mod forces;
mod loads;
mod look;
mod parts;
mod solve;
mod thrust;
mod tie_set;
mod tied;
mod work;

use std::sync::Arc;
use std::time::Duration;

use ::contact::grasp::REACH_MM;
use ::contact::{Contact, Pose, Sample, Samples, Search, Sweeps, Vector};

pub use solve::Change;
use tie_set::TieSet;

use super::buried::{Buried, Sides};
use super::delassus::Delassus;
use super::inertial_compliance::InertialCompliance;
use super::past::{Force, Held, Past};
use super::rows::Row;
use super::state::State;
use super::ties::{NO_TOOL, Placed};
use super::tool::{MAX_TOOLS, Mode, PUT_MM, Tool, ToolReading};
use crate::bundle::Mesh;
use crate::error::{Error, Result};
use crate::memory::{self, HeldBytes};
use look::MOST_ROWS;
use work::Work;

const WHAT: &str = "the contact of instruments";
/// A tool that goes farther in a step is quick, mm.
const QUICK_MM: f32 = 0.5;
/// Tissue no deeper than this in a tool is clear of it, mm.
const RESTING_MM: f32 = 0.9;
/// Tissue that is farther from a tool is not pushed by it, mm.
const OPEN_MM: f32 = 0.5;

/// The contact of one scene.
#[derive(HeldBytes)]
pub struct ContactProblem {
    #[held(skip)]
    samples: Arc<Samples>,
    #[held(skip)]
    mesh: Arc<Mesh>,
    /// Tools of the step being made, by the host's list: the place in it is a tool's identity from step to step.
    tools: Vec<Tool>,
    /// Where each tool was when the step began.
    before: Vec<Pose>,
    /// Where the host has put each: a broad one that thrusts may stop on its way there.
    goals: Vec<Pose>,
    /// Which of them were put there in this step.
    put: Vec<bool>,
    /// One of those was elsewhere before.
    has_leapt: bool,
    /// Which of them are so quick or thin that they could pass a sample between two searches: samples are searched along their whole way.
    swept: Vec<bool>,
    /// Which of those were clear of the tissue when the step began: their contact may be lost by the iterations.
    may_lose: Vec<bool>,
    /// How far a linearisation of each tool's gap may move a sample, mm: beyond that the tangent no longer describes the surface.
    trusted: Vec<f32>,
    /// For each that lay in the tissue when the step began, the shortest way out.
    buried: Vec<Option<Buried>>,
    /// Room for rays through the surface.
    sides: Sides,
    /// Ties of the step, beside the tools.
    tied: TieSet,
    /// At the end of the last published step.
    pub past: Past,
    /// Of the step being made.
    pub next: Past,
    /// Finds the samples near a tool, with room for what a look finds.
    search: Search,
    sweeps: Sweeps,
    /// How the rows move under their forces: tissue at rest, at the step's length.
    delassus: Delassus,
    /// The same of deformed tissue.
    tangent: Delassus,
    /// What a moment between steps has of inertia, another in each frame.
    inertial_compliance: InertialCompliance,
    /// What the last look found, ascending by tool and sample, then the ties; `contacts` and `forces` are in their order.
    rows: Vec<Row>,
    /// Rows that a solve had no room for: their forces go.
    shed: Vec<Row>,
    /// Samples that the last look found.
    found: usize,
    contacts: Vec<Contact>,
    forces: Vec<Vector>,
    /// The same before a linearisation.
    earlier: Vec<Vector>,
    /// Forces before the last solve, to go part of the way.
    kept: Vec<Force>,
    /// Those of a step's first guess.
    guessed: Vec<Force>,
    /// Those of a state without inverted elements, while a step that has lost its contact looks for a better one.
    sound: Vec<Force>,
    /// Where the tools came from, while they take another way.
    ways: Vec<(Pose, bool, Option<Buried>)>,
    /// What the step may still cost.
    pub work: Work,
    /// What its solves took, and what the last of them left unsolved, mm.
    spent: Duration,
    unsolved_mm: f32,
    /// A tool lay in the tissue when the step, or a part of it, began.
    pub lay_in_tissue: bool,
    /// What the last solve changed, by degrees of freedom of the prior: see [`Change`].
    columns: Vec<u32>,
    change: Vec<f32>,
    /// The contact as a collision field, for scenes without corrections.
    nodes: Vec<u32>,
    vectors: Vec<f32>,
}

impl ContactProblem {
    /// A scene without tools.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(samples: Arc<Samples>, mesh: Arc<Mesh>) -> Result<ContactProblem> {
        let mut sweeps = Sweeps::default();
        memory::tried(sweeps.reserve(MOST_ROWS), WHAT)?;
        // Those of a solve and of the one before it, each with the nodes of its sample and their three axes.
        let (room, nodes, dofs) = (2 * MOST_ROWS, 6 * MOST_ROWS, 18 * MOST_ROWS);
        Ok(ContactProblem {
            tools: memory::room(MAX_TOOLS, WHAT)?,
            before: memory::room(MAX_TOOLS, WHAT)?,
            goals: memory::room(MAX_TOOLS, WHAT)?,
            put: memory::room(MAX_TOOLS, WHAT)?,
            has_leapt: false,
            swept: memory::room(MAX_TOOLS, WHAT)?,
            may_lose: memory::room(MAX_TOOLS, WHAT)?,
            trusted: memory::room(MAX_TOOLS, WHAT)?,
            buried: memory::room(MAX_TOOLS, WHAT)?,
            sides: Sides::new(mesh.node_count())?,
            tied: TieSet::default(),
            past: Past::with_room(room)?,
            next: Past::with_room(room)?,
            search: memory::tried(Search::with_room(&samples), WHAT)?,
            sweeps,
            delassus: Delassus::default(),
            tangent: Delassus::default(),
            inertial_compliance: InertialCompliance::default(),
            rows: memory::room(room, WHAT)?,
            shed: memory::room(room, WHAT)?,
            found: 0,
            contacts: memory::room(room, WHAT)?,
            forces: memory::room(room, WHAT)?,
            earlier: memory::room(room, WHAT)?,
            kept: memory::room(room, WHAT)?,
            guessed: memory::room(room, WHAT)?,
            sound: memory::room(room, WHAT)?,
            ways: memory::room(MAX_TOOLS, WHAT)?,
            spent: Duration::ZERO,
            work: Work::new(),
            unsolved_mm: 0.0,
            lay_in_tissue: false,
            columns: memory::room(dofs, WHAT)?,
            change: memory::room(dofs, WHAT)?,
            nodes: memory::room(nodes, WHAT)?,
            vectors: memory::room(3 * nodes, WHAT)?,
            samples,
            mesh,
        })
    }

    /// Back to a scene that has had no tools: forgets those of this step and what the last step left.
    pub fn reset(&mut self) {
        self.forget_tools();
        self.past.clear();
    }

    /// A step without tools and ties. What the last step left stays in `past` until this one is published, in case it is refused.
    pub fn forget_tools(&mut self) {
        self.tools.clear();
        self.before.clear();
        self.goals.clear();
        self.put.clear();
        self.swept.clear();
        self.may_lose.clear();
        self.buried.clear();
        self.tied.clear();
        self.next.clear();
    }

    /// Wall time of the step's solves, ms.
    pub fn spent_ms(&self) -> f64 {
        1e3 * self.spent.as_secs_f64()
    }

    /// Exchanges the responses of the contact for those of another length of step, on which they depend.
    pub fn exchange(&mut self, responses: &mut Delassus) {
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
        self.spent = Duration::ZERO;
        self.unsolved_mm = 0.0;
        self.lay_in_tissue = false;
        // Budgets come after it: how much a step may cost depends on whether a tool may lose its contact.
        self.enter(tools, ties, rest, start)?;
        self.work = Work::of(self.may_lose(), self.tied.work());
        Ok(())
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
        self.tools.clear();
        self.tools.extend_from_slice(tools);
        // From here on `next` has the forces, grasps and ties of the last published step, and a step that fails leaves `past` as it was.
        self.next.take(&self.past)?;
        self.tie(ties)?;
        self.next.tools.truncate(tools.len());
        memory::fit(&mut self.next.tools, tools.len(), WHAT)?;
        let state = State {
            rest,
            u: start,
            start,
        };
        self.before.clear();
        self.goals.clear();
        self.goals.extend(tools.iter().map(|tool| tool.pose));
        self.put.clear();
        self.has_leapt = false;
        self.swept.clear();
        self.may_lose.clear();
        self.buried.clear();
        for (index, tool) in tools.iter().enumerate() {
            let known = self.past.tools.get(index).map(|held| held.pose);
            // Farther than that no hand goes in a step: it is another place, and there was no way there.
            let moved = known.filter(|from| tool.body.motion(from, &tool.pose) <= PUT_MM);
            let from = moved.unwrap_or(tool.pose);
            self.before.push(from);
            self.put.push(moved.is_none());
            self.has_leapt |= known.is_some() && moved.is_none();
            let (samples, mesh, sides) = (&self.samples, &self.mesh, &mut self.sides);
            let buried = Buried::find(&tool.body, &from, samples, mesh, state, sides);
            self.buried.push(buried);
            let is_quick = tool.body.motion(&from, &tool.pose) > QUICK_MM;
            let is_broad = tool.body.is_broad();
            self.swept.push(!is_broad || (is_quick && moved.is_some()));
            self.may_lose.push(false);
            if self.next.tools.len() <= index {
                self.next.tools.push(Held::default());
            }
            let held = &mut self.next.tools[index];
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
                    (held.grasp).close(&self.samples, &tool.body, &from, REACH_MM, position);
                memory::tried(closed, WHAT)?;
            } else if !closes {
                held.grasp.open();
            }
            held.closed = closes;
        }
        for index in 0..tools.len() {
            // Samples inside of a thick tool come out of it as they are.
            let is_broad = self.tools[index].body.is_broad();
            if is_broad && self.reaches(index, state) {
                self.buried[index] = None;
            }
            self.lay_in_tissue |= self.buried[index].is_some();
            self.may_lose[index] =
                self.swept[index] && (!is_broad || self.depth(index, state, 0.0) <= RESTING_MM);
        }
        Ok(())
    }

    /// Whether a tool is near enough to touch the tissue in this step, or pushed it in the last, or there are ties.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn is_near(&mut self, state: State<'_>) -> Result<bool> {
        if !self.next.forces.is_empty() || self.has_grasp() || self.has_ties() {
            return Ok(true);
        }
        self.look(state, 1.0, true, MOST_ROWS)?;
        Ok(!self.rows.is_empty())
    }

    /// Whether a tool is so quick or thin that this step may lose its contact.
    pub fn may_lose(&self) -> bool {
        self.may_lose.contains(&true)
    }

    /// Whether a tool that was elsewhere was put where it is in this step, without a way.
    pub fn has_leapt(&self) -> bool {
        self.has_leapt
    }

    /// Whether forces were at work at the end of the last step.
    pub fn had_forces(&self) -> bool {
        !self.past.forces.is_empty()
    }

    /// Whether forces are at work in the step being made.
    pub fn has_forces(&self) -> bool {
        !self.next.forces.is_empty()
    }

    /// Whether tools pushed at the end of the last step.
    pub fn tools_pushed(&self) -> bool {
        self.past.forces.iter().any(|force| force.tool != NO_TOOL)
    }

    /// Whether tools push in the step being made.
    pub fn tools_push(&self) -> bool {
        self.next.forces.iter().any(|force| force.tool != NO_TOOL)
    }

    /// Whether a grasper holds a sample.
    pub fn has_grasp(&self) -> bool {
        let holds = |held: &Held| !held.grasp.anchors().is_empty();
        self.next.tools.iter().any(holds)
    }

    /// Nodes of the surface that tools may touch, all that a solve asks of a state of the tissue.
    pub fn nodes(&self) -> &[u32] {
        self.samples.nodes()
    }

    /// The sample of a force.
    pub fn sample(&self, row: u32) -> Sample {
        self.samples.at(row)
    }

    /// The step being made becomes the last.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.past, &mut self.next);
    }
}
