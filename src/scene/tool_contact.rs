//! The contact of tools and ties in a scene: taken at the start of a step, published at its end, remembered in snapshots.
//!
//! The contact problem holds two accounts: `past`, what the last published state was made with
//! (forces, grasps, ties that broke), and `next`, that of the step being made. A step starts from
//! `past` and writes `next`; only when the state is published do they change places, so that a
//! refused step leaves what was felt before. Forces are found again by sample and tool, which is
//! why they are kept sorted.

use std::sync::Arc;

use ::contact::Tie;

use super::body::SceneBody;
use super::published::Published;
use super::step_states::StepStates;
use super::{Contact, StepInput};
use crate::contact::ties::tie_of;
use crate::contact::{ContactProblem, Force, MAX_TOOLS, Past, Placed, State, Tool, ToolUse};
use crate::error::{Error, Result};
use crate::features::{Instruments, Proven};
use crate::memory::{self, HeldBytes};
use crate::stats::{SceneStats, flag};

const WHAT: &str = "the contact of instruments";
/// Tissue this deep inside of a tool raises [`flag::DEEP`], mm.
const DEEP_MM: f32 = 1.0;
/// A contact solve that leaves more than this raises [`flag::UNSOLVED`], mm.
const UNSOLVED_MM: f32 = 0.01;

/// See the module.
#[derive(Default, HeldBytes)]
pub struct ToolContact {
    /// From the first step that has tools or ties.
    pub problem: Option<Proven<Instruments, ContactProblem>>,
    /// The ties of the step being made, their far ends in the mesh's frame.
    pub placed_ties: Vec<Placed>,
    /// What the tools of the step being made do, where the bundle's limits for tools say something about it.
    #[held(skip)]
    pub used: Option<ToolUse>,
    /// Whether tools drive the step being made, or drove the last one before it that anything drove. Their contact is then in
    /// `problem`, and the step's contact set is filled from it.
    pub driven: bool,
}

impl ToolContact {
    /// Takes the tools and ties of a step that starts at `start` `[K,3]`; says whether one is near enough to touch the tissue, or
    /// there are ties. `was_driven`: the last step that anything drove was driven by tools.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for a bundle without linear response, and for ties in a scene that makes no corrections.
    pub fn update(
        &mut self,
        body: &SceneBody,
        start: &[f32],
        input: &StepInput<'_>,
        (was_driven, corrects): (bool, bool),
    ) -> Result<bool> {
        let _span = tracing::trace_span!("search").entered();
        self.driven = match input.contact {
            Contact::Tools(_) => true,
            Contact::None => was_driven,
            Contact::Dense(_) | Contact::Sparse { .. } => false,
        };
        let ties = input.loads.ties;
        // Which tools the contact problem makes the step with: those of the host, or none where it is asked for the ties or a cut body alone.
        let tools: &[Tool] = match input.contact {
            Contact::Tools(tools) => tools,
            // The elements make each step of a cut body, and of one with ties, as if tools were there.
            Contact::None if body.cut.is_some() || !ties.is_empty() => &[],
            _ => {
                if let Some(problem) = &mut self.problem {
                    problem.forget_tools();
                }
                return Ok(false);
            }
        };
        check_ties(ties, corrects)?;
        if body.model.prior.is_none() {
            return Err(Error::Unsupported(
                "instruments: the bundle has no linear response to solve their contact with; pass the nodes that upt_scene_contacts_from_instruments finds".into(),
            ));
        }
        // From the first tool on: a scene that tools never touch has no room for their contact.
        let problem = made(&mut self.problem, body)?;
        super::ties::place(&mut self.placed_ties, body, input, tools.len())?;
        let rest = &body.mesh.positions;
        problem.begin(tools, &self.placed_ties, rest, start)?;
        problem.is_near(State {
            rest,
            u: start,
            start,
        })
    }

    /// The tools' readings in the state `next`, made from `start`.
    pub fn finish(
        &mut self,
        body: &SceneBody,
        (next, start): (&[f32], &[f32]),
        stats: &mut SceneStats,
    ) {
        if let Some(problem) = &mut self.problem {
            let state = State {
                rest: &body.mesh.positions,
                u: next,
                start,
            };
            problem.finish(state, true);
        }
        self.report_depth(stats);
    }

    /// What the contact of the step being made says in its statistics.
    pub fn report_depth(&self, stats: &mut SceneStats) {
        let Some(problem) = &self.problem else {
            return;
        };
        stats.timing.contact_ms = problem.solution.spent_ms();
        let readings = problem.next.tools.iter().map(|held| held.reading);
        if readings
            .clone()
            .any(|reading| reading.residual_mm > UNSOLVED_MM)
        {
            stats.flags |= flag::UNSOLVED;
        }
        let deepest = readings.map(|r| r.penetration_mm).fold(0.0, f32::max);
        if deepest > DEEP_MM || problem.ways.lay_in_tissue {
            stats.flags |= flag::DEEP;
        }
    }

    /// The tools of the step being made become those of the last.
    pub fn commit(&mut self) {
        if let Some(problem) = &mut self.problem {
            problem.commit();
        }
    }

    /// Nothing pushes the tissue.
    pub fn clear_forces(&mut self) {
        if let Some(problem) = &mut self.problem {
            problem.next.forces.clear();
        }
    }

    /// No tool and no tie has ever been.
    pub fn reset(&mut self) {
        if let Some(problem) = &mut self.problem {
            problem.reset();
        }
    }

    /// The tools' readings and forces become readable.
    pub fn publish(&self, body: &SceneBody, shared: &mut Published) {
        match &self.problem {
            Some(problem) => {
                problem.report(&mut shared.tools, &body.mesh.positions, &shared.last.field)
            }
            None => shared.tools.clear(),
        }
    }

    /// What it remembers of the last published step, or of the one being made.
    pub fn past(&self, next: bool) -> Option<&Past> {
        let problem = self.problem.as_ref()?;
        Some(match next {
            true => &problem.next,
            false => &problem.past,
        })
    }

    /// Whether tools push the last published state.
    pub fn pushes(&self) -> bool {
        self.past(false).is_some_and(|past| !past.forces.is_empty())
    }

    /// The tools' loads at the contact nodes of the last step, in the host's order: what the tissue does to them, mN.
    pub fn loads_at_contacts(&self, states: &StepStates, out: &mut [f32]) {
        out.fill(0.0);
        let Some(problem) = &self.problem else {
            return;
        };
        problem.each_push(|node, force| {
            if let Ok(at) = states.contact.nodes.binary_search(&node) {
                let at = 3 * states.contact.order[at] as usize;
                for (sum, force) in out[at..at + 3].iter_mut().zip(force.to_array()) {
                    *sum -= force;
                }
            }
        });
    }

    /// A copy of what contact remembers, where there is any.
    ///
    /// None is written where there is nothing, so that scenes without tools have short snapshots.
    pub fn saved(&self) -> Result<Option<Past>> {
        match self.past(false) {
            Some(past) if !past.is_empty() => past.copy().map(Some),
            _ => Ok(None),
        }
    }

    /// Takes what was saved or admitted.
    pub fn put(&mut self, body: &SceneBody, past: Option<Past>) -> Result<()> {
        match past {
            Some(past) => made(&mut self.problem, body)?.past = past,
            None => {
                if let Some(problem) = &mut self.problem {
                    problem.past.clear();
                }
            }
        }
        Ok(())
    }

    /// Takes what pushes and holds the tissue from before the body was cut: the same points of it have other rows now.
    pub fn follow(&mut self, before: (&ToolContact, &SceneBody), body: &SceneBody) -> Result<()> {
        let (before, body_before) = before;
        let Some(past) = before.past(false) else {
            return Ok(());
        };
        // Rows are numbers of samples: a cut gives the surface other samples, and the same point of the tissue another number.
        let mut past = past.copy()?;
        let held = past.tools.iter().flat_map(|held| held.grasp.anchors());
        let pushed = past.forces.iter().map(|force| force.sample);
        let pushed = pushed.filter(|row| tie_of(*row).is_none());
        let count = held.clone().count() + past.forces.len();
        let all = held.map(|own| own.sample).chain(pushed);
        let mut rows = memory::collected(count, all, WHAT)?;
        rows.sort_unstable();
        rows.dedup();
        let samples = [body_before.model.samples()?, body.model.samples()?];
        let found = ::contact::followed(&samples[0], &samples[1], &rows);
        let found = memory::tried(found, WHAT)?;
        // A tie's row is its place in the list, whatever becomes of the surface.
        let renamed = |row: u32| match tie_of(row) {
            Some(_) => Some(row),
            None => rows.binary_search(&row).ok().and_then(|at| found[at]),
        };
        past.forces.retain_mut(|force| match renamed(force.sample) {
            Some(row) => {
                force.sample = row;
                true
            }
            None => false,
        });
        // Two samples of before may be one now: forces are found by binary search, each once.
        past.forces.sort_unstable_by_key(Force::key);
        past.forces.dedup_by_key(|force| force.key());
        for held in &mut past.tools {
            held.grasp.rename(renamed);
        }
        self.put(body, Some(past))
    }

    /// Bytes of what is saved of it, at most.
    pub fn saved_bytes(&self, body: &SceneBody) -> usize {
        // A sample may be pushed and held by each of the tools; more than all samples once is never seen.
        let faces = body.mesh.domain.faces.len() / 3 + body.mesh.domain.opened.pieces.len();
        let ties = self.past(false).map_or(0, |past| past.ties.len());
        64 * MAX_TOOLS + 4096 + 16 * 64 * faces + 160 * ties
    }
}

/// The problem of a body; made where there is none yet.
fn made<'a>(
    problem: &'a mut Option<Proven<Instruments, ContactProblem>>,
    body: &SceneBody,
) -> Result<&'a mut ContactProblem> {
    match problem {
        Some(problem) => Ok(problem),
        none => {
            let make = || {
                ContactProblem::new(
                    body.model.samples()?,
                    Arc::clone(&body.mesh),
                    body.model.execution.isa,
                )
            };
            Ok(none.insert(Proven::new(make, WHAT)?))
        }
    }
}

/// # Errors
/// [`Error::Unsupported`] for ties in a scene that makes no corrections.
fn check_ties(ties: &[Tie], corrects: bool) -> Result<()> {
    match ties.is_empty() || corrects {
        true => Ok(()),
        false => Err(Error::Unsupported(
            "ties: the scene makes no corrections, in which ties pull; set `corrections`".into(),
        )),
    }
}
