//! The tissue at the present moment: between steps, and while one is in flight, with the instruments where they are now.
//!
//! A time `tau` after the last published step `n`, `u = u_n + tau v_n + A_k(tau) B^T (f - f_n)`: the last velocities go on, and contact is solved at the
//! instruments' poses with the compliance of that time, `kappa = 9/(4 tau²) + 3 alpha/(2 tau)`. When a step arrives, what it puts
//! elsewhere than the frame before is blended in over a step's time.

use std::sync::RwLock;

use super::Scene;
use super::core::{Core, lock_read, lock_write};
use super::published::Published;
use super::tools::lock;
use crate::contact::{Compliance, Past, Problem, State, Tool};
use crate::error::{Error, Result};
use crate::kernels::respond::accumulate_rows;
use crate::kernels::rows::{RowPlan, decode_rows};
use crate::kernels::{FlushToZero, Isa, Pool};
use crate::memory;
use crate::model::Model;

const WHAT: &str = "the present state of a scene";
/// Below this nothing has moved since the step, s.
const AT_ONCE_S: f64 = 1e-5;
/// The last velocities are followed for at most this many steps.
const MOST_STEPS: f64 = 2.0;

/// What a published step leaves for frames after it.
#[derive(Debug, Default)]
pub struct Moment {
    /// `[K,3]`, mm/s.
    pub velocity: Vec<f32>,
    /// Where the tools were, and their forces.
    pub past: Past,
    /// Steps made, by which a new one is known.
    pub step: u64,
}

/// What makes frames. One thread at a time.
pub struct Presenter {
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
    /// In the region: what the contact moves, the frame before, what is blended in, `[n,3]`.
    moved: Vec<f32>,
    shown: Vec<f32>,
    offset: Vec<f32>,
    coordinates: Vec<f32>,
    natural: Vec<f32>,
    held_back: Vec<f32>,
    rows: Vec<u32>,
    /// The frame before: its time after its step, and its tools.
    before_s: f64,
    before: Vec<Tool>,
}

impl Presenter {
    fn new(scene: &Scene) -> Result<Presenter> {
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
            .held_back(corrections.integrator.kappa())
            .len();
        Ok(Presenter {
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
            coordinates: memory::zeros(prior.width(), WHAT)?,
            natural: memory::zeros(natural, WHAT)?,
            held_back: memory::zeros(natural, WHAT)?,
            rows: memory::collected(natural, 0..natural as u32, WHAT)?,
            before_s: 0.0,
            before: Vec::new(),
        })
    }

    /// Takes the region of the host's output.
    fn take_region(&mut self, model: &Model, shared: &Published) -> Result<()> {
        let count = self.last.len() / 3;
        let wanted = shared.region.as_deref();
        let same = match wanted {
            Some(region) => self.region == region,
            None => self.region.len() == count && self.region.is_sorted(),
        };
        if same && !self.region.is_empty() {
            return Ok(());
        }
        let Some(prior) = &model.prior else {
            return Ok(());
        };
        let region = match wanted {
            Some(region) => memory::copied(region, WHAT)?,
            None => memory::collected(count, 0..count as u32, WHAT)?,
        };
        self.plan = RowPlan::try_region(&prior.basis(), &region, true)?;
        for list in [&mut self.moved, &mut self.shown, &mut self.offset] {
            *list = memory::zeros(3 * region.len(), WHAT)?;
        }
        self.region = region;
        self.step = None;
        Ok(())
    }

    /// Takes a new step.
    fn take_step(&mut self, shared: &Published, moment: &Moment) {
        self.last.copy_from_slice(&shared.last.field);
        self.velocity.copy_from_slice(&moment.velocity);
        self.problem.past.take(&moment.past);
    }

    /// The region's displacements, `tau` after the last step, into `out`; nothing blended in.
    fn compute(&mut self, scene: &Scene, tau: f64, tools: &[Tool], out: &mut [f32]) -> Result<()> {
        let model = &scene.model;
        let (Some(prior), corrections) = (&model.prior, model.corrections()?) else {
            return Ok(());
        };
        // In contact the instruments keep the velocities up; free, the damping takes them.
        let alpha = corrections.integrator.damping_per_s;
        let along = match self.problem.pushed() || alpha <= 0.0 {
            true => tau as f32,
            false => (-(-alpha * tau).exp_m1() / alpha) as f32,
        };
        for ((free, last), velocity) in self.free.iter_mut().zip(&self.last).zip(&self.velocity) {
            *free = last + along * velocity;
        }
        let rest = &scene.mesh.positions;
        self.problem.begin(tools, rest, &self.last)?;
        let state = State {
            rest,
            u: &self.free,
            start: &self.last,
        };
        let mut pushed = false;
        if tau > AT_ONCE_S && self.problem.is_near(state) {
            let kappa = corrections.integrator.over(tau).kappa();
            self.held_back
                .copy_from_slice(&corrections.space.held_back(kappa));
            let compliance = Compliance {
                prior,
                held: &self.held,
                inertia: Some((&corrections.space, &self.held_back)),
            };
            self.problem.forget_columns();
            let change = self.problem.solve(compliance, state, 1.0)?;
            self.natural.fill(0.0);
            for (&dof, force) in change.dofs.iter().zip(change.forces) {
                let own = corrections.space.at_contact(dof as usize);
                for ((y, held_back), own) in self.natural.iter_mut().zip(&self.held_back).zip(own) {
                    *y -= held_back * own * force;
                }
            }
            let failed = |error: crate::kernels::PoolError| Error::Panic(error.to_string());
            let (isa, pool, q) = (self.isa, &self.pool, &mut self.coordinates);
            let modes = corrections.space.modes();
            accumulate_rows(isa, pool, modes, &self.rows, &self.natural, false, q)
                .map_err(failed)?;
            let response = prior.response.stored();
            accumulate_rows(isa, pool, response, change.dofs, change.forces, true, q)
                .map_err(failed)?;
            decode_rows(isa, pool, &prior.basis(), &self.plan, q, &mut self.moved)
                .map_err(failed)?;
            pushed = true;
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

    /// Bytes held.
    fn memory_bytes(&self) -> usize {
        // The published moment holds velocities too.
        let lists = self.last.len()
            + 2 * self.velocity.len()
            + self.free.len()
            + self.region.len()
            + self.moved.len()
            + self.shown.len()
            + self.offset.len()
            + self.coordinates.len();
        4 * lists + self.held.len() + self.plan.memory_bytes() + self.problem.memory_bytes()
    }
}

impl Scene {
    /// The displacements `[n,3]` of the region `seconds` after the last published step, with instruments where they are then.
    ///
    /// # Errors
    /// [`Error::NonFinite`] and [`Error::Argument`] for a time or an instrument, [`Error::Unsupported`] for a bundle without linear response or
    /// corrections or a scene that does not correct, [`Error::Busy`] while another thread presents, and at the first call while a step is in flight.
    pub fn present(&self, seconds: f64, tools: &[Tool], out: &mut [f32]) -> Result<()> {
        if !seconds.is_finite() {
            return Err(Error::NonFinite(format!("seconds is {seconds}")));
        }
        if seconds < 0.0 {
            return Err(Error::Argument(format!(
                "seconds is {seconds}; it is the time since the last step, 0 or more"
            )));
        }
        self.check_out(out.len())?;
        let _flush = FlushToZero::enter();
        let mut place = lock(&self.tools.presenter)?;
        if place.is_none() {
            let mut made = Box::new(Presenter::new(self)?);
            self.with(|core, published| core.begin_moments(published))?;
            made.step = None;
            *place = Some(made);
        }
        let Some(presenter) = place.as_mut() else {
            return Ok(());
        };
        let step_s = self.model.manifest.dt_s;
        let tau = seconds.min(MOST_STEPS * step_s);
        let shared = lock_read(&self.shared.published);
        presenter.take_region(&self.model, &shared)?;
        let Some(moment) = &shared.moment else {
            return Err(Error::State("present: the scene keeps no moments".into()));
        };
        if presenter.step != Some(moment.step) {
            let known = presenter.step.is_some();
            presenter.take_step(&shared, moment);
            presenter.step = Some(moment.step);
            drop(shared);
            // What the frame before would have been after the new step: the difference is blended in.
            let mut offset = std::mem::take(&mut presenter.offset);
            if known {
                let before = std::mem::take(&mut presenter.before);
                let then = (presenter.before_s - step_s).max(0.0);
                let made = presenter.compute(self, then, &before, &mut offset);
                presenter.before = before;
                for (offset, shown) in offset.iter_mut().zip(&presenter.shown) {
                    *offset = shown - *offset;
                }
                presenter.offset = offset;
                made?;
            } else {
                offset.fill(0.0);
                presenter.offset = offset;
            }
        } else {
            drop(shared);
        }
        presenter.compute(self, tau, tools, out)?;
        // At its own time a step is shown as it is.
        if tau > AT_ONCE_S {
            let part = (1.0 - tau / step_s).max(0.0) as f32;
            for (out, offset) in out.iter_mut().zip(&presenter.offset) {
                *out += part * offset;
            }
        }
        presenter.shown.copy_from_slice(out);
        presenter.before_s = tau;
        presenter.before.clear();
        presenter.before.extend_from_slice(tools);
        Ok(())
    }

    /// Bytes of what presents.
    pub(super) fn presenter_bytes(&self) -> usize {
        let presenter = lock(&self.tools.presenter);
        presenter.map_or(0, |place| place.as_ref().map_or(0, |p| p.memory_bytes()))
    }
}

impl Core {
    /// From now on each published step leaves a moment.
    fn begin_moments(&mut self, published: &RwLock<Published>) -> Result<()> {
        if self.corrected.is_none() {
            return Err(Error::Unsupported(
                "present: the scene does not correct (`corrections`); show its steps by upt_scene_sample".into(),
            ));
        }
        let mut shared = lock_write(published);
        if shared.moment.is_none() {
            let len = shared.last.field.len();
            shared.moment = Some(Moment {
                velocity: memory::zeros(len, WHAT)?,
                past: Past::with_room(1024)?,
                step: 0,
            });
        }
        self.leave_moment(&mut shared);
        Ok(())
    }

    /// Leaves the moment of the state that has just been published, where frames are made of it.
    pub(super) fn leave_moment(&self, shared: &mut Published) {
        let (Some(moment), Some(corrected)) = (&mut shared.moment, &self.corrected) else {
            return;
        };
        moment
            .velocity
            .copy_from_slice(&corrected.stage.motion.velocity);
        match &self.problem {
            Some(problem) => moment.past.take(&problem.past),
            None => moment.past.clear(),
        }
        moment.step += 1;
    }
}
