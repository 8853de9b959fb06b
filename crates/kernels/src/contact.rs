//! Contact forces of the linear-elastic prior: `f = A_CC^-1 c`, where `A_CC [3m,3m]` is the part of the
//! compliance `A` (mm/mN) at the degrees of freedom in contact and `c` is the displacement there (mm).
//!
//! Dense Cholesky `A_CC = U^T U` in f64, in place, upper triangle, row-major; blocks of rows are
//! factored and then subtracted from the rest by a register-tiled product. f64 because neighbouring
//! contact nodes move almost alike: at a condition number of 1e5 an f32 factor keeps two digits, and
//! at these sizes f64 costs tens of microseconds. Where a pivot is lost in the rounding of the
//! stored f32 compliance, a relative Tikhonov term is added and reported.

mod gram;
mod upper;

pub use gram::subtract_gram;

use field::memory::{self, HeldBytes};
use gram::whiten_rows;
use lanes::Isa;
use upper::{factor_upper, solve_upper};

/// First Tikhonov term, relative to the mean diagonal; ten times more on each further attempt. It
/// is ten times the floor of a pivot (`upper::PIVOT_FLOOR`), so that the first attempt lifts pivots
/// that are just below it; the last one is 1, the mean diagonal itself.
const FIRST_TERM: f64 = 1e-5;
/// One without a term, and six with one.
const ATTEMPTS: i32 = 7;

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
#[derive(Debug, Default, HeldBytes)]
pub struct ContactFactor {
    /// `3 m` of the block taken last, whether or not it has a factor.
    order: usize,
    /// `U [3m,3m]` in the upper triangle, row-major; what is below it is scratch. Its length is what the last block needed.
    upper: Vec<f64>,
    /// The right side of a solve in f64, `[3m]`.
    right: Vec<f64>,
    /// Whether `upper` is a factor: false before the first one, and after one that could not be made.
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
    /// [`field::Error::OutOfMemory`].
    pub fn try_with_capacity(order: usize) -> field::error::Result<Self> {
        let mut factor = Self::default();
        factor.reserve(order)?;
        Ok(factor)
    }

    /// Makes room for a block of `order`, so that [`ContactFactor::factor`] of such a one does not allocate.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn reserve(&mut self, order: usize) -> field::error::Result<()> {
        const WHAT: &str = "the factor of a contact block";
        let upper = (order * order).saturating_sub(self.upper.len());
        let right = order.saturating_sub(self.right.len());
        memory::reserve(&mut self.upper, upper, WHAT)?;
        memory::reserve(&mut self.right, right, WHAT)
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
    /// The contact nodes decide the block. While they stay, steps solve with the factor that there
    /// is, `O(m^2)`; only new nodes cost the `O(m^3)` of this function.
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
            if attempt > 0 {
                term = FIRST_TERM * 10f64.powi(attempt - 1);
            }
            fill(&mut self.upper);
            // Checked once: what `fill` writes does not change between attempts.
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
    /// It is how the elastic coordinates that a contact excludes are taken out of a matrix: `A -=`
    /// that Gram matrix ([`subtract_gram`]).
    pub fn whiten(&self, isa: Isa, columns: usize, z: &mut [f64]) {
        assert!(self.ready, "no factor: call factor first");
        assert_eq!(z.len(), self.order * columns, "z must be [3m,n]");
        whiten_rows(isa, &self.upper, columns, z);
    }
}

#[cfg(test)]
mod tests;
