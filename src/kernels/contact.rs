//! Contact forces of the linear-elastic prior: `f = A_CC^-1 c`, where `A_CC [3m,3m]` is the part of the
//! compliance `A` (mm/mN) at the degrees of freedom in contact and `c` is the displacement there (mm).
//!
//! Dense Cholesky `A_CC = U^T U` in f64, in place, upper triangle, row-major; blocks of rows are
//! factored and then subtracted from the rest by a register-tiled product. f64 because neighbouring
//! contact nodes move almost alike: at a condition number of 1e5 an f32 factor keeps two digits, and
//! at these sizes f64 costs tens of microseconds. Where a pivot is lost in the rounding of the
//! stored f32 compliance, a relative Tikhonov term is added and reported.

use super::isa::{Isa, by_isa};
use super::lanes::Lanes;
use crate::memory;

/// Pivots below this part of their diagonal are rounding noise of the f32 compliance.
const PIVOT_FLOOR: f64 = 1e-6;
/// First Tikhonov term, relative to the mean diagonal; ten times more on each further attempt.
const FIRST_TERM: f64 = 1e-5;
const ATTEMPTS: i32 = 6;
/// Rows factored before the rest is updated.
const BLOCK: usize = 24;

/// Why no factor could be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FactorError {
    /// The compliance holds a NaN, an infinity or a diagonal that is not positive.
    #[error(
        "compliance of contact dof {dof} is {value}: it must be finite and positive; rebuild prior.safetensors"
    )]
    Diagonal { dof: u32, value: f32 },
    /// No Tikhonov term made the block positive definite.
    #[error(
        "compliance block of {order} contact dofs is not positive definite even with a relative Tikhonov term of {term:e}; rebuild prior.safetensors"
    )]
    Indefinite { order: usize, term: f64 },
}

/// How a factor came out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FactorReport {
    /// Degrees of freedom, `3 m`.
    pub order: usize,
    /// Tikhonov term relative to the mean diagonal; 0 where none was needed.
    pub term: f64,
}

impl FactorReport {
    /// Whether the block was near-singular and was changed.
    pub fn regularised(&self) -> bool {
        self.term > 0.0
    }
}

/// A Cholesky factor of the contact block, kept while the contact nodes stay.
#[derive(Debug, Default)]
pub struct ContactFactor {
    order: usize,
    upper: Vec<f64>,
    right: Vec<f64>,
    ready: bool,
}

impl ContactFactor {
    /// Room for blocks up to `order = 3 m`; larger ones make [`ContactFactor::factor`] allocate.
    pub fn with_capacity(order: usize) -> Self {
        Self {
            upper: Vec::with_capacity(order * order),
            right: Vec::with_capacity(order),
            ..Self::default()
        }
    }

    /// As [`ContactFactor::with_capacity`].
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn try_with_capacity(order: usize) -> crate::Result<Self> {
        let mut factor = Self::default();
        factor.reserve(order)?;
        Ok(factor)
    }

    /// Makes room for a block of `order`, so that [`ContactFactor::factor`] of such a one does not allocate.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn reserve(&mut self, order: usize) -> crate::Result<()> {
        const WHAT: &str = "the factor of a contact block";
        let upper = (order * order).saturating_sub(self.upper.len());
        let right = order.saturating_sub(self.right.len());
        memory::reserve(&mut self.upper, upper, WHAT)?;
        memory::reserve(&mut self.right, right, WHAT)
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        8 * (self.upper.capacity() + self.right.capacity())
    }

    /// Degrees of freedom of the current factor; 0 before the first.
    pub fn order(&self) -> usize {
        if self.ready { self.order } else { 0 }
    }

    /// Factors the block of the degrees of freedom `dofs`: `fill` writes its upper triangle into `[3m,3m]` row-major, and is
    /// called again where a Tikhonov term has to be added.
    ///
    /// # Errors
    /// See [`FactorError`]; there is no factor then ([`ContactFactor::order`] is 0).
    pub fn factor(
        &mut self,
        isa: Isa,
        dofs: &[u32],
        mut fill: impl FnMut(&mut [f64]),
    ) -> Result<FactorReport, FactorError> {
        let order = dofs.len();
        self.ready = false;
        self.order = order;
        self.upper.resize(order * order, 0.0);
        self.right.resize(order, 0.0);
        let (mut term, mut mean) = (0.0, 0.0);
        for attempt in 0..ATTEMPTS {
            fill(&mut self.upper);
            if attempt == 0 {
                for (&dof, value) in dofs.iter().zip(self.upper.iter().step_by(order + 1)) {
                    if !(*value > 0.0 && value.is_finite()) {
                        let value = *value as f32;
                        return Err(FactorError::Diagonal { dof, value });
                    }
                    mean += value / order as f64;
                }
            }
            for value in self.upper.iter_mut().step_by(order + 1) {
                *value += term * mean;
            }
            let mut positive = true;
            factor_upper(isa, &mut self.upper, order, &mut positive);
            if positive {
                self.ready = true;
                return Ok(FactorReport { order, term });
            }
            term = FIRST_TERM * 10f64.powi(attempt);
        }
        Err(FactorError::Indefinite { order, term })
    }

    /// `forces = A_CC^-1 displacement`, both `[3m]`, mm to mN.
    ///
    /// # Panics
    /// If there is no factor or a length is not its order.
    pub fn solve(&mut self, isa: Isa, displacement: &[f32], forces: &mut [f32]) {
        assert!(
            self.ready || self.order == 0,
            "no factor: call factor first"
        );
        assert_eq!(displacement.len(), self.order, "displacement must be [3m]");
        assert_eq!(forces.len(), self.order, "forces must be [3m]");
        for (to, &from) in self.right.iter_mut().zip(displacement) {
            *to = f64::from(from);
        }
        // Rows are short and their ends many: wider registers take 1.2 times as long, with the same bits.
        let isa = isa.min(Isa::Avx2);
        solve_upper(isa, &self.upper, &mut self.right);
        for (to, &from) in forces.iter_mut().zip(&self.right) {
            *to = from as f32;
        }
    }
}

impl ContactFactor {
    /// `R^-T Z` with `A_CC = R^T R`, in place: `z [3m,n]`, row-major. The Gram matrix of the columns of the result is `Z^T A_CC^-1 Z`.
    ///
    /// # Panics
    /// If there is no factor or `z` has another length.
    pub fn whiten(&self, isa: Isa, columns: usize, z: &mut [f64]) {
        assert!(self.ready, "no factor: call factor first");
        assert_eq!(z.len(), self.order * columns, "z must be [3m,n]");
        whiten_rows(isa, &self.upper, columns, z);
    }
}

fn whiten_rows_scalar(u: &[f64], columns: usize, z: &mut [f64]) {
    let n = z.len() / columns.max(1);
    for k in 0..n {
        for at in 0..columns {
            let known: f64 = (0..k).map(|i| u[i * n + k] * z[i * columns + at]).sum();
            z[k * columns + at] = (z[k * columns + at] - known) / u[k * n + k];
        }
    }
}

by_isa! { fn whiten_rows(u: &[f64], columns: usize, z: &mut [f64]) = whiten_rows_body, whiten_rows_scalar; }

/// The same, by rows of `u`. Only the compiler's vector instructions depend on `V`.
#[inline(always)]
unsafe fn whiten_rows_body<V: Lanes>(u: &[f64], columns: usize, z: &mut [f64]) {
    let n = z.len() / columns.max(1);
    for k in 0..n {
        let (above, below) = z.split_at_mut((k + 1) * columns);
        let row = &mut above[k * columns..];
        let inverse = 1.0 / u[k * n + k];
        row.iter_mut().for_each(|x| *x *= inverse);
        for (to, &factor) in below.chunks_exact_mut(columns).zip(&u[k * n + k + 1..]) {
            for (to, &x) in to.iter_mut().zip(&*row) {
                *to = (-factor).mul_add(x, *to);
            }
        }
    }
}

/// `upper -= scale Z^T Z` for `z [m,n]` in the upper triangle of `upper [n,n]`; what it writes below is never read.
///
/// # Panics
/// If a length does not fit.
pub fn subtract_gram(isa: Isa, z: &[f64], columns: usize, scale: f64, upper: &mut [f64]) {
    assert_eq!(upper.len(), columns * columns, "upper must be [n,n]");
    assert!(z.len().is_multiple_of(columns.max(1)), "z must be [m,n]");
    gram(isa, z, columns, scale, upper);
}

fn gram_scalar(z: &[f64], columns: usize, scale: f64, upper: &mut [f64]) {
    for (i, row) in upper.chunks_exact_mut(columns).enumerate() {
        for (j, to) in row.iter_mut().enumerate().skip(i) {
            let rows = z.chunks_exact(columns);
            *to -= scale * rows.map(|z| z[i] * z[j]).sum::<f64>();
        }
    }
}

by_isa! { fn gram(z: &[f64], columns: usize, scale: f64, upper: &mut [f64]) = gram_body, gram_scalar; }

#[inline(always)]
unsafe fn gram_body<V: Lanes>(z: &[f64], columns: usize, scale: f64, upper: &mut [f64]) {
    let n = columns;
    let mut i = 0;
    while i + 4 <= n {
        let rows = &mut upper[i * n..][..4 * n];
        let mut j = i;
        while j + 16 <= n {
            subtract_scaled_tile::<4, 16>(z, rows, n, i, j, scale);
            j += 16;
        }
        while j + 4 <= n {
            subtract_scaled_tile::<4, 4>(z, rows, n, i, j, scale);
            j += 4;
        }
        while j < n {
            subtract_scaled_tile::<4, 1>(z, rows, n, i, j, scale);
            j += 1;
        }
        i += 4;
    }
    while i < n {
        let rows = &mut upper[i * n..][..n];
        for j in i..n {
            subtract_scaled_tile::<1, 1>(z, rows, n, i, j, scale);
        }
        i += 1;
    }
}

/// Whether a pivot stands out of the rounding of its diagonal `pivot + removed`; a NaN does not.
fn is_sound(pivot: f64, removed: f64) -> bool {
    pivot > PIVOT_FLOOR * (pivot + removed)
}

/// `A = U^T U`, the readable way; `positive` is false where a pivot is too small.
fn factor_upper_scalar(a: &mut [f64], n: usize, positive: &mut bool) {
    for k in 0..n {
        let pivot = a[k * n + k];
        let removed: f64 = (0..k).map(|i| a[i * n + k] * a[i * n + k]).sum();
        if !is_sound(pivot, removed) {
            *positive = false;
            return;
        }
        let root = pivot.sqrt();
        for j in k..n {
            a[k * n + j] /= root;
        }
        for i in k + 1..n {
            for j in i..n {
                a[i * n + j] -= a[k * n + i] * a[k * n + j];
            }
        }
    }
}

by_isa! { fn factor_upper(a: &mut [f64], n: usize, positive: &mut bool) = factor_upper_body, factor_upper_scalar; }

/// The same, by blocks of rows. Only the compiler's vector instructions depend on `V`.
#[inline(always)]
unsafe fn factor_upper_body<V: Lanes>(a: &mut [f64], n: usize, positive: &mut bool) {
    let mut start = 0;
    while start < n {
        let end = (start + BLOCK).min(n);
        if !factor_rows(a, n, start, end) {
            *positive = false;
            return;
        }
        let (done, rest) = a.split_at_mut(end * n);
        let block = &done[start * n..];
        let mut i = end;
        while i + 4 <= n {
            let rows = &mut rest[(i - end) * n..][..4 * n];
            // The first tile starts on the diagonal: what it writes below is never read.
            let mut j = i;
            while j + 16 <= n {
                subtract_tile::<4, 16>(block, rows, n, i, j);
                j += 16;
            }
            while j + 4 <= n {
                subtract_tile::<4, 4>(block, rows, n, i, j);
                j += 4;
            }
            while j < n {
                subtract_tile::<4, 1>(block, rows, n, i, j);
                j += 1;
            }
            i += 4;
        }
        while i < n {
            let rows = &mut rest[(i - end) * n..][..n];
            for j in i..n {
                subtract_tile::<1, 1>(block, rows, n, i, j);
            }
            i += 1;
        }
        start = end;
    }
}

/// Factors rows `start..end`, whose earlier rows have been subtracted already.
#[inline(always)]
fn factor_rows(a: &mut [f64], n: usize, start: usize, end: usize) -> bool {
    for k in start..end {
        let (above, below) = a.split_at_mut((k + 1) * n);
        let pivot = above[k * n + k];
        let removed: f64 = (0..k).map(|i| above[i * n + k] * above[i * n + k]).sum();
        if !is_sound(pivot, removed) {
            return false;
        }
        let row = &mut above[k * n..];
        let inverse = 1.0 / pivot.sqrt();
        row[k..].iter_mut().for_each(|x| *x *= inverse);
        for i in k + 1..end {
            let factor = row[i];
            let to = &mut below[(i - k - 1) * n..][i..n];
            for (to, &x) in to.iter_mut().zip(&row[i..]) {
                *to = (-factor).mul_add(x, *to);
            }
        }
    }
    true
}

/// `rows[r][j + c] -= sum_k block[k][i + r] * block[k][j + c]` for an `R x C` tile in registers.
#[inline(always)]
fn subtract_tile<const R: usize, const C: usize>(
    block: &[f64],
    rows: &mut [f64],
    n: usize,
    i: usize,
    j: usize,
) {
    subtract_scaled_tile::<R, C>(block, rows, n, i, j, 1.0);
}

/// The same, the sum times `scale`.
#[inline(always)]
fn subtract_scaled_tile<const R: usize, const C: usize>(
    block: &[f64],
    rows: &mut [f64],
    n: usize,
    i: usize,
    j: usize,
    scale: f64,
) {
    let mut sum = [[0.0f64; C]; R];
    for row in block.chunks_exact(n) {
        let left: &[f64; R] = row[i..i + R].try_into().expect("R numbers");
        let right: &[f64; C] = row[j..j + C].try_into().expect("C numbers");
        for r in 0..R {
            for c in 0..C {
                sum[r][c] = left[r].mul_add(right[c], sum[r][c]);
            }
        }
    }
    for (r, sum) in sum.iter().enumerate() {
        for (to, sum) in rows[r * n + j..][..C].iter_mut().zip(sum) {
            *to -= scale * sum;
        }
    }
}

fn solve_upper_scalar(u: &[f64], x: &mut [f64]) {
    solve(u, x);
}

by_isa! { fn solve_upper(u: &[f64], x: &mut [f64]) = solve_upper_body, solve_upper_scalar; }

#[inline(always)]
unsafe fn solve_upper_body<V: Lanes>(u: &[f64], x: &mut [f64]) {
    solve(u, x);
}

/// `U^T U x = b` in place.
#[inline(always)]
fn solve(u: &[f64], x: &mut [f64]) {
    let n = x.len();
    for k in 0..n {
        let row = &u[k * n..][..n];
        let y = x[k] / row[k];
        x[k] = y;
        for (x, &u) in x[k + 1..].iter_mut().zip(&row[k + 1..]) {
            *x -= y * u;
        }
    }
    for k in (0..n).rev() {
        let row = &u[k * n..][..n];
        let mut sums = [0.0; 8];
        let (us, xs) = (row[k + 1..].chunks_exact(8), x[k + 1..].chunks_exact(8));
        let tail: f64 = us
            .remainder()
            .iter()
            .zip(xs.remainder())
            .map(|(u, x)| u * x)
            .sum();
        for (u, x) in us.zip(xs) {
            for lane in 0..8 {
                sums[lane] += u[lane] * x[lane];
            }
        }
        x[k] = (x[k] - tail - sums.iter().sum::<f64>()) / row[k];
    }
}

#[cfg(test)]
mod tests;
