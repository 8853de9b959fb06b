//! Natural modes of the held body: `K phi = omega² M phi`, the lowest frequencies.
//!
//! Block Lanczos with full orthogonalisation (Golub and Van Loan 2013, sections 10.3.6 and 10.3.7) on `M^1/2 K^-1 M^1/2`, whose largest eigenvalues
//! are the lowest `1 / omega²`: one solve with the factor a vector, so it costs as much as a few hundred compliance columns and no other
//! factorisation. `faer`'s Krylov-Schur does not end on bodies with equal frequencies, such as a torus.

use super::{Factor, LinearError, Stiffness};
use crate::mesh::{Mesh, tet_volume};
use faer::{Mat, Side};

/// The lowest modes, ascending by frequency.
#[derive(Debug, Clone)]
pub struct NaturalModes {
    /// Angular frequency of each, rad/s.
    pub frequency: Vec<f64>,
    /// `[m, 3K]`, zero at held nodes, `phi^T M phi = 1` with `M` in kg.
    pub modes: Vec<f64>,
}

/// Lumped mass of each node, kg: a quarter of each tetrahedron's at its corners.
fn lumped_mass(mesh: &Mesh, density_kg_m3: f64) -> Vec<f64> {
    let mut mass = vec![0.0; mesh.node_count()];
    for (at, tet) in mesh.tets.iter().enumerate() {
        let density = mesh.laws().density_of(at, density_kg_m3);
        let share = 0.25e-9 * density * tet_volume(&mesh.positions, *tet);
        for &node in tet {
            mass[node as usize] += share;
        }
    }
    mass
}

/// `M^1/2 K^-1 M^1/2`; `root` is the diagonal of `M^1/2`.
struct Flexibility<'a> {
    factor: &'a Factor,
    root: &'a [f64],
    go_on: &'a (dyn Fn() -> bool + Sync),
}

impl Flexibility<'_> {
    fn apply(&self, right: &[f64]) -> Result<Vec<f64>, LinearError> {
        if !(self.go_on)() {
            return Err(LinearError::Stopped);
        }
        let mut values: Vec<f64> = self.root.iter().zip(right).map(|(m, x)| m * x).collect();
        self.factor.solve(&mut values);
        values.iter_mut().zip(self.root).for_each(|(x, m)| *x *= m);
        Ok(values)
    }
}

/// Vectors that the space grows by at once: so many equal eigenvalues, which a symmetric body has in pairs, are told apart.
const BLOCK: usize = 4;
/// Largest residual of a mode, as a share of its eigenvalue.
const TOLERANCE: f64 = 1e-8;
/// Vectors of the space at most: for each mode, and beside them.
const MOST_VECTORS: [usize; 2] = [6, 80];
/// What is left of a vector that the space holds already, as a share of it.
const ROUNDING: f64 = 1e-12;

/// A space of orthonormal vectors that images of its own are added to.
struct Krylov {
    /// `[m, n]` by rows.
    vectors: Vec<Vec<f64>>,
    /// `V^T A V`, lower half: row `i` has `i + 1` numbers.
    projected: Vec<Vec<f64>>,
    /// What is left of the newest images outside of the space, and orthonormal vectors that span it.
    left: Vec<Vec<f64>>,
    next: Vec<Vec<f64>>,
}

impl Krylov {
    /// Starts from any vectors that no mode is orthogonal to: a fixed sequence, so that the modes are the same every time.
    fn new(n: usize) -> Self {
        let mut state = 0u64;
        let mut next: Vec<Vec<f64>> = Vec::new();
        for _ in 0..BLOCK.min(n) {
            let draw = |_| {
                state += 1;
                let bits = state.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11;
                bits as f64 / (1u64 << 53) as f64 - 0.5
            };
            let vector = (0..n).map(draw).collect();
            next.extend(outside(vector, &[&next]));
        }
        Self {
            vectors: Vec::new(),
            projected: Vec::new(),
            left: Vec::new(),
            next,
        }
    }

    /// Takes the next vectors in, with their images.
    fn grow(
        &mut self,
        apply: impl Fn(&[f64]) -> Result<Vec<f64>, LinearError>,
    ) -> Result<(), LinearError> {
        let first = self.vectors.len();
        self.vectors.append(&mut self.next);
        self.left.clear();
        for column in first..self.vectors.len() {
            let mut image = apply(&self.vectors[column])?;
            let row = (0..=column).map(|at| dot(&self.vectors[at], &image));
            self.projected.push(row.collect());
            subtract(&mut image, &self.vectors);
            self.left.push(image);
        }
        for image in &self.left {
            let scale = self.projected[first][first].abs();
            if norm(image) > ROUNDING * scale {
                self.next
                    .extend(outside(image.clone(), &[&self.vectors, &self.next]));
            }
        }
        Ok(())
    }

    /// The largest `count` eigenvalues of the projection, descending, with the coordinates of their vectors and the lengths of their residuals.
    fn ritz(&self, count: usize) -> Option<Vec<(f64, Vec<f64>, f64)>> {
        let m = self.vectors.len();
        let projected = Mat::from_fn(m, m, |i, j| self.projected[i.max(j)][i.min(j)]);
        let found = projected.self_adjoint_eigen(Side::Lower).ok()?;
        let first = m - self.left.len();
        let pairs = (m - count..m).rev().map(|column| {
            let coordinates: Vec<f64> = (0..m).map(|row| found.U()[(row, column)]).collect();
            let newest = self.left.iter().zip(&coordinates[first..]);
            let residual =
                newest.fold(vec![0.0; self.vectors[0].len()], |mut sum, (left, part)| {
                    sum.iter_mut()
                        .zip(left)
                        .for_each(|(sum, x)| *sum += part * x);
                    sum
                });
            (found.S()[column], coordinates, norm(&residual))
        });
        Some(pairs.collect())
    }
}

/// In eight sums, which a processor makes at once.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, a_rest) = a.as_chunks::<8>();
    let (b, b_rest) = b.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// Takes off what orthonormal vectors span.
fn subtract(vector: &mut [f64], of: &[Vec<f64>]) {
    for other in of {
        let part = dot(vector, other);
        vector
            .iter_mut()
            .zip(other)
            .for_each(|(x, y)| *x -= part * y);
    }
}

/// The unit vector along what is left of a vector outside of spaces; none where that is rounding.
fn outside(mut vector: Vec<f64>, spaces: &[&Vec<Vec<f64>>]) -> Option<Vec<f64>> {
    let before = norm(&vector);
    // Once more for what rounding left of them.
    for _ in 0..2 {
        spaces.iter().for_each(|space| subtract(&mut vector, space));
    }
    let length = norm(&vector);
    (length > ROUNDING * before).then(|| {
        vector.iter_mut().for_each(|x| *x /= length);
        vector
    })
}

/// The largest eigenvalues of a symmetric positive operator of `n` dimensions, descending, and their unit vectors.
fn largest(
    n: usize,
    count: usize,
    apply: impl Fn(&[f64]) -> Result<Vec<f64>, LinearError>,
) -> Result<Vec<(f64, Vec<f64>)>, LinearError> {
    let most = (MOST_VECTORS[0] * count + MOST_VECTORS[1]).min(n);
    let mut krylov = Krylov::new(n);
    let mut looks_at = 2 * count;
    loop {
        krylov.grow(&apply)?;
        let m = krylov.vectors.len();
        let is_last = m >= most || krylov.next.is_empty();
        if m < count.max(looks_at) && !is_last {
            continue;
        }
        looks_at = m + count / 4;
        let pairs = krylov.ritz(count.min(m)).unwrap_or_default();
        let is_good = |(value, _, residual): &(f64, Vec<f64>, f64)| *residual <= TOLERANCE * value;
        let found = pairs.iter().take_while(|pair| is_good(pair)).count();
        if found == count {
            let combined = pairs.into_iter().map(|(value, coordinates, _)| {
                let mut vector = vec![0.0; n];
                for (basis, part) in krylov.vectors.iter().zip(&coordinates) {
                    vector
                        .iter_mut()
                        .zip(basis)
                        .for_each(|(x, y)| *x += part * y);
                }
                (value, vector)
            });
            return Ok(combined.collect());
        }
        if is_last {
            return Err(LinearError::NotConverged {
                asked: count,
                found,
            });
        }
    }
}

/// The `count` lowest natural modes of `mesh` with the held nodes that `stiffness` was assembled without.
///
/// `go_on` is asked before every solve. Memory: the factor and at most `6 count + 80` vectors of its size, mostly half of them.
///
/// # Errors
/// More modes than degrees of freedom; not all converge; [`LinearError::Stopped`] where `go_on` says no.
pub fn natural_modes(
    mesh: &Mesh,
    stiffness: &Stiffness,
    factor: &Factor,
    density_kg_m3: f64,
    count: usize,
    go_on: &(dyn Fn() -> bool + Sync),
) -> Result<NaturalModes, LinearError> {
    let n = stiffness.dofs();
    if count == 0 || 2 * count >= n {
        return Err(LinearError::Modes {
            asked: count,
            dofs: n,
        });
    }
    let mass = lumped_mass(mesh, density_kg_m3);
    let free = &stiffness.free.nodes;
    let root: Vec<f64> = (free.iter())
        .flat_map(|&node| [mass[node as usize].sqrt(); 3])
        .collect();
    let operator = Flexibility {
        factor,
        root: &root,
        go_on,
    };
    let found = largest(n, count, |right| operator.apply(right))?;
    let width = 3 * mesh.node_count();
    let mut modes = vec![0.0; count * width];
    for (mode, (_, vector)) in modes.chunks_exact_mut(width).zip(&found) {
        for (at, &node) in free.iter().enumerate() {
            for axis in 0..3 {
                let row = 3 * at + axis;
                mode[3 * node as usize + axis] = vector[row] / root[row];
            }
        }
    }
    Ok(NaturalModes {
        frequency: found.iter().map(|(value, _)| value.powf(-0.5)).collect(),
        modes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_frequencies_are_all_found() {
        // 1, 1, 1/2, 1/2, 1/3, ...: each eigenvalue twice.
        let value = |at: usize| 1.0 / (1 + at / 2) as f64;
        let apply = |x: &[f64]| Ok(x.iter().enumerate().map(|(at, x)| value(at) * x).collect());
        let found = largest(400, 11, apply).unwrap();
        for (at, (eigenvalue, vector)) in found.iter().enumerate() {
            assert!((eigenvalue - value(at)).abs() < 1e-12, "{at}: {eigenvalue}");
            let own: f64 = (0..400)
                .filter(|row| value(*row) == value(at))
                .map(|row| vector[row].powi(2))
                .sum();
            assert!((own - 1.0).abs() < 1e-9, "{at}: {own}");
        }
    }

    #[test]
    fn a_space_that_is_used_up_is_the_end() {
        let apply = |x: &[f64]| Ok(x.to_vec());
        let found = largest(30, 3, apply).unwrap();
        assert!(found.iter().all(|(value, _)| (value - 1.0).abs() < 1e-12));
        // Six equal ones are more than a block tells apart.
        assert!(matches!(
            largest(30, 6, apply),
            Err(LinearError::NotConverged { asked: 6, found: 4 })
        ));
    }
}
