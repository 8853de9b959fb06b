//! BDF2 over the steps of a solver: what it knows before a step, velocities and inertia after it, and the error of its length.

use super::Integrator;
use super::extent::Extent;
use super::input::{Input, Report, SolverContext};
use super::passes;
use super::solver::ImplicitSolver;
use crate::error::Result;
use crate::kernels::parts::Parts;

/// Parts of the second difference of the displacement, and of that of the velocity over a step, by
/// which a step of BDF2 errs. Both differences are of known states; their weights scale them to
/// millimetres of error, and a bundle's calibration follows on top.
const BEND: f64 = 0.02;
const JERK: f64 = 0.05;

/// BDF2's differences of one number: what a node's displacement or velocity was, and is.
#[derive(Clone, Copy)]
struct Differences {
    /// `1 / 2h`, 1/s.
    half: f32,
    /// 0 where the past is not known: its velocities count as none.
    known: f32,
}

impl Differences {
    /// Of a step of this length; a step from a host's displacement (`still`) knows no velocity.
    fn new(step_s: f64, input: &Input<'_>) -> Differences {
        Differences {
            half: (0.5 / step_s) as f32,
            known: if input.still { 0.0 } else { 1.0 },
        }
    }

    /// `(3 x_{n+1} - 4 x_n + x_{n-1}) / 2h`, by the differences, which are small where the numbers are not.
    #[inline(always)]
    fn rate(self, [next, last, before]: [f32; 3]) -> f32 {
        (3.0 * (next - last) - (last - before)) * self.half
    }

    /// Velocity, and acceleration from it and the two velocities before.
    #[inline(always)]
    fn motion(self, displacements: [f32; 3], [v_n, v_before]: [f32; 2]) -> [f32; 2] {
        let v = self.rate(displacements);
        [v, self.rate([v, self.known * v_n, self.known * v_before])]
    }
}

impl ImplicitSolver {
    /// Inertia and damping of the step at the last displacement, less the loads.
    pub(super) fn prepare(&mut self, context: SolverContext<'_>, input: &Input<'_>) -> Result<()> {
        let env = context.env();
        let (last, before) = (input.last, input.before);
        let Integrator {
            step_s,
            damping_per_s,
        } = context.time_step.integrator;
        let (bdf2, alpha) = (Differences::new(step_s, input), damping_per_s as f32);
        let (mass, motion) = (&env.body.mass_of_dof, &self.motion);
        let len = self.balance.drift.len();
        let drift = Parts::new(&mut self.balance.drift);
        passes::each(env.pool, len, 6, |range, _| {
            // SAFETY: this part belongs to this piece alone.
            let drift = unsafe { drift.part(range.start, range.len()) };
            let (last, before) = (&last[range.clone()], &before[range.clone()]);
            let velocity = &motion.velocity[range.clone()];
            let velocity_before = &motion.velocity_before[range.clone()];
            let mass = &mass[range];
            for i in 0..drift.len() {
                // As if the step moved nothing: `u_{n+1} = u_n`. What a move adds is `kappa M (u - u_n)`, which is linear.
                let displacements = [last[i], last[i], before[i]];
                let [v, a] = bdf2.motion(displacements, [velocity[i], velocity_before[i]]);
                drift[i] = mass[i] * (a + alpha * v);
            }
        })?;
        self.balance.take_load(
            input,
            step_s as f32,
            &self.motion.velocity,
            self.relaxing.as_deref(),
        )
    }

    /// Velocities of a state that the model predicted and nothing corrected.
    ///
    /// # Errors
    /// A panic on another thread of the pool.
    pub fn follow(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        next: &[f32],
    ) -> Result<()> {
        self.memory.begin();
        self.balance.load.clear();
        self.finish(context, input, next)?;
        Ok(())
    }

    /// The state being made is one that no equation of motion led to: without velocity.
    /// The pairs go too: they would lead back to what was refused.
    pub fn stop_next(&mut self) {
        self.next.velocity.fill(0.0);
        self.next.velocity_before.fill(0.0);
        self.next.inertia.fill(0.0);
        self.next.load.clear();
        self.next.truncated_mm = 0.0;
        self.clear_pairs();
    }

    /// The end of a step after [`finish`](Self::finish): what fell back has followed no equation of motion, so it leaves no velocity behind; the state's error is estimated.
    pub(super) fn end(&mut self, report: &mut Report, uncorrected_mm: Option<f32>) -> Result<()> {
        if report.fell_back {
            self.stop_next();
            self.next.leave_load(&self.balance.load)?;
        }
        self.next.min_det = report.min_det;
        self.next.estimate(&self.motion, report, uncorrected_mm);
        Ok(())
    }

    /// Velocity and inertia at `next`, the end of the step from `last`, and what a step of this length leaves out; returns how far the step went, root mean square
    /// over the nodes, mm.
    pub(super) fn finish(
        &mut self,
        context: SolverContext<'_>,
        input: &Input<'_>,
        next: &[f32],
    ) -> Result<f32> {
        let env = context.env();
        let (last, before) = (input.last, input.before);
        let Integrator {
            step_s,
            damping_per_s,
        } = context.time_step.integrator;
        let (bdf2, alpha) = (Differences::new(step_s, input), damping_per_s as f32);
        let (mass, motion) = (&env.body.mass_of_dof, &self.motion);
        let time = step_s as f32;
        // In pieces, each by one thread, whose sums are added in their order: the same bits for any number of threads.
        let mut sums = passes::Sums::new(&mut self.balance.partial, next.len(), 3);
        let parts = sums.parts();
        let own = &mut self.next;
        let outputs = [
            Parts::new(&mut own.velocity),
            Parts::new(&mut own.velocity_before),
            Parts::new(&mut own.inertia),
        ];
        passes::each(env.pool, next.len(), 9, |range, piece| {
            // SAFETY: these parts belong to this piece alone.
            let [velocity, velocity_before, inertia] =
                [0, 1, 2].map(|i| unsafe { outputs[i].part(range.start, range.len()) });
            let (last, before) = (&last[range.clone()], &before[range.clone()]);
            let known_v = &motion.velocity[range.clone()];
            let known_before = &motion.velocity_before[range.clone()];
            let (next, mass) = (&next[range.clone()], &mass[range]);
            for i in 0..next.len() {
                let displacements = [next[i], last[i], before[i]];
                let [v, a] = bdf2.motion(displacements, [known_v[i], known_before[i]]);
                velocity[i] = v;
                velocity_before[i] = bdf2.known * known_v[i];
                inertia[i] = mass[i] * (a + alpha * v);
            }
            // SAFETY: these sums belong to this piece alone.
            let sums = unsafe { parts.part(3 * piece, 3) };
            // Second differences of displacement and velocity: zero for steady motion.
            // What BDF2 leaves out is of third order; these differences of known states are its measure, and [`BEND`] and [`JERK`] their weights.
            sums[0] = passes::sum_of_squares(next.len(), |i| next[i] - 2.0 * last[i] + before[i]);
            sums[1] = passes::sum_of_squares(next.len(), |i| {
                time * (velocity[i] - 2.0 * velocity_before[i] + bdf2.known * known_before[i])
            });
            sums[2] = passes::sum_of_squares(next.len(), |i| next[i] - last[i]);
        })?;
        let nodes = (next.len() / 3) as f64;
        let [bend, jerk, went] = [0, 1, 2].map(|at| (sums.total(at) / nodes).sqrt());
        // Root mean square over the nodes, mm.
        let truncated = libm::hypot(BEND * bend, JERK * jerk);
        self.next.leave_load(&self.balance.load)?;
        let own = &mut self.next;
        // Who knows better sets these after it: this is what a state has that no element was asked of.
        own.min_det = 1.0;
        own.extent = Extent::default();
        own.truncated_mm = match truncated.is_finite() {
            true => truncated as f32,
            false => 0.0,
        };
        own.error_mm = 0.0;
        own.reaction.clear();
        Ok(went as f32)
    }
}
