//! One solve: gaps and slips at a state of the tissue, the forces, and what they change.

use crate::clock::Instant;

use ::contact::{Limits, Rows, Vector, Whole};

use super::look::MOST_ROWS;
use super::{ContactProblem, WHAT};
use crate::contact::Compliance;
use crate::contact::past::Force;
use crate::contact::rows::Moving;
use crate::contact::state::{State, vector};
use crate::contact::ties::{NO_TOOL, Points, Pulling};
use crate::error::Result;
use crate::memory;

/// Multiplications of one linearisation at most: about half a millisecond.
const SOLVE_WORK: u64 = 2_000_000;
/// How many times that where no tool may lose its contact.
const LONGEST_LINEARISATION: u64 = 15;
/// What else a solve takes, in multiplications: for each node and sample that is looked at, for each row and linearisation, and for
/// each pair of rows.
const LOOK_WORK: u64 = 60;
const MEASURE_WORK: u64 = 1000;
const READ_WORK: u64 = 80;
/// Samples of a solve that is short of work.
const FEW_ROWS: usize = 64;

/// Linearisations of the gap.
const LINEARISATIONS: usize = 2;
/// How often a linearisation that goes too far is made again.
const MOST_REPEATS: usize = 8;
/// The surface of a tool is as its tangents say for this way at least, mm, and for the tool's half thickness.
const LEAST_WAY_MM: f32 = 1.0;

/// Of a solve that a picture shows: a thousandth of a millimetre is not seen, and a frame has little time.
const SHOWN: Limits = Limits {
    tolerance_mm: 1e-3,
    least_sweeps: 8,
    most_sweeps: 60,
    most_work: SOLVE_WORK,
};

/// Which compliance a solve takes, and how long it goes on.
#[derive(Clone, Copy)]
enum Time {
    /// Of a step's length: the same in each.
    StepEnd,
    /// Of a moment between steps, another in each call.
    Any,
}

impl Time {
    fn limits(self) -> Limits {
        match self {
            Self::StepEnd => Limits {
                most_work: SOLVE_WORK,
                ..Limits::default()
            },
            Self::Any => SHOWN,
        }
    }
}

/// What one solve changed: forces on the degrees of freedom of the prior's columns.
#[derive(Clone, Copy, Debug)]
pub struct Change<'a> {
    /// Rows of the response `[3n]`, ascending.
    pub dofs: &'a [u32],
    /// `[3n]`, mN.
    pub forces: &'a [f32],
}

impl ContactProblem {
    /// As [`ContactProblem::solve`] at the tools' ends, with what does not depend on how long ago the step was kept from call to call.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn solve_between(
        &mut self,
        compliance: Compliance<'_>,
        state: State<'_>,
    ) -> Result<Change<'_>> {
        self.solve_at(compliance, state, 1.0, Time::Any)
    }

    /// Solves for the forces at `state`, which is the tissue under the forces so far, with the tools at part `part` in `(0, 1]` of
    /// their way. Gives what has changed.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn solve(
        &mut self,
        compliance: Compliance<'_>,
        state: State<'_>,
        part: f32,
    ) -> Result<Change<'_>> {
        self.solve_at(compliance, state, part, Time::StepEnd)
    }

    fn solve_at(
        &mut self,
        compliance: Compliance<'_>,
        state: State<'_>,
        part: f32,
        time: Time,
    ) -> Result<Change<'_>> {
        let start = Instant::now();
        memory::replace(&mut self.kept, &self.next.forces, WHAT)?;
        // With little work left fewer rows are solved for, and the others wait for the next solve.
        let is_short = self.work.begin_solve();
        let most = if is_short { FEW_ROWS } else { MOST_ROWS };
        self.look(state, part, false, most)?;
        self.fit()?;
        self.forces.clear();
        self.forces.extend(self.rows.iter().map(|row| row.force));
        self.columns.clear();
        self.columns.extend(self.rows.iter().map(|row| row.sample));
        // Kept apart, so that the tissue at rest is not read again after each look at the deformed one.
        let own = match compliance.tangent {
            Some(_) => &mut self.tangent,
            None => &mut self.delassus,
        };
        let all = Points {
            samples: &self.samples,
            ties: &self.tied.list,
            generation: self.tied.generation,
        };
        let rows = &self.columns;
        let (mut whole, mut at);
        let w: &mut dyn Rows = match time {
            Time::StepEnd => {
                whole = Whole::new(own.of(compliance, all, rows)?, rows.len());
                &mut whole
            }
            Time::Any => {
                at = self.inertial_compliance.at(own, compliance, all, rows)?;
                &mut at
            }
        };
        let read = READ_WORK * (self.rows.len() * self.rows.len()) as u64;
        let found = LOOK_WORK * (self.samples.nodes().len() + self.found) as u64;
        self.work.take(read + found);
        let moving = Moving {
            tools: &self.tools,
            before: &self.before,
            put: &self.put,
            swept: &self.swept,
            buried: &self.buried,
            held: &self.next.tools,
            samples: &self.samples,
            state,
            part,
            pulling: Pulling {
                ties: &self.tied.list,
                held: &self.next.ties,
                from: &self.tied.from,
                tools: &self.tools,
                before: &self.before,
                step_s: self.tied.step_s,
            },
        };
        // Only for what is quick or thin: what was put into the tissue may find its way out by any side.
        self.trusted.clear();
        let tools = self.tools.iter().zip(&self.may_lose);
        self.trusted
            .extend(tools.map(|(tool, may_lose)| match may_lose {
                true => tool.body.finest().max(LEAST_WAY_MM),
                false => f32::MAX,
            }));
        let (mut pass, mut extra) = (0, MOST_REPEATS);
        while pass < LINEARISATIONS {
            self.contacts.clear();
            self.contacts
                .extend(self.rows.iter().map(|row| moving.measure(row)));
            self.earlier.clear();
            self.earlier.extend_from_slice(&self.forces);
            // Quick and thin tools need many short linearisations, others a few that may take longer.
            let limits = time.limits();
            let most_work = match self.may_lose.contains(&true) {
                true => limits.most_work,
                false => limits.most_work.saturating_mul(LONGEST_LINEARISATION),
            };
            let limits = Limits {
                most_work: most_work.min(self.work.for_solve()),
                ..limits
            };
            let outcome = self
                .sweeps
                .solve(w, &self.contacts, &mut self.forces, limits);
            let measured = MEASURE_WORK * self.rows.len() as u64;
            self.work.take(outcome.work + measured);
            self.unsolved_mm = match outcome.converged {
                true => 0.0,
                false => outcome.change_mm,
            };
            // A tool's surface is as its tangents say only so far: beyond, the solve goes part of the way and is made again.
            let pairs = self.forces.iter().zip(&self.earlier).enumerate();
            let ways =
                pairs.filter(|(_, (now, before))| **now != **before || **now != Vector::ZERO);
            let ways = ways.map(|(at, _)| {
                let tool = self.rows[at].tool as usize;
                let way = match self.rows[at].tool {
                    // A tie's law holds however far it goes.
                    NO_TOOL => f32::MAX,
                    _ => self.trusted.get(tool).map_or(LEAST_WAY_MM, |way| *way),
                };
                self.sweeps.shift(at).length() / way
            });
            // The tool that was trusted least decides for all: forces of one move the samples of another.
            let part = 1.0 / ways.fold(1.0, f32::max);
            for (at, row) in self.rows.iter_mut().enumerate() {
                // The next linearisation is about where these forces take the samples.
                row.point += self.sweeps.shift(at) * part;
            }
            if part < 1.0 && extra > 0 && !is_short {
                let forces = self.forces.iter_mut().zip(&self.earlier);
                forces.for_each(|(now, before)| *now = *before + (*now - *before) * part);
                extra -= 1;
            } else {
                pass += 1;
            }
        }
        self.next.forces.clear();
        self.columns.clear();
        for (row, force) in self.rows.iter().zip(&self.forces) {
            let sample = all.at(row.sample);
            // Only what has changed: the state has the forces of before in it already.
            if *force != row.force {
                self.columns
                    .extend(compliance.entries(sample).map(|entry| entry.0));
            }
            if *force != Vector::ZERO {
                self.next.forces.push(Force {
                    tool: row.tool,
                    sample: row.sample,
                    force: *force,
                });
            }
        }
        // Rows without room lose their force, and the tissue must learn of it.
        for row in &self.shed {
            let sample = self.samples.at(row.sample);
            self.columns
                .extend(compliance.entries(sample).map(|entry| entry.0));
        }
        self.columns.sort_unstable();
        self.columns.dedup();
        self.change.clear();
        self.change.resize(3 * self.columns.len(), 0.0);
        let changes = self.rows.iter().zip(&self.forces);
        let changes = changes.map(|(row, force)| (row.sample, *force - row.force));
        let shed = self.shed.iter().map(|row| (row.sample, -row.force));
        for (sample, change) in changes.chain(shed) {
            if change == Vector::ZERO {
                continue;
            }
            for (column, weight) in compliance.entries(all.at(sample)) {
                let at = 3 * self.columns.partition_point(|c| *c < column);
                for (sum, value) in self.change[at..at + 3].iter_mut().zip(change.to_array()) {
                    *sum += weight * value;
                }
            }
        }
        // Columns become degrees of freedom in place, from the last.
        let count = self.columns.len();
        self.columns.resize(3 * count, 0);
        for at in (0..count).rev() {
            let column = self.columns[at];
            for axis in 0..3 {
                self.columns[3 * at + axis] = 3 * column + axis as u32;
            }
        }
        self.spent += start.elapsed();
        Ok(Change {
            dofs: &self.columns,
            forces: &self.change,
        })
    }

    /// Room for what a solve of `rows` leaves: it cannot stop half way.
    fn fit(&mut self) -> Result<()> {
        let rows = self.rows.len();
        memory::tried(self.sweeps.reserve(rows), WHAT)?;
        memory::fit(&mut self.forces, rows, WHAT)?;
        memory::fit(&mut self.earlier, rows, WHAT)?;
        memory::fit(&mut self.contacts, rows, WHAT)?;
        // Three nodes a sample, six a tie, and three axes a node; `blend` gives forces of before their part back.
        let changed = rows + self.shed.len() + self.tied.list.len();
        memory::fit(&mut self.columns, 9 * changed, WHAT)?;
        memory::fit(&mut self.change, 9 * changed, WHAT)?;
        let forces = rows + self.kept.len() + self.tied.list.len();
        let guessed = self.guessed.len().max(self.sound.len());
        memory::fit(&mut self.next.forces, forces.max(guessed), WHAT)?;
        memory::fit(&mut self.nodes, 3 * forces, WHAT)?;
        memory::fit(&mut self.vectors, 9 * forces, WHAT)
    }

    /// The contact solved once on the static response, as a collision field: nodes, ascending, and where they go, `[m,3]`, mm.
    ///
    /// The state is taken as that under half of the last forces; the other half is solved for again.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn prescribe(
        &mut self,
        compliance: Compliance<'_>,
        state: State<'_>,
    ) -> Result<(&[u32], &[f32])> {
        for force in &mut self.next.forces {
            force.force *= 0.5;
        }
        self.solve(compliance, state, 1.0)?;
        self.nodes.clear();
        for force in &self.next.forces {
            let sample = self.samples.at(force.sample);
            let own = |node: &u32| {
                matches!(
                    compliance.prior.column_for(compliance.held, *node),
                    Some((_, true))
                )
            };
            self.nodes
                .extend(sample.entries().map(|entry| entry.0).filter(own));
        }
        self.nodes.sort_unstable();
        self.nodes.dedup();
        self.vectors.clear();
        for &node in &self.nodes {
            let mut place = vector(state.u, node);
            if let Some((column, _)) = compliance.prior.column_for(compliance.held, node) {
                place += self
                    .delassus
                    .moved(column as u32, &self.columns, &self.change);
            }
            self.vectors.extend(place.to_array());
        }
        // The whole force: what was solved for and the half that stayed.
        for force in &mut self.next.forces {
            let kept = self.kept.binary_search_by_key(&force.key(), Force::key);
            if let Ok(at) = kept {
                force.force += self.kept[at].force;
            }
        }
        Ok((&self.nodes, &self.vectors))
    }
}
