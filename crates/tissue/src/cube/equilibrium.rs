//! The equilibria of bricks whose held unknowns go along with a strain, by Newton's method.

use super::brick::{Point, points};
use super::grid::Grid;
use crate::band::Band;
use elements::{Deformation, Moduli, stress, tangent};

/// Newton's steps to a strain.
const MOST_STEPS: usize = 40;
/// What remains of the forces, relative to those that hold.
const BALANCE: f64 = 1e-7;
/// The least part of a step.
const LEAST_STEP: f64 = 1e-3;
/// Least `det F` of a state.
const LEAST_DET: f64 = 0.02;

pub struct Equilibrium<'a> {
    bricks: Vec<(&'a [usize; 20], [Point; 8])>,
    moduli: Moduli,
    /// How far an unknown moves at a strain of 1, mm; none where it is free.
    held: Vec<Option<f64>>,
    strain: f64,
    /// mm.
    u: Vec<f64>,
    /// Of the bricks, µN.
    force: Vec<f64>,
    band: Band,
}

impl<'a> Equilibrium<'a> {
    /// At rest.
    pub fn new(grid: &'a Grid, moduli: Moduli, held: &[(usize, f64)]) -> Self {
        let count = 3 * grid.places.len();
        let mut motions = vec![None; count];
        for (unknown, motion) in held {
            motions[*unknown] = Some(*motion);
        }
        let bricks = grid.bricks.iter();
        Self {
            bricks: bricks
                .map(|nodes| (nodes, points(&nodes.map(|node| grid.places[node]))))
                .collect(),
            moduli,
            held: motions,
            strain: 0.0,
            u: vec![0.0; count],
            force: vec![0.0; count],
            band: Band::new(count, grid.width()),
        }
    }

    /// What holds an unknown, µN.
    pub fn force(&self, unknown: usize) -> f64 {
        self.force[unknown]
    }

    /// Forces, and if that is asked for their derivatives; false where a brick folds.
    fn evaluate(&mut self, u: &[f64], with_tangent: bool) -> bool {
        self.force.fill(0.0);
        self.band.clear();
        for (nodes, points) in &self.bricks {
            for point in points {
                let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                for (node, gradient) in nodes.iter().zip(&point.gradients) {
                    for i in 0..3 {
                        for j in 0..3 {
                            f[i][j] += u[3 * node + i] * gradient[j];
                        }
                    }
                }
                let state = Deformation::of(f);
                if state.det.is_nan() || state.det < LEAST_DET {
                    return false;
                }
                let stress = stress(&state, self.moduli);
                for (node, g) in nodes.iter().zip(&point.gradients) {
                    for i in 0..3 {
                        let row = stress[i];
                        let sum = row[0] * g[0] + row[1] * g[1] + row[2] * g[2];
                        self.force[3 * node + i] += point.volume * sum;
                    }
                }
                if with_tangent {
                    let tangent = tangent(&state, self.moduli);
                    add(&mut self.band, nodes, point, &tangent);
                }
            }
        }
        true
    }

    /// The sum of forces times a step over the free unknowns.
    fn slope(&self, step: &[f64]) -> f64 {
        let rows = self.force.iter().zip(step).zip(&self.held);
        let free = rows.filter(|(_, held)| held.is_none());
        free.map(|((force, step), _)| force * step).sum()
    }

    fn is_balanced(&self) -> bool {
        let (mut left, mut acting) = (0.0, 0.0);
        for (force, held) in self.force.iter().zip(&self.held) {
            match held {
                None => left += force * force,
                Some(_) => acting += force * force,
            }
        }
        left <= BALANCE * BALANCE * acting
    }

    /// On to a strain; false where no equilibrium was found, and the state is then of no use.
    pub fn settle(&mut self, strain: f64) -> bool {
        let mut u = self.u.clone();
        for taken in 0..MOST_STEPS {
            if !self.evaluate(&u, true) {
                return false;
            }
            // The first step takes the plates along.
            let moves = taken == 0;
            if !moves && self.is_balanced() {
                (self.u, self.strain) = (u, strain);
                return true;
            }
            let mut step: Vec<f64> = self.force.iter().map(|f| -f).collect();
            for (at, held) in self.held.iter().enumerate() {
                if let Some(motion) = held {
                    let by = if moves {
                        motion * (strain - self.strain)
                    } else {
                        0.0
                    };
                    self.band.fix(at, by, &mut step);
                }
            }
            if !self.band.factor() {
                return false;
            }
            self.band.solve(&mut step);
            let slope = self.slope(&step);
            let mut part = 1.0;
            u = loop {
                let next: Vec<f64> = u.iter().zip(&step).map(|(u, s)| u + part * s).collect();
                let is_sound = self.evaluate(&next, false);
                if is_sound && (moves || self.slope(&step) <= 0.9 * slope.abs()) {
                    break next;
                }
                part *= 0.5;
                if moves || part < LEAST_STEP {
                    return false;
                }
            };
        }
        false
    }
}

/// Adds `g_j (dP_ij / dF_kl) h_l` between the gradients of two nodes.
fn add(band: &mut Band, nodes: &[usize; 20], point: &Point, tangent: &[[f64; 9]; 9]) {
    for (column, h) in nodes.iter().zip(&point.gradients) {
        let mut along = [[0.0; 3]; 9];
        for (row, along) in tangent.iter().zip(&mut along) {
            for k in 0..3 {
                let own = &row[3 * k..3 * k + 3];
                along[k] = point.volume * (own[0] * h[0] + own[1] * h[1] + own[2] * h[2]);
            }
        }
        for (row, g) in nodes.iter().zip(&point.gradients) {
            // The rest is the mirror of these.
            if row < column {
                continue;
            }
            for i in 0..3 {
                for k in 0..3 {
                    let sum = (0..3).map(|j| g[j] * along[3 * i + j][k]).sum();
                    band.add(3 * row + i, 3 * column + k, sum);
                }
            }
        }
    }
}
