//! Corrections of a step that tools drive: their contact forces are loads, solved for again inside of each iteration.
//!
//! With `F(u) = f_int(u) + M (a + alpha v)` on the free nodes, `B` the rows of the samples and `A_k` the compliance of `K + kappa M`:
//!
//! ```text
//! u <- u_n - N diag(1 / (w² + kappa)) N^T [I_{n+1}(u_n) - I_n]        free motion of the natural modes
//! contact(u, f):  f' such that the gaps at u + A_k B^T (f' - f) obey Signorini's and Coulomb's laws
//! (u, f) <- contact(u, f_n)
//! k times:  d = -LBFGS(P) [F(u) - B^T f];  (u', f') <- contact(u + d, f);  u <- u + t (u' - u)
//! ```
//!
//! The pairs hold `F` without the loads: they survive any change of contact.

use std::time::Instant;

use super::input::{Input, Lent, Report};
use super::precondition::{Preconditioner, mask_held};
use super::stage::{MOST_PARTS, SHORTENINGS, SLOPE, SMALLEST_DET, Stage, dot};
use crate::contact::{Compliance, Problem, State};
use crate::error::Result;

/// The state of an iteration.
struct Iterate<'a> {
    u: &'a mut [f32],
    /// `F(u)`, µN.
    g: &'a mut [f32],
    /// Smallest det F.
    det: f32,
}

impl Stage {
    /// Makes the step from `input.last` that the tools of `problem` cause.
    pub fn correct_loaded(
        &mut self,
        lent: Lent<'_>,
        input: &Input<'_>,
        rest: &[f32],
        problem: &mut Problem,
        next: &mut [f32],
    ) -> Result<Report> {
        self.nodes.clear();
        self.preconditioner.prescribe(lent.env(), &[])?;
        self.memory.begin();
        self.memory.mask(&[]);
        self.prepare(lent, input);
        let mut report = Report::default();
        let mut u = std::mem::take(&mut self.u);
        let mut g = std::mem::take(&mut self.g);
        let mut at = Iterate {
            u: &mut u,
            g: &mut g,
            det: 1.0,
        };
        let result = self.iterate_loaded(lent, input, rest, problem, &mut at, &mut report);
        if result.is_ok() {
            next.copy_from_slice(&u);
            self.finish(lent, input, next);
            if report.fell_back {
                self.stop_next();
            }
            self.next.min_det = report.min_det;
        }
        (self.u, self.g) = (u, g);
        result.map(|()| report)
    }

    fn iterate_loaded(
        &mut self,
        lent: Lent<'_>,
        input: &Input<'_>,
        rest: &[f32],
        problem: &mut Problem,
        at: &mut Iterate<'_>,
        report: &mut Report,
    ) -> Result<()> {
        self.guess_loaded(lent, input, rest, problem, at, report)?;
        let touched = problem.touched(&lent.corrections.body.held);
        self.preconditioner.engage(lent.env(), touched)?;
        let start = self.unbalanced(lent, problem, at.g);
        let mut size = start;
        for iteration in 0..input.enough.iterations {
            let until = input.enough.until;
            let late = until.is_some_and(|until| Instant::now() >= until);
            if !size.is_finite() || at.det < SMALLEST_DET || (iteration > 0 && late) {
                break;
            }
            self.improve_at(lent, input, rest, problem, at, 1.0, report)?;
            report.iterations += 1;
            let before = size;
            size = self.unbalanced(lent, problem, at.g);
            let moved = (dot(&self.d, &self.d) / (self.d.len() / 3) as f64).sqrt();
            report.remaining_mm = (moved * size / before.max(f64::MIN_POSITIVE)) as f32;
            if report.remaining_mm < input.enough.remaining_mm {
                break;
            }
        }
        if !size.is_finite() || at.det < SMALLEST_DET {
            // Linear elasticity from rest, with the tools where they are.
            problem.let_go();
            at.u.fill(0.0);
            self.press(lent, input, rest, problem, 1.0, at.u)?;
            at.det = self.residual(lent, input.last, at.u, at.g, report)?;
            let sound = self.motion.min_det >= SMALLEST_DET && !input.still;
            if at.det < SMALLEST_DET && sound {
                // Inverted too: the tissue stays where it was.
                problem.let_go();
                at.u.copy_from_slice(input.last);
                at.det = self.residual(lent, input.last, at.u, at.g, report)?;
            }
            report.fell_back = true;
            self.memory.clear();
        }
        report.residual = (size / start.max(f64::MIN_POSITIVE)) as f32;
        report.min_det = at.det;
        Ok(())
    }

    /// `|F - B^T f|`, left in `q`.
    fn unbalanced(&mut self, lent: Lent<'_>, problem: &Problem, g: &[f32]) -> f64 {
        self.q.copy_from_slice(g);
        unload(problem, &lent.corrections.body.held, &mut self.q);
        dot(&self.q, &self.q).sqrt()
    }

    /// The first guess: the last state, the free motion of the natural modes, and the linear response to the tools, in parts of
    /// their way; in so many that the first of them does not halve the smallest det F, with an iteration each.
    fn guess_loaded(
        &mut self,
        lent: Lent<'_>,
        input: &Input<'_>,
        rest: &[f32],
        problem: &mut Problem,
        at: &mut Iterate<'_>,
        report: &mut Report,
    ) -> Result<()> {
        let lost = self.motion.min_det < SMALLEST_DET && !input.still;
        let least = SMALLEST_DET.max(0.5 * self.motion.min_det.min(1.0));
        let ways = problem.parts();
        let mut iterated = 1;
        loop {
            problem.restart();
            if lost {
                at.u.fill(0.0);
                problem.let_go();
            } else {
                at.u.copy_from_slice(input.last);
                self.move_freely(lent, at.u)?;
            }
            let parts = ways.max(iterated);
            for part in 1..=parts {
                let way = part as f32 / parts as f32;
                self.press(lent, input, rest, problem, way, at.u)?;
                // An iteration after each of `iterated` parts of the load but the last.
                let due = part * iterated / parts > (part - 1) * iterated / parts;
                if due && part < parts {
                    at.det = self.residual(lent, input.last, at.u, at.g, report)?;
                    if at.det > SMALLEST_DET {
                        self.improve_at(lent, input, rest, problem, at, way, report)?;
                    }
                }
            }
            at.det = self.residual(lent, input.last, at.u, at.g, report)?;
            report.parts = parts;
            if at.det > least || iterated >= MOST_PARTS {
                return Ok(());
            }
            iterated *= 2;
        }
    }

    /// `u += -N diag(1 / (m (w² + kappa))) N^T [I_{n+1}(u_n) - I_n]`: what the natural modes do by themselves.
    fn move_freely(&mut self, lent: Lent<'_>, u: &mut [f32]) -> Result<()> {
        for ((q, drift), inertia) in self.q.iter_mut().zip(&self.drift).zip(&self.motion.inertia) {
            *q = drift - inertia;
        }
        mask_held(&lent.corrections.body.held, &mut self.q);
        self.preconditioner
            .move_natural(lent.env(), &self.q, &mut self.d, u)
    }

    /// Contact at `u`, the tools at part `way` of their way: `u` becomes `u + A_k B^T (f' - f)`.
    fn press(
        &mut self,
        lent: Lent<'_>,
        input: &Input<'_>,
        rest: &[f32],
        problem: &mut Problem,
        way: f32,
        u: &mut [f32],
    ) -> Result<()> {
        let state = State {
            rest,
            u,
            start: input.last,
        };
        let compliance = compliance(lent, &self.preconditioner);
        let change = problem.solve(compliance, state, way)?;
        self.preconditioner.load(
            lent.env(),
            change.dofs,
            change.forces,
            &mut self.scratch_field,
            u,
        )
    }

    /// One iteration with the tools at part `way` of their way.
    #[allow(clippy::too_many_arguments)]
    fn improve_at(
        &mut self,
        lent: Lent<'_>,
        input: &Input<'_>,
        rest: &[f32],
        problem: &mut Problem,
        at: &mut Iterate<'_>,
        way: f32,
        report: &mut Report,
    ) -> Result<()> {
        let env = lent.env();
        let held = &env.body.held;
        let (mut d, mut q) = (std::mem::take(&mut self.d), std::mem::take(&mut self.q));
        let mut g_new = std::mem::take(&mut self.g_new);
        // The total residual is the right side; `g_new` holds it until it is overwritten.
        g_new.copy_from_slice(at.g);
        unload(problem, held, &mut g_new);
        let preconditioner = &mut self.preconditioner;
        self.memory.direction(env, &g_new, &mut q, &mut d, |q, z| {
            preconditioner.apply(env, q, z)
        })?;
        mask_held(held, &mut d);
        for ((q, u), d) in q.iter_mut().zip(&*at.u).zip(&d) {
            *q = u + d;
        }
        self.press(lent, input, rest, problem, way, &mut q)?;
        for ((d, q), u) in d.iter_mut().zip(&q).zip(&*at.u) {
            *d = q - u;
        }
        mask_held(held, &mut d);
        let work = work(problem, &d);
        let slope = dot(at.g, &d) - work;
        let mut t = 1.0f32;
        for attempt in 0..=SHORTENINGS {
            for ((q, u), d) in q.iter_mut().zip(&*at.u).zip(&d) {
                *q = u + t * d;
            }
            let det = self.residual(lent, input.last, &q, &mut g_new, report)?;
            let slope_new = dot(&g_new, &d) - work;
            if det > SMALLEST_DET && 0.5 * (slope + slope_new) <= SLOPE * slope {
                at.u.copy_from_slice(&q);
                for ((q, new), old) in q.iter_mut().zip(&g_new).zip(&*at.g) {
                    *q = new - old;
                }
                self.memory.store(env, &d, t, &q)?;
                at.g.copy_from_slice(&g_new);
                at.det = det;
                if t < 1.0 {
                    problem.blend(t);
                }
                break;
            }
            if attempt == SHORTENINGS || slope >= 0.0 {
                problem.undo();
                self.memory.clear();
                break;
            }
            t *= if det > SMALLEST_DET && slope_new.is_finite() {
                (-slope / (slope_new - slope)).clamp(0.1, 0.5) as f32
            } else {
                0.5
            };
        }
        (self.d, self.q, self.g_new) = (d, q, g_new);
        Ok(())
    }
}

fn compliance<'a>(lent: Lent<'a>, preconditioner: &'a Preconditioner) -> Compliance<'a> {
    Compliance {
        prior: lent.prior,
        held: &lent.corrections.body.held,
        inertia: Some((&lent.corrections.space, preconditioner.held_back())),
    }
}

/// Takes the tools' loads off a residual, µN.
fn unload(problem: &Problem, held: &[bool], residual: &mut [f32]) {
    problem.each_load(|node, force| {
        if !held[node as usize] {
            let at = 3 * node as usize;
            for (r, f) in residual[at..at + 3].iter_mut().zip(force.to_array()) {
                *r -= 1e3 * f;
            }
        }
    });
}

/// Work of the tools' loads over a field, nJ.
fn work(problem: &Problem, d: &[f32]) -> f64 {
    let mut sum = 0.0f64;
    problem.each_load(|node, force| {
        let at = 3 * node as usize;
        for (d, f) in d[at..at + 3].iter().zip(force.to_array()) {
            sum += 1e3 * f64::from(*d) * f64::from(f);
        }
    });
    sum
}
