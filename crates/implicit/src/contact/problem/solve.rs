//! One solve: gaps and slips at a state of the tissue, the forces, and what they change.

use crate::clock::Instant;

use ::contact::Vector;

use super::ContactProblem;
use super::gauge::Gauge;
use super::look::Look;
use super::solution::{Change, Time};
use crate::contact::Compliance;
use crate::contact::past::Force;
use crate::contact::rows::MOST_ROWS;
use crate::contact::rows::WHAT;
use crate::contact::state::{State, vector};
use crate::error::Result;
use crate::memory;

/// What a look takes, in multiplications for each node and sample.
const LOOK_WORK: u64 = 60;
/// Samples of a solve that is short of work.
const FEW_ROWS: usize = 64;

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

    /// See [`ContactProblem::solve`]: rows, `W` and `g`, sweeps, forces, and what of them is new. Until the forces are written nothing has changed but scratch.
    fn solve_at(
        &mut self,
        compliance: Compliance<'_>,
        state: State<'_>,
        part: f32,
        time: Time,
    ) -> Result<Change<'_>> {
        let start = Instant::now();
        let ContactProblem {
            surface,
            ways,
            tied,
            next,
            near,
            kept,
            solution,
            work,
            prescribed,
            ..
        } = self;
        memory::replace(&mut kept.before, &next.forces, WHAT)?;
        // With little work left fewer rows are solved for, and the others wait for the next solve.
        let is_short = work.begin_solve();
        let look = Look {
            part,
            wide: false,
            most: if is_short { FEW_ROWS } else { MOST_ROWS },
        };
        // Rows with their forces so far: `f` of the state.
        near.look(surface, ways, (tied, next), state, look)?;
        let rows = near.rows.len();
        let forces = rows + kept.before.len() + tied.list.len();
        // All that may fail comes before the first force changes: a solve that has begun ends.
        solution.fit(rows, rows + near.shed.len() + tied.list.len())?;
        memory::fit(&mut next.forces, forces.max(kept.most()), WHAT)?;
        prescribed.fit(forces)?;
        work.take(LOOK_WORK * (surface.samples.all_nodes().len() + near.found) as u64);
        let gauge = Gauge {
            samples: &surface.samples,
            ways,
            tied,
            next,
        };
        let (which, at) = ((compliance, time), (state, part));
        // `f'`, in the order of the rows.
        solution.solve((gauge, near), which, at, (work, is_short))?;
        // Ascending by tool and sample, as the rows are: later they are found by binary search.
        next.forces.clear();
        for (row, force) in near.rows.iter().zip(&solution.forces) {
            if *force != Vector::ZERO {
                next.forces.push(Force {
                    tool: row.tool,
                    sample: row.sample,
                    force: *force,
                });
            }
        }
        let points = tied.points(&surface.samples);
        // `B^T (f' - f)`, which the tissue has yet to learn of.
        solution.tell_change(points, near, compliance);
        solution.spent += start.elapsed();
        Ok(solution.change())
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
        let (nodes, vectors) = (&mut self.prescribed.nodes, &mut self.prescribed.vectors);
        nodes.clear();
        for force in &self.next.forces {
            let sample = self.surface.samples.at(force.sample);
            let own = |node: &u32| {
                matches!(
                    compliance.prior.column_for(compliance.held, *node),
                    Some((_, true))
                )
            };
            nodes.extend(sample.entries().map(|entry| entry.0).filter(own));
        }
        nodes.sort_unstable();
        nodes.dedup();
        vectors.clear();
        let Change { dofs, forces } = self.solution.change();
        for &node in &*nodes {
            let mut place = vector(state.u, node);
            if let Some((column, _)) = compliance.prior.column_for(compliance.held, node) {
                place += (self.solution.responses.rest).moved(column as u32, dofs, forces);
            }
            vectors.extend(place.to_array());
        }
        // The whole force: what was solved for and the half that stayed.
        let before = &self.kept.before;
        for force in &mut self.next.forces {
            let kept = before.binary_search_by_key(&force.key(), Force::key);
            if let Ok(at) = kept {
                force.force += before[at].force;
            }
        }
        Ok((nodes, vectors))
    }
}
