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
mod cost;
mod course;
mod factor;
mod iteration;
mod linear;
mod linearisation;
mod near;
mod pairs;
mod places;
mod record;
mod sets;
mod settle;
mod state;
mod step;

use ::elements::Scratch;

use self::clusters::Clusters;
use self::course::{WHOLE, Wanted};
use self::linear::WHAT;
use self::near::{NearSet, level_of};
use self::pairs::Pairs;
use self::sets::{Coming, Set};
use self::state::{Measured, Moved, Reach, Residuals, Spare};
use self::step::{add, dot, resize};
use super::extent::Extent;
use super::far::FarField;
use super::input::{Input, SolverContext};
use super::precondition::{Env, Preconditioner};
use crate::contact::ContactProblem;
use crate::error::Result;
use crate::memory::{self, HeldBytes};

pub(super) use self::centres::add_centres;
pub use self::course::Course;
pub use self::record::Record;

/// Far elements of a chunk that is near in part are looked at where its smallest det F is below this.
const LOOKED_AT_DET: f32 = 0.5;

/// What a solver lends to the iterations of a step.
pub(super) struct StepContext<'a> {
    /// Tables and threads.
    pub context: SolverContext<'a>,
    pub input: &'a Input<'a>,
    /// For its coarse level; `coordinates` are written over.
    pub preconditioner: &'a mut Preconditioner,
    /// Of the last evaluation of all elements: its smallest det F by chunk.
    pub scratch: &'a mut Scratch,
    /// What BDF2 takes from the past `[K,3]`, µN.
    pub drift: &'a [f32],
}

/// A state whose residual is known at every node.
#[derive(Clone, Copy)]
pub(super) struct Base<'a> {
    /// `[K,3]`, mm.
    pub u: &'a [f32],
    /// `F(u) [K,3]`, µN, without the tools' loads.
    pub residual: &'a [f32],
}

/// A scene's own part.
#[derive(HeldBytes)]
pub struct LocalSolver {
    /// What is near in this step, with its factor.
    pub(super) set: Set,
    /// Which set that is, and the next one, made a part a step.
    pub(super) coming: Coming,
    pub(super) pairs: Pairs,
    /// The law's part of the far elements, by their means.
    clusters: Clusters,
    pub(super) reach: Reach,
    /// Since the base.
    now: Moved,
    /// The direction.
    d: Moved,
    /// Of the state that stands and of the one tried.
    residuals: Residuals,
    pub(super) measured: Measured,
    spare: Spare,
}

impl LocalSolver {
    /// Buffers.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(context: SolverContext<'_>) -> Result<LocalSolver> {
        let env = context.env();
        let (nodes, count) = (env.body.mass.len(), env.space.count());
        Ok(LocalSolver {
            set: Set::new(env)?,
            coming: Coming::default(),
            pairs: Pairs::new(count)?,
            clusters: Clusters::new(&context.corrections.far, count)?,
            reach: Reach::new()?,
            now: Moved::with_modes(count)?,
            d: Moved::with_modes(count)?,
            residuals: Residuals::new(nodes, count)?,
            measured: Measured::new(env),
            spare: Spare::new(env)?,
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
        // About the nodes that the tools touch, those where the body has been cut, and those of a support group that is let go: the bundle's columns and modes
        // know nothing of either of the latter.
        self.reach.about.clear();
        add_centres(
            rest,
            &step.context.corrections.changed,
            &mut self.reach.about,
        )?;
        // What a group held is as near as what a tool touches: no mode of the bundle moves it.
        for group in step.context.let_go_groups() {
            add_centres(rest, &group.nodes, &mut self.reach.about)?;
        }
        add_centres(rest, &self.reach.touched, &mut self.reach.about)?;
        self.make_sets((env, far, rest), base.u)?;
        self.now.clear(&self.set.near)?;
        self.d.clear(&self.set.near)?;
        self.residuals.residual.clear(&self.set.near)?;
        resize(&mut self.residuals.base, 3 * self.set.near.places.free)?;
        resize(&mut self.residuals.inner, 3 * self.set.near.places.free)?;
        // `p_0 = Phi^T r_0`: of the base, at all nodes.
        step.preconditioner.project(env, base.residual)?;
        let q = &step.preconditioner.coordinates;
        env.on_modes(q, &mut self.residuals.base_modes)?;
        self.clusters.begin(far, &self.set.near, base.u);
        self.measured.work += self.set.near.base_work();
        // From here on `trial` is the base wherever no near node is: only near places are written in an iteration.
        self.residuals.trial.copy_from_slice(base.u);
        self.measured.far_det = f32::MAX;
        self.evaluate_near(step)?;
        std::mem::swap(&mut self.residuals.residual, &mut self.residuals.next);
        // What the base has is not what has come since.
        self.residuals.base.copy_from_slice(&self.residuals.inner);
        self.residuals
            .residual
            .p
            .copy_from_slice(&self.residuals.base_modes);
        // Of a chunk that is near in part the far elements are looked at one by one where it is bad.
        let forces = &env.body.forces;
        let dets = step.scratch.smallest_by_chunk().iter().enumerate();
        let far_dets = dets.map(|(chunk, &found)| match self.set.near.far_share[chunk] {
            1.0 => found,
            0.0 => f32::MAX,
            _ if found > LOOKED_AT_DET => f32::MAX,
            _ => self.set.near.far_det(forces, chunk, base.u),
        });
        self.measured.far_det = far_dets.fold(f32::MAX, f32::min);
        Ok(())
    }

    /// Sees to it that a near set is in force about what the tools touch, with the factor of its tangent and the pairs laid out; takes the next one a part
    /// further. `u [K,3]` is the state in which tangents are taken.
    fn make_sets(
        &mut self,
        (env, far, rest): (Env<'_>, &FarField, &[f32]),
        u: &[f32],
    ) -> Result<()> {
        let (coming, pairs) = (&mut self.coming, &mut self.pairs);
        coming.about.clear();
        add_centres(rest, &self.reach.about, &mut coming.about)?;
        for record in pairs.records() {
            add_centres(rest, &record.about, &mut coming.about)?;
        }
        coming.about.sort_unstable();
        let wanted = Wanted {
            rest,
            about: &coming.about,
            level: self.reach.extent.level as usize,
            is_due: std::mem::take(&mut coming.is_due),
        };
        let level_of = |centres: &[u32], asked| level_of(far, rest, centres, asked);
        let before = coming.course.now.level;
        let is_other = coming.course.go_on(wanted, level_of)?;
        let (now, room) = (&mut coming.course.now, &mut self.spare.room);
        if now.level != before {
            // What the pairs know of a narrower set is linear where the wider one is not.
            pairs.clear();
        }
        let is_made = self.set.is_of(now) && self.set.near.made == WHOLE;
        if !is_made {
            pairs.forget_layout();
            if let Some(other) = &mut coming.other
                && other.is_of(now)
            {
                std::mem::swap(&mut self.set, other);
            }
            self.set.make((env, far, rest), now, room)?;
            self.clusters.take(far, &self.set.left);
        }
        let Set { near, factor, .. } = &mut self.set;
        let last = &mut coming.last_factor;
        let is_new = factor.renew((env, near, far), u, &mut now.tangent, last)?;
        // By what is wanted, and not by what is there: a restored scene has to make what this one has.
        self.measured.work += match (is_other, is_new) {
            (true, _) => near.making_work(),
            (false, true) => near.factor_work(),
            (false, false) => 0,
        };
        pairs.lay_out(env, near, room)?;
        // One dear thing a step.
        if wanted.is_due && !is_other && !is_new {
            coming.course.prepare(wanted, level_of)?;
        }
        coming.make_next((env, far, rest), u, room)?;
        // So that publishing it cannot fail.
        coming.published.fit(&coming.course)
    }

    /// Another boundary holds the body: what is near is made anew, and the factor, by whose number others know its columns.
    pub(super) fn leave_boundary(&mut self) {
        self.set.near.made = 0;
        self.coming.forget();
    }

    /// Whether all nodes that the tools push are inside.
    pub(super) fn holds_loads(&self, problem: &ContactProblem, held: &[bool]) -> bool {
        let mut holds = true;
        problem
            .each_load(|node, _| holds &= held[node as usize] || self.set.near.places.holds(node));
        holds
    }

    /// Whether a direction is not worth many tries: that of a step whose work is bounded, of a body that is far in part. What inverts elements there leads into the
    /// tissue that the tool was put into, and not out of it.
    pub(super) fn is_dear(&self, problem: &ContactProblem) -> bool {
        problem.work.is_bounded() && !self.set.near.places.is_all()
    }

    /// How far the next step reaches, `u` being the state of this one.
    pub(super) fn next_extent(&self, u: &[f32]) -> Extent {
        let extent = self.reach.extent;
        if self.reach.touched.is_empty() || self.coming.course.changes(extent.level as usize) {
            // What moves then is not what a tool pushes; or a wider set is on its way.
            return extent;
        }
        let u = u.as_chunks::<3>().0;
        let squares = self.reach.touched.iter().map(|&node| u[node as usize]);
        let squares = squares.map(|u| u.iter().map(|u| u * u).sum::<f32>());
        let pushed_mm = squares.fold(0.0, f32::max).sqrt();
        extent.after(self.measured.far_mm, pushed_mm)
    }

    /// `|r_S - loads|`, µN: what is out of balance near the tools.
    pub(super) fn unbalanced(&mut self, problem: &ContactProblem) -> Result<f64> {
        memory::replace(
            &mut self.residuals.reduced.r,
            &self.residuals.residual.r,
            WHAT,
        )?;
        let (near, r) = (&self.set.near, &mut self.residuals.reduced.r);
        each_load(problem, near, |place, force| {
            add(-1.0, &force, &mut r[place..])
        });
        Ok(dot(r, r).sqrt())
    }

    /// Puts the near nodes at part `t` of the direction.
    fn place_at(&mut self, base: &[f32], t: f32) {
        let inside = 3 * self.set.near.places.inside;
        for (place, &node) in self.set.near.places.nodes[..self.set.near.places.free]
            .iter()
            .enumerate()
        {
            for axis in 0..3 {
                let (at, from) = (3 * place + axis, 3 * node as usize + axis);
                let mut moved = self.now.modes[at];
                let mut along = if t == 0.0 { 0.0 } else { self.d.modes[at] };
                if at < inside {
                    moved += self.now.step.t[at];
                    along += if t == 0.0 { 0.0 } else { self.d.step.t[at] };
                }
                self.residuals.trial[from] = base[from] + moved + t * along;
            }
        }
    }

    /// `r_S` of the state of `trial` into `next`, with the forces at the free nodes in `inner`; gives the smallest det F of the near elements.
    fn evaluate_near(&mut self, step: &StepContext<'_>) -> Result<f32> {
        let env = step.context.env();
        self.measured.work += self.set.near.try_work();
        self.residuals.next.clear(&self.set.near)?;
        let (near, inner) = (&mut self.set.near, &mut self.residuals.inner);
        let det = near.internal(&self.residuals.trial, inner);
        let kappa = env.time_step.integrator.kappa() as f32;
        let rows = inner.as_chunks_mut::<3>().0.iter_mut();
        for (r, &node) in rows.zip(&near.places.nodes[..near.places.inside]) {
            // `kappa M (u - u_n)`, with what the past adds to it in `drift`, µN.
            let inertia = kappa * env.body.mass[node as usize];
            for (axis, r) in r.iter_mut().enumerate() {
                let at = 3 * node as usize + axis;
                *r += step.drift[at] + inertia * (self.residuals.trial[at] - step.input.last[at]);
            }
        }
        self.residuals
            .next
            .r
            .copy_from_slice(&inner[..3 * near.places.inside]);
        Ok(det)
    }

    /// The residual of the state at part `t` of the direction, where [`LocalSolver::place_at`] has put it, into `next`; gives the smallest det F.
    fn evaluate(&mut self, step: &mut StepContext<'_>, t: f32) -> Result<f32> {
        let env = step.context.env();
        let far = &step.context.corrections.far;
        let det = self.evaluate_near(step)?;
        let (near, inner) = (&self.set.near, &self.residuals.inner);
        // What the near elements have added to what is linear.
        resize(&mut self.spare.room.field, 3 * near.places.free)?;
        for (at, added) in self.spare.room.field.iter_mut().enumerate() {
            let linear = self.now.linear[at] + t * self.d.linear[at];
            *added = inner[at] - self.residuals.base[at] - linear;
        }
        // `Phi^T` of what the near elements have added beyond the linear part, through the coordinates of the blocks that are near.
        let (near, q, p) = (
            &self.set.near,
            &mut self.spare.room.q,
            &mut self.residuals.next.p,
        );
        near.blocks.all.project(env, &self.spare.room.field, q);
        env.on_modes_in(&near.blocks.all.ranges, q, &mut self.spare.on_modes);
        self.spare.more_on_modes.copy_from_slice(&self.now.step.c);
        add(t, &self.d.step.c, &mut self.spare.more_on_modes);
        let far_det = (self.clusters).added_on_modes(env, far, &self.spare.more_on_modes, p)?;
        add(1.0, &self.spare.on_modes, p);
        add(1.0, &self.residuals.base_modes, p);
        add(1.0, &self.now.stiff, p);
        add(t, &self.d.stiff, p);
        Ok(det.min(far_det).min(self.measured.far_det))
    }
}

/// Calls with the place (as an index of fields) and the share, µN, of each free near node in the tools' loads.
fn each_load(problem: &ContactProblem, near: &NearSet, mut take: impl FnMut(usize, [f32; 3])) {
    problem.each_load(|node, force| {
        if near.places.holds(node) {
            let place = near.places.of(node).unwrap_or_default();
            take(3 * place, force.to_array().map(|f| 1e3 * f));
        }
    });
}

#[cfg(test)]
mod tests;
