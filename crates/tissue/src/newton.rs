//! Newton's method from one equilibrium to the next, with a line search, for bodies whose held unknowns go along with a parameter.

use crate::band::Band;

/// A last step, relative to the largest displacement, with which a state is found: where cells grow over orders of size, forces end at their rounding.
const STILL: f64 = 1e-6;
/// The least part of a step.
const LEAST_PART: f64 = 1e-3;

/// Forces of a body's states, and when they are in balance.
pub(crate) trait Balance {
    /// Newton's steps at most.
    const MOST_STEPS: usize;

    /// Forces of the displacements `u`, and if that is asked for their derivatives, at a value of the parameter; false where a cell folds.
    fn evaluate(&mut self, to: f64, u: &[f64], with_tangent: bool) -> bool;

    /// Whether what is left of the forces is small beside those that hold and load the body.
    fn is_balanced(&self, to: f64) -> bool;

    /// The last forces, by unknown.
    fn forces(&self) -> &[f64];

    /// How far each unknown moves by the parameter; none where it is free.
    fn held(&self) -> &[Option<f64>];

    /// The derivatives.
    fn band(&mut self) -> &mut Band;
}

/// The sum of the forces times a step over the free unknowns.
fn slope(body: &impl Balance, step: &[f64]) -> f64 {
    let rows = body.forces().iter().zip(step).zip(body.held());
    let free = rows.filter(|(_, held)| held.is_none());
    free.map(|((force, step), _)| force * step).sum()
}

/// The displacements in equilibrium at `to`, from those at `from`; none where no equilibrium was found.
pub(crate) fn settle<B: Balance>(
    body: &mut B,
    mut u: Vec<f64>,
    from: f64,
    to: f64,
) -> Option<Vec<f64>> {
    for taken in 0..B::MOST_STEPS {
        if !body.evaluate(to, &u, true) {
            return None;
        }
        // The first step takes what is held along.
        let moves = taken == 0;
        if !moves && body.is_balanced(to) {
            return Some(u);
        }
        let mut step: Vec<f64> = body.forces().iter().map(|f| -f).collect();
        for at in 0..step.len() {
            if let Some(motion) = body.held()[at] {
                let by = if moves { motion * (to - from) } else { 0.0 };
                body.band().fix(at, by, &mut step);
            }
        }
        if !body.band().factor() {
            return None;
        }
        body.band().solve(&mut step);
        let before = slope(body, &step);
        let largest = |list: &[f64]| list.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let is_last = !moves && largest(&step) <= STILL * largest(&u);
        let mut part = 1.0;
        loop {
            let next: Vec<f64> = u.iter().zip(&step).map(|(u, s)| u + part * s).collect();
            let is_sound = body.evaluate(to, &next, false);
            if is_sound && (is_last || moves || slope(body, &step) <= 0.9 * before.abs()) {
                u = next;
                break;
            }
            part *= 0.5;
            if moves || part < LEAST_PART {
                return None;
            }
        }
        if is_last {
            return Some(u);
        }
    }
    None
}
