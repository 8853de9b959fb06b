//! What rows are measured by: the tools on their ways, the ties, and what both hold.

use ::contact::{LEAN, Samples, Vector};

use super::tie_set::TieSet;
use super::ways::ToolWays;
use crate::contact::past::{Force, Past};
use crate::contact::rows::{Moving, OPEN_MM, Row};
use crate::contact::state::State;
use crate::contact::ties::Points;

/// Lent by a problem for a look or a solve, while its rows and forces change.
#[derive(Clone, Copy)]
pub struct Gauge<'a> {
    pub samples: &'a Samples,
    pub ways: &'a ToolWays,
    pub tied: &'a TieSet,
    /// The end of the step being made.
    pub next: &'a Past,
}

impl<'a> Gauge<'a> {
    /// Nodes and weights of all rows.
    pub fn points(&self) -> Points<'a> {
        self.tied.points(self.samples)
    }

    /// The tools at part `part` of their way.
    pub fn moving(&self, state: State<'a>, part: f32) -> Moving<'a> {
        let (ways, next) = (self.ways, self.next);
        Moving {
            tools: &ways.tools,
            before: &ways.before,
            put: &ways.put,
            swept: &ways.swept,
            buried: &ways.buried,
            held: &next.tools,
            samples: self.samples,
            state,
            part,
            pulling: self.tied.pulling(ways, next),
        }
    }

    /// The row of a sample under a force of a tool, unmeasured.
    pub fn row(&self, tool: u32, sample: u32, force: Vector, state: State<'_>) -> Row {
        let nodes = self.samples.at(sample);
        Row {
            tool,
            sample,
            force,
            far: false,
            // `Moving::contact` measures it, with the part of the way that is asked for.
            gap: 0.0,
            point: nodes.gather(|node| state.position(node)),
            outward: (self.samples).outward(sample, |node| state.position(node)),
            is_wall: self.samples.is_on_wall(sample),
        }
    }

    /// Whether forces of a tool are at its surface, each on tissue that faces the tool there, and none where the tissue has left it.
    pub fn pushes_from_outside(&self, index: usize, state: State<'_>, part: f32) -> bool {
        let own = |force: &&Force| force.tool == index as u32;
        let mut forces = self.next.forces.iter().filter(own).peekable();
        let moving = self.moving(state, part);
        let is_outside = |force: &Force| {
            let row = self.row(force.tool, force.sample, force.force, state);
            let contact = moving.contact(&row, part);
            contact.gap < OPEN_MM && contact.normal.dot(row.outward) <= LEAN
        };
        // A tool without forces pushes from nowhere.
        forces.peek().is_some() && forces.all(is_outside)
    }
}
