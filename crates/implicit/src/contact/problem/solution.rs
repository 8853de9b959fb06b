//! The forces on the rows of a problem: linearisations of their gaps and slips, solved by sweeps, and what the forces change.
//!
//! `W f + g` are the gaps and slips under the forces `f`, with the Delassus matrix `W = B A B^T` and the measured `g`; the laws of Signorini, Coulomb and
//! ties hold at its solution (`crates/contact/src/sweeps.rs`).

use std::time::Duration;

use ::contact::{Contact, Limits, Rows, Sweeps, Vector, Whole};

use super::gauge::Gauge;
use super::look::NearRows;
use super::work::Work;
use crate::contact::Compliance;
use crate::contact::delassus::Delassus;
use crate::contact::in_lanes::InLanes;
use crate::contact::inertial_compliance::InertialCompliance;
use crate::contact::rows::MOST_ROWS;
use crate::contact::rows::Row;
use crate::contact::rows::WHAT;
use crate::contact::state::State;
use crate::contact::ties::{NO_TOOL, Points};
use crate::error::Result;
use crate::kernels::Isa;
use crate::memory::{self, HeldBytes};

/// Multiplications of one linearisation at most: about half a millisecond.
const SOLVE_WORK: u64 = 2_000_000;
/// How many times that where no tool may lose its contact.
const LONGEST_LINEARISATION: u64 = 15;
/// What a solve takes besides its sweeps, in multiplications: for each row and linearisation, and for each pair of rows.
const MEASURE_WORK: u64 = 1000;
const READ_WORK: u64 = 80;
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
pub enum Time {
    /// Of a step's length: the same in each.
    StepEnd,
    /// Of a moment between steps, another in each call.
    Any,
}

impl Time {
    /// When the sweeps of one linearisation end.
    pub fn limits(self) -> Limits {
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

/// How the rows move under their forces.
#[derive(HeldBytes)]
pub struct Responses {
    /// By which rows are added up.
    #[held(skip)]
    isa: Isa,
    /// Of tissue at rest, at the step's length.
    pub(super) rest: Delassus,
    /// Of deformed tissue: kept apart, so that the tissue at rest is not read again after each look at the deformed one.
    tangent: Delassus,
    /// What a moment between steps has of inertia, another in each frame.
    inertial: InertialCompliance,
}

impl Responses {
    fn new(isa: Isa) -> Responses {
        Responses {
            isa,
            rest: Delassus::default(),
            tangent: Delassus::default(),
            inertial: InertialCompliance::default(),
        }
    }

    /// Exchanges the responses of the contact for those of another length of step, on which they depend.
    pub fn exchange(&mut self, other: &mut Delassus) {
        std::mem::swap(&mut self.rest, other);
    }

    /// Samples of the last solve that took the compliance of the tissue as it was deformed.
    pub fn deformed(&self) -> &[u32] {
        self.tangent.rows()
    }

    /// `f^T W f` under forces on them, mN mm.
    pub fn work(&self, force: impl Fn(u32) -> Vector) -> f32 {
        self.tangent.work(force)
    }
}

/// See the module. `contacts` and `forces` are in the order of the rows.
#[derive(HeldBytes)]
pub struct Solution {
    pub responses: Responses,
    sweeps: Sweeps,
    contacts: Vec<Contact>,
    pub(super) forces: Vec<Vector>,
    /// The forces before a linearisation.
    earlier: Vec<Vector>,
    /// How far a linearisation of each tool's gap may move a sample, mm: beyond that the tangent no longer describes the surface.
    trusted: Vec<f32>,
    /// What the last solve changed, by degrees of freedom of the prior: see [`Change`].
    columns: Vec<u32>,
    change: Vec<f32>,
    /// What the last solve left unsolved, mm.
    pub(super) unsolved_mm: f32,
    /// What the solves of the step took.
    pub(super) spent: Duration,
}

impl Solution {
    /// Room for two solves, each with the nodes of its samples and their three axes.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub(super) fn new(most_tools: usize, isa: Isa) -> Result<Solution> {
        let mut sweeps = Sweeps::default();
        memory::tried(sweeps.reserve(MOST_ROWS), WHAT)?;
        let (room, dofs) = (2 * MOST_ROWS, 18 * MOST_ROWS);
        Ok(Solution {
            responses: Responses::new(isa),
            sweeps,
            contacts: memory::room(room, WHAT)?,
            forces: memory::room(room, WHAT)?,
            earlier: memory::room(room, WHAT)?,
            trusted: memory::room(most_tools, WHAT)?,
            columns: memory::room(dofs, WHAT)?,
            change: memory::room(dofs, WHAT)?,
            unsolved_mm: 0.0,
            spent: Duration::ZERO,
        })
    }

    /// Wall time of the step's solves, ms.
    pub fn spent_ms(&self) -> f64 {
        1e3 * self.spent.as_secs_f64()
    }

    /// Room for what a solve of `rows` leaves, `changed` with rows that may change too: it cannot stop half way.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub(super) fn fit(&mut self, rows: usize, changed: usize) -> Result<()> {
        memory::tried(self.sweeps.reserve(rows), WHAT)?;
        memory::fit(&mut self.forces, rows, WHAT)?;
        memory::fit(&mut self.earlier, rows, WHAT)?;
        memory::fit(&mut self.contacts, rows, WHAT)?;
        // Four nodes a sample, eight a tie at most, and three axes a node; `blend` gives forces of before their part back.
        memory::fit(&mut self.columns, 12 * changed, WHAT)?;
        memory::fit(&mut self.change, 12 * changed, WHAT)
    }

    /// Solves for the forces on `near`, whose points go along; `is_short` of work makes no linearisation again.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub(super) fn solve(
        &mut self,
        (gauge, near): (Gauge<'_>, &mut NearRows),
        (compliance, time): (Compliance<'_>, Time),
        (state, part): (State<'_>, f32),
        (work, is_short): (&mut Work, bool),
    ) -> Result<()> {
        self.forces.clear();
        self.forces.extend(near.rows.iter().map(|row| row.force));
        self.columns.clear();
        self.columns.extend(near.rows.iter().map(|row| row.sample));
        // The matrix is read for the columns that these rows touch, of which those are known already that the solve before had.
        let own = match compliance.tangent {
            Some(_) => &mut self.responses.tangent,
            None => &mut self.responses.rest,
        };
        let (all, rows) = (gauge.points(), &self.columns);
        let (mut whole, mut at);
        let w: &mut dyn Rows = match time {
            Time::StepEnd => {
                whole = InLanes {
                    whole: Whole::new(own.of(compliance, all, rows)?, rows.len()),
                    isa: self.responses.isa,
                };
                &mut whole
            }
            Time::Any => {
                at = (self.responses.inertial).at(own, compliance, all, rows)?;
                &mut at
            }
        };
        // Work is counted, not timed: the same step costs the same on every machine.
        work.take(READ_WORK * (rows.len() * rows.len()) as u64);
        let moving = gauge.moving(state, part);
        // Only for what is quick or thin: what was put into the tissue may find its way out by any side.
        let ways = gauge.ways;
        self.trusted.clear();
        let tools = ways.tools.iter().zip(&ways.may_lose);
        self.trusted
            .extend(tools.map(|(tool, may_lose)| match may_lose {
                true => tool.body.finest().max(LEAST_WAY_MM),
                false => f32::MAX,
            }));
        // Gaps of curved tools are linearised about where the forces take the samples: twice, and again where that went too far.
        let (mut pass, mut extra) = (0, MOST_REPEATS);
        while pass < LINEARISATIONS {
            self.contacts.clear();
            self.contacts
                .extend(near.rows.iter().map(|row| moving.measure(row)));
            self.earlier.clear();
            self.earlier.extend_from_slice(&self.forces);
            // Quick and thin tools need many short linearisations, others a few that may take longer.
            let limits = time.limits();
            let most_work = match ways.may_lose() {
                true => limits.most_work,
                false => limits.most_work.saturating_mul(LONGEST_LINEARISATION),
            };
            let limits = Limits {
                most_work: most_work.min(work.for_solve()),
                ..limits
            };
            // Block Gauss-Seidel from the forces so far: a solve that goes on from a near one takes few sweeps.
            let outcome = self
                .sweeps
                .solve(w, &self.contacts, &mut self.forces, limits);
            let measured = MEASURE_WORK * near.rows.len() as u64;
            work.take(outcome.work + measured);
            self.unsolved_mm = match outcome.converged {
                true => 0.0,
                false => outcome.change_mm,
            };
            let part = trusted_part(
                &self.sweeps,
                &near.rows,
                (&self.forces, &self.earlier),
                &self.trusted,
            );
            for (at, row) in near.rows.iter_mut().enumerate() {
                // The next linearisation is about where these forces take the samples.
                row.point += self.sweeps.shift(at) * part;
            }
            if part < 1.0 && extra > 0 && !is_short && !work.is_late() {
                let forces = self.forces.iter_mut().zip(&self.earlier);
                forces.for_each(|(now, before)| *now = *before + (*now - *before) * part);
                extra -= 1;
            } else {
                pass += 1;
            }
        }
        Ok(())
    }

    /// What the last solve changed.
    pub(super) fn change(&self) -> Change<'_> {
        Change {
            dofs: &self.columns,
            forces: &self.change,
        }
    }

    /// Finds what the forces change of the tissue that had those of the rows before, by the prior's degrees of freedom.
    pub(super) fn tell_change(
        &mut self,
        all: Points<'_>,
        near: &NearRows,
        compliance: Compliance<'_>,
    ) {
        self.columns.clear();
        for (row, force) in near.rows.iter().zip(&self.forces) {
            // Only what has changed: the state has the forces of before in it already.
            if *force != row.force {
                let entries = compliance.entries(all.at(row.sample));
                self.columns.extend(entries.map(|entry| entry.0));
            }
        }
        // Rows without room lose their force, and the tissue must learn of it.
        for row in &near.shed {
            let entries = compliance.entries(all.samples.at(row.sample));
            self.columns.extend(entries.map(|entry| entry.0));
        }
        self.columns.sort_unstable();
        self.columns.dedup();
        self.change.clear();
        self.change.resize(3 * self.columns.len(), 0.0);
        let changes = near.rows.iter().zip(&self.forces);
        let changes = changes.map(|(row, force)| (row.sample, *force - row.force));
        let shed = near.shed.iter().map(|row| (row.sample, -row.force));
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
    }
}

/// The part of a linearisation that may be gone: a tool's surface is as its tangents say only so far. The tool that was trusted least decides for all:
/// forces of one move the samples of another.
fn trusted_part(
    sweeps: &Sweeps,
    rows: &[Row],
    (forces, earlier): (&[Vector], &[Vector]),
    trusted: &[f32],
) -> f32 {
    let pairs = forces.iter().zip(earlier).enumerate();
    let ways = pairs.filter(|(_, (now, before))| **now != **before || **now != Vector::ZERO);
    let ways = ways.map(|(at, _)| {
        let way = match rows[at].tool {
            // A tie's law holds however far it goes.
            NO_TOOL => f32::MAX,
            tool => trusted.get(tool as usize).map_or(LEAST_WAY_MM, |way| *way),
        };
        sweeps.shift(at).length() / way
    });
    1.0 / ways.fold(1.0, f32::max)
}
