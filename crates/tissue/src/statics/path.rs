//! One contact set led through a list of prescribed displacements, an equilibrium at each.
//!
//! The minimiser is L-BFGS with the linear stiffness, contact held, as its preconditioner:
//! `H_0 g = y - A[:,C] A_CC^-1 y_C`, `y = K^-1 g`. The stiffness at rest is far from that of a body under a deep push
//! (it is nearly incompressible in another configuration), so plain modified Newton steps diverge there; the line search
//! on the energy and the pairs of earlier steps, which are kept from one depth to the next, deal with it.

use super::energy::{Energy, StrainEnergy};
use super::quasi_newton::{Pairs, product};
use crate::linear::{ContactFactor, FreeNodes};

/// On the way from one asked displacement to the next at most so many halves are taken.
const MAX_HALVINGS: u32 = 6;
/// Iterations before it is halved.
const MAX_ITERATIONS: usize = 120;
/// Tolerance on the way, relative to that of an equilibrium that is kept.
const LOOSE: f64 = 20.0;

/// A state of rest under prescribed displacements.
pub(super) struct Equilibrium {
    /// Which of the asked displacements.
    pub index: usize,
    /// `[3K]`, mm.
    pub displacement: Vec<f64>,
    /// Force of the tissue on the instrument `[3m]`, mN.
    pub reaction: Vec<f64>,
    pub energy: Energy,
}

/// Displacement of the contact nodes to reach, `[3m]` mm.
struct Target {
    vectors: Vec<f64>,
    /// `None` on the way to the next one.
    index: Option<usize>,
}

/// A body with a contact set, at rest under the last displacement reached.
pub(super) struct Path<'a> {
    body: &'a StrainEnergy,
    free: &'a FreeNodes,
    nodes: Vec<u32>,
    /// `[3m,3K]`, mm/mN.
    columns: Vec<f32>,
    contact: ContactFactor,
    tolerance_mm: f64,
    /// The next one last.
    targets: Vec<Target>,
    /// The last equilibrium, its contact vectors and their linear response.
    rest: Vec<f64>,
    rest_vectors: Vec<f64>,
    rest_linear: Vec<f64>,
    linear: Vec<f64>,
    u: Vec<f64>,
    gradient: Vec<f64>,
    reaction: Vec<f64>,
    energy: Energy,
    trial: Vec<f64>,
    trial_gradient: Vec<f64>,
    direction: Vec<f64>,
    pairs: Pairs,
    iterations: usize,
    /// Halves taken since the last asked displacement.
    halvings: u32,
    /// Equilibria found.
    pub found: Vec<Equilibrium>,
    /// Why the asked displacement of this index, and with it all later ones, was not reached.
    pub failure: Option<(usize, String)>,
    /// Right-hand sides that were solved for.
    pub solves: usize,
}

impl<'a> Path<'a> {
    /// From rest through `asked` displacements `[3m]` of the (free) `nodes`.
    pub fn new(
        body: &'a StrainEnergy,
        free: &'a FreeNodes,
        nodes: Vec<u32>,
        columns: Vec<f32>,
        contact: ContactFactor,
        asked: Vec<Vec<f64>>,
        tolerance_mm: f64,
    ) -> Self {
        let (size, wide) = (3 * nodes.len(), 3 * free.index.len());
        let mut targets: Vec<Target> = asked
            .into_iter()
            .enumerate()
            .map(|(index, vectors)| Target {
                vectors,
                index: Some(index),
            })
            .collect();
        targets.reverse();
        let zero = || vec![0.0; wide];
        let mut path = Self {
            body,
            free,
            nodes,
            columns,
            contact,
            tolerance_mm,
            targets,
            rest: zero(),
            rest_vectors: vec![0.0; size],
            rest_linear: zero(),
            linear: zero(),
            u: zero(),
            gradient: zero(),
            reaction: vec![0.0; size],
            energy: Energy {
                value: 0.0,
                min_det: 1.0,
            },
            trial: zero(),
            trial_gradient: zero(),
            direction: zero(),
            pairs: Pairs::default(),
            iterations: 0,
            halvings: 0,
            found: Vec::new(),
            failure: None,
            solves: 0,
        };
        path.begin();
        path
    }

    /// Whether nothing is left to reach.
    pub fn is_done(&self) -> bool {
        self.targets.is_empty()
    }

    /// Writes the right-hand side of the next solve, over the free dofs.
    pub fn right_side(&mut self, out: &mut [f64]) {
        self.direction.copy_from_slice(&self.gradient);
        self.pairs.before(&mut self.direction);
        for (out, &node) in out.as_chunks_mut::<3>().0.iter_mut().zip(&self.free.nodes) {
            out.copy_from_slice(&self.direction[3 * node as usize..3 * node as usize + 3]);
        }
        self.solves += 1;
    }

    /// Takes a step, given the solution for [`Self::right_side`].
    pub fn advance(&mut self, solution: &[f64]) {
        self.precondition(solution);
        self.pairs.after(&mut self.direction);
        let slope = product(&self.gradient, &self.direction);
        if slope.is_nan() || slope <= 0.0 {
            // At an equilibrium to rounding there is no slope either.
            let still = self.gradient.iter().all(|g| g.abs() < 1e-12);
            if self.pairs.is_empty() || still {
                self.settle(still);
            } else {
                self.pairs.clear();
            }
            return;
        }
        let small = self.length_of_direction() < self.tolerance();
        let mut length = 1.0;
        for _ in 0..12 {
            for ((trial, u), d) in self.trial.iter_mut().zip(&self.u).zip(&self.direction) {
                *trial = u - length * d;
            }
            let energy = self.body.evaluate(&self.trial, &mut self.trial_gradient);
            if self.change(&energy, length) <= -1e-4 * length * slope {
                self.accept(energy);
                self.iterations += 1;
                if small {
                    self.settle(true);
                } else if self.iterations >= MAX_ITERATIONS {
                    self.settle(false);
                }
                return;
            }
            length *= if energy.value.is_finite() { 0.5 } else { 0.25 };
        }
        if small || self.pairs.is_empty() {
            self.settle(small);
        } else {
            self.pairs.clear();
        }
    }

    /// Energy of the trial point, `length` along the direction, beyond the present one's.
    ///
    /// Near an equilibrium the difference of two sums over the elements is rounding alone, and then the gradients at
    /// both ends tell (the trapezoidal rule): they keep their digits, whatever the logarithm of the platform rounds.
    fn change(&self, energy: &Energy, length: f64) -> f64 {
        let change = energy.value - self.energy.value;
        if change.abs() > 1e-8 * self.energy.value.abs() || !change.is_finite() {
            return change;
        }
        // The direction is zero at held and contact nodes, so their forces do not count.
        let ends = product(&self.gradient, &self.direction)
            + product(&self.trial_gradient, &self.direction);
        -0.5 * length * ends
    }

    fn tolerance(&self) -> f64 {
        match self.targets.last() {
            Some(Target { index: None, .. }) => LOOSE * self.tolerance_mm,
            _ => self.tolerance_mm,
        }
    }

    /// Root mean square of the step over the nodes, mm.
    fn length_of_direction(&self) -> f64 {
        (product(&self.direction, &self.direction) / self.free.index.len() as f64).sqrt()
    }

    /// `direction = y - A[:,C] A_CC^-1 y_C`: a unit step of the linear body that keeps the contact.
    fn precondition(&mut self, solution: &[f64]) {
        self.direction.fill(0.0);
        for (part, &node) in solution.as_chunks::<3>().0.iter().zip(&self.free.nodes) {
            self.direction[3 * node as usize..3 * node as usize + 3].copy_from_slice(part);
        }
        let at_contact: Vec<f64> = of_nodes(&self.direction, &self.nodes);
        for (force, column) in self
            .contact
            .forces(&at_contact)
            .iter()
            .zip(self.columns.chunks_exact(self.u.len()))
        {
            for (d, a) in self.direction.iter_mut().zip(column) {
                *d -= force * f64::from(*a);
            }
        }
        set_nodes(&mut self.direction, &self.nodes, None);
    }

    /// Moves to the trial point.
    fn accept(&mut self, energy: Energy) {
        self.reaction = self.hold();
        let step = self.trial.iter().zip(&self.u).map(|(a, b)| a - b).collect();
        let gradients = self.trial_gradient.iter().zip(&self.gradient);
        self.pairs
            .push(step, gradients.map(|(a, b)| a - b).collect());
        self.take(energy);
    }

    /// Takes what holds the body out of the trial gradient; returns the reaction at the contact.
    fn hold(&mut self) -> Vec<f64> {
        let forces = of_nodes(&self.trial_gradient, &self.nodes);
        set_nodes(&mut self.trial_gradient, &self.nodes, None);
        for (node, free) in self.free.index.iter().enumerate() {
            if *free == u32::MAX {
                self.trial_gradient[3 * node..3 * node + 3].fill(0.0);
            }
        }
        forces.into_iter().map(|f| -f).collect()
    }

    fn take(&mut self, energy: Energy) {
        std::mem::swap(&mut self.u, &mut self.trial);
        std::mem::swap(&mut self.gradient, &mut self.trial_gradient);
        self.energy = energy;
    }

    /// Ends with the present target: reached, or to be approached in two halves.
    fn settle(&mut self, reached: bool) {
        if reached && let Some(target) = self.targets.pop() {
            if let Some(index) = target.index {
                self.halvings = 0;
                self.found.push(Equilibrium {
                    index,
                    displacement: self.u.clone(),
                    reaction: self.reaction.clone(),
                    energy: self.energy,
                });
            }
            self.rest.copy_from_slice(&self.u);
            self.rest_vectors = target.vectors;
            self.rest_linear.copy_from_slice(&self.linear);
        } else {
            self.pairs.clear();
            self.halve("not in equilibrium");
        }
        self.begin();
    }

    /// Puts the point halfway from the last equilibrium before the next target; gives up after too many.
    fn halve(&mut self, cause: &str) {
        let Some(next) = self.targets.last() else {
            return;
        };
        self.halvings += 1;
        if self.halvings > MAX_HALVINGS {
            let index = self.targets.iter().rev().find_map(|target| target.index);
            let text = format!("{cause} after {MAX_HALVINGS} halvings of the way");
            self.failure = Some((index.unwrap_or(0), text));
            self.targets.clear();
            return;
        }
        let ends = self.rest_vectors.iter().zip(&next.vectors);
        let target = Target {
            vectors: ends.map(|(a, b)| 0.5 * (a + b)).collect(),
            index: None,
        };
        self.targets.push(target);
    }

    /// Starts towards the next target from a guess without inverted elements.
    fn begin(&mut self) {
        while let Some(target) = self.targets.last() {
            let vectors = target.vectors.clone();
            if self.guess(&vectors) {
                self.iterations = 0;
                return;
            }
            self.halve("elements invert");
        }
    }

    /// The linear response plus the last equilibrium's residual, which grows with the square of the push; else the last
    /// equilibrium moved by the linear response.
    fn guess(&mut self, vectors: &[f64]) -> bool {
        self.linear.fill(0.0);
        for (force, column) in self
            .contact
            .forces(vectors)
            .iter()
            .zip(self.columns.chunks_exact(self.u.len()))
        {
            for (l, a) in self.linear.iter_mut().zip(column) {
                *l += force * f64::from(*a);
            }
        }
        let before = product(&self.rest_vectors, &self.rest_vectors);
        let growth = if before > 0.0 {
            (product(vectors, vectors) / before).min(9.0)
        } else {
            0.0
        };
        for factor in [growth, 1.0] {
            for (at, trial) in self.trial.iter_mut().enumerate() {
                *trial = self.linear[at] + factor * (self.rest[at] - self.rest_linear[at]);
            }
            set_nodes(&mut self.trial, &self.nodes, Some(vectors));
            let energy = self.body.evaluate(&self.trial, &mut self.trial_gradient);
            if energy.value.is_finite() {
                self.reaction = self.hold();
                self.take(energy);
                return true;
            }
        }
        false
    }
}

fn of_nodes(field: &[f64], nodes: &[u32]) -> Vec<f64> {
    nodes
        .iter()
        .flat_map(|&node| {
            field[3 * node as usize..3 * node as usize + 3]
                .iter()
                .copied()
        })
        .collect()
}

/// Sets the rows of `nodes` to `values [3m]`, or to zero.
fn set_nodes(field: &mut [f64], nodes: &[u32], values: Option<&[f64]>) {
    for (at, &node) in nodes.iter().enumerate() {
        let row = &mut field[3 * node as usize..3 * node as usize + 3];
        match values {
            Some(values) => row.copy_from_slice(&values[3 * at..3 * at + 3]),
            None => row.fill(0.0),
        }
    }
}
