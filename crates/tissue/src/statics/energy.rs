//! Strain energy of the reference's law and its derivative, all in f64.
//!
//! `W = mu/2 (J^(-2/3) I1 - 3) + kappa/2 (J - 1)²` on each linear tetrahedron, so the derivative by a corner is
//! `V P g_a` with `P = mu J^(-2/3) (F - I1 / (3 J) cof F) + kappa (J - 1) cof F` and the shape gradients `g_a`.
//! Units: mm, mN; moduli mN/mm², energies mN mm (µJ).

use crate::material::Material;
use crate::mesh::Mesh;
use crate::vector::{cross, dot, subtract};

/// A tetrahedron: corners, rest volume times its stiffness over the material's (mm³), gradients of the shape functions
/// 1, 2, 3 (1/mm).
struct Element {
    corners: [u32; 4],
    volume: f64,
    gradients: [[f64; 3]; 3],
}

/// The energy of a body as a function of its displacement.
pub(crate) struct StrainEnergy {
    elements: Vec<Element>,
    shear: f64,
    bulk: f64,
}

/// The energy and its least volume ratio at one displacement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Energy {
    /// mN mm; infinite where an element is flat or inverted.
    pub value: f64,
    /// Smallest det F.
    pub min_det: f64,
}

impl StrainEnergy {
    /// Rest shape of a validated mesh.
    pub fn new(mesh: &Mesh, material: &Material) -> Self {
        let elements = mesh.tets.iter().enumerate().map(|(at, &corners)| {
            let point = |k: usize| mesh.positions[corners[k] as usize].map(f64::from);
            let edges = [1, 2, 3].map(|k| subtract(point(k), point(0)));
            let normals = [
                cross(edges[1], edges[2]),
                cross(edges[2], edges[0]),
                cross(edges[0], edges[1]),
            ];
            let six_volumes = dot(edges[0], normals[0]);
            Element {
                corners,
                volume: six_volumes / 6.0 * f64::from(mesh.stiffness_of(at)),
                gradients: normals.map(|n| n.map(|x| x / six_volumes)),
            }
        });
        Self {
            elements: elements.collect(),
            shear: material.shear_pa() * 1e-3,
            bulk: material.bulk_pa() * 1e-3,
        }
    }

    /// Energy at `u [3K]` (mm), and its derivative (mN) to `gradient [3K]`.
    ///
    /// Where an element is inverted the energy is infinite and the gradient unspecified.
    pub fn evaluate(&self, u: &[f64], gradient: &mut [f64]) -> Energy {
        gradient.fill(0.0);
        let mut sum = Energy {
            value: 0.0,
            min_det: f64::INFINITY,
        };
        for element in &self.elements {
            let at = element.corners.map(|node| 3 * node as usize);
            let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            for a in 0..3 {
                for i in 0..3 {
                    let relative = u[at[a + 1] + i] - u[at[0] + i];
                    for j in 0..3 {
                        f[i][j] += relative * element.gradients[a][j];
                    }
                }
            }
            let cofactor = [cross(f[1], f[2]), cross(f[2], f[0]), cross(f[0], f[1])];
            let det = dot(f[0], cofactor[0]);
            if det.is_nan() || det <= 0.0 {
                sum.value = f64::INFINITY;
                sum.min_det = det;
                return sum;
            }
            sum.min_det = sum.min_det.min(det);
            let invariant = dot(f[0], f[0]) + dot(f[1], f[1]) + dot(f[2], f[2]);
            let isochoric = self.shear / (det * det).cbrt();
            sum.value += element.volume
                * (0.5 * (isochoric * invariant - 3.0 * self.shear)
                    + 0.5 * self.bulk * (det - 1.0) * (det - 1.0));
            let along = self.bulk * (det - 1.0) - isochoric * invariant / (3.0 * det);
            for i in 0..3 {
                let stress = [0, 1, 2]
                    .map(|j| element.volume * (isochoric * f[i][j] + along * cofactor[i][j]));
                for a in 0..3 {
                    let force = dot(stress, element.gradients[a]);
                    gradient[at[a + 1] + i] += force;
                    gradient[at[0] + i] -= force;
                }
            }
        }
        sum
    }
}
