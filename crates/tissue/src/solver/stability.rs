//! The critical step `2 / omega_max` from the largest eigenvalue of `M^-1 K`.
//!
//! Power iteration with the solver's own element kernel, `K v = -f(eps v) / eps`,
//! gives the eigenvalue at rest (the element bound `h/c` alone is 1.6 times too
//! cautious). In motion that value is scaled by the ratio of the present element
//! bound to the one at rest, `max_e sum_a |cof F dN_a/dX|²`: the pressure-wave
//! speed across the thinnest element. Ogden's law stiffens in itself, which
//! `stiffest.rs` adds. Fibres that are slack at rest do not show in the eigenvalue there: the step
//! is shortened by what they would add to the bound.

use super::Solver;

/// Enough for 1 to 2 % on tetrahedral meshes; the safety factor covers the rest.
const ITERATIONS: u32 = 80;

/// Length of the probing displacement, as a part of the mesh's mean element size.
const PROBE: f64 = 1e-3;

impl Solver {
    /// The critical step at rest with all fibres taut over that with all slack; 1 of a body without.
    pub(super) fn tautness_at_rest(&mut self) -> f64 {
        let laws = std::iter::once(&self.partition.moduli.law).chain(&self.partition.laws);
        if !laws.clone().any(|law| law.fibres().is_some()) {
            return 1.0;
        }
        let with = (self.partition.moduli, self.partition.laws.clone());
        self.partition.moduli = self.partition.moduli.without_fibres();
        for law in &mut self.partition.laws {
            *law = law.matrix();
        }
        let slack = self.diagnose().largest_bound;
        (self.partition.moduli, self.partition.laws) = with;
        (slack / self.bound_at_rest).sqrt()
    }

    /// Estimate at the rest state, s. Leaves the fields dirty: call `reset` afterwards.
    pub(super) fn estimate_critical_step(&mut self) -> f64 {
        let owned: Vec<usize> = (0..self.mass.len())
            .filter(|slot| self.mass[*slot] > 0.0 && !self.held[*slot])
            .collect();
        if owned.is_empty() {
            return f64::INFINITY;
        }
        let volume: f64 = self.mass.iter().map(|m| f64::from(*m)).sum::<f64>()
            / self.options.material.density_g_mm3();
        let probe = PROBE * (volume / self.tets.len() as f64).cbrt();
        // Deterministic start with energy in all directions (a Weyl sequence).
        let mut vector: Vec<[f64; 3]> = owned
            .iter()
            .enumerate()
            .map(|(i, _)| {
                [0.754_877_666_246_693, 0.569_840_290_998_053, 0.362_4]
                    .map(|step: f64| ((i as f64 + 1.0) * step).fract() - 0.5)
            })
            .collect();
        let mut eigenvalue = 0.0;
        for _ in 0..ITERATIONS {
            let longest = vector
                .iter()
                .flatten()
                .fold(0.0f64, |m, v| m.max(v.abs()))
                .max(f64::MIN_POSITIVE);
            for (slot, v) in owned.iter().zip(&mut vector) {
                let u = &mut self.fields.displacement[*slot].0;
                for k in 0..3 {
                    v[k] *= probe / longest;
                    u[k] = v[k] as f32;
                }
            }
            self.update_forces();
            let (mut numerator, mut denominator) = (0.0, 0.0);
            for (slot, v) in owned.iter().zip(&mut vector) {
                let mass = f64::from(self.mass[*slot]);
                let force = self.fields.force[*slot].0;
                for k in 0..3 {
                    let image = -f64::from(force[k]) / mass;
                    numerator += mass * v[k] * image;
                    denominator += mass * v[k] * v[k];
                    v[k] = image;
                }
            }
            eigenvalue = numerator / denominator;
        }
        for slot in owned {
            self.fields.displacement[slot].0 = [0.0; 4];
        }
        2.0 / eigenvalue.sqrt()
    }
}
