//! Energy and stress of a law in principal stretches, in f64, without eigenvectors.
//!
//! With `H = F - 1`, `A = H + H^T + H^T H`, `t = tr A / 3` and the traceless `D = (A - t) / (1 + t)`, stretches without change of volume
//! are `Cbar = (1 + x)^(-1/3) (1 + D)`, `x = det D - D:D/2`: everything is of the size of the strain. A function of `Cbar` without its
//! trace is `T = a1 D + a2 (D² - D:D/3)`, with divided differences at the eigenvalues of `D`, which the angle of its cubic gives. Where
//! eigenvalues coincide a derivative stands for a difference, and where all do a series.

use crate::laws::Stretches;

/// Eigenvalues of `D` closer than this have a derivative in place of a difference.
const COINCIDENT: f64 = 1e-6;
/// With all of them closer than this the series is more accurate.
const SMALL: f64 = 2e-4;
/// Least value of `det (1 + D)`.
const LEAST: f64 = 1e-6;

/// A symmetric matrix: 11, 12, 13, 22, 23, 33.
pub type Symmetric = [f64; 6];

/// `D` of a deformation and what follows from it.
struct Shape {
    d: Symmetric,
    /// `D:D / 2` and `det D`.
    j2: f64,
    j3: f64,
    /// `ln (1 + x)`.
    log: f64,
}

impl Shape {
    /// From a deformation gradient, rows.
    fn new(f: &[[f64; 3]; 3]) -> Self {
        let mut h = *f;
        for i in 0..3 {
            h[i][i] -= 1.0;
        }
        let a = ENTRIES
            .map(|[i, j]| h[i][j] + h[j][i] + (0..3).map(|k| h[k][i] * h[k][j]).sum::<f64>());
        let t = (a[0] + a[3] + a[5]) / 3.0;
        let scale = 1.0 / (1.0 + t).max(LEAST);
        let mut d = a.map(|a| a * scale);
        for k in [0, 3, 5] {
            d[k] -= t * scale;
        }
        let j2 = 0.5 * (d[0] * d[0] + d[3] * d[3] + d[5] * d[5])
            + d[1] * d[1]
            + d[2] * d[2]
            + d[4] * d[4];
        let j3 = d[0] * (d[3] * d[5] - d[4] * d[4]) - d[1] * (d[1] * d[5] - d[4] * d[2])
            + d[2] * (d[1] * d[4] - d[3] * d[2]);
        let log = libm::log1p((j3 - j2).max(LEAST - 1.0));
        Self { d, j2, j3, log }
    }

    /// Eigenvalues of `D`, the largest first.
    fn eigenvalues(&self) -> [f64; 3] {
        let r = (self.j2 / 3.0).sqrt();
        if r == 0.0 {
            return [0.0; 3];
        }
        // `D` has no trace, so its characteristic polynomial is `d^3 - j2 d - j3`, with the roots
        // `2 r cos(angle + 2 pi k / 3)`.
        let cosine = (self.j3 / (2.0 * r * r * r)).clamp(-1.0, 1.0);
        let angle = libm::acos(cosine) / 3.0;
        let first = 2.0 * r * libm::cos(angle);
        let last = 2.0 * r * libm::cos(angle + std::f64::consts::TAU / 3.0);
        [first, -first - last, last]
    }

    /// The logarithm of a stretch without change of volume from an eigenvalue of `D`.
    fn logarithm(&self, d: f64) -> f64 {
        0.5 * (libm::log1p(d.max(LEAST - 1.0)) - self.log / 3.0)
    }

    /// `(f(a) - f(b)) / (a - b)`.
    fn difference(&self, law: &Stretches, [a, b]: [f64; 2]) -> f64 {
        if a - b < COINCIDENT {
            let middle = 0.5 * (a + b);
            law.rise(self.logarithm(middle)) / (2.0 * (1.0 + middle).max(LEAST))
        } else {
            (law.pull(self.logarithm(a)) - law.pull(self.logarithm(b))) / (a - b)
        }
    }
}

/// Rows and columns of the entries of [`Symmetric`].
const ENTRIES: [[usize; 2]; 6] = [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];

/// Where row `i`, column `j` is in [`Symmetric`].
pub const PLACE: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// `J^(-2/3) I1 - 3`, without cancellation.
pub fn first_invariant(f: &[[f64; 3]; 3]) -> f64 {
    3.0 * libm::expm1(-Shape::new(f).log / 3.0)
}

/// How much steeper the steepest principal stress rises than at rest, there 1.
pub fn stiffening(law: &Stretches, f: &[[f64; 3]; 3]) -> f64 {
    let shape = Shape::new(f);
    let logarithms = shape.eigenvalues().map(|d| shape.logarithm(d));
    let squares = logarithms.map(|s| libm::exp(2.0 * s));
    let mean = squares.iter().sum::<f64>() / 3.0;
    let grown = |square: f64| 2.0 * law.slope * square * (square - mean);
    let rises = [0, 1, 2].map(|k| law.rise(logarithms[k]) + grown(squares[k]));
    0.5 * rises.into_iter().fold(0.0, f64::max)
}

/// `w` over the shear modulus.
pub fn energy(law: &Stretches, f: &[[f64; 3]; 3]) -> f64 {
    let shape = Shape::new(f);
    law.energy(shape.eigenvalues().map(|d| shape.logarithm(d)))
}

/// `T = dev sum mu Cbar^(alpha / 2)` over the shear modulus: the first Piola stress is `cof F T / J`.
pub fn deviator(law: &Stretches, f: &[[f64; 3]; 3]) -> Symmetric {
    let shape = Shape::new(f);
    let Shape { d, j2, j3, log } = shape;
    let [first, middle, last] = shape.eigenvalues();
    let [own, squared] = if first - last < SMALL {
        law.series(j2, j3, log)
    } else {
        let upper = shape.difference(law, [first, middle]);
        let lower = shape.difference(law, [middle, last]);
        let squared = (upper - lower) / (first - last);
        [upper + squared * last, squared]
    };
    let mut out = ENTRIES.map(|[i, j]| {
        let square: f64 = (0..3).map(|k| d[PLACE[i][k]] * d[PLACE[k][j]]).sum();
        own * d[PLACE[i][j]] + squared * square
    });
    for k in [0, 3, 5] {
        out[k] -= squared * 2.0 * j2 / 3.0;
    }
    out
}
