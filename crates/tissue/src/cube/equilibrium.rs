//! The equilibria of bricks whose held unknowns go along with a strain, by Newton's method.

use super::brick::{Point, points};
use super::grid::Grid;
use crate::band::Band;
use crate::newton::{self, Balance};
use elements::{Deformation, Moduli, stress, tangent};

/// What remains of the forces, relative to those that hold.
const BALANCE: f64 = 1e-7;
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

    /// On to a strain; false where no equilibrium was found, and the state is then of no use.
    pub fn settle(&mut self, strain: f64) -> bool {
        let (from, u) = (self.strain, self.u.clone());
        let Some(u) = newton::settle(self, u, from, strain) else {
            return false;
        };
        (self.u, self.strain) = (u, strain);
        true
    }
}

impl Balance for Equilibrium<'_> {
    const MOST_STEPS: usize = 40;

    /// Forces, and if that is asked for their derivatives; false where a brick folds.
    fn evaluate(&mut self, _strain: f64, u: &[f64], with_tangent: bool) -> bool {
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

    fn is_balanced(&self, _strain: f64) -> bool {
        let (mut left, mut acting) = (0.0, 0.0);
        for (force, held) in self.force.iter().zip(&self.held) {
            match held {
                None => left += force * force,
                Some(_) => acting += force * force,
            }
        }
        left <= BALANCE * BALANCE * acting
    }

    fn forces(&self) -> &[f64] {
        &self.force
    }

    fn held(&self) -> &[Option<f64>] {
        &self.held
    }

    fn band(&mut self) -> &mut Band {
        &mut self.band
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
