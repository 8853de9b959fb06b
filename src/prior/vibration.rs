//! Free vibration (`vibration.safetensors` of `docs/reference/formats.md`): what linear elasticity does when the contact is gone.
//!
//! The held, damped, linear-elastic body swings from the last response: `M u'' + alpha M u' + K u = 0`. Its eigenmodes
//! are independent oscillators, each advanced over a step exactly.

use super::table::PriorTable;
use crate::bundle::TensorFile;
use crate::error::Result;
use crate::kernels::project::row_dots;
use crate::kernels::respond::accumulate_rows;
use crate::kernels::rows::Stored;
use crate::kernels::{Isa, Pool};

/// Most modes that a file may hold.
const LIMIT: usize = 4096;

/// Modes and their exact step.
#[derive(Debug)]
pub struct FreeVibration {
    /// Mode amplitude of a unit force at a contact dof `[3D,m]`, mm/mN.
    force_to_mode: Vec<f32>,
    /// Modes in block coordinates `[m,Q]`.
    modes: Vec<f32>,
    /// Amplitudes of a field in block coordinates `[m,Q]`; empty where the file has none.
    projection: Vec<f32>,
    /// `0..m`, as the row list of the product with `modes`.
    rows: Vec<u32>,
    /// For each mode `A, B, C, D` of `z' = A z + B w`, `w' = C z + D w`.
    propagator: Vec<[f32; 4]>,
}

impl FreeVibration {
    /// Reads and checks the tables for a prior; `damping` in 1/s, `dt` in s. `projected`: the amplitudes of
    /// fields are needed too.
    pub fn parse(
        file: &TensorFile,
        prior: &PriorTable,
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
        let dofs = 3 * prior.contact_nodes.len();
        Ok(FreeVibration {
            force_to_mode: file.f32("force_to_mode", &[Some(dofs), Some(count)])?,
            modes: file.f32("modes", &[Some(count), Some(prior.width())])?,
            projection: if projected {
                file.f32("projection", &[Some(count), Some(prior.width())])?
            } else {
                Vec::new()
            },
            rows: (0..count as u32).collect(),
            propagator: frequency
                .iter()
                .map(|&omega| propagator(f64::from(omega), damping, dt))
                .collect(),
        })
    }

    /// Number of modes, `m`.
    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// The table from contact forces to mode amplitudes, `[3D,m]`.
    pub fn force_to_mode(&self) -> Stored<'_> {
        Stored::F32(&self.force_to_mode)
    }

    /// One step without contact. A state is `m` amplitudes, mm, and then `m` velocities times the step, mm.
    pub fn advance(&self, state: &[f32], next: &mut [f32]) {
        let count = self.count();
        let (z, w) = state.split_at(count);
        let (z_next, w_next) = next.split_at_mut(count);
        for (i, &[a, b, c, d]) in self.propagator.iter().enumerate() {
            z_next[i] = a * z[i] + b * w[i];
            w_next[i] = c * z[i] + d * w[i];
        }
    }

    /// The field of a state in block coordinates `[Q]`.
    pub fn field(&self, isa: Isa, pool: &Pool, state: &[f32], q: &mut [f32]) -> Result<()> {
        let modes = Stored::F32(&self.modes);
        let amplitudes = &state[..self.count()];
        Ok(accumulate_rows(
            isa, pool, modes, &self.rows, amplitudes, false, q,
        )?)
    }

    /// The amplitudes `[m]`, mm, of a field in block coordinates `[Q]`: its mass-weighted projection on the modes.
    pub fn amplitudes(&self, isa: Isa, pool: &Pool, q: &[f32], out: &mut [f32]) -> Result<()> {
        let rows = Stored::F32(&self.projection);
        Ok(row_dots(isa, pool, rows, &self.rows, q, out)?)
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.force_to_mode.len()
            + self.modes.len()
            + self.projection.len()
            + 5 * self.rows.len())
    }
}

/// The exact step of `z'' + damping z' + omega^2 z = 0`, velocities times `dt`.
pub fn propagator(omega: f64, damping: f64, dt: f64) -> [f32; 4] {
    let half = 0.5 * damping;
    let squared = omega * omega - half * half;
    let root = squared.abs().sqrt();
    let decay = (-half * dt).exp();
    // sin(r t) / r and cos(r t), with r imaginary where the mode is overdamped.
    let (sine, cosine) = if root * dt < 1e-6 {
        (dt, 1.0)
    } else if squared > 0.0 {
        ((root * dt).sin() / root, (root * dt).cos())
    } else {
        ((root * dt).sinh() / root, (root * dt).cosh())
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
