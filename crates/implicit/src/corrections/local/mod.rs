//! Local iterations: all degrees of freedom near the tools, modes and responses elsewhere; an iteration costs what the tools touch.
//!
//! From a base `u_0`, whose residual is known at every node, the state is
//!
//! ```text
//! u = u_0 + t + Phi c        t on the inside nodes S only
//! r_S = F_S(u)                by the near elements
//! Phi^T r = p_0 + Phi^T eta + G c + far(c)        eta = what the near elements have added since, less (K + kappa M) Phi c
//! ```
//!
//! with `G = Phi^T (K + kappa M) Phi`, and `far` what the law adds in the far clusters ([`super::far`]): a Galerkin method on the modes and the
//! nodes near the tools. An iteration is L-BFGS around a preconditioner of two levels, the exact factor of the tangent close to the tools and the modes
//! ([`factor`]), the contact solved in it with the compliance of that preconditioner ([`columns`]), a search along the line.
//! The field is decoded once, at the end, when the far nodes get the preconditioner's first level of the base. `docs/decisions/023-local-iterations.md` says
//! what was tried.

mod centres;
mod clusters;
mod columns;
mod factor;
mod iteration;
mod linear;
mod linearisation;
mod near;
mod pairs;
mod record;
mod step;

use ::elements::Scratch;

use self::clusters::Clusters;
use self::columns::NearColumns;
use self::factor::NearFactor;
use self::linear::WHAT;
use self::near::NearSet;
use self::pairs::{Pairs, Room};
use self::step::{Change, Step, add, dot, resize};
use super::input::{Input, SolverContext};
use super::passes::add_smoothed;
use super::precondition::Preconditioner;
use crate::contact::ContactProblem;
use crate::error::Result;
use crate::kernels::vectors::PartialSums;
use crate::memory::{self, HeldBytes};

pub(super) use self::centres::add_centres;
pub use self::linearisation::Linearisation;
pub(super) use self::near::LEVELS;
pub use self::record::Record;

/// Far elements of a chunk that is near in part are looked at where its smallest det F is below this.
const LOOKED_AT_DET: f32 = 0.5;

/// What a solver lends to the iterations of a step.
pub(super) struct StepContext<'a> {
    pub context: SolverContext<'a>,
    pub input: &'a Input<'a>,
    pub preconditioner: &'a mut Preconditioner,
    pub scratch: &'a mut Scratch,
    /// What BDF2 takes from the past `[K,3]`, µN.
    pub drift: &'a [f32],
}

/// A state whose residual is known at every node.
#[derive(Clone, Copy)]
pub(super) struct Base<'a> {
    pub u: &'a [f32],
    pub residual: &'a [f32],
}

/// How an iteration went.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gain {
    /// It led to another state.
    pub is_better: bool,
    /// How deep tools and tissue lie in each other there, mm.
    pub sunk_mm: f32,
}

/// A scene's own part.
#[derive(HeldBytes)]
pub struct LocalSolver {
    near: NearSet,
    pub(super) pairs: Pairs,
    clusters: Clusters,
    pub(super) factor: NearFactor,
    columns: NearColumns,
    /// Nodes that the tools touch, thinned out: what the pairs are about.
    about: Vec<u32>,
    /// Since the base.
    now: Step,
    residual: Change,
    /// Forces of the near elements at the free nodes, inertia with them at the inside ones, at the base and of the next state, and what of the change
    /// is linear in `c`; `[3 free]`.
    base: Vec<f32>,
    inner: Vec<f32>,
    linear: Vec<f32>,
    /// `Phi^T r` at the base, and `G c` since.
    base_modes: Vec<f32>,
    stiff: Vec<f32>,
    /// The direction, and what is linear in it.
    d: Step,
    /// `Phi c` of the direction and of the steps since the base at the near nodes `[.., 3]`, by place.
    d_modes: Vec<f32>,
    modes: Vec<f32>,
    d_linear: Vec<f32>,
    d_stiff: Vec<f32>,
    /// The residual without the loads, as the first recursion changes it; that of the next state.
    reduced: Change,
    next: Change,
    /// Where the tissue would be `[K,3]`; at nodes that are not near, the base.
    trial: Vec<f32>,
    /// Of the whole body.
    mass_g: f64,
    /// Nodes that the tools touch, while a round begins.
    pub(super) touched: Vec<u32>,
    /// How far the next round reaches, a level of the near set.
    pub(super) level: usize,
    /// Smallest det F of the far elements at the base.
    far_det: f32,
    /// Smallest det F, and the root mean square that the last direction moves, mm.
    pub(super) det: f32,
    pub(super) moved_mm: f32,
    /// Root mean square over the nodes that the last smoothing of the far ones moved, mm.
    pub(super) far_mm: f32,
    /// Farthest that a far node has gone since the base, mm.
    pub(super) far_moved_mm: f32,
    partial: PartialSums,
    room: Room,
    on_modes: Vec<f32>,
    more_on_modes: Vec<f32>,
    solved: Vec<f32>,
    loads: Vec<(u32, f32)>,
}

impl LocalSolver {
    /// Buffers.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(context: SolverContext<'_>) -> Result<LocalSolver> {
        let env = context.env();
        let far = &context.corrections.far;
        let (count, width) = (env.space.count(), env.prior.width());
        let columns = (3 * env.prior.contact_nodes.len()).min(768);
        let modes = || memory::zeros(count, WHAT);
        Ok(LocalSolver {
            near: NearSet::new(env)?,
            pairs: Pairs::new(count)?,
            clusters: Clusters::new(far, count)?,
            factor: NearFactor::default(),
            columns: NearColumns::default(),
            about: memory::room(64, WHAT)?,
            now: Step::with_modes(count)?,
            residual: Change::with_modes(count)?,
            base: Vec::new(),
            inner: Vec::new(),
            linear: Vec::new(),
            base_modes: modes()?,
            stiff: modes()?,
            d: Step::with_modes(count)?,
            d_modes: Vec::new(),
            modes: Vec::new(),
            d_linear: Vec::new(),
            d_stiff: modes()?,
            reduced: Change::with_modes(count)?,
            next: Change::with_modes(count)?,
            trial: memory::zeros(3 * env.body.mass.len(), WHAT)?,
            mass_g: env.body.mass.iter().map(|&mass| f64::from(mass)).sum(),
            touched: memory::room(256, WHAT)?,
            level: 0,
            far_det: 1.0,
            det: 1.0,
            moved_mm: 0.0,
            far_mm: 0.0,
            far_moved_mm: 0.0,
            partial: PartialSums::with_room(3 * env.body.mass.len(), 1)?,
            room: Room {
                q: memory::zeros(width, WHAT)?,
                ..Room::default()
            },
            on_modes: modes()?,
            more_on_modes: modes()?,
            solved: modes()?,
            loads: memory::room(columns, WHAT)?,
        })
    }

    /// That of a solver, made at the first step that tools drive.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub(super) fn made<'a>(
        slot: &'a mut Option<Box<LocalSolver>>,
        context: SolverContext<'_>,
    ) -> Result<&'a mut LocalSolver> {
        let local = match slot.take() {
            Some(local) => local,
            None => memory::boxed(LocalSolver::new(context)?, WHAT)?,
        };
        Ok(slot.insert(local))
    }

    /// Starts from `base`, with `touched` nodes.
    pub(super) fn begin(&mut self, step: &mut StepContext<'_>, base: Base<'_>) -> Result<()> {
        let _span = tracing::trace_span!("reach").entered();
        let env = step.context.env();
        let far = &step.context.corrections.far;
        let rest = step.input.rest;
        self.about.clear();
        add_centres(rest, &step.context.corrections.changed, &mut self.about)?;
        // What a group held is as near as what a tool touches: no mode of the bundle moves it.
        for group in step.context.let_go_groups() {
            add_centres(rest, &group.nodes, &mut self.about)?;
        }
        add_centres(rest, &self.touched, &mut self.about)?;
        let pairs = &self.pairs;
        let abouts = pairs.records().map(|record| record.about.as_slice());
        let last = pairs
            .records()
            .last()
            .map(|record| record.centres.as_slice());
        self.near.choose(rest, last, &self.about, abouts)?;
        if !self.near.is_chosen(self.level) {
            self.pairs.forget_layout();
            self.near.fill(env, far, rest, self.level)?;
            let (near, room) = (&self.near, &mut self.room);
            (self.clusters).leave_out(env, far, near, step.preconditioner, room)?;
            self.factor.plan(&self.near, rest)?;
            self.near.finish();
        }
        (self.factor).renew(env, &self.near, far, base.u)?;
        self.pairs
            .lay_out(env, &self.near, step.preconditioner, &mut self.room)?;
        self.now.clear(&self.near)?;
        self.residual.clear(&self.near)?;
        resize(&mut self.base, 3 * self.near.free)?;
        resize(&mut self.linear, 3 * self.near.free)?;
        resize(&mut self.d_linear, 3 * self.near.free)?;
        resize(&mut self.inner, 3 * self.near.free)?;
        resize(&mut self.modes, 3 * self.near.nodes.len())?;
        resize(&mut self.d_modes, 3 * self.near.nodes.len())?;
        step.preconditioner.project(env, base.residual)?;
        let q = &step.preconditioner.coordinates;
        step.preconditioner.on_modes(env, q, &mut self.base_modes)?;
        self.stiff.fill(0.0);
        self.d_stiff.fill(0.0);
        self.clusters.begin(far, &self.near, base.u);
        self.trial.copy_from_slice(base.u);
        self.d.clear(&self.near)?;
        self.far_det = f32::MAX;
        self.evaluate(step, 0.0)?;
        std::mem::swap(&mut self.residual, &mut self.next);
        // What the base has is not what has come since.
        self.base.copy_from_slice(&self.inner);
        self.residual.p.copy_from_slice(&self.base_modes);
        // Of a chunk that is near in part the far elements are looked at one by one where it is bad.
        let forces = &env.body.forces;
        let dets = step.scratch.smallest_by_chunk().iter().enumerate();
        let far_dets = dets.map(|(chunk, &found)| match self.near.far_share[chunk] {
            1.0 => found,
            0.0 => f32::MAX,
            _ if found > LOOKED_AT_DET => f32::MAX,
            _ => self.near.far_det(forces, chunk, base.u),
        });
        self.far_det = far_dets.fold(f32::MAX, f32::min);
        Ok(())
    }

    /// Another boundary holds the body: what is near is made anew, and the factor, by whose number others know its columns.
    pub(super) fn leave_boundary(&mut self) {
        self.near.is_whole = false;
    }

    /// Whether all nodes that the tools push are inside.
    pub(super) fn holds_loads(&self, problem: &ContactProblem, held: &[bool]) -> bool {
        let mut holds = true;
        problem.each_load(|node, _| holds &= held[node as usize] || self.near.holds(node));
        holds
    }

    /// The level that the next step begins with, `u` being the state of this one.
    pub(super) fn next_level(&self, u: &[f32]) -> usize {
        if self.touched.is_empty() {
            // What moves then is not what a tool pushes.
            return self.level;
        }
        let u = u.as_chunks::<3>().0;
        let squares = self.touched.iter().map(|&node| u[node as usize]);
        let squares = squares.map(|u| u.iter().map(|u| u * u).sum::<f32>());
        let pushed_mm = squares.fold(0.0, f32::max).sqrt();
        near::next_level(self.level, self.far_mm, pushed_mm)
    }

    /// `|r_S - loads|`, µN: what is out of balance near the tools.
    pub(super) fn unbalanced(&mut self, problem: &ContactProblem) -> Result<f64> {
        memory::replace(&mut self.reduced.r, &self.residual.r, WHAT)?;
        let (near, r) = (&self.near, &mut self.reduced.r);
        each_load(problem, near, |place, force| {
            add(-1.0, &force, &mut r[place..])
        });
        Ok(dot(r, r).sqrt())
    }

    /// Puts the near nodes at part `t` of the direction.
    fn place_at(&mut self, base: &[f32], t: f32) {
        let inside = 3 * self.near.inside;
        for (place, &node) in self.near.nodes[..self.near.free].iter().enumerate() {
            for axis in 0..3 {
                let (at, from) = (3 * place + axis, 3 * node as usize + axis);
                let mut moved = self.modes[at];
                let mut along = if t == 0.0 { 0.0 } else { self.d_modes[at] };
                if at < inside {
                    moved += self.now.t[at];
                    along += if t == 0.0 { 0.0 } else { self.d.t[at] };
                }
                self.trial[from] = base[from] + moved + t * along;
            }
        }
    }

    /// The residual of the state at part `t` of the direction, where [`LocalSolver::place_at`] has put it, into `next`; gives the smallest det F.
    fn evaluate(&mut self, step: &mut StepContext<'_>, t: f32) -> Result<f32> {
        let env = step.context.env();
        let far = &step.context.corrections.far;
        self.next.clear(&self.near)?;
        let (near, inner) = (&mut self.near, &mut self.inner);
        let det = near.internal(&self.trial, inner);
        let kappa = env.time_step.integrator.kappa() as f32;
        let rows = inner.as_chunks_mut::<3>().0.iter_mut();
        for (r, &node) in rows.zip(&near.nodes[..near.inside]) {
            let inertia = kappa * env.body.mass[node as usize];
            for (axis, r) in r.iter_mut().enumerate() {
                let at = 3 * node as usize + axis;
                *r += step.drift[at] + inertia * (self.trial[at] - step.input.last[at]);
            }
        }
        self.next.r.copy_from_slice(&inner[..3 * near.inside]);
        // What the near elements have added to what is linear.
        resize(&mut self.room.field, 3 * near.free)?;
        for (at, added) in self.room.field.iter_mut().enumerate() {
            let linear = self.linear[at] + t * self.d_linear[at];
            *added = inner[at] - self.base[at] - linear;
        }
        let (near, q, p) = (&self.near, &mut self.room.q, &mut self.next.p);
        near.project(env, &self.room.field, q);
        (step.preconditioner).on_modes_in(env, &near.ranges, q, &mut self.on_modes);
        self.more_on_modes.copy_from_slice(&self.now.c);
        add(t, &self.d.c, &mut self.more_on_modes);
        let far_det = (self.clusters).added_on_modes(env, far, &self.more_on_modes, p)?;
        add(1.0, &self.on_modes, p);
        add(1.0, &self.base_modes, p);
        add(1.0, &self.stiff, p);
        add(t, &self.d_stiff, p);
        Ok(det.min(far_det).min(self.far_det))
    }

    /// The whole field into `u`, which holds the base, of which `residual` is; `scratch [K,3]`. Leaves what the far nodes were smoothed by in `far_mm`,
    /// and how far one has gone at most in `far_moved_mm`.
    pub(super) fn settle(
        &mut self,
        step: &mut StepContext<'_>,
        residual: &[f32],
        scratch: &mut [f32],
        u: &mut [f32],
    ) -> Result<()> {
        let env = step.context.env();
        let preconditioner = &mut *step.preconditioner;
        preconditioner.take_coordinates(env, &self.now.c)?;
        preconditioner.decode(env, scratch)?;
        for (place, t) in self.now.t.as_chunks::<3>().0.iter().enumerate() {
            let node = self.near.nodes[place] as usize;
            add(1.0, t, &mut scratch[3 * node..][..3]);
        }
        let (near, count) = (&self.near, u.len() / 3);
        let fields = (residual, &mut *scratch, u);
        let moved = add_smoothed(env, fields, |node| near.holds(node), &mut self.partial)?;
        self.far_mm = (moved / count.max(1) as f64).sqrt() as f32;
        let changes = scratch.as_chunks::<3>().0.iter().zip(0..);
        let far = changes.filter(|(_, node)| !near.holds(*node));
        let squares = far.map(|(change, _)| change.iter().map(|x| x * x).sum::<f32>());
        self.far_moved_mm = squares.fold(0.0, f32::max).sqrt();
        Ok(())
    }
}

/// Calls with the place (as an index of fields) and the share, µN, of each free near node in the tools' loads.
fn each_load(problem: &ContactProblem, near: &NearSet, mut take: impl FnMut(usize, [f32; 3])) {
    problem.each_load(|node, force| {
        if near.holds(node) {
            let place = near.place(node).unwrap_or_default();
            take(3 * place, force.to_array().map(|f| 1e3 * f));
        }
    });
}

#[cfg(test)]
mod tests;
