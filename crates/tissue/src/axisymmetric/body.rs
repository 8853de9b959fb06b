//! Forces of the triangles and their tangent.

use super::section::Section;
use crate::band::Band;
use elements::{Deformation, Moduli, stress, tangent};
use std::f64::consts::PI;

/// Least `det F` of a state.
const LEAST_DET: f64 = 0.02;

/// A triangle turned about the axis.
struct Ring {
    nodes: [usize; 3],
    /// mm³.
    volume: f64,
    /// Of the shape functions across and along the axis, 1/mm.
    gradients: [[f64; 2]; 3],
    /// `1 / (3 r)` of its middle: a third of a corner's displacement over the radius, 1/mm.
    hoop: f64,
}

pub(super) struct Body {
    rings: Vec<Ring>,
    moduli: Moduli,
}

impl Body {
    pub fn new(section: &Section, moduli: Moduli) -> Self {
        let ring = |nodes: &[usize; 3]| {
            let p = nodes.map(|node| section.place(node));
            let edge = |from: usize, to: usize| [0, 1].map(|k| p[to][k] - p[from][k]);
            let ([a, b], [c, d]) = (edge(0, 1), edge(0, 2));
            let twice = a * d - b * c;
            let three = p.iter().map(|p| p[0]).sum::<f64>();
            Ring {
                nodes: *nodes,
                volume: PI * twice * three / 3.0,
                gradients: [0, 1, 2].map(|at| {
                    let [r, z] = edge((at + 1) % 3, (at + 2) % 3);
                    [-z / twice, r / twice]
                }),
                hoop: 1.0 / three,
            }
        };
        Self {
            rings: section.triangles.iter().map(ring).collect(),
            moduli,
        }
    }

    /// Adds the elements' forces at `u` (two an unknown's node, across and along; µN) to `force` and, if that is asked for, their derivatives to `band`.
    ///
    /// False where an element is inverted, or nearly; the sums are then of no use.
    pub fn add(&self, u: &[f64], force: &mut [f64], mut band: Option<&mut Band>) -> bool {
        for ring in &self.rings {
            let state = ring.deformation(u);
            if state.det.is_nan() || state.det < LEAST_DET || state.f[1][1] <= 0.0 {
                return false;
            }
            let stress = stress(&state, self.moduli);
            let parts = [0, 1, 2, 3, 4, 5].map(|row| ring.part(row));
            for (row, part) in parts.iter().enumerate() {
                let sum: f64 = part.iter().map(|(at, x)| x * stress[at / 3][at % 3]).sum();
                force[ring.unknown(row)] += ring.volume * sum;
            }
            let Some(band) = band.as_deref_mut() else {
                continue;
            };
            let tangent = tangent(&state, self.moduli);
            for (row, own) in parts.iter().enumerate() {
                for (column, other) in parts.iter().enumerate() {
                    let mut sum = 0.0;
                    for (a, x) in own {
                        for (b, y) in other {
                            sum += x * y * tangent[*a][*b];
                        }
                    }
                    let [row, column] = [row, column].map(|at| ring.unknown(at));
                    band.add(row, column, ring.volume * sum);
                }
            }
        }
        true
    }
}

impl Ring {
    /// The unknown in one of the six rows: each corner's across and along.
    fn unknown(&self, row: usize) -> usize {
        2 * self.nodes[row / 2] + row % 2
    }

    /// The entries of `F`, by `3 i + j`, that it changes, and by how much.
    fn part(&self, row: usize) -> [(usize, f64); 3] {
        let [r, z] = self.gradients[row / 2];
        match row % 2 {
            0 => [(0, r), (2, z), (4, self.hoop)],
            _ => [(6, r), (8, z), (4, 0.0)],
        }
    }

    /// Axes of `F` in the order r, around, z.
    fn deformation(&self, u: &[f64]) -> Deformation {
        let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for row in 0..6 {
            for (at, x) in self.part(row) {
                f[at / 3][at % 3] += x * u[self.unknown(row)];
            }
        }
        Deformation::of(f)
    }
}
