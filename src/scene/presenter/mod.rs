//! What makes frames between steps.
//!
//! A time `tau` after the last published step `n`, `u = u_n + tau v_n + A_k(tau) B^T (f - f_n)`: the last velocities go on, as far as the tools
//! do ([`along`]), and contact is solved at the instruments' poses with the compliance of that time, `kappa = 9/(4 tau²) + 3 alpha/(2 tau)`. When a step arrives, the frame goes on
//! from where it would have been without it, and over to it within two fifths of a step, or at 25 mm/s where that takes longer.

mod along;
mod nodes;

use std::sync::Arc;

use super::core::lock_read;
use super::points::AttachedPoints;
use super::present::Moment;
use super::published::{Published, Values};
use super::{Contact, Scene};
use crate::contact::problem::Change;
use crate::contact::{Compliance, Problem, State};
use crate::error::{Error, Result};
use crate::kernels::respond::accumulate_rows;
use crate::kernels::rows::{RowPlan, decode_rows};
use crate::kernels::{Isa, Pool};
use crate::memory;
use crate::model::Model;
use crate::output::Output;
use along::Along;
use nodes::{Means, Nodes};

const WHAT: &str = "the present state of a scene";
/// Below this nothing has moved since the step, s.
const AT_ONCE_S: f64 = 1e-5;
/// The last velocities are followed for at most this many steps.
const MOST_STEPS: f64 = 2.0;
/// A frame goes over from one step to the next within this many steps (longer carries the older step's error on), or at this
/// speed, mm/s, where the way is long (faster is seen as a jerk).
const BLEND_STEPS: f64 = 0.4;
const BLEND_MM_S: f64 = 25.0;

/// What makes frames. One thread at a time.
pub struct Presenter {
    /// What it shows: the region, or the attached points by the nodes around them.
    values: Values,
    attached: Arc<AttachedPoints>,
    problem: Problem,
    pool: Pool,
    isa: Isa,
    held: Vec<bool>,
    /// State of the last step, its velocity, and its tissue at the moment asked for, `[K,3]`.
    last: Vec<f32>,
    velocity: Vec<f32>,
    free: Vec<f32>,
    step: Option<u64>,
    /// The region and its rows.
    region: Vec<u32>,
    plan: RowPlan,
    /// In the region: what the contact moves, what the step before would show, how far that is from what the last one shows, `[n,3]`.
    moved: Vec<f32>,
    shown: Vec<f32>,
    offset: Vec<f32>,
    /// The frame at the region's nodes.
    nodal: Vec<f32>,
    /// Longest of the offsets, mm.
    longest: f32,
    coordinates: Vec<f32>,
    natural: Vec<f32>,
    held_back: Vec<f32>,
    rows: Vec<u32>,
    /// Time of the last frame before the last step was seen, after that step: from there the way over to it goes.
    seen_s: f64,
    along: Along,
    nodes: Box<Nodes>,
    /// Time of the last frame, after its step.
    before_s: f64,
}

impl Presenter {
    pub fn new(scene: &Scene, values: Values) -> Result<Presenter> {
        let model = &scene.model;
        let (Some(prior), Ok(corrections)) = (&model.prior, model.corrections()) else {
            return Err(Error::Unsupported(
                "present: the bundle has no linear response or no corrections; show its steps by upt_scene_sample".into(),
            ));
        };
        let count = scene.node_count();
        let field = || memory::zeros(3 * count, WHAT);
        let mut held = memory::filled(count, false, WHAT)?;
        for &node in &scene.mesh.held_nodes {
            held[node as usize] = true;
        }
        let natural = corrections
            .space
            .held_back(corrections.pace.integrator.kappa())
            .len();
        Ok(Presenter {
            values,
            attached: Arc::default(),
            problem: Problem::new(model.samples()?)?,
            pool: Pool::new(1).map_err(|error| Error::Argument(error.to_string()))?,
            isa: Isa::detect(),
            held,
            last: field()?,
            velocity: field()?,
            free: field()?,
            step: None,
            region: Vec::new(),
            plan: RowPlan::default(),
            moved: Vec::new(),
            shown: Vec::new(),
            offset: Vec::new(),
            nodal: Vec::new(),
            longest: 0.0,
            coordinates: memory::zeros(prior.width(), WHAT)?,
            natural: memory::zeros(natural, WHAT)?,
            held_back: memory::zeros(natural, WHAT)?,
            rows: memory::collected(natural, 0..natural as u32, WHAT)?,
            seen_s: 0.0,
            along: Along::new()?,
            nodes: Box::default(),
            before_s: 0.0,
        })
    }

    /// Takes the nodes of the host's output of `len` floats.
    fn take_region(&mut self, model: &Model, shared: &Published, len: usize) -> Result<()> {
        shared.check_len(self.values, len)?;
        let count = self.last.len() / 3;
        let wanted = shared.region.as_deref();
        let same = match (self.values, wanted) {
            (Values::Points, _) => Arc::ptr_eq(&self.attached, &shared.attached),
            (Values::Region, Some(region)) => self.region == region,
            (Values::Region, None) => self.region.len() == count && self.region.is_sorted(),
        };
        if same && !self.region.is_empty() {
            return Ok(());
        }
        let Some(prior) = &model.prior else {
            return Ok(());
        };
        let region = match (self.values, wanted) {
            (Values::Points, _) => {
                let mut nodes = memory::copied(shared.attached.needed_nodes(), WHAT)?;
                nodes.sort_unstable();
                nodes.dedup();
                nodes
            }
            (Values::Region, Some(region)) => memory::copied(region, WHAT)?,
            (Values::Region, None) => memory::collected(count, 0..count as u32, WHAT)?,
        };
        self.plan = RowPlan::try_region(&prior.basis(), &region, true)?;
        let lists = [&mut self.moved, &mut self.shown, &mut self.offset];
        for list in lists.into_iter().chain([&mut self.nodal]) {
            *list = memory::zeros(3 * region.len(), WHAT)?;
        }
        self.region = region;
        if self.values == Values::Points {
            self.attached = Arc::clone(&shared.attached);
        }
        self.step = None;
        Ok(())
    }

    /// Takes a new step.
    fn take_step(&mut self, shared: &Published, moment: &Moment, later_s: Option<f64>) {
        match later_s {
            Some(seconds) => self.along.keep(&self.problem, seconds),
            None => self.along.forget(),
        }
        self.last.copy_from_slice(&shared.last.field);
        self.velocity.copy_from_slice(&moment.velocity);
        self.problem.past.take(&moment.past);
        self.nodes.then.clear();
        self.nodes.then.extend_from_slice(&moment.nodes);
        self.nodes.forces.clear();
        self.nodes.forces.extend_from_slice(&moment.forces);
    }

    /// The region's displacements, `tau` after the last step, into `out`; nothing blended in.
    fn compute(
        &mut self,
        scene: &Scene,
        tau: f64,
        driven: Contact<'_>,
        out: &mut [f32],
    ) -> Result<()> {
        let model = &scene.model;
        let (Some(prior), corrections) = (&model.prior, model.corrections()?) else {
            return Ok(());
        };
        let tau = tau.min(MOST_STEPS * scene.step_s());
        let alpha = corrections.pace.integrator.damping_per_s;
        let rest = &scene.mesh.positions;
        let kappa = corrections.pace.integrator.over(tau.max(AT_ONCE_S)).kappa();
        self.held_back
            .copy_from_slice(&corrections.space.held_back(kappa));
        let (last, velocity) = (&self.last, &self.velocity);
        let change = match driven {
            Contact::Tools(tools) => {
                self.along
                    .look(&self.problem, tools, (rest, last), (tau, alpha));
                self.along.follow(rest, last, velocity, &mut self.free);
                self.problem.begin(tools, rest, last)?;
                let state = State {
                    rest,
                    u: &self.free,
                    start: last,
                };
                let compliance = Compliance {
                    prior,
                    held: &self.held,
                    inertia: Some((&corrections.space, &self.held_back)),
                };
                match tau > AT_ONCE_S && self.problem.is_near(state) {
                    true => Some(self.problem.solve_between(compliance, state)?),
                    false => None,
                }
            }
            nodes => {
                self.nodes.take(nodes, self.held.len())?;
                let stretch = self.nodes.stretch(last, velocity, tau);
                self.along.follow_evenly(stretch, (tau, alpha));
                self.along.follow(rest, last, velocity, &mut self.free);
                let near = !self.nodes.now.is_empty() || !self.nodes.then.is_empty();
                match tau > AT_ONCE_S && near {
                    true => {
                        let means = Means {
                            isa: self.isa,
                            prior,
                            space: &corrections.space,
                            held_back: &self.held_back,
                            held: &self.held,
                        };
                        self.nodes.solve(&means, &self.free)?;
                        Some(Change {
                            dofs: &self.nodes.dofs,
                            forces: &self.nodes.change,
                        })
                    }
                    false => None,
                }
            }
        };
        let pushed = change.is_some();
        if let Some(change) = change {
            self.natural.fill(0.0);
            for (&dof, force) in change.dofs.iter().zip(change.forces) {
                let own = corrections.space.at_contact(dof as usize);
                for ((y, held_back), own) in self.natural.iter_mut().zip(&self.held_back).zip(own) {
                    *y -= held_back * own * force;
                }
            }
            let (isa, pool, q) = (self.isa, &self.pool, &mut self.coordinates);
            let modes = corrections.space.modes();
            accumulate_rows(isa, pool, modes, &self.rows, &self.natural, false, q)?;
            let response = prior.response.stored();
            accumulate_rows(isa, pool, response, change.dofs, change.forces, true, q)?;
            decode_rows(isa, pool, &prior.basis(), &self.plan, q, &mut self.moved)?;
        }
        for (i, &node) in self.region.iter().enumerate() {
            let at = 3 * node as usize;
            for axis in 0..3 {
                let moved = if pushed {
                    self.moved[3 * i + axis]
                } else {
                    0.0
                };
                out[3 * i + axis] = match self.held[node as usize] {
                    true => 0.0,
                    false => self.free[at + axis] + moved,
                };
            }
        }
        Ok(())
    }

    /// The region or the points `tau` after the last published step, into `out`.
    pub fn frame(
        &mut self,
        scene: &Scene,
        tau: f64,
        driven: Contact<'_>,
        out: Output<'_, f32>,
    ) -> Result<()> {
        let step_s = scene.step_s();
        let step = {
            let shared = lock_read(&scene.shared.published);
            self.take_region(&scene.model, &shared, out.len())?;
            step_of(&shared)?
        };
        let mut nodal = std::mem::take(&mut self.nodal);
        let made = match self.step == Some(step) {
            true => self.go_on(scene, tau, driven, &mut nodal),
            false => self.arrive(scene, (step, tau), driven, &mut nodal),
        };
        if made.is_ok() {
            self.before_s = tau;
            self.blend(tau, step_s, &mut nodal);
            match self.values {
                Values::Region => out.copy_from(&nodal),
                Values::Points => {
                    for (u, &node) in nodal.as_chunks::<3>().0.iter().zip(&self.region) {
                        self.free[3 * node as usize..][..3].copy_from_slice(u);
                    }
                    let out = out.filled(0.0);
                    self.attached.add_interpolated(1.0, &self.free, out);
                }
            }
        }
        self.nodal = nodal;
        made
    }

    /// A frame of the step that is known.
    fn go_on(
        &mut self,
        scene: &Scene,
        tau: f64,
        driven: Contact<'_>,
        out: &mut [f32],
    ) -> Result<()> {
        if tau < self.seen_s {
            // The host took the step for the one before when it first saw it.
            self.forget_apart();
            self.seen_s = tau;
        }
        self.compute(scene, tau, driven, out)
    }

    /// The first frame of a step.
    fn arrive(
        &mut self,
        scene: &Scene,
        (step, tau): (u64, f64),
        driven: Contact<'_>,
        out: &mut [f32],
    ) -> Result<()> {
        let step_s = scene.step_s();
        let known = self.step;
        let mut since_s = 0.0;
        if let Some(known) = known {
            // What the frame would have been without the new step: it goes on from there.
            let steps = step.saturating_sub(known) as f64;
            let then = tau + steps * step_s;
            since_s = (then - self.before_s).max(0.0);
            let mut shown = std::mem::take(&mut self.shown);
            let made = self.compute(scene, then, driven, &mut shown);
            self.blend(then, step_s, &mut shown);
            self.shown = shown;
            made?;
        }
        {
            let shared = lock_read(&scene.shared.published);
            self.step = Some(step_of(&shared)?);
            let later = known.map(|known| self.step.unwrap_or(known).saturating_sub(known));
            if let Some(moment) = &shared.moment {
                self.take_step(&shared, moment, later.map(|steps| steps as f64 * step_s));
            }
        }
        self.compute(scene, tau, driven, out)?;
        self.seen_s = tau - since_s;
        match known {
            Some(_) if tau > AT_ONCE_S => self.keep_apart(out),
            _ => self.forget_apart(),
        }
        Ok(())
    }

    /// How far the frame without the last step is from that with it.
    fn keep_apart(&mut self, out: &[f32]) {
        for ((offset, shown), out) in self.offset.iter_mut().zip(&self.shown).zip(out) {
            *offset = shown - out;
        }
        let lengths = self.offset.as_chunks::<3>().0.iter();
        self.longest = lengths.map(length).fold(0.0, f32::max);
    }

    fn forget_apart(&mut self) {
        self.offset.fill(0.0);
        self.longest = 0.0;
    }

    /// Takes a frame from where it would have been without the last step to where it is with it, within [`BLEND_STEPS`] or at [`BLEND_MM_S`].
    fn blend(&self, tau: f64, step_s: f64, out: &mut [f32]) {
        // At its own time a step is shown as it is.
        if tau <= AT_ONCE_S {
            return;
        }
        let since = (tau - self.seen_s).max(0.0);
        let part = (1.0 - since / (BLEND_STEPS * step_s)).max(0.0) as f32;
        let gone = (BLEND_MM_S * since) as f32;
        if part == 0.0 && self.longest <= gone {
            return;
        }
        let pairs = out.as_chunks_mut::<3>().0.iter_mut();
        for (out, offset) in pairs.zip(self.offset.as_chunks::<3>().0) {
            let part = part.max(1.0 - gone / length(offset).max(f32::MIN_POSITIVE));
            for (out, offset) in out.iter_mut().zip(offset) {
                *out += part * offset;
            }
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        // The published moment holds velocities too.
        let lists = self.last.len()
            + 2 * self.velocity.len()
            + self.free.len()
            + self.region.len()
            + self.moved.len()
            + self.shown.len()
            + self.offset.len()
            + self.nodal.len()
            + self.coordinates.len();
        4 * lists
            + self.along.memory_bytes()
            + self.nodes.memory_bytes()
            + self.held.len()
            + self.plan.memory_bytes()
            + self.problem.memory_bytes()
    }
}

fn length(v: &[f32; 3]) -> f32 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

/// Steps made, by which a new one is known.
fn step_of(shared: &Published) -> Result<u64> {
    match &shared.moment {
        Some(moment) => Ok(moment.step),
        None => Err(Error::State("present: the scene keeps no moments".into())),
    }
}
