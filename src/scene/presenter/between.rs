//! The tissue a time `tau` after a step `n`: `u = u_n + tau v_n + A_k(tau) B^T (f - f_n)`.
//!
//! The last velocities go on, as far as the tools do ([`super::extrapolation`]), and contact is
//! solved at the instruments' poses with the compliance of that time,
//! `kappa = 9/(4 tau²) + 3 alpha/(2 tau)`.

use std::mem::swap;
use std::sync::Arc;

use super::contact_response::{ContactResponse, FrameModes};
use super::extrapolation::VelocityExtrapolation;
use super::known_step::{KnownStep, StepState};
use super::led::LedGroups;
use super::nodes::{DrivenNodes, ResponseContext};
use super::solves::{Drive, Moves, SolveKey, Solves};
use super::touched::{ShownTissue, TouchedTissue};
use crate::contact::problem::Change;
use crate::contact::{Compliance, ContactProblem, State};
use crate::error::{Error, Result};
use crate::kernels::rows::{RowPlan, decode_rows};
use crate::kernels::{Machine, Pool};
use crate::memory::{self, HeldBytes};
use crate::scene::frame_state::FrameState;
use crate::scene::step_input::{Contact, FrameInput};
use crate::scene::supports;
use crate::scene::tissue::Tissue;

pub(super) const WHAT: &str = "the present state of a scene";
/// Below this nothing has moved since the step, s.
pub(super) const AT_ONCE_S: f64 = 1e-5;
/// How often the contact of a tool that has lost it is solved again: as often as in a step.
const MORE_PRESSES: u32 = 6;
/// The last velocities are followed for at most this many steps: the next one may be late by one.
const MOST_STEPS: f64 = 2.0;

/// The nodes that are shown.
pub(super) struct ShownNodes<'a> {
    pub region: &'a [u32],
    /// Their rows of the linear response.
    pub plan: &'a RowPlan,
    /// Room for what the contact moves there, `[n,3]`.
    pub moved: &'a mut [f32],
}

/// A step, and what its tissue does after it.
#[derive(HeldBytes)]
pub(super) struct Between {
    /// Contact at the poses of the frame. Its past is that of the known step, never of a frame: frames leave no trace.
    problem: ContactProblem,
    pub known: StepState,
    /// The step before the known one, or what the next is read into.
    other: KnownStep,
    /// Of one thread: the scene's own pool may be at work on a step.
    #[held(skip)]
    machine: Machine,
    /// By node: whether the mesh holds it.
    held: Vec<bool>,
    pub shown: ShownTissue,
    modes: FrameModes,
    /// How much of the last velocities goes on at each place.
    extrapolation: VelocityExtrapolation,
    /// Contact at nodes in place of tools.
    nodes: DrivenNodes,
    /// Support groups where the frame's input has them.
    led: LedGroups,
}

impl Between {
    /// For the scene's body; it knows no step yet.
    pub(super) fn new(scene: &Tissue<'_>) -> Result<Between> {
        let model = scene.model;
        let (Some(prior), Ok(corrections)) = (&model.prior, model.corrections()) else {
            return Err(Error::Unsupported(
                "present: the bundle has no linear response or no corrections; show its steps with upt_scene_sample".into(),
            ));
        };
        let count = scene.mesh.node_count();
        let field = || memory::zeros(3 * count, WHAT);
        let mut held = memory::filled(count, false, WHAT)?;
        for &node in &scene.mesh.held_nodes {
            held[node as usize] = true;
        }
        let problem = ContactProblem::new(
            model.samples()?,
            Arc::clone(&model.mesh),
            model.execution.isa,
        )?;
        Ok(Between {
            shown: ShownTissue {
                free: field()?,
                touched: TouchedTissue::new(prior, problem.surface.samples.all_nodes(), count)?,
                solve: None,
            },
            problem,
            known: StepState {
                step: None,
                last: field()?,
                velocity: field()?,
            },
            other: KnownStep {
                last: field()?,
                velocity: field()?,
                ..KnownStep::default()
            },
            machine: Machine {
                isa: model.execution.isa,
                pool: Pool::of(model.execution.isa, 1)
                    .map_err(|error| Error::Argument(error.to_string()))?,
            },
            held,
            modes: FrameModes::new(corrections.space.natural_count())?,
            extrapolation: VelocityExtrapolation::new()?,
            nodes: DrivenNodes::new()?,
            led: LedGroups::default(),
        })
    }

    /// Takes a step's state `[K,3]` and moment, which are `later_s` after those of the step before; none where nothing was known before.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`]: nothing has changed.
    pub(super) fn take(
        &mut self,
        state: &[f32],
        frame_state: &FrameState,
        later_s: Option<f64>,
    ) -> Result<()> {
        let other = &mut self.other;
        match later_s {
            Some(seconds) => {
                (other.paths).follow(&self.extrapolation.paths, &self.problem, seconds)?
            }
            None => other.paths.forget(),
        }
        other.last.copy_from_slice(state);
        other.velocity.copy_from_slice(&frame_state.velocity);
        other.past.take(&frame_state.past)?;
        memory::replace(&mut other.then, &frame_state.nodes, WHAT)?;
        memory::replace(&mut other.forces, &frame_state.forces, WHAT)?;
        supports::copy(&frame_state.groups, &mut other.groups)?;
        other.step = Some(frame_state.step);
        self.give_back();
        Ok(())
    }

    /// Exchanges the known step and the other: takes the last [`Between::take`] back.
    pub(super) fn give_back(&mut self) {
        let KnownStep {
            step,
            last,
            velocity,
            past,
            then,
            forces,
            groups,
            paths,
        } = &mut self.other;
        swap(&mut self.known.step, step);
        swap(&mut self.known.last, last);
        swap(&mut self.known.velocity, velocity);
        swap(&mut self.problem.past, past);
        swap(&mut self.nodes.of_step.then, then);
        swap(&mut self.nodes.of_step.forces, forces);
        swap(&mut self.led.states, groups);
        swap(&mut self.extrapolation.paths, paths);
    }

    /// The displacements of a view's nodes `tau` after the step, into `out [n,3]`.
    ///
    /// # Errors
    /// Those of [`Scene::present`] for the tools or nodes.
    pub(super) fn show(
        &mut self,
        scene: &Tissue<'_>,
        tau: f64,
        driven: FrameInput<'_>,
        (view, solves): (ShownNodes<'_>, &mut Solves),
        out: &mut [f32],
    ) -> Result<()> {
        let model = scene.model;
        let (Some(prior), corrections, Some(step)) =
            (&model.prior, model.corrections()?, self.known.step)
        else {
            return Ok(());
        };
        // A host that stops stepping sees the tissue come to a stand, not drift away.
        let tau = tau.min(MOST_STEPS * scene.integrator.step_s);
        let alpha = scene.integrator.damping_per_s;
        let rest = scene.mesh.positions.as_slice();
        // Without a drive the tools of the last step have left, or its nodes are released.
        let FrameInput { contact, supports } = driven;
        let driven = match contact {
            Contact::None if self.nodes.of_step.then.is_empty() => Contact::Tools(&[]),
            other => other,
        };
        let (last, velocity) = (self.known.last.as_slice(), self.known.velocity.as_slice());
        match driven {
            Contact::Tools(tools) => {
                self.extrapolation
                    .look(&self.problem, tools, (rest, last), (tau, alpha));
            }
            nodes => {
                nodes.gather(&mut self.nodes.now, [scene.intact_nodes, self.held.len()])?;
                let stretch = self
                    .nodes
                    .of_step
                    .stretch(&self.nodes.now, last, velocity, tau);
                self.extrapolation.follow_evenly(stretch, (tau, alpha));
            }
        }
        let (fields, groups) = ((rest, last, velocity), corrections.groups.as_slice());
        self.led.look(
            (scene.mesh, groups),
            supports,
            &self.extrapolation,
            fields,
            &mut self.shown.free,
        )?;
        let question = SolveKey {
            step,
            tau,
            extrapolation: &self.extrapolation,
            led: self.led.key(),
            drive: match driven {
                Contact::Tools(tools) => Drive::Tools(tools),
                _ => Drive::Nodes(&self.nodes.now),
            },
        };
        // Two views of one moment ask the same: the contact is solved once for them.
        let known = solves.find(&question);
        // What is shown, and where contact is looked at.
        let touched = match (known, question.drive) {
            (Some(_), Drive::Nodes(_)) => &[][..],
            (_, Drive::Tools(_)) => self.problem.surface.samples.all_nodes(),
            (None, Drive::Nodes(now)) => &now.nodes,
        };
        for nodes in [touched, view.region] {
            let moved = |node, u| self.led.moved(groups, node, u);
            self.extrapolation
                .follow(nodes, fields, moved, &mut self.shown.free);
        }
        let make = |q: &mut [f32]| -> Result<Moves> {
            let kappa = scene.integrator.over(tau.max(AT_ONCE_S)).kappa();
            // As many as before.
            self.modes.inertial_compliance.clear();
            self.modes
                .inertial_compliance
                .extend(corrections.space.holds_back(kappa));
            let response = ContactResponse {
                isa: self.machine.isa,
                pool: &self.machine.pool,
                prior,
                space: &corrections.space,
                inertial_compliance: &self.modes.inertial_compliance,
                rows: &self.modes.rows,
            };
            let tools = match question.drive {
                Drive::Tools(tools) => tools,
                Drive::Nodes(now) => {
                    let near = !now.is_empty() || !self.nodes.of_step.then.is_empty();
                    if tau <= AT_ONCE_S || !near {
                        return Ok(Moves::Nothing);
                    }
                    let means = ResponseContext {
                        isa: self.machine.isa,
                        prior,
                        space: &corrections.space,
                        inertial_compliance: &self.modes.inertial_compliance,
                        held: &self.held,
                    };
                    self.nodes.of_step.solve(&means, now, &self.shown.free)?;
                    let change = Change {
                        dofs: &self.nodes.of_step.dofs,
                        forces: &self.nodes.of_step.change,
                    };
                    response.add(change, &mut self.modes.natural, false, q)?;
                    return Ok(Moves::Pushed);
                }
            };
            // Where the tissue goes on as it went a quick or thin tool may have lost it, as often as it is pressed, or flung it: then it stays where the step left it.
            for pushed in [Moves::Pushed, Moves::Stays] {
                if pushed == Moves::Stays {
                    let nodes = self.problem.surface.samples.all_nodes();
                    self.led.stay(groups, nodes, last, &mut self.shown.free);
                    q.fill(0.0);
                }
                self.problem.begin_frame(tools, rest, last)?;
                self.problem.tied.step_s = tau as f32;
                let state = State {
                    rest,
                    u: &self.shown.free,
                    start: last,
                };
                if tau <= AT_ONCE_S || !self.problem.is_near(state)? {
                    return Ok(match pushed {
                        Moves::Stays => Moves::Stays,
                        _ => Moves::Nothing,
                    });
                }
                let compliance = Compliance::at_rest(
                    prior,
                    &self.held,
                    Some((&corrections.space, &self.modes.inertial_compliance)),
                );
                let change = self.problem.solve_between(compliance, state)?;
                response.add(change, &mut self.modes.natural, false, q)?;
                // As in a step: a quick or thin tool that has lost the contact is pressed again about where the tissue has come to.
                for press in 0..=MORE_PRESSES {
                    if !self.problem.ways.may_lose() || self.problem.work.is_spent() {
                        return Ok(pushed);
                    }
                    let means = (self.machine.isa, &self.machine.pool, &**prior);
                    let nodes = (self.problem.surface.samples.all_nodes(), &*self.held);
                    self.shown
                        .touched
                        .place(means, nodes, &self.shown.free, Some(q))?;
                    if !(self.shown.touched).has_lost(&mut self.problem, rest, last) {
                        if !self.shown.touched.has_flung(&self.problem) {
                            return Ok(pushed);
                        }
                        q.fill(0.0);
                        break;
                    }
                    if press == MORE_PRESSES {
                        break;
                    }
                    let u = self.shown.touched.displacement();
                    let change = (self.problem).solve_between(compliance, State { u, ..state })?;
                    response.add(change, &mut self.modes.natural, true, q)?;
                }
            }
            Ok(Moves::Stays)
        };
        let place = match known {
            Some(place) => place,
            None => solves.make(&question, prior.width(), make)?,
        };
        self.shown.solve = Some(place);
        if solves.stays(place) {
            let nodes = self.problem.surface.samples.all_nodes().iter();
            let nodes = nodes.chain(view.region);
            self.led.stay(groups, nodes, last, &mut self.shown.free);
        }
        let moves = solves.moves(place);
        if let Some(q) = moves {
            decode_rows(
                self.machine.isa,
                &self.machine.pool,
                &prior.basis(),
                view.plan,
                q,
                view.moved,
            )?;
        }
        let nodes = out.as_chunks_mut::<3>().0.iter_mut().zip(view.region);
        for ((out, &node), moved) in nodes.zip(view.moved.as_chunks::<3>().0) {
            let free = &self.shown.free.as_chunks::<3>().0[node as usize];
            *out = match (self.held[node as usize], moves) {
                // It goes on as it went: on, or nowhere.
                (true, _) => *free,
                (false, Some(_)) => std::array::from_fn(|k| free[k] + moved[k]),
                (false, None) => *free,
            };
        }
        Ok(())
    }
}

impl Between {
    /// Whether the frame that [`Between::show`] has made last would lose the contact of a quick or thin tool with these displacements at
    /// the region's nodes.
    ///
    /// # Errors
    /// Those of [`Between::show`].
    pub(super) fn sinks(
        &mut self,
        scene: &Tissue<'_>,
        driven: FrameInput<'_>,
        solves: &Solves,
        (region, u): (&[u32], &[f32]),
    ) -> Result<bool> {
        let (Some(prior), Contact::Tools(tools)) = (&scene.model.prior, driven.contact) else {
            return Ok(false);
        };
        let (rest, last) = (scene.mesh.positions.as_slice(), self.known.last.as_slice());
        self.problem.begin_frame(tools, rest, last)?;
        if !self.problem.ways.may_lose() {
            return Ok(false);
        }
        let q = self.shown.solve.and_then(|place| solves.moves(place));
        let nodes = (self.problem.surface.samples.all_nodes(), &*self.held);
        let means = (self.machine.isa, &self.machine.pool, &**prior);
        self.shown
            .touched
            .place(means, nodes, &self.shown.free, q)?;
        self.shown.touched.replace(region, u);
        Ok(self.shown.touched.has_lost(&mut self.problem, rest, last))
    }
}
