//! One local iteration: a direction of L-BFGS with the contact's answer in it, and how far along it.

use std::cell::RefCell;

use super::columns::Response;
use super::linear::WHAT;
use super::step::{add, dot, resize};
use super::{LocalSolver, StepContext, each_load};
use crate::contact::{Compliance, ContactProblem, State};
use crate::corrections::line_search::{DEAR_SHORTENINGS, LineSearch, SHORTENINGS, Tried};
use crate::corrections::precondition::{DIAGONAL_WEIGHT, Env};
use crate::corrections::solver::SMALLEST_DET;
use crate::error::Result;
use crate::memory;

impl LocalSolver {
    /// One iteration with the tools at part `way` of their way; tells whether it led to another state. `over` says how deep tissue and tools lie in each other there, over what a
    /// part of the direction may leave.
    ///
    /// `base` is the field `[K,3]` that the round began with, mm. `over` gets the problem, the trial
    /// field and the part of the direction; at most 1 means that the contact is not lost.
    pub(in crate::corrections) fn improve(
        &mut self,
        step: &mut StepContext<'_>,
        problem: &mut ContactProblem,
        base: &[f32],
        way: f32,
        over: impl Fn(&mut ContactProblem, &[f32], f32) -> f32,
    ) -> Result<bool> {
        let _span = tracing::trace_span!("iteration").entered();
        let env = step.context.env();
        // The direction for the loads that are there; then what the contact changes at its end, as a second answer of the same preconditioner.
        self.measured.work += self.set.near.direction_work();
        self.descend(step, problem)?;
        self.decode_contact(step, problem)?;
        self.solve_contact(step, problem, base, way)?;
        self.decode_direction(step)?;
        // What of the change along the direction is linear is computed once here; each part `t` of it then costs the near elements alone.
        // `G c` of the direction: what `K + kappa M` makes of its modes, on the modes.
        let stiff = &mut self.d.stiff;
        step.preconditioner.stiffen(env, &self.d.step.c, stiff)?;
        (self.set.near).linear(env, &self.d.modes, None, &mut self.d.linear);
        self.measure_direction(env);
        // Along a line the loads do not change, so their work is a constant of the slopes.
        // The slope of the energy along the line is `F(u) . d - f . d`: the second part stays as
        // the tools' loads do.
        let work = self.work(problem);
        let slope = self.residuals.residual.over(&self.d.step) - work;
        let most = match self.is_dear(problem) {
            true => DEAR_SHORTENINGS,
            false => SHORTENINGS,
        };
        let mut search = LineSearch::new(slope, most);
        loop {
            let t = search.t;
            self.place_at(base, t);
            // `next` becomes the residual there; `residual` stays that of the state that stands until `accept` exchanges them.
            let det = self.evaluate(step, t)?;
            // `d` is the direction until `accept` scales it: the slope is that of the line, not of the part.
            let slope_new = self.residuals.next.over(&self.d.step) - work;
            let left = match det > SMALLEST_DET {
                true => over(problem, &self.residuals.trial, t),
                false => f32::MAX,
            };
            // An iteration may not lose the contact, unless it had been lost.
            let is_kept = left <= 1.0 || {
                self.place_at(base, 0.0);
                left <= over(problem, &self.residuals.trial, t)
            };
            // A part stands where the mean of the slopes at its ends says that the energy falls,
            // elements are sound and the contact is kept; else a shorter one is tried, a few times.
            match search.judge(is_kept, slope_new) {
                Tried::Accepted => {
                    self.accept(step, t)?;
                    self.measured.det = det;
                    // The forces were solved for at the whole direction.
                    if t < 1.0 {
                        problem.kept.blend(&mut problem.next, t);
                    }
                    return Ok(true);
                }
                Tried::Shortened => {}
                Tried::GivenUp => {
                    self.place_at(base, 0.0);
                    // Back to the forces and the state before; pairs and factor have led astray, and are forgotten.
                    problem.kept.undo(&mut problem.next);
                    self.pairs.clear();
                    self.coming.clear_tangent();
                    return Ok(false);
                }
            }
        }
    }

    /// The direction of L-BFGS, without what the contact makes of it.
    fn descend(&mut self, step: &mut StepContext<'_>, problem: &ContactProblem) -> Result<()> {
        let env = step.context.env();
        self.residuals.reduced.take(&self.residuals.residual)?;
        let (near, reduced) = (&self.set.near, &mut self.residuals.reduced);
        each_load(problem, near, |place, force| {
            add(-1.0, &force, &mut reduced.r[place..])
        });
        self.take_loads_off(step, problem)?;
        // The two halves of L-BFGS, with the preconditioner where an initial matrix would stand.
        // Both halves change `reduced` and `d` in place: the first takes off it what the pairs know, the second adds that to the direction.
        // `recursion` holds the coefficients that the second half needs (Nocedal and Wright,
        // algorithm 7.4).
        let recursion = self.pairs.descend(env.isa, &mut self.residuals.reduced);
        self.d.step.clear(&self.set.near)?;
        self.precondition(step)?;
        self.pairs.ascend(env.isa, recursion, &mut self.d.step);
        Ok(())
    }

    /// Takes the work of the modes on the tools' loads off the reduced residual.
    /// `Phi^T f` needs no field where the forces lie on nodes with columns: their rows of the modes
    /// are stored.
    fn take_loads_off(&mut self, step: &StepContext<'_>, problem: &ContactProblem) -> Result<()> {
        let env = step.context.env();
        let (p, mut is_known) = (&mut self.residuals.reduced.p, true);
        problem.each_load(
            |node, force| match env.prior.column_for(&env.held.is, node) {
                Some((column, true)) => {
                    for (axis, force) in force.to_array().into_iter().enumerate() {
                        add(-1e3 * force, env.space.at_contact(3 * column + axis), p);
                    }
                }
                _ => is_known = false,
            },
        );
        if is_known {
            return Ok(());
        }
        // On nodes without columns.
        let (near, field) = (&self.set.near, &mut self.spare.room.field);
        resize(field, 3 * near.places.free)?;
        each_load(problem, near, |place, force| {
            let node = near.places.nodes[place / 3];
            if !matches!(env.prior.column_for(&env.held.is, node), Some((_, true))) {
                add(1.0, &force, &mut field[place..]);
            }
        });
        near.blocks.all.project(env, field, &mut self.spare.room.q);
        let work = &mut self.spare.on_modes;
        env.on_modes_in(&near.blocks.all.ranges, &self.spare.room.q, work);
        add(-1.0, work, p);
        Ok(())
    }

    /// `Phi^T` of the base's residual less the tools' loads; none where these push nodes without columns.
    pub(in crate::corrections) fn base_on_modes(
        &mut self,
        env: Env<'_>,
        problem: &ContactProblem,
    ) -> Option<&[f32]> {
        let (p, mut is_known) = (&mut self.spare.on_modes, true);
        p.copy_from_slice(&self.residuals.base_modes);
        let held = &env.held.is;
        problem.each_load(|node, force| match env.prior.column_for(held, node) {
            Some((column, true)) => {
                for (axis, force) in force.to_array().into_iter().enumerate() {
                    add(-1e3 * force, env.space.at_contact(3 * column + axis), p);
                }
            }
            _ => is_known &= held[node as usize],
        });
        is_known.then_some(p)
    }

    /// `P` of the reduced residual, added to the direction ([`super::factor`]); outside of the core `w D^-1`.
    /// The two halves in the core before and after the modes make the whole symmetric, as L-BFGS
    /// needs.
    fn precondition(&mut self, step: &mut StepContext<'_>) -> Result<()> {
        let env = step.context.env();
        let preconditioner = &*step.preconditioner;
        let (near, room) = (&self.set.near, &mut self.spare.room);
        // Places are sorted: core, other inside nodes, free border, held border. So `..core` is the core's part of any list by place.
        let core = 3 * near.places.core;
        // `B r` in the core, in place; the residual of the core becomes the move that balances it.
        let (t, outer) = self.residuals.reduced.r.split_at_mut(core);
        let rows = outer.as_chunks::<3>().0.iter();
        let places = self.d.step.t[core..].as_chunks_mut::<3>().0.iter_mut();
        for ((t, r), &node) in places.zip(rows).zip(&near.places.nodes[near.places.core..]) {
            let [xx, xy, xz, yy, yz, zz] = env.time_step.inverse_blocks[node as usize];
            t[0] += DIAGONAL_WEIGHT * (xx * r[0] + xy * r[1] + xz * r[2]);
            t[1] += DIAGONAL_WEIGHT * (xy * r[0] + yy * r[1] + yz * r[2]);
            t[2] += DIAGONAL_WEIGHT * (xz * r[0] + yz * r[1] + zz * r[2]);
        }
        let p = &mut self.residuals.reduced.p;
        resize(&mut room.field, 3 * near.places.free)?;
        room.field[..core].copy_from_slice(t);
        self.set.factor.solve(env.isa, t);
        self.set.factor.take_off(env, near, room, (t, p))?;
        // `G^-1` of what is left to the modes once the core has moved.
        // `c = G^-1 (p - Phi^T K t)`: `take_off` has taken the core's move off `p`.
        preconditioner.respond_on_modes(env, p, &mut self.spare.solved)?;
        add(1.0, &self.spare.solved, &mut self.d.step.c);
        add(1.0, t, &mut self.d.step.t);
        // What the modes do in the core and around it is all that the core asks for.
        env.near_coordinates(&self.spare.solved, &near.blocks.around.ranges, &mut room.q);
        resize(&mut room.linear, 3 * near.places.free)?;
        near.blocks.around.decode(env, &room.q, &mut room.linear)?;
        // In the core the field that the move of the modes stretches over it takes its place.
        self.set.factor.stretch(&room.linear, t);
        self.set.factor.solve(env.isa, t);
        add(-1.0, t, &mut self.d.step.t);
        add(-1.0, &room.linear[..core], &mut self.d.step.t);
        Ok(())
    }

    /// The contact where the direction leads to: the direction takes on the response to what it changes.
    fn solve_contact(
        &mut self,
        step: &mut StepContext<'_>,
        problem: &mut ContactProblem,
        base: &[f32],
        way: f32,
    ) -> Result<()> {
        let _span = tracing::trace_span!("contact").entered();
        let env = step.context.env();
        // The contact is solved where the whole direction leads: `blend` takes part of its change where the line search goes part of the way.
        self.place_at(base, 1.0);
        let state = State {
            rest: step.input.rest,
            u: &self.residuals.trial,
            start: step.input.last,
        };
        // Columns are made as the contact asks for them, so the response changes while the problem reads it: hence the `RefCell`.
        let own = (
            &mut self.set.factor,
            &mut self.spare.columns,
            &mut self.spare.room,
        );
        let response = Response {
            env,
            near: &self.set.near,
            preconditioner: step.preconditioner,
            own: RefCell::new(own),
        };
        let compliance = Compliance {
            tangent: Some(&response),
            prior: step.context.prior,
            held: &env.held.is,
            inertia: Some((env.space, step.preconditioner.inertial_compliance())),
        };
        // `f' - f`: the direction has the loads of before in it already.
        let change = problem.solve(compliance, state, way)?;
        self.spare.loads.clear();
        memory::fit(&mut self.spare.loads, change.dofs.len(), WHAT)?;
        let loads = change
            .dofs
            .iter()
            .copied()
            .zip(change.forces.iter().copied());
        // The difference alone: what the loads of before do is in the direction.
        self.spare.loads.extend(loads.filter(|load| load.1 != 0.0));
        match self.spare.loads.is_empty() {
            true => Ok(()),
            false => self.respond(step),
        }
    }

    /// Adds the response to `loads` to the direction.
    pub(super) fn respond(&mut self, step: &mut StepContext<'_>) -> Result<()> {
        let env = step.context.env();
        self.residuals.reduced.clear(&self.set.near)?;
        let (near, reduced) = (&self.set.near, &mut self.residuals.reduced);
        for &(dof, force) in &self.spare.loads {
            let node = env.prior.contact_nodes[dof as usize / 3];
            if near.places.holds(node)
                && let Some(place) = near.places.of(node)
            {
                reduced.r[3 * place + dof as usize % 3] += 1e3 * force;
            }
        }
        env.work_of_modes(&self.spare.loads, &mut reduced.p);
        self.precondition(step)
    }

    /// `Phi c` of the direction where the contact looks: by the core and what is around it, zero elsewhere, where the samples that it found last are there.
    fn decode_contact(
        &mut self,
        step: &mut StepContext<'_>,
        problem: &ContactProblem,
    ) -> Result<()> {
        let (env, near) = (step.context.env(), &self.set.near);
        let points = problem.tied.points(&problem.surface.samples);
        if !problem.near.lie(points, |node| near.is_around(node)) {
            return self.decode_direction(step);
        }
        let (around, q) = (&near.blocks.around, &mut self.spare.room.q);
        resize(&mut self.d.modes, 3 * near.places.nodes.len())?;
        env.near_coordinates(&self.d.step.c, &around.ranges, q);
        around.decode(env, q, &mut self.d.modes[..3 * near.places.free])
    }

    /// `Phi c` of the direction at the near nodes.
    pub(super) fn decode_direction(&mut self, step: &mut StepContext<'_>) -> Result<()> {
        let env = step.context.env();
        let (ranges, q) = (&self.set.near.blocks.all.ranges, &mut self.spare.room.q);
        env.near_coordinates(&self.d.step.c, ranges, q);
        self.set.near.decode(env, q, &mut self.d.modes)
    }

    /// Root mean square of the direction, weighted by mass.
    fn measure_direction(&mut self, env: Env<'_>) {
        let mut square = 0.0f64;
        let rows = self.d.step.t.as_chunks::<3>().0.iter();
        for (t, &node) in rows.zip(&self.set.near.places.nodes) {
            // Weighted by mass, so that a fine mesh near the tool counts no more than its volume does.
            let own: f32 = t.iter().map(|t| t * t).sum();
            square += f64::from(own) * f64::from(env.body.mass[node as usize]);
        }
        let count = env.space.count();
        // Only the natural modes are orthogonal by mass: the others need the whole Gram matrix.
        let rows = env.space.mass().chunks_exact(count);
        for (row, value) in rows.zip(&self.d.step.c) {
            square += dot(row, &self.d.step.c) * f64::from(*value);
        }
        self.measured.moved_mm = (square.max(0.0) / self.measured.mass_g).sqrt() as f32;
    }

    /// Work of the tools' loads over the direction, nJ.
    fn work(&self, problem: &ContactProblem) -> f64 {
        let mut sum = 0.0f64;
        let inside = 3 * self.set.near.places.inside;
        each_load(problem, &self.set.near, |place, force| {
            for (axis, force) in force.into_iter().enumerate() {
                let at = place + axis;
                // At border nodes only the modes move; at inside ones `t` besides.
                let mut d = self.d.modes[at];
                if at < inside {
                    d += self.d.step.t[at];
                }
                sum += f64::from(d) * f64::from(force);
            }
        });
        sum
    }

    /// The state at part `t` of the direction stands; it and what it changes are a pair.
    fn accept(&mut self, step: &mut StepContext<'_>, t: f32) -> Result<()> {
        let env = step.context.env();
        if t != 1.0 {
            self.d.step.scale(t);
        }
        add(t, &self.d.modes, &mut self.now.modes);
        add(t, &self.d.linear, &mut self.now.linear);
        add(t, &self.d.stiff, &mut self.now.stiff);
        // `y` is the change of the residual over the step, `s` the step; the two of them are the pair.
        self.residuals.reduced.take(&self.residuals.next)?;
        self.residuals.reduced.add(-1.0, &self.residuals.residual);
        self.now.step.add(1.0, &self.d.step);
        // Before the pair is stored: `self.residuals.residual` is the new one from here on, and `reduced` still holds the change.
        std::mem::swap(&mut self.residuals.residual, &mut self.residuals.next);
        let (near, room) = (&self.set.near, &mut self.spare.room);
        let pair = (&self.d.step, &self.residuals.reduced);
        (self.pairs).store(env, near, room, &self.reach.about, pair)
    }
}
