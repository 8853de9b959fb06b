//! Eigenvalues and eigenvectors of a symmetric 3 x 3 matrix by Jacobi's rotations.
//!
//! Golub and Van Loan, *Matrix Computations*, on Jacobi methods. Slower than a closed form, but
//! eigenvectors of nearly equal eigenvalues come out orthogonal to rounding.

/// Sweeps: each squares the off-diagonal part, so that a few reach the last bit.
const SWEEPS: u32 = 8;

/// Eigenvalues, and the eigenvectors as columns; in no particular order.
pub fn spectrum(matrix: [[f64; 3]; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
    let mut a = matrix;
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..SWEEPS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            // The smaller of the two angles that annihilate the entry: it keeps the rotations from
            // undoing each other.
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + libm::hypot(theta, 1.0));
            let c = 1.0 / libm::hypot(t, 1.0);
            let s = t * c;
            for row in &mut a {
                [row[p], row[q]] = [c * row[p] - s * row[q], s * row[p] + c * row[q]];
            }
            for k in 0..3 {
                [a[p][k], a[q][k]] = [c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]];
            }
            for row in &mut v {
                [row[p], row[q]] = [c * row[p] - s * row[q], s * row[p] + c * row[q]];
            }
        }
    }
    ([a[0][0], a[1][1], a[2][2]], v)
}

#[cfg(test)]
mod tests {
    use super::spectrum;

    #[test]
    fn it_rebuilds_the_matrix() {
        let far = [[2.0, -0.3, 0.7], [-0.3, 1.0, 0.2], [0.7, 0.2, -4.0]];
        let close = [[1.0, 1e-9, 0.0], [1e-9, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for matrix in [far, close] {
            let (values, vectors) = spectrum(matrix);
            for i in 0..3 {
                for j in 0..3 {
                    let sum: f64 = (0..3)
                        .map(|k| vectors[i][k] * values[k] * vectors[j][k])
                        .sum();
                    assert!((sum - matrix[i][j]).abs() < 1e-14, "{sum}");
                }
            }
        }
    }
}
