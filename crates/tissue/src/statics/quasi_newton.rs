//! Limited-memory BFGS (Nocedal 1980) around a preconditioner that the caller applies.
//!
//! The two loops are apart, so that the preconditioner of many minimisations can be applied in one blocked solve.

use std::collections::VecDeque;

/// Pairs kept.
const MEMORY: usize = 10;

/// Differences of the last iterates and of their gradients.
#[derive(Default)]
pub(super) struct Pairs {
    kept: VecDeque<(Vec<f64>, Vec<f64>, f64)>,
    weights: Vec<f64>,
}

pub(super) fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

impl Pairs {
    /// Whether no pair is kept: the direction is the preconditioned gradient alone.
    pub fn is_empty(&self) -> bool {
        self.kept.is_empty()
    }

    /// Forgets all pairs.
    pub fn clear(&mut self) {
        self.kept.clear();
    }

    /// Adds `step` and the change of the gradient over it; one without positive curvature is left out.
    pub fn push(&mut self, step: Vec<f64>, change: Vec<f64>) {
        let curvature = product(&step, &change);
        let size = product(&step, &step).sqrt() * product(&change, &change).sqrt();
        if curvature > 1e-10 * size {
            if self.kept.len() == MEMORY {
                self.kept.pop_front();
            }
            self.kept.push_back((step, change, 1.0 / curvature));
        }
    }

    /// First loop, newest pair first: `gradient` becomes what the preconditioner is applied to.
    pub fn before(&mut self, gradient: &mut [f64]) {
        self.weights.clear();
        for (step, change, inverse) in self.kept.iter().rev() {
            let weight = inverse * product(step, gradient);
            self.weights.push(weight);
            for (g, y) in gradient.iter_mut().zip(change) {
                *g -= weight * y;
            }
        }
    }

    /// Second loop, oldest pair first: the preconditioned vector becomes `H g`.
    pub fn after(&self, direction: &mut [f64]) {
        for ((step, change, inverse), weight) in self.kept.iter().zip(self.weights.iter().rev()) {
            let rest = weight - inverse * product(change, direction);
            for (d, s) in direction.iter_mut().zip(step) {
                *d += rest * s;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadratic_is_minimised_in_as_many_steps_as_it_has_curvatures() {
        // f = sum k_i x_i² / 2 with k = 1, 3, 10: exact line search, unit preconditioner.
        let stiffness = [1.0, 3.0, 10.0];
        let gradient =
            |x: &[f64]| -> Vec<f64> { x.iter().zip(stiffness).map(|(x, k)| k * x).collect() };
        let mut pairs = Pairs::default();
        let mut x = vec![1.0, -2.0, 0.5];
        for _ in 0..3 {
            let g = gradient(&x);
            let mut d = g.clone();
            pairs.before(&mut d);
            pairs.after(&mut d);
            let length = product(&g, &d) / product(&d, &gradient(&d));
            let step: Vec<f64> = d.iter().map(|v| -length * v).collect();
            for (x, s) in x.iter_mut().zip(&step) {
                *x += s;
            }
            let change = gradient(&x).iter().zip(&g).map(|(a, b)| a - b).collect();
            pairs.push(step, change);
        }
        assert!(product(&x, &x).sqrt() < 1e-10, "{x:?}");
    }
}
