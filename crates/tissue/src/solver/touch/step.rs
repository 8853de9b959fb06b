//! Contact in one inner step: where the free update left the samples, the sweeps, and what the nodes and tools get of it.
//!
//! A force `f` on a sample with weights `w_k` moves its nodes by `w_k g_k f` over the step, `g` the gain of the central
//! differences; so a sample moves by `f sum w_k² g_k`, the same in all directions, and its own block of the Delassus
//! matrix is a number. Wanted are `gap >= 0` at the end of the step and Coulomb's law for the slip over the step.
//! What is already inside comes out by [`RECOVERY`] a step: put out at once, it would leave with that speed.

use super::row::Row;
use super::rows::SEARCH_STEPS;
use super::{SWEEPS, TEAR_S, Touch};
use crate::solver::fields::Node;
use contact::grasp::tension;
use contact::{Pose, Vector, pose};

/// Part of a penetration that is taken back in one inner step.
const RECOVERY: f32 = 0.1;

/// Part of the last step's forces that a step starts from. All of them would make the sweeps an integral control of a body
/// without damping, which rings where they do not converge: many samples on few nodes.
const WARM: f32 = 0.8;

/// The solver's slot arrays; only the thread that resolves contact may use them.
#[derive(Clone, Copy)]
pub(in crate::solver) struct Access {
    pub displacement: *mut Node,
    pub increment: *mut Node,
    pub force: *const Node,
    /// Of the central differences.
    pub beta: f32,
}

impl Access {
    unsafe fn vector(node: *const Node) -> Vector {
        // SAFETY: the caller's.
        let [x, y, z, _] = unsafe { (*node).0 };
        Vector::new(x, y, z)
    }

    unsafe fn position(&self, touch: &Touch, node: u32) -> Vector {
        let slot = touch.scene.slot_of_node[node as usize] as usize;
        // SAFETY: the caller's; every node has a slot.
        let u = unsafe { Self::vector(self.displacement.add(slot)) };
        touch.scene.rest[node as usize] + u
    }
}

impl Touch {
    /// Corrects displacements and increments after the free update of `step` (from 1), to which ties have added `tied` by slot; returns the work on the tissue, nJ.
    ///
    /// # Safety
    /// No other thread may touch the arrays behind `access`, which must have all of the solver's slots.
    pub unsafe fn resolve(
        &mut self,
        access: Access,
        step: u32,
        tied: impl Fn(u32) -> Vector,
    ) -> f64 {
        if (step - 1).is_multiple_of(SEARCH_STEPS) {
            // SAFETY: as the caller promises; `look` only reads through it.
            let scene = self.scene.clone();
            self.look(step, |node| {
                let slot = scene.slot_of_node[node as usize] as usize;
                // SAFETY: the caller's; every node has a slot.
                let u = unsafe { Access::vector(access.displacement.add(slot)) };
                scene.rest[node as usize] + u
            });
        }
        if self.rows.is_empty() {
            return 0.0;
        }
        // SAFETY: as the caller promises.
        unsafe { self.gather(access, tied) };
        let (from, to) = (self.part(step - 1), self.part(step));
        let poses: Vec<(Pose, Pose)> = self
            .tools
            .iter()
            .map(|tool| {
                let at = |t| pose::between(&tool.from, &tool.to, t);
                (at(from), at(to))
            })
            .collect();
        self.measure(&poses);
        for _ in 0..SWEEPS {
            for at in 0..self.rows.len() {
                self.relax(at);
            }
        }
        let work = self.account(&poses, step);
        // SAFETY: as the caller promises.
        unsafe { self.scatter(access) };
        work
    }

    unsafe fn gather(&mut self, access: Access, tied: impl Fn(u32) -> Vector) {
        for at in 0..self.reached.len() {
            let slot = self.reached[at].slot as usize;
            let node = self.reached[at].node;
            // SAFETY: as the caller promises.
            let (position, increment, force, gain) = unsafe {
                let increment = access.increment.add(slot);
                (
                    access.position(self, node),
                    Access::vector(increment),
                    Access::vector(access.force.add(slot)),
                    (*increment).0[3],
                )
            };
            let reached = &mut self.reached[at];
            reached.gain = gain;
            reached.at = position;
            reached.increment = increment;
            // A prescribed or held node moves as it is told, before and after.
            reached.earlier = match gain > 0.0 {
                true => (increment - tied(slot as u32) - force * gain) / access.beta,
                false => increment,
            };
            reached.change = Vector::ZERO;
        }
    }

    /// Gaps, slips and normals after the free update, and the forces to start from.
    fn measure(&mut self, poses: &[(Pose, Pose)]) {
        for at in 0..self.rows.len() {
            let mut row = self.rows[at];
            let (before, now) = &poses[row.tool as usize];
            let (tool, body) = &self.scene.tools[row.tool as usize];
            row.point = self.value(&row, |r| r.at);
            row.force *= WARM;
            row.gain = row
                .nodes
                .iter()
                .zip(row.weights)
                .map(|(n, w)| w * w * self.reached[*n as usize].gain)
                .sum();
            let started = row.point - self.value(&row, |r| r.increment);
            row.carried = now.transform_point(before.inverse_transform_point(started)) - started;
            let nearest = body.nearest_at(now, row.point);
            row.normal = nearest.normal;
            row.gap = nearest.distance;
            if let (Some(outward), None) = (row.wall, row.bound) {
                let found = body.nearest_at_wall(now, row.point, outward);
                (row.normal, row.gap) =
                    found.map_or((-outward, f32::MAX), |found| (found.normal, found.distance));
            }
            match row.bound {
                Some(place) => row.slip = row.point - now.transform_point(place),
                None => {
                    row.slip = row.point - started - row.carried;
                    let push = row.force.dot(row.normal).max(0.0);
                    let drag = row.force - row.normal * row.force.dot(row.normal);
                    row.force = row.normal * push + cut(drag, tool.friction * push);
                }
            }
            if row.gain <= 0.0 {
                row.force = Vector::ZERO;
            }
            self.rows[at] = row;
            self.push(&row, row.force);
        }
    }

    /// One row's force for the change that the others made.
    fn relax(&mut self, at: usize) {
        let row = self.rows[at];
        if row.gain <= 0.0 {
            return;
        }
        let moved = self.value(&row, |r| r.change);
        let force = match row.bound {
            Some(_) => {
                let allowed = row.last_slip.unwrap_or_default() * (1.0 - RECOVERY);
                row.force - (row.slip + moved - allowed) / row.gain
            }
            None => {
                let (tool, _) = &self.scene.tools[row.tool as usize];
                let gap = row.gap + row.normal.dot(moved) - allowed(&row);
                let push = row.force.dot(row.normal);
                let wanted = (push - gap / row.gain).max(0.0);
                if wanted == 0.0 && push == 0.0 {
                    return;
                }
                let slip = row.slip + moved;
                let slip = slip - row.normal * slip.dot(row.normal);
                let drag = row.force - row.normal * push - slip / row.gain;
                row.normal * wanted + cut(drag, tool.friction * wanted)
            }
        };
        self.push(&row, force - row.force);
        self.rows[at].force = force;
    }

    /// Adds what a force on a row's sample does to its nodes.
    fn push(&mut self, row: &Row, force: Vector) {
        for (node, weight) in row.nodes.iter().zip(row.weights) {
            let reached = &mut self.reached[*node as usize];
            reached.change += force * (weight * reached.gain);
        }
    }

    /// The tools' share of the step; returns the work on the tissue, nJ.
    fn account(&mut self, poses: &[(Pose, Pose)], step: u32) -> f64 {
        let reported = step + self.reported() > self.steps;
        let mut total = 0.0;
        let mut pulls = vec![(Vector::ZERO, Vector::ZERO); self.tools.len()];
        for at in 0..self.rows.len() {
            let row = self.rows[at];
            let moved = self.value(&row, |r| r.change);
            let gap = row.gap + row.normal.dot(moved);
            self.rows[at].last_gap = Some(gap);
            self.rows[at].last_slip = row.bound.map(|_| row.slip + moved);
            let tool = &mut self.tools[row.tool as usize];
            if row.bound.is_none() && row.gain > 0.0 {
                tool.penetration = tool.penetration.max(-gap);
            }
            if row.force == Vector::ZERO {
                continue;
            }
            if row.bound.is_some() {
                let (force, normal) = &mut pulls[row.tool as usize];
                *force += row.force;
                *normal += row.normal;
            }
            tool.work += f64::from(row.force.dot(row.carried));
            if reported {
                let arm = row.point + moved - poses[row.tool as usize].1.translation;
                let torque = arm.cross(row.force);
                for k in 0..3 {
                    tool.force[k] -= f64::from(row.force[k]);
                    tool.torque[k] -= f64::from(torque[k]);
                }
                *self.sums.entry((row.tool, row.sample)).or_default() += row.force;
            }
            let mean = 0.5 * (self.value(&row, |r| r.increment + r.earlier) + moved);
            total += f64::from(row.force.dot(mean));
        }
        for (index, (force, normal)) in pulls.into_iter().enumerate() {
            self.tear(index, tension(force, normal.normalize_or_zero()));
        }
        total
    }

    /// Opens a grasp that is pulled too hard.
    fn tear(&mut self, index: usize, pull: Vector) {
        let (tool, _) = &self.scene.tools[index];
        let held = &mut self.tools[index];
        held.pull += (pull - held.pull) * (self.dt / TEAR_S).min(1.0) as f32;
        if held.grasp.tear(held.pull, tool.tear_off_mn * 1e3) {
            held.torn = true;
            held.pull = Vector::ZERO;
            for row in self.rows.iter_mut().filter(|r| r.tool == index as u32) {
                if row.bound.take().is_some() {
                    row.force = Vector::ZERO;
                }
            }
        }
    }

    unsafe fn scatter(&self, access: Access) {
        for reached in &self.reached {
            let slot = reached.slot as usize;
            // SAFETY: as the caller promises.
            unsafe {
                let displacement = &mut (*access.displacement.add(slot)).0;
                let increment = &mut (*access.increment.add(slot)).0;
                for k in 0..3 {
                    displacement[k] += reached.change[k];
                    increment[k] += reached.change[k];
                }
            }
        }
    }

    /// A row's value of something that its nodes have.
    fn value(&self, row: &Row, of: impl Fn(&super::Reached) -> Vector) -> Vector {
        let [u, v, w, x] = row.weights;
        let [a, b, c, d] = row.nodes.map(|node| of(&self.reached[node as usize]));
        let on_face = a * u + b * v + c * w;
        match x == 0.0 {
            true => on_face,
            false => on_face + d * x,
        }
    }
}

/// The gap that a row may have at the end of the step.
fn allowed(row: &Row) -> f32 {
    let last = row.last_gap.unwrap_or(row.gap);
    (last * (1.0 - RECOVERY)).min(0.0)
}

/// A drag cut to the friction cone.
fn cut(drag: Vector, limit: f32) -> Vector {
    let size = drag.length();
    if size <= limit {
        drag
    } else if limit > 0.0 {
        drag * (limit / size)
    } else {
        Vector::ZERO
    }
}
