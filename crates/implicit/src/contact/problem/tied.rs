//! The ties of a problem: which go on from the last step, what pulls on the tissue, and what breaks.

use ::contact::Vector;

use super::{ContactProblem, WHAT};
use crate::contact::past::Force;
use crate::contact::rows::Row;
use crate::contact::state::State;
use crate::contact::ties::{HeldTie, NO_TOOL, Placed, Points, Pulling, row_of, tie_of};
use crate::contact::tool::TieReading;
use crate::contact::tool::{PUT_MM, Tool};
use crate::error::Result;
use crate::memory;

/// With the tie that is pulled hardest for its strength break those that are pulled by this part of that.
const TOGETHER: f32 = 0.9;

impl ContactProblem {
    /// Takes the ties of a step; `next` is the last one's state.
    pub(super) fn tie(&mut self, ties: &[Placed]) -> Result<()> {
        let is_other = ties.len() != self.tied.list.len()
            || !(ties.iter().zip(&self.tied.list)).all(|(a, b)| a.has_nodes_of(b));
        // Rows of ties are known by number: what was computed for another list must not be taken for this one's.
        if is_other {
            self.tied.generation += 1;
        }
        let held = &mut self.next.ties;
        memory::fit(held, ties.len(), WHAT)?;
        memory::replace(&mut self.tied.list, ties, WHAT)?;
        memory::fit(&mut self.tied.from, ties.len(), WHAT)?;
        self.tied.from.clear();
        held.truncate(ties.len());
        for (index, placed) in ties.iter().enumerate() {
            let known = (held.get(index)).filter(|known| known.placed.goes_on_as(placed));
            let from = known.map(|known| known.placed.place);
            // A far end that leaps has no way, as a tool that is put elsewhere has none.
            let near = from.filter(|from| from.distance(placed.place) <= PUT_MM);
            self.tied.from.push(near.unwrap_or(placed.place));
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
        self.next.forces.retain(|force| there(force.sample));
        self.tied.broke = false;
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

    /// How long the step being made is, s: what damps ties is told by it.
    pub fn take_length(&mut self, step_s: f32) {
        self.tied.step_s = step_s;
    }

    /// The ties of this step.
    pub fn ties(&self) -> &[Placed] {
        &self.tied.list
    }

    /// Where their far ends were when it began.
    pub fn tied_from(&self) -> &[Vector] {
        &self.tied.from
    }

    /// Whether there are any in this step.
    pub fn has_ties(&self) -> bool {
        !self.tied.list.is_empty()
    }

    pub(super) fn points(&self) -> Points<'_> {
        Points {
            samples: &self.samples,
            ties: &self.tied.list,
            generation: self.tied.generation,
        }
    }

    pub(super) fn pulling(&self) -> Pulling<'_> {
        Pulling {
            ties: &self.tied.list,
            held: &self.next.ties,
            from: &self.tied.from,
            tools: &self.tools,
            before: &self.before,
            step_s: self.tied.step_s,
        }
    }

    /// Whether a tie broke when the last state was looked at.
    pub fn has_broken(&self) -> bool {
        self.tied.broke
    }

    /// Adds the free nodes of the ties that pull to `nodes`.
    pub(super) fn add_tied_nodes(&mut self, held: &[bool]) {
        for index in 0..self.tied.list.len() {
            if self.pulling().is_whole(index) {
                let nodes = self.tied.list[index].row().into_entries();
                let nodes = nodes.map(|entry| entry.0);
                self.nodes
                    .extend(nodes.filter(|node| !held[*node as usize]));
            }
        }
    }

    /// From a tie's far end to its point at `state`, the end of the step; none where its tool is gone.
    fn way_of_tie(&self, index: usize, state: State<'_>) -> Option<Vector> {
        let row = self.tied.list[index].row();
        let point = row.gather(|node| state.position(node));
        self.pulling().end(index, 1.0).map(|end| point - end)
    }

    /// Sums up what each tie does at `state`, the end of the step; with `breaks` those break that are pulled too hard, the hardest first: others
    /// may hold once they have.
    pub(super) fn finish_ties(&mut self, state: State<'_>, breaks: bool) {
        self.tied.broke = false;
        let mut hardest = 0.0f32;
        for index in 0..self.tied.list.len() {
            let way = self.way_of_tie(index, state);
            let force = Force::of_tie(&self.next.forces, index);
            let held = &mut self.next.ties[index];
            held.reading = TieReading {
                force: force.to_array(),
                length_mm: way.unwrap_or_default().length(),
                broken: held.broken,
                broke: held.reading.broke,
            };
            hardest = hardest.max(strain(held, way));
        }
        // The step is made again without those that break here, so that the others can take on what these bore.
        if !breaks || hardest <= 1.0 {
            return;
        }
        for index in 0..self.tied.list.len() {
            let way = self.way_of_tie(index, state);
            let held = &mut self.next.ties[index];
            if strain(held, way) > (TOGETHER * hardest).max(1.0) {
                held.broken = true;
                held.reading.broken = true;
                held.reading.broke = true;
                self.tied.broke = true;
            }
        }
    }

    /// What ties do to a tool: a force, and a torque about its position.
    pub(super) fn pull_of_ties(&self, tool: u32) -> (Vector, Vector) {
        let (mut force, mut torque) = (Vector::ZERO, Vector::ZERO);
        for (index, placed) in self.tied.list.iter().enumerate() {
            let is_own =
                matches!(placed.tie.end, ::contact::End::Tool { tool: own, .. } if own == tool);
            if is_own && let Some(end) = self.pulling().end(index, 1.0) {
                let own = -Force::of_tie(&self.next.forces, index);
                let arm = end - self.tools[tool as usize].pose.translation;
                force += own;
                torque += arm.cross(own);
            }
        }
        (force, torque)
    }

    /// The rows of ties, after those of tools: all that pull where they are taut, and those with a force.
    pub(super) fn look_at_ties(&mut self, state: State<'_>) -> Result<()> {
        memory::reserve(&mut self.rows, self.tied.list.len(), WHAT)?;
        for index in 0..self.tied.list.len() {
            let force = Force::of_tie(&self.next.forces, index);
            if force == Vector::ZERO && !self.pulling().is_whole(index) {
                continue;
            }
            let row = self.tied.list[index].row();
            self.rows.push(Row {
                tool: NO_TOOL,
                sample: row_of(index),
                force,
                point: row.gather(|node| state.position(node)),
                far: false,
                gap: 0.0,
                outward: Vector::ZERO,
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
