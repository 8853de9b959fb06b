//! The element law: nodal forces of a neo-Hookean tetrahedron.
//!
//! With `F = I + du/dX` constant on a tetrahedron of rest volume `V` and shape gradients `g_a`, the derivative of its strain
//! energy is `f_a = V P g_a`, `P = F S = mu J^(-2/3) (F - I1/(3 J) cof F) + kappa (J - 1) cof F`, which is
//! `S = mu J^(-2/3) (I - I1/3 C^-1) + kappa J (J - 1) C^-1`. Lengths are mm, moduli Pa, forces 1e-3 mN; all in f64.

/// Neo-Hookean moduli.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moduli {
    /// Shear modulus `mu = E / (2 (1 + nu))`, Pa.
    pub shear_pa: f64,
    /// Bulk modulus `kappa = E / (3 (1 - 2 nu))`, Pa.
    pub bulk_pa: f64,
}

impl Moduli {
    /// From Young's modulus, Pa, and Poisson's ratio below 0.5.
    pub fn from_young(young_pa: f64, poisson: f64) -> Self {
        Self {
            shear_pa: young_pa / (2.0 * (1.0 + poisson)),
            bulk_pa: young_pa / (3.0 * (1.0 - 2.0 * poisson)),
        }
    }
}

/// Below this `det F` the isochoric factor is that of a nearly flat element, so that it stays finite.
const SMALLEST_DET: f64 = 0.05;

/// A tetrahedron's corners, rest volume (mm³) times its stiffness over the material's, and gradients of its shape functions 1, 2, 3 (1/mm);
/// the gradient of shape function 0 is minus their sum.
#[derive(Debug, Clone, Copy)]
pub(super) struct Element {
    pub corners: [u32; 4],
    pub volume: f64,
    pub gradients: [[f64; 3]; 3],
}

impl Element {
    pub(super) fn new(positions: &[f32], corners: [u32; 4]) -> Self {
        let point = |a: usize| {
            let at = 3 * corners[a] as usize;
            [0, 1, 2].map(|k| f64::from(positions[at + k]))
        };
        let origin = point(0);
        let edges = [1, 2, 3].map(|a| sub(point(a), origin));
        let normals = [
            cross(edges[1], edges[2]),
            cross(edges[2], edges[0]),
            cross(edges[0], edges[1]),
        ];
        let six_volumes = dot(edges[0], normals[0]);
        Self {
            corners,
            volume: six_volumes / 6.0,
            gradients: normals.map(|n| n.map(|x| x / six_volumes)),
        }
    }

    /// `V P g_a` of the four corners, 1e-3 mN, and `det F`.
    pub(super) fn forces(&self, displacement: &[f32], moduli: Moduli) -> ([[f64; 3]; 4], f64) {
        let u = self.corners.map(|node| {
            let at = 3 * node as usize;
            [0, 1, 2].map(|k| f64::from(displacement[at + k]))
        });
        // Rows of F.
        let mut f = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for a in 0..3 {
            let relative = sub(u[a + 1], u[0]);
            for (row, relative) in f.iter_mut().zip(relative) {
                for (f, gradient) in row.iter_mut().zip(self.gradients[a]) {
                    *f += relative * gradient;
                }
            }
        }
        let cofactor = [cross(f[1], f[2]), cross(f[2], f[0]), cross(f[0], f[1])];
        let det = dot(f[0], cofactor[0]);
        let invariant: f64 = f.iter().map(|row| dot(*row, *row)).sum();
        let root = inverse_cube_root(det.max(SMALLEST_DET));
        let isochoric = moduli.shear_pa * root * root;
        let over_three_dets = root * root * root * (1.0 / 3.0);
        let along_cofactor = moduli.bulk_pa * (det - 1.0) - isochoric * invariant * over_three_dets;
        let mut forces = [[0.0; 3]; 4];
        for i in 0..3 {
            let row: [f64; 3] =
                [0, 1, 2].map(|j| isochoric * f[i][j] + along_cofactor * cofactor[i][j]);
            for a in 0..3 {
                let force = self.volume * dot(row, self.gradients[a]);
                forces[a + 1][i] = force;
                forces[0][i] -= force;
            }
        }
        (forces, det)
    }
}

/// `x^(-1/3)` of a positive normal number, to 1e-12: a guess from the exponent and two corrections of fourth order, because
/// libm's root and the divisions after it took half of an element's time.
fn inverse_cube_root(x: f64) -> f64 {
    let mut y = f64::from_bits(0x553E_F0FF_289D_D796 - x.to_bits() / 3);
    for _ in 0..2 {
        // y (1 - e)^(-1/3) with e = 1 - x y^3.
        let e = 1.0 - x * (y * y * y);
        y += y * e * (1.0 / 3.0 + e * (2.0 / 9.0 + e * (14.0 / 81.0)));
    }
    y
}

pub(super) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
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
