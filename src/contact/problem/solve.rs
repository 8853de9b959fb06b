//! One solve: gaps and slips at a state of the tissue, the forces, and what they change.

use std::time::Instant;

use ::contact::{Limits, Rows, Vector, Whole};

use super::{Problem, WHAT};
use crate::contact::Compliance;
use crate::contact::past::Force;
use crate::contact::rows::{Moving, State, vector};
use crate::error::Result;
use crate::memory;

/// Linearisations of the gap.
const LINEARISATIONS: usize = 2;

/// Of a solve that a picture shows: a thousandth of a millimetre is not seen, and a frame has little time.
const SHOWN: Limits = Limits {
    tolerance_mm: 1e-3,
    least_sweeps: 8,
    most_sweeps: 60,
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
            Self::StepEnd => Limits::default(),
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

impl Problem {
    /// As [`Problem::solve`] at the tools' ends, with what does not depend on how long ago the step was kept from call to call.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
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
    /// [`Error::OutOfMemory`].
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
        self.look(state, part, false)?;
        self.fit()?;
        self.forces.clear();
        self.forces.extend(self.rows.iter().map(|row| row.force));
        let samples = &self.samples;
        self.columns.clear();
        self.columns.extend(self.rows.iter().map(|row| row.sample));
        let (own, all, rows) = (&mut self.delassus, samples.rows(), &self.columns);
        let (mut whole, mut at);
        let w: &mut dyn Rows = match time {
            Time::StepEnd => {
                whole = Whole::new(own.of(compliance, all, rows)?, rows.len());
                &mut whole
            }
            Time::Any => {
                at = self.held_back.at(own, compliance, all, rows)?;
                &mut at
            }
        };
        let moving = Moving {
            tools: &self.tools,
            before: &self.before,
            put: &self.put,
            held: &self.next.tools,
            samples,
            state,
            part,
        };
        for pass in 0..LINEARISATIONS {
            self.contacts.clear();
            for (at, row) in self.rows.iter_mut().enumerate() {
                if pass > 0 {
                    row.point += self.sweeps.shift(at);
                }
                self.contacts.push(moving.measure(row));
            }
            self.sweeps
                .solve(w, &self.contacts, &mut self.forces, time.limits());
        }
        self.next.forces.clear();
        self.columns.clear();
        for (row, force) in self.rows.iter().zip(&self.forces) {
            let sample = self.samples.rows()[row.sample as usize];
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
        self.columns.sort_unstable();
        self.columns.dedup();
        self.change.clear();
        self.change.resize(3 * self.columns.len(), 0.0);
        for (row, force) in self.rows.iter().zip(&self.forces) {
            let sample = self.samples.rows()[row.sample as usize];
            let change = *force - row.force;
            if *force == row.force {
                continue;
            }
            for (column, weight) in compliance.entries(sample) {
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
        memory::fit(&mut self.contacts, rows, WHAT)?;
        // Three nodes a sample and three axes a node; `blend` gives forces of before their part back.
        memory::fit(&mut self.columns, 9 * rows, WHAT)?;
        memory::fit(&mut self.change, 9 * rows, WHAT)?;
        let forces = rows + self.kept.len();
        memory::fit(&mut self.next.forces, forces, WHAT)?;
        memory::fit(&mut self.nodes, 3 * forces, WHAT)?;
        memory::fit(&mut self.vectors, 9 * forces, WHAT)
    }

    /// The contact solved once on the static response, as a collision field: nodes, ascending, and where they go, `[m,3]`, mm.
    ///
    /// The state is taken as that under half of the last forces; the other half is solved for again.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
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
            let sample = self.samples.rows()[force.sample as usize];
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

    /// Goes only part of the way from the forces before the last solve to those after it.
    pub fn blend(&mut self, part: f32) {
        for force in &mut self.next.forces {
            force.force *= part;
        }
        for at in 0..self.kept.len() {
            let kept = self.kept[at];
            let found = self
                .next
                .forces
                .binary_search_by_key(&kept.key(), Force::key);
            let share = kept.force * (1.0 - part);
            match found {
                Ok(place) => self.next.forces[place].force += share,
                Err(place) => self.next.forces.insert(
                    place,
                    Force {
                        force: share,
                        ..kept
                    },
                ),
            }
        }
    }

    /// Takes the forces before the last solve back.
    pub fn undo(&mut self) {
        std::mem::swap(&mut self.next.forces, &mut self.kept);
    }
}
