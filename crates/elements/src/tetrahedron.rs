//! The element in f64: energy and nodal forces of a hyperelastic tetrahedron.
//!
//! With `F = I + du/dX` constant on a tetrahedron of rest volume `V` and shape gradients `g_a`, the derivative of its strain
//! energy is `f_a = V P g_a`, with the stress `P` of the material's law ([`crate::Law`]). For neo-Hookean tissue it is
//! `P = F S = mu J^(-2/3) (F - I1/(3 J) cof F) + kappa (J - 1) cof F`, which is
//! `S = mu J^(-2/3) (I - I1/3 C^-1) + kappa J (J - 1) C^-1`. Lengths are mm, moduli Pa: energies nJ, forces µN.

use crate::fibres::{self, Stretched};
use crate::laws::{Invariants, Isochoric, Law};
use crate::material::Moduli;
use crate::principal::{self, PLACE};
use crate::vector::{cross, dot, subtract};

/// Below this `det F` the isochoric factor is that of a nearly flat element, so that it stays finite.
pub(crate) const SMALLEST_DET: f64 = 0.05;

/// A tetrahedron's corners, rest volume times its stiffness over the material's, and gradients of its shape functions.
#[derive(Debug, Clone, Copy)]
pub struct Tetrahedron {
    /// Mesh nodes.
    pub corners: [u32; 4],
    /// mm³, times the stiffness.
    pub volume: f64,
    /// Of the shape functions 1, 2, 3, 1/mm; that of shape function 0 is minus their sum.
    pub gradients: [[f64; 3]; 3],
    /// Direction of its fibres at rest: a unit vector, or zero for none.
    pub fibre: [f64; 3],
}

/// `F` of one element and what the law needs of it.
#[derive(Debug, Clone, Copy)]
pub struct Deformation {
    /// Deformation gradient, rows.
    pub f: [[f64; 3]; 3],
    /// `cof F`, rows.
    pub cofactor: [[f64; 3]; 3],
    /// `J = det F`.
    pub det: f64,
    /// `I1 = |F|²`.
    pub invariant: f64,
    /// Direction of the fibres at rest: a unit vector, or zero for none.
    pub fibre: [f64; 3],
}

impl Tetrahedron {
    /// From the rest positions of its corners, mm, and its stiffness over the material's.
    pub fn new(corners: [u32; 4], rest: [[f64; 3]; 4], stiffness: f64) -> Self {
        let edges = [1, 2, 3].map(|a| subtract(rest[a], rest[0]));
        let normals = [
            cross(edges[1], edges[2]),
            cross(edges[2], edges[0]),
            cross(edges[0], edges[1]),
        ];
        let six_volumes = dot(edges[0], normals[0]);
        Self {
            corners,
            volume: six_volumes / 6.0 * stiffness,
            gradients: normals.map(|n| n.map(|x| x / six_volumes)),
            fibre: [0.0; 3],
        }
    }

    /// The same with the direction of its fibres at rest: a unit vector, or zero for none.
    pub fn along(self, fibre: [f32; 3]) -> Self {
        Self {
            fibre: fibre.map(f64::from),
            ..self
        }
    }

    /// The deformation under the corners' displacements, mm.
    pub fn deformation(&self, u: [[f64; 3]; 4]) -> Deformation {
        let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for a in 0..3 {
            let relative = subtract(u[a + 1], u[0]);
            for (row, relative) in f.iter_mut().zip(relative) {
                for (f, gradient) in row.iter_mut().zip(self.gradients[a]) {
                    *f += relative * gradient;
                }
            }
        }
        Deformation::of(f).along(self.fibre)
    }

    /// `V P g_a` of the four corners, µN; they are in balance.
    pub fn forces(&self, deformation: &Deformation, moduli: Moduli) -> [[f64; 3]; 4] {
        let stress = stress(deformation, moduli);
        let mut forces = [[0.0; 3]; 4];
        for i in 0..3 {
            for a in 0..3 {
                let force = self.volume * dot(stress[i], self.gradients[a]);
                forces[a + 1][i] = force;
                forces[0][i] -= force;
            }
        }
        forces
    }

    /// Diagonal 3x3 blocks of the stiffness at rest for the four corners, µN/mm: xx, xy, xz, yy, yz, zz.
    ///
    /// The tangent of the law at `F = I` is that of linear elasticity, `mu` and `lambda = kappa - 2/3 mu`:
    /// `V (mu |g|² I + (lambda + mu) g g^T)`.
    pub fn diagonal_blocks(&self, moduli: Moduli) -> [[f64; 6]; 4] {
        let [a, b, c] = self.gradients;
        let first = [0, 1, 2].map(|k| -(a[k] + b[k] + c[k]));
        let both = moduli.bulk_pa + moduli.shear_pa / 3.0;
        [first, a, b, c].map(|g| {
            let own = moduli.shear_pa * dot(g, g);
            [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|(i, j)| {
                let diagonal = if i == j { own } else { 0.0 };
                self.volume * (diagonal + both * g[i] * g[j])
            })
        })
    }
}

impl Deformation {
    /// That of a deformation gradient, rows, of an element without fibres.
    pub fn of(f: [[f64; 3]; 3]) -> Deformation {
        let cofactor = [cross(f[1], f[2]), cross(f[2], f[0]), cross(f[0], f[1])];
        Deformation {
            f,
            cofactor,
            det: dot(f[0], cofactor[0]),
            invariant: f.iter().map(|row| dot(*row, *row)).sum(),
            fibre: [0.0; 3],
        }
    }

    /// The same with the direction of fibres at rest: a unit vector, or zero for none.
    pub fn along(self, fibre: [f64; 3]) -> Self {
        Self { fibre, ..self }
    }

    /// Its fibres; none where it has no direction.
    pub(crate) fn fibres(&self) -> Option<Stretched> {
        Stretched::of(&self.f, self.fibre)
    }

    /// `I1`, `I2` and `det^(-1/3)`, where `det` stands for `det F`.
    pub fn invariants(&self, det: f64) -> Invariants {
        Invariants {
            first: self.invariant,
            second: self.cofactor.iter().map(|row| dot(*row, *row)).sum(),
            root: inverse_cube_root(det),
        }
    }
}

/// The least size of `det F` in the stress of a law in principal stretches.
pub(crate) const LEAST_DET: f64 = 0.01;

/// First Piola-Kirchhoff stress `P`, rows, Pa.
pub fn stress(state: &Deformation, moduli: Moduli) -> [[f64; 3]; 3] {
    match moduli.law {
        Law::NeoHookean(law) => stress_by_invariants(law, state, moduli),
        Law::MooneyRivlin(law) => stress_by_invariants(law, state, moduli),
        Law::Ogden(_) => stress_by_stretches(state, moduli),
        Law::Yeoh(law) => stress_by_invariants(law, state, moduli),
        Law::VerondaWestmann(law) => stress_by_invariants(law, state, moduli),
        Law::Fibred(own) => {
            let mut sum = stress(state, moduli.without_fibres());
            fibres::add_stress(&own, state.fibres(), moduli.shear_pa, &mut sum);
            sum
        }
    }
}

/// `P = cof F (T / J + kappa (J - 1))`.
fn stress_by_stretches(state: &Deformation, moduli: Moduli) -> [[f64; 3]; 3] {
    let deviator = principal::deviator(&moduli.law.stretches(0.0), &state.f);
    let scale = moduli.shear_pa / state.det.abs().max(LEAST_DET).copysign(state.det);
    let mut inner = deviator.map(|t| t * scale);
    for k in [0, 3, 5] {
        inner[k] += moduli.bulk_pa * (state.det - 1.0);
    }
    let cofactor = &state.cofactor;
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| cofactor[i][k] * inner[PLACE[k][j]]).sum()))
}

fn stress_by_invariants<M: Isochoric>(
    law: M,
    state: &Deformation,
    moduli: Moduli,
) -> [[f64; 3]; 3] {
    let slopes = law.slopes(state.invariants(state.det.max(SMALLEST_DET)));
    let along = moduli.bulk_pa * (state.det - 1.0) + moduli.shear_pa * slopes.volume;
    let own = moduli.shear_pa * (slopes.first + slopes.second * state.invariant);
    let mut stress =
        [0, 1, 2].map(|i| [0, 1, 2].map(|j| own * state.f[i][j] + along * state.cofactor[i][j]));
    if slopes.second != 0.0 {
        let second = moduli.shear_pa * slopes.second;
        for i in 0..3 {
            // Row i of (F F^T) F.
            for k in 0..3 {
                let product = second * dot(state.f[i], state.f[k]);
                for j in 0..3 {
                    stress[i][j] -= product * state.f[k][j];
                }
            }
        }
    }
    stress
}

/// Strain energy a rest volume, `mu w + kappa/2 (J - 1)²`, Pa; `det F` must be positive.
pub fn energy_density(state: &Deformation, moduli: Moduli) -> f64 {
    moduli.shear_pa * shape_energy(state, moduli.law, state.det)
        + 0.5 * moduli.bulk_pa * (state.det - 1.0) * (state.det - 1.0)
}

/// `w`: the strain energy without change of volume over the shear modulus, where `det` stands for `det F`; with that of fibres.
pub fn shape_energy(state: &Deformation, law: Law, det: f64) -> f64 {
    match law {
        Law::NeoHookean(law) => law.energy(state.invariants(det)),
        Law::MooneyRivlin(law) => law.energy(state.invariants(det)),
        Law::Ogden(_) => principal::energy(&law.stretches(0.0), &state.f),
        Law::Yeoh(law) => law.energy(state.invariants(det)),
        Law::VerondaWestmann(law) => law.energy(state.invariants(det)),
        Law::Fibred(own) => {
            shape_energy(state, own.matrix.into(), det) + fibres::energy(&own, state.fibres())
        }
    }
}

/// How much stiffer than at rest a law is against a change of the shape that a body has: of neo-Hookean and Mooney-Rivlin tissue 1, as an
/// estimate; of the others the steepest rise of a principal stress with the logarithm of its stretch, over that at rest. Of tissue with fibres that of its matrix.
pub fn stiffening(state: &Deformation, law: Law) -> f64 {
    match law {
        Law::NeoHookean(_) | Law::MooneyRivlin(_) => 1.0,
        Law::Ogden(_) => principal::stiffening(&law.stretches(0.0), &state.f),
        Law::Yeoh(_) | Law::VerondaWestmann(_) => {
            let x = principal::first_invariant(&state.f);
            principal::stiffening(&law.stretches(x), &state.f)
        }
        Law::Fibred(own) => stiffening(state, own.matrix.into()),
    }
}

/// `x^(-1/3)` of a positive normal number, to 1e-12: a guess from the exponent and two corrections of fourth order. The same
/// bits on every platform, and half the time of libm's root with the divisions after it.
pub fn inverse_cube_root(x: f64) -> f64 {
    let mut y = f64::from_bits(0x553E_F0FF_289D_D796 - x.to_bits() / 3);
    for _ in 0..2 {
        // y (1 - e)^(-1/3) with e = 1 - x y^3.
        let e = 1.0 - x * (y * y * y);
        y += y * e * (1.0 / 3.0 + e * (2.0 / 9.0 + e * (14.0 / 81.0)));
    }
    y
}

#[cfg(test)]
mod tests {
    use super::inverse_cube_root;

    #[test]
    fn the_root_is_the_libraries() {
        let mut x = 1e-3;
        while x < 1e3 {
            let relative = inverse_cube_root(x) * x.cbrt() - 1.0;
            assert!(relative.abs() < 1e-12, "{x}: {relative:e}");
            x *= 1.0173;
        }
    }
}
