//! Free vibration (`vibration.safetensors` of `docs/reference/formats.md`): what linear elasticity does when the contact is gone.
//!
//! The held, damped, linear-elastic body swings from the last response: `M u'' + alpha M u' + K u = 0`. Its eigenmodes
//! are independent oscillators, each advanced over a step exactly.
//!
//! A corrected state is more than its modes. What they leave out, `b = Phi (q - sum_k z_k modes[k])`, a learned linear map may carry on
//! (`release.safetensors`).
//!
//! With `r = sqrt(w^2 - (alpha/2)^2)` an oscillator of frequency `w` goes over a step `h` as
//! `z' = e^(-alpha h/2) (cos(r h) + alpha/2 sin(r h)/r) z + e^(-alpha h/2) sin(r h)/r v`; there is
//! no error of integration and no limit on the step. Velocities are kept times the step, mm, so
//! that amplitudes and velocities have one unit.

use super::release::Release;
use bundle::TensorFile;
use field::error::Result;
use field::memory::{self, HeldBytes};
use kernels::project::row_dots;
use kernels::respond::accumulate_rows;
use kernels::rows::Stored;
use kernels::{Isa, Pool};

/// Most modes that a file may hold: each costs a row of the table in every step without contact.
const LIMIT: usize = 4096;

/// Modes and their exact step.
#[derive(Clone, Debug, HeldBytes)]
pub struct FreeVibration {
    /// Mode amplitude of a unit force at a contact dof `[3D,m]`, mm/mN.
    force_to_mode: Vec<f32>,
    /// Modes in block coordinates `[m,Q]`.
    modes: Vec<f32>,
    /// Amplitudes of a field in block coordinates `[m,Q]`; empty where the file has none.
    projection: Vec<f32>,
    /// `0..m`, as the row list of the product with `modes`; of the learned modes its first `r`.
    rows: Vec<u32>,
    /// Natural modes, `m`: those of [`FreeVibration`], without the learned ones.
    count: usize,
    /// The learned map; empty where the file has none.
    release: Release,
    /// For each mode `A, B, C, D` of `z' = A z + B w`, `w' = C z + D w`.
    propagator: Vec<[f32; 4]>,
}

const WHAT: &str = "the free vibration";

impl FreeVibration {
    /// Reads and checks the tables for a response of shape `[3D,Q]`; `damping` in 1/s, `dt` in s. `projected`: the
    /// amplitudes of fields are needed too.
    pub fn parse(
        file: &TensorFile,
        [dofs, width]: [usize; 2],
        damping: f64,
        dt: f64,
        projected: bool,
    ) -> Result<FreeVibration> {
        let frequency = file.f32("frequency", &[None])?;
        let count = frequency.len();
        if count == 0 || count > LIMIT {
            return Err(file.bad("frequency", format!("must hold 1 to {LIMIT} modes")));
        }
        if let Some(at) = frequency.iter().position(|&omega| omega <= 0.0) {
            return Err(file.bad("frequency", format!("element {at} is not positive")));
        }
        Ok(FreeVibration {
            force_to_mode: file.float("force_to_mode", &[Some(dofs), Some(count)])?,
            modes: file.float("modes", &[Some(count), Some(width)])?,
            projection: if projected {
                file.float("projection", &[Some(count), Some(width)])?
            } else {
                Vec::new()
            },
            rows: memory::collected(count, 0..count as u32, WHAT)?,
            count,
            release: Release::default(),
            propagator: {
                let frequency = frequency.iter().map(|&omega| f64::from(omega));
                let over = frequency.map(|omega| propagator(omega, damping, dt));
                memory::collected(count, over, WHAT)?
            },
        })
    }

    /// Reads the learned map that carries on what the modes leave out; `width`: that of the prior, `Q`.
    pub fn learn(&mut self, file: &TensorFile, width: usize) -> Result<()> {
        self.release = Release::parse(file, width)?;
        let count = self.count.max(self.release.count);
        self.rows = memory::collected(count, 0..count as u32, WHAT)?;
        Ok(())
    }

    /// Number of modes, `m`.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Numbers of a state: `m` amplitudes, `m` velocities times the step, and of a learned map `b` and the `b` before it, mm.
    pub fn state_len(&self) -> usize {
        2 * (self.count + self.release.count)
    }

    /// The table from contact forces to mode amplitudes, `[3D,m]`.
    pub fn force_to_mode(&self) -> Stored<'_> {
        Stored::F32(&self.force_to_mode)
    }

    /// One step without contact.
    /// `state` and `next` have [`FreeVibration::state_len`] numbers; they are two arrays, since the
    /// state before stays readable until the step is published.
    pub fn advance(&self, state: &[f32], next: &mut [f32]) {
        let count = self.count();
        let (state, b) = state.split_at(2 * count);
        let (next, b_next) = next.split_at_mut(2 * count);
        self.release.advance(b, b_next);
        let (z, w) = state.split_at(count);
        let (z_next, w_next) = next.split_at_mut(count);
        for (i, &[a, b, c, d]) in self.propagator.iter().enumerate() {
            z_next[i] = a * z[i] + b * w[i];
            w_next[i] = c * z[i] + d * w[i];
        }
    }

    /// The field of a state in block coordinates `[Q]`.
    pub fn field(&self, isa: Isa, pool: &Pool, state: &[f32], q: &mut [f32]) -> Result<()> {
        let (modes, rows) = (Stored::F32(&self.modes), &self.rows[..self.count]);
        accumulate_rows(isa, pool, modes, rows, &state[..self.count], false, q)?;
        let (modes, rows) = (
            Stored::F32(&self.release.modes),
            &self.rows[..self.release.count],
        );
        let b = &state[2 * self.count..][..self.release.count];
        if !rows.is_empty() {
            accumulate_rows(isa, pool, modes, rows, b, true, q)?;
        }
        Ok(())
    }

    /// Sets `b` (`before`: the one before it) of a state from what its amplitudes `z` leave out of a field in block coordinates, which
    /// they are taken from.
    /// On return `q` holds the remainder itself. Without a learned map nothing is done.
    pub fn set_remainder(
        &self,
        isa: Isa,
        pool: &Pool,
        z: &[f32],
        q: &mut [f32],
        state: &mut [f32],
        before: bool,
    ) -> Result<()> {
        let count = self.release.count;
        if count == 0 {
            return Ok(());
        }
        for (z, mode) in z.iter().zip(self.modes.chunks_exact(q.len())) {
            q.iter_mut().zip(mode).for_each(|(q, mode)| *q -= z * mode);
        }
        let start = 2 * self.count + if before { count } else { 0 };
        let modes = Stored::F32(&self.release.modes);
        let b = &mut state[start..start + count];
        Ok(row_dots(isa, pool, modes, &self.rows[..count], q, b)?)
    }

    /// The amplitudes `[m]`, mm, of a field in block coordinates `[Q]`: its mass-weighted projection on the modes.
    pub fn amplitudes(&self, isa: Isa, pool: &Pool, q: &[f32], out: &mut [f32]) -> Result<()> {
        let rows = Stored::F32(&self.projection);
        let list = &self.rows[..self.count];
        Ok(row_dots(isa, pool, rows, list, q, out)?)
    }
}

/// The exact step of `z'' + damping z' + omega^2 z = 0`, velocities times `dt`.
/// `[A, B, C, D]` of `z' = A z + B w`, `w' = C z + D w` with `w = dt z'`. In f64, once a model.
pub fn propagator(omega: f64, damping: f64, dt: f64) -> [f32; 4] {
    let half = 0.5 * damping;
    let squared = omega * omega - half * half;
    let root = squared.abs().sqrt();
    let decay = libm::exp(-half * dt);
    // sin(r t) / r and cos(r t), with r imaginary where the mode is overdamped.
    // Near critical damping both forms divide by almost nothing; their limit is `t`.
    let (sine, cosine) = if root * dt < 1e-6 {
        (dt, 1.0)
    } else if squared > 0.0 {
        (libm::sin(root * dt) / root, libm::cos(root * dt))
    } else {
        (libm::sinh(root * dt) / root, libm::cosh(root * dt))
    };
    let impulse = decay * sine;
    let place = decay * cosine + half * impulse;
    [
        place,
        impulse / dt,
        -omega * omega * impulse * dt,
        place - damping * impulse,
    ]
    .map(|x| x as f32)
}

#[cfg(test)]
mod tests {
    use super::propagator;

    /// 50 ms of the oscillator by 50,000 small leapfrog steps.
    fn integrated(omega: f64, damping: f64, mut z: f64, mut v: f64) -> (f64, f64) {
        let h = 1e-6;
        for _ in 0..50_000 {
            let half = v + 0.5 * h * (-damping * v - omega * omega * z);
            z += h * half;
            v = (half - 0.5 * h * omega * omega * z) / (1.0 + 0.5 * h * damping);
        }
        (z, v)
    }

    #[test]
    fn a_step_is_the_damped_oscillator_below_at_and_above_critical_damping() {
        for (omega, damping) in [(6.0, 20.0), (10.0, 20.0), (40.0, 20.0), (85.0, 0.0)] {
            let [a, b, c, d] = propagator(omega, damping, 0.05).map(f64::from);
            let (z, v) = integrated(omega, damping, 2.0, -30.0);
            let (z0, w0) = (2.0, -30.0 * 0.05);
            assert!((a * z0 + b * w0 - z).abs() < 2e-4, "{omega} {damping}: {z}");
            assert!(
                (c * z0 + d * w0 - v * 0.05).abs() < 2e-4,
                "{omega} {damping}: {v}"
            );
        }
    }
}
