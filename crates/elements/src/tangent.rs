//! The tangent of the stress, `dP/dF`, of every law, and the stiffness of an element in its present shape, in f64.
//!
//! All laws are functions of the principal stretches, those by invariants of exponents 2 and -2. With `P = cof F (T/J + p)`,
//! `p = kappa (J - 1)`: `dP = dcof (T/J + p) + cof F (dT/J - T dJ/J² + kappa dJ)`. In the eigenvectors of `C` the
//! diagonal of `dT` follows the principal stresses `f(s)`, `s = ln lambda - ln J / 3`, and its other entries are
//! `(f_i - f_j) / (l_i - l_j) dC_ij` with the eigenvalues `l` of `C`. Fibres add theirs (`fibres.rs`).

use crate::fibres;
use crate::laws::Law;
use crate::material::Moduli;
use crate::spectrum::spectrum;
use crate::tetrahedron::{Deformation, LEAST_DET, SMALLEST_DET, Tetrahedron, inverse_cube_root};
use crate::vector::{cross, dot};

/// Eigenvalues of `C` closer than this, relative, have a derivative in place of a difference.
const COINCIDENT: f64 = 1e-6;
/// Least eigenvalue of `C`.
/// An element that is flat to this degree has no stretch to take the logarithm of.
const LEAST: f64 = 1e-12;

type Matrix = [[f64; 3]; 3];

/// `dP_ij / dF_kl` in row `3 i + j`, column `3 k + l`, Pa; symmetric.
pub fn tangent(state: &Deformation, moduli: Moduli) -> [[f64; 9]; 9] {
    let mut sum = tangent_with(state, moduli, 1.0);
    if let Some(own) = moduli.law.fibres() {
        fibres::add_tangent(own, state.fibres(), moduli.shear_pa, &mut sum);
    }
    sum
}

/// That of the matrix, with a part of what the pressure adds by the change of `cof F`.
fn tangent_with(state: &Deformation, moduli: Moduli, turning: f64) -> [[f64; 9]; 9] {
    let f = &state.f;
    let c = [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| f[k][i] * f[k][j]).sum::<f64>()));
    let (values, vectors) = spectrum(c);
    let values = values.map(|l| l.max(LEAST));
    let log_det = values.map(libm::log).iter().sum::<f64>() / 2.0;
    let logarithm = |l: f64| 0.5 * libm::log(l) - log_det / 3.0;
    let squares = values.map(|l| l * libm::exp(-2.0 / 3.0 * log_det));
    let law = moduli.law.stretches(squares.iter().sum::<f64>() - 3.0);
    let pulls = values.map(|l| moduli.shear_pa * law.pull(logarithm(l)));
    let rises = values.map(|l| moduli.shear_pa * law.rise(logarithm(l)));
    let mut slopes = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let gap = values[i] - values[j];
            // The divided difference of the stresses by eigenvalue. Where two eigenvalues coincide
            // its limit is the derivative, `d(ln lambda) / dl = 1 / (2 l)`.
            let middle = 0.5 * (values[i] + values[j]);
            slopes[i][j] = if gap.abs() < COINCIDENT * middle {
                moduli.shear_pa * law.rise(logarithm(middle)) / (2.0 * middle)
            } else {
                (pulls[i] - pulls[j]) / gap
            };
        }
    }
    let mean = pulls.iter().sum::<f64>() / 3.0;
    let deviator = from_principal(&vectors, |i, j| if i == j { pulls[i] - mean } else { 0.0 });
    let cofactor = &state.cofactor;
    let bounded = state.det.abs().max(LEAST_DET).copysign(state.det);
    let pressure = turning * moduli.bulk_pa * (state.det - 1.0);
    let mut inner = deviator.map(|row| row.map(|t| t / bounded));
    for i in 0..3 {
        inner[i][i] += pressure;
    }

    let mut out = [[0.0; 9]; 9];
    for column in 0..9 {
        let (k, l) = (column / 3, column % 3);
        // dF has a single one, in row k, column l.
        let mut df = [[0.0; 3]; 3];
        df[k][l] = 1.0;
        let d_cofactor = [(1, 2), (2, 0), (0, 1)].map(|(a, b)| {
            let (first, second) = (cross(df[a], f[b]), cross(f[a], df[b]));
            [0, 1, 2].map(|i| first[i] + second[i])
        });
        let d_det = cofactor[k][l];
        // dC in the eigenvectors: 2 sym(F^T dF) = f_k e_l^T + e_l f_k^T with row k of F.
        let along = [0, 1, 2].map(|i| (0..3).map(|a| vectors[a][i] * f[k][a]).sum::<f64>());
        let dc = |i: usize, j: usize| along[i] * vectors[l][j] + along[j] * vectors[l][i];
        let stretch = [0, 1, 2].map(|i| dc(i, i) / (2.0 * values[i]));
        let growth = stretch.iter().sum::<f64>() / 3.0;
        // How the whole of the term of exponent 2 changes with `I1`.
        let first = (0..3).map(|i| 2.0 * squares[i] * (stretch[i] - growth));
        let grown = moduli.shear_pa * law.slope * first.sum::<f64>();
        let own = [0, 1, 2].map(|i| rises[i] * (stretch[i] - growth) + grown * squares[i]);
        let own_mean = own.iter().sum::<f64>() / 3.0;
        let d_deviator = from_principal(&vectors, |i, j| {
            if i == j {
                own[i] - own_mean
            } else {
                slopes[i][j] * dc(i, j)
            }
        });
        let shrink = if state.det.abs() > LEAST_DET {
            d_det / (bounded * bounded)
        } else {
            0.0
        };
        for i in 0..3 {
            for j in 0..3 {
                let mut sum = cofactor[i][j] * moduli.bulk_pa * d_det;
                for a in 0..3 {
                    let d_inner = d_deviator[a][j] / bounded - deviator[a][j] * shrink;
                    sum += d_cofactor[i][a] * inner[a][j] + cofactor[i][a] * d_inner;
                }
                out[3 * i + j][column] = sum;
            }
        }
    }
    out
}

/// The stiffness of a unit of volume of neo-Hookean tissue, without eigenvectors: with `C = cof F`
///
/// ```text
/// dP/dF = mu J^(-2/3) I + a (F (x) C + C (x) F) + b C (x) C + p dC/dF        a = -2/3 mu J^(-5/3)
/// b = kappa + 5/9 mu I1 J^(-8/3)        p = kappa (J - 1) - 1/3 mu I1 J^(-5/3)
/// ```
///
/// between shape gradients `g`, `h`; there `dC/dF` is the cross product with `F (g x h)`.
fn neo_hookean(
    state: &Deformation,
    moduli: Moduli,
    turning: f64,
    gradients: [[f64; 3]; 4],
) -> [[f64; 12]; 12] {
    let (mu, det, f) = (moduli.shear_pa, state.det, &state.f);
    let root = inverse_cube_root(det);
    let own = mu * root * root;
    let a = -2.0 / 3.0 * own / det;
    let p = turning * moduli.bulk_pa * (det - 1.0) - own / det * state.invariant / 3.0;
    let b = moduli.bulk_pa + 5.0 / 9.0 * own / (det * det) * state.invariant;
    let turned = |rows: &Matrix, g: [f64; 3]| [0, 1, 2].map(|i| dot(rows[i], g));
    let along = gradients.map(|g| turned(f, g));
    let normal = gradients.map(|g| turned(&state.cofactor, g));
    let mut out = [[0.0; 12]; 12];
    for first in 0..4 {
        for second in first..4 {
            let [g, h] = [gradients[first], gradients[second]];
            let [x, y, z] = turned(f, cross(g, h)).map(|x| p * x);
            let spin = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]];
            let diagonal = own * dot(g, h);
            for i in 0..3 {
                let from_normal = a * along[first][i] + b * normal[first][i];
                let from_along = a * normal[first][i];
                for k in 0..3 {
                    let mut sum = from_normal * normal[second][k]
                        + from_along * along[second][k]
                        + spin[i][k];
                    if i == k {
                        sum += diagonal;
                    }
                    out[3 * first + i][3 * second + k] = sum;
                    out[3 * second + k][3 * first + i] = sum;
                }
            }
        }
    }
    out
}

/// `V diag V^T` of a matrix that is given in the eigenvectors.
fn from_principal(vectors: &Matrix, entry: impl Fn(usize, usize) -> f64) -> Matrix {
    let inner = [0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j)));
    let half = [0, 1, 2]
        .map(|i| [0, 1, 2].map(|j| (0..3).map(|k| inner[i][k] * vectors[j][k]).sum::<f64>()));
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| (0..3).map(|k| vectors[i][k] * half[k][j]).sum()))
}

/// The largest eigenvalue of what fibres add to the stiffness of an element, over its volume, Pa/mm², from the gradients of its four shape functions: of
/// slack fibres what they add as soon as they are taut.
pub fn stiffest_pull(gradients: &[[f64; 3]; 4], state: &Deformation, moduli: &Moduli) -> f64 {
    let (Some(fibres), Some(own)) = (moduli.law.fibres(), state.fibres()) else {
        return 0.0;
    };
    let x = own.x.max(0.0);
    let slope = 4.0 * fibres.rise(x) * dot(own.image, own.image) + 2.0 * fibres.pull(x);
    let along = gradients.iter().map(|g| dot(*g, own.a));
    moduli.shear_pa * slope * along.map(|b| b * b).sum::<f64>()
}

impl Tetrahedron {
    /// Derivatives of [`Tetrahedron::forces`] by the corners' displacements, µN/mm: entry `[3 a + i][3 b + j]` of corners `a`, `b` and
    /// axes `i`, `j`; symmetric. At rest its diagonal blocks are [`Tetrahedron::diagonal_blocks`].
    pub fn stiffness(&self, state: &Deformation, moduli: Moduli) -> [[f64; 12]; 12] {
        self.stiffness_with(state, moduli, 1.0)
    }

    /// The same without what the pressure adds as `cof F` changes, `kappa (J - 1) dcof F`: the part that makes the tangent of nearly incompressible
    /// tissue indefinite at a change of volume of some hundredths.
    pub fn steady_stiffness(&self, state: &Deformation, moduli: Moduli) -> [[f64; 12]; 12] {
        self.stiffness_with(state, moduli, 0.0)
    }

    /// `turning` is the part of the pressure's `kappa (J - 1) dcof F` that is taken: 1 or 0. The
    /// formula of neo-Hookean tissue divides by powers of `J`, so flat and inverted elements take
    /// the general one, which bounds it.
    fn stiffness_with(&self, state: &Deformation, moduli: Moduli, turning: f64) -> [[f64; 12]; 12] {
        let [a, b, c] = self.gradients;
        let gradients = [[0, 1, 2].map(|k| -(a[k] + b[k] + c[k])), a, b, c];
        let mut sum = match moduli.law.matrix() {
            Law::NeoHookean(_) if state.det > SMALLEST_DET => {
                neo_hookean(state, moduli, turning, gradients)
                    .map(|row| row.map(|k| self.volume * k))
            }
            _ => self.contract(&tangent_with(state, moduli, turning), gradients),
        };
        if let Some(own) = moduli.law.fibres() {
            let weight = (moduli.shear_pa, self.volume);
            fibres::add_stiffness(own, state.fibres(), weight, gradients, &mut sum);
        }
        sum
    }

    /// `V g_a . tangent . g_b` of all corners.
    ///
    /// Block by block of `i` and `k`, since a corner's gradient meets `j` and `l` alone.
    fn contract(&self, tangent: &[[f64; 9]; 9], gradients: [[f64; 3]; 4]) -> [[f64; 12]; 12] {
        let mut out = [[0.0; 12]; 12];
        for i in 0..3 {
            for k in 0..3 {
                let block = [0, 1, 2].map(|j| [0, 1, 2].map(|l| tangent[3 * i + j][3 * k + l]));
                for (second, g) in gradients.iter().enumerate() {
                    let image = block.map(|row| dot(row, *g));
                    for (first, g) in gradients.iter().enumerate() {
                        out[3 * first + i][3 * second + k] = self.volume * dot(*g, image);
                    }
                }
            }
        }
        out
    }
}
