//! The rest shape of a body that was scanned under its weight: the inverse static problem.
//!
//! Known are the places `x` under gravity `g`, sought are those at rest `X`, of which `x` is the equilibrium:
//!
//! ```text
//! r(X) = f(x - X; X) - M(X) g = 0 at free nodes        X = x at held ones
//! ```
//!
//! with the elements' forces `f` and the masses `M` of the rest shape. Nothing is solved forward: with the stiffness `K` of the scanned shape, of which
//! `dr/dX` is close to `-K`, each step is `X <- X + K^-1 r`, and Anderson's mixing of the last steps (Walker and Ni 2011) takes up what `K` does not know.
//! A gravity from which that does not converge is reached in parts.

use elements::{Moduli, Tetrahedron};

use super::StaticsError;
use super::energy::moduli_by_law;
use crate::linear::{Factor, Lame, Stiffness};
use crate::material::Material;
use crate::mesh::Mesh;

/// Largest component of the last step, mm.
const STEP_MM: f64 = 1e-5;
/// Steps for each part of the gravity.
const MOST_STEPS: usize = 60;
/// Parts that a gravity is reached in, tried in turn.
const PARTS: [u32; 3] = [1, 4, 16];
/// Steps that are mixed.
const MIXED: usize = 6;
/// A rest shape whose elements have less than this part of their scanned volume, or more than its inverse, is none.
const SMALLEST_VOLUME: f64 = 0.05;

/// Places at rest `[K,3]`, mm, of a body that lies as `mesh` has it under `gravity` (m/s²), held at `held`.
///
/// # Errors
/// [`StaticsError::None`] where no rest shape was found, [`StaticsError::Linear`] where the stiffness has no factor.
pub fn unload(
    mesh: &Mesh,
    held: &[u32],
    material: &Material,
    gravity: [f64; 3],
) -> Result<Vec<[f64; 3]>, StaticsError> {
    let mut held = held.to_vec();
    held.sort_unstable();
    held.dedup();
    mesh.check_laws(material)?;
    let lame = Lame::from_young(material.young_pa, material.poisson)?;
    let stiffness = Stiffness::assemble(mesh, &held, lame)?;
    let scan = Scan {
        mesh,
        moduli: moduli_by_law(mesh, material),
        density: material.density_kg_m3,
        factor: Factor::new(&stiffness, &mesh.positions, 1)?,
        free: stiffness.free.nodes,
        places: mesh.positions.iter().map(|x| x.map(f64::from)).collect(),
    };
    let mut reached = 0.0;
    for parts in PARTS {
        let mut rest = scan.places.clone();
        let found = (1..=parts).all(|part| {
            let share = f64::from(part) / f64::from(parts);
            let is_there = scan.settle(gravity.map(|g| share * g), &mut rest);
            if is_there {
                reached = f64::max(reached, share);
            }
            is_there
        });
        if found {
            return Ok(rest);
        }
    }
    Err(StaticsError::None(format!(
        "no rest shape is found beyond {:.0} % of this gravity: the body would hang through itself; give a stiffer material, or of an organ in fluid the part of its weight that the fluid does not carry",
        100.0 * reached
    )))
}

/// A body as it was scanned.
struct Scan<'a> {
    mesh: &'a Mesh,
    /// mN/mm².
    /// By number of a law.
    moduli: Vec<Moduli>,
    /// g/mm³.
    /// kg/m³, of tetrahedra without one of their region.
    density: f64,
    factor: Factor,
    free: Vec<u32>,
    /// `x [K,3]`, mm.
    places: Vec<[f64; 3]>,
}

impl Scan<'_> {
    /// Moves `rest` to the rest shape under this gravity; false where that was not reached.
    fn settle(&self, gravity: [f64; 3], rest: &mut [[f64; 3]]) -> bool {
        let mut mixing = Mixing::default();
        for _ in 0..MOST_STEPS {
            let Some(mut step) = self.residual(gravity, rest) else {
                return false;
            };
            self.factor.solve(&mut step);
            let size = step.iter().fold(0.0f64, |most, s| most.max(s.abs()));
            if !size.is_finite() {
                return false;
            }
            let own = self.gathered(rest);
            let mut next = mixing.next(own.clone(), step);
            // Halfway back until no element is inverted.
            let mut tries = 0;
            loop {
                let mut there = rest.to_vec();
                self.put(&next, &mut there);
                if self.residual(gravity, &there).is_some() {
                    rest.copy_from_slice(&there);
                    break;
                }
                tries += 1;
                if tries > 10 {
                    return false;
                }
                next.iter_mut()
                    .zip(&own)
                    .for_each(|(next, own)| *next = 0.5 * (*next + own));
            }
            if size < STEP_MM {
                return true;
            }
        }
        false
    }

    fn gathered(&self, rest: &[[f64; 3]]) -> Vec<f64> {
        let rows = self.free.iter().map(|node| rest[*node as usize]);
        rows.flatten().collect()
    }

    fn put(&self, values: &[f64], rest: &mut [[f64; 3]]) {
        for (node, row) in self.free.iter().zip(values.as_chunks::<3>().0) {
            rest[*node as usize] = *row;
        }
    }

    /// `r` at the free nodes, mN; none where an element is inverted or has no volume.
    fn residual(&self, gravity: [f64; 3], rest: &[[f64; 3]]) -> Option<Vec<f64>> {
        let mut sums = vec![[0.0f64; 3]; rest.len()];
        for (at, corners) in self.mesh.tets.iter().enumerate() {
            let places = corners.map(|node| rest[node as usize]);
            let volume = signed_volume(places);
            let scanned = signed_volume(corners.map(|node| self.places[node as usize]));
            let part = volume / scanned;
            if !(part > SMALLEST_VOLUME && part < 1.0 / SMALLEST_VOLUME) {
                return None;
            }
            let element = Tetrahedron::new(*corners, places, f64::from(self.mesh.stiffness_of(at)))
                .along(self.mesh.laws().fibre_of(at));
            let state = element.deformation(corners.map(|node| {
                let node = node as usize;
                [0, 1, 2].map(|k| self.places[node][k] - rest[node][k])
            }));
            if state.det.is_nan() || state.det <= 0.0 {
                return None;
            }
            let moduli = self.moduli[usize::from(self.mesh.laws().number_of(at))];
            // g m/s² is mN.
            let density = 1e-6 * self.mesh.laws().density_of(at, self.density);
            let weight = gravity.map(|g| 0.25 * volume * density * g);
            for (node, force) in corners.iter().zip(element.forces(&state, moduli)) {
                let sum = &mut sums[*node as usize];
                (0..3).for_each(|k| sum[k] += force[k] - weight[k]);
            }
        }
        Some(self.gathered(&sums))
    }
}

fn signed_volume([a, b, c, d]: [[f64; 3]; 4]) -> f64 {
    let edge = |p: [f64; 3]| [0, 1, 2].map(|k| p[k] - a[k]);
    let [u, v, w] = [edge(b), edge(c), edge(d)];
    let cross = [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ];
    cross.iter().zip(w).map(|(a, b)| a * b).sum::<f64>() / 6.0
}

/// Anderson's mixing: of the last states and steps the combination whose step is smallest.
#[derive(Default)]
struct Mixing {
    last: Option<(Vec<f64>, Vec<f64>)>,
    /// Changes of the state and of the step.
    changes: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Mixing {
    fn next(&mut self, state: Vec<f64>, step: Vec<f64>) -> Vec<f64> {
        let minus = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect();
        if let Some((state_before, step_before)) = &self.last {
            if self.changes.len() == MIXED {
                self.changes.remove(0);
            }
            let change = (minus(&state, state_before), minus(&step, step_before));
            self.changes.push(change);
        }
        let mut next: Vec<f64> = state.iter().zip(&step).map(|(x, s)| x + s).collect();
        for (amount, (state, step)) in self.amounts(&step).into_iter().zip(&self.changes) {
            for (next, (x, s)) in next.iter_mut().zip(state.iter().zip(step)) {
                *next -= amount * (x + s);
            }
        }
        self.last = Some((state, step));
        next
    }

    /// What of each change leaves the least of a step, by Gram and Schmidt.
    fn amounts(&self, step: &[f64]) -> Vec<f64> {
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let count = self.changes.len();
        let mut directions: Vec<Vec<f64>> = Vec::new();
        // Of each change its parts along the directions, a triangle.
        let mut parts = vec![vec![0.0; count]; count];
        for (at, (_, change)) in self.changes.iter().enumerate() {
            let mut own = change.clone();
            for (row, direction) in directions.iter().enumerate() {
                let part = product(&own, direction);
                parts[at][row] = part;
                (own.iter_mut().zip(direction)).for_each(|(own, d)| *own -= part * d);
            }
            let size = product(&own, &own).sqrt();
            let is_new = size > 1e-10 * product(change, change).sqrt();
            parts[at][at] = if is_new { size } else { 0.0 };
            let scale = if is_new { size.recip() } else { 0.0 };
            own.iter_mut().for_each(|value| *value *= scale);
            directions.push(own);
        }
        let mut amounts = vec![0.0; count];
        for row in (0..count).rev() {
            let later: f64 = (row + 1..count)
                .map(|at| parts[at][row] * amounts[at])
                .sum();
            if parts[row][row] > 0.0 {
                amounts[row] = (product(step, &directions[row]) - later) / parts[row][row];
            }
        }
        amounts
    }
}
