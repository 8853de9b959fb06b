//! The ties of the step that a problem makes: which go on from the last step, what pulls on the tissue, and what breaks.

use ::contact::{Samples, Vector};

use super::ways::ToolWays;
use crate::contact::past::{Force, Past};
use crate::contact::rows::Row;
use crate::contact::rows::WHAT;
use crate::contact::state::State;
use crate::contact::ties::{HeldTie, NO_TOOL, Placed, Points, Pulling, row_of, tie_of};
use crate::contact::tool::{PUT_MM, TieReading};
use crate::error::Result;
use crate::memory::{self, HeldBytes};

/// What solves of a step may take for each pair of ties, in multiplications: some sweeps in each of a dozen solves.
const PAIR_WORK: u64 = 4000;
/// With the tie that is pulled hardest for its strength break those that are pulled by this part of that.
const TOGETHER: f32 = 0.9;

/// The ties of the step being made.
#[derive(Default, HeldBytes)]
pub struct TieSet {
    pub list: Vec<Placed>,
    /// Where their far ends were when it began.
    pub from: Vec<Vector>,
    /// Another number for ties of other nodes.
    pub(super) generation: u64,
    /// How long the step is, s: what damps ties is told by it.
    pub step_s: f32,
    /// Those of the last step, while a frame begins.
    pub(super) given: Vec<Placed>,
    /// One broke when the last state was looked at.
    pub broke: bool,
}

impl TieSet {
    /// No ties.
    pub(super) fn clear(&mut self) {
        self.list.clear();
        self.from.clear();
    }

    /// Whether there are ties in this step.
    pub fn has_any(&self) -> bool {
        !self.list.is_empty()
    }

    /// Work that the solves of a step may take beyond that of tools.
    pub(super) fn work(&self) -> u64 {
        PAIR_WORK * (self.list.len() * self.list.len()) as u64
    }

    /// Takes the ties of a step; `next` is the last one's state.
    pub(super) fn take(&mut self, ties: &[Placed], next: &mut Past) -> Result<()> {
        let is_other = ties.len() != self.list.len()
            || !(ties.iter().zip(&self.list)).all(|(a, b)| a.has_nodes_of(b));
        // Rows of ties are known by number: what was computed for another list must not be taken for this one's.
        if is_other {
            self.generation += 1;
        }
        let held = &mut next.ties;
        memory::fit(held, ties.len(), WHAT)?;
        memory::replace(&mut self.list, ties, WHAT)?;
        memory::fit(&mut self.from, ties.len(), WHAT)?;
        self.from.clear();
        held.truncate(ties.len());
        for (index, placed) in ties.iter().enumerate() {
            let known = (held.get(index)).filter(|known| known.placed.goes_on_as(placed));
            let from = known.map(|known| known.placed.place);
            // A far end that leaps has no way, as a tool that is put elsewhere has none.
            let near = from.filter(|from| from.distance(placed.place) <= PUT_MM);
            self.from.push(near.unwrap_or(placed.place));
            let now = HeldTie {
                placed: *placed,
                broken: known.is_some_and(|known| known.broken),
                reading: TieReading::default(),
            };
            match held.get_mut(index) {
                Some(place) => *place = now,
                None => held.push(now),
            }
        }
        let count = ties.len();
        let there = |row: u32| tie_of(row).is_none_or(|index| index < count);
        next.forces.retain(|force| there(force.sample));
        self.broke = false;
        Ok(())
    }

    /// Nodes and weights of all rows, those of samples and those of ties.
    pub fn points<'a>(&'a self, samples: &'a Samples) -> Points<'a> {
        Points {
            samples,
            ties: &self.list,
            generation: self.generation,
        }
    }

    /// What the law of a tie is asked with: where its far end is at a part of the step depends on the tools and on what is broken.
    pub(super) fn pulling<'a>(&'a self, ways: &'a ToolWays, next: &'a Past) -> Pulling<'a> {
        Pulling {
            ties: &self.list,
            held: &next.ties,
            from: &self.from,
            tools: &ways.tools,
            before: &ways.before,
            step_s: self.step_s,
        }
    }

    /// Adds the free nodes of the ties that pull to `nodes`.
    pub(super) fn add_nodes(
        &self,
        (ways, next): (&ToolWays, &Past),
        held: &[bool],
        nodes: &mut Vec<u32>,
    ) {
        let pulling = self.pulling(ways, next);
        for (index, placed) in self.list.iter().enumerate() {
            if pulling.is_whole(index) {
                let own = placed.row().into_entries().map(|entry| entry.0);
                nodes.extend(own.filter(|node| !held[*node as usize]));
            }
        }
    }

    /// Sums up what each tie does at `state`, the end of the step; with `breaks` those break that are pulled too hard, the hardest first: others
    /// may hold once they have.
    pub(super) fn finish(
        &mut self,
        ways: &ToolWays,
        next: &mut Past,
        state: State<'_>,
        breaks: bool,
    ) {
        // From a tie's far end to its point; none where its tool is gone.
        let way = |next: &Past, index: usize| {
            let point = self.list[index].row().gather(|node| state.position(node));
            let end = self.pulling(ways, next).end(index, 1.0);
            end.map(|end| point - end)
        };
        let mut broke = false;
        let mut hardest = 0.0f32;
        for index in 0..self.list.len() {
            let way = way(next, index);
            let force = Force::of_tie(&next.forces, index);
            let held = &mut next.ties[index];
            held.reading = TieReading {
                force: force.to_array(),
                length_mm: way.unwrap_or_default().length(),
                broken: held.broken,
                broke: held.reading.broke,
            };
            hardest = hardest.max(strain(held, way));
        }
        // The step is made again without those that break here, so that the others can take on what these bore.
        if breaks && hardest > 1.0 {
            for index in 0..self.list.len() {
                let way = way(next, index);
                let held = &mut next.ties[index];
                if strain(held, way) > (TOGETHER * hardest).max(1.0) {
                    held.broken = true;
                    held.reading.broken = true;
                    held.reading.broke = true;
                    broke = true;
                }
            }
        }
        self.broke = broke;
    }

    /// What ties do to a tool: a force, and a torque about its position.
    pub(super) fn pull_on(&self, tool: u32, ways: &ToolWays, next: &Past) -> (Vector, Vector) {
        let (mut force, mut torque) = (Vector::ZERO, Vector::ZERO);
        for (index, placed) in self.list.iter().enumerate() {
            let is_own =
                matches!(placed.tie.end, ::contact::End::Tool { tool: own, .. } if own == tool);
            if is_own && let Some(end) = self.pulling(ways, next).end(index, 1.0) {
                let own = -Force::of_tie(&next.forces, index);
                let arm = end - ways.tools[tool as usize].pose.translation;
                force += own;
                torque += arm.cross(own);
            }
        }
        (force, torque)
    }

    /// The rows of ties, after those of tools: all that pull where they are taut, and those with a force.
    pub(super) fn add_rows(
        &self,
        (ways, next): (&ToolWays, &Past),
        state: State<'_>,
        rows: &mut Vec<Row>,
    ) -> Result<()> {
        memory::reserve(rows, self.list.len(), WHAT)?;
        let pulling = self.pulling(ways, next);
        for (index, placed) in self.list.iter().enumerate() {
            let force = Force::of_tie(&next.forces, index);
            if force == Vector::ZERO && !pulling.is_whole(index) {
                continue;
            }
            rows.push(Row {
                tool: NO_TOOL,
                sample: row_of(index),
                force,
                point: placed.row().gather(|node| state.position(node)),
                far: false,
                gap: 0.0,
                outward: Vector::ZERO,
                is_wall: false,
            });
        }
        Ok(())
    }
}

/// The tension of a tie as a part of what it bears; 0 of one that pushes, never breaks or is broken.
fn strain(held: &HeldTie, way: Option<Vector>) -> f32 {
    let most = held.placed.tie.break_mn;
    let force = Vector::from(held.reading.force);
    let pulls = way.is_some_and(|way| way.dot(force) < 0.0);
    match pulls && most > 0.0 && !held.broken {
        true => force.length() / most,
        false => 0.0,
    }
}
