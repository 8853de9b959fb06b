//! Sparse Cholesky of the stiffness (`faer`, supernodal) and solves with many right-hand sides.
//!
//! A factor that would take more than [`DOUBLE_BYTES`] in float64 is kept in float32, in half the memory. It then preconditions
//! conjugate gradients on the float64 stiffness, which need two or three steps.

use super::refined::Scaled;
use super::{LinearError, Stiffness, nested_dissection};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::Perm;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::traits::RealField;
use faer::{Conj, MatMut, Par, Side};

/// Largest factor in float64, bytes: meshes of about 90,000 nodes.
const DOUBLE_BYTES: usize = 3 << 30;

/// `K = L L^T` of the free degrees of freedom.
pub struct Factor {
    symbolic: SymbolicCholesky<usize>,
    values: Values,
    par: Par,
}

enum Values {
    Double(Vec<f64>),
    /// Of the scaled stiffness, by which its solutions are corrected.
    Single(Vec<f32>, Box<Scaled>),
}

/// Size of a factor.
#[derive(Debug, Clone, Copy)]
pub struct FactorStats {
    /// Degrees of freedom.
    pub dofs: usize,
    /// Stored entries of the lower triangle of `K`.
    pub stiffness_entries: usize,
    /// Stored entries of `L` (with the padding of its dense panels).
    pub factor_entries: usize,
    /// What they take.
    pub factor_bytes: usize,
}

/// Neighbours of each free node from the block pattern of the lower triangle.
fn neighbours(stiffness: &Stiffness) -> Vec<Vec<u32>> {
    let mut lists = vec![Vec::new(); stiffness.free.nodes.len()];
    for node in 0..lists.len() {
        let column = stiffness.column_offsets[3 * node]..stiffness.column_offsets[3 * node + 1];
        for at in column.skip(3).step_by(3) {
            let other = stiffness.rows[at] / 3;
            lists[node].push(other as u32);
            lists[other].push(node as u32);
        }
    }
    lists
}

impl Factor {
    /// Factorises with nested dissection on `positions` (all nodes of the mesh, mm). `threads` 0 means all. A factor above 3 GiB is kept in
    /// float32; where that is too coarse for the stiffness, in float64 after all.
    ///
    /// # Errors
    /// [`LinearError::Indefinite`] where a component of the mesh has no held node,
    /// [`LinearError::Factor`] when memory does not suffice.
    pub fn new(
        stiffness: &Stiffness,
        positions: &[[f32; 3]],
        threads: usize,
    ) -> Result<Self, LinearError> {
        Self::within(stiffness, positions, threads, DOUBLE_BYTES)
    }

    /// With another limit of a factor in float64, bytes.
    pub(super) fn within(
        stiffness: &Stiffness,
        positions: &[[f32; 3]],
        threads: usize,
        double_bytes: usize,
    ) -> Result<Self, LinearError> {
        let free: Vec<[f32; 3]> = stiffness
            .free
            .nodes
            .iter()
            .map(|&n| positions[n as usize])
            .collect();
        let order = nested_dissection(&free, &neighbours(stiffness), 48);
        let forward: Vec<usize> = order
            .iter()
            .flat_map(|&n| (0..3).map(move |axis| 3 * n as usize + axis))
            .collect();
        let mut inverse = vec![0usize; forward.len()];
        for (new, &old) in forward.iter().enumerate() {
            inverse[old] = new;
        }
        let perm = Perm::new_checked(forward.into(), inverse.into(), stiffness.dofs());

        let par = if threads == 1 {
            Par::Seq
        } else {
            Par::rayon(threads)
        };
        let n = stiffness.dofs();
        let pattern = SymbolicSparseColMatRef::new_checked(
            n,
            n,
            &stiffness.column_offsets,
            None,
            &stiffness.rows,
        );
        let symbolic = factorize_symbolic_cholesky(
            pattern,
            Side::Lower,
            SymmetricOrdering::Custom(perm.as_ref()),
            CholeskySymbolicParams::default(),
        )
        .map_err(|e| LinearError::Factor(format!("{e:?}")))?;
        let single = if symbolic.len_val() * size_of::<f64>() > double_bytes {
            let scaled = Box::new(Scaled::new(stiffness));
            // An error: too coarse for this stiffness, not positive definite after rounding.
            let found = numeric(&symbolic, pattern, &scaled.values(), par).ok();
            found.map(|values| Values::Single(values, scaled))
        } else {
            None
        };
        let values = match single {
            Some(values) => values,
            None => Values::Double(numeric(&symbolic, pattern, &stiffness.values, par)?),
        };
        Ok(Self {
            symbolic,
            values,
            par,
        })
    }

    /// Solves `K X = B` in place; `columns` is `[count, n]` (each right-hand side contiguous).
    ///
    /// # Panics
    /// If `columns.len()` is not a multiple of the number of degrees of freedom.
    pub fn solve(&self, columns: &mut [f64]) {
        self.solve_to(columns, 1e-9);
    }

    /// The same where a residual of `tolerance` times the right-hand side is enough; a factor in float64 always does better.
    ///
    /// # Panics
    /// As [`Factor::solve`].
    pub fn solve_to(&self, columns: &mut [f64], tolerance: f64) {
        let n = self.symbolic.nrows();
        assert!(
            columns.len().is_multiple_of(n),
            "{} values, {n} dofs",
            columns.len()
        );
        let count = columns.len() / n;
        if count == 0 {
            return;
        }
        match &self.values {
            Values::Double(values) => triangular(&self.symbolic, values, columns, self.par),
            Values::Single(values, scaled) => scaled.solve(columns, tolerance, &|batch| {
                triangular(&self.symbolic, values, batch, self.par);
            }),
        }
    }

    /// Sizes, for logs and tables.
    pub fn stats(&self, stiffness: &Stiffness) -> FactorStats {
        FactorStats {
            dofs: stiffness.dofs(),
            stiffness_entries: stiffness.values.len(),
            factor_entries: self.symbolic.len_val(),
            factor_bytes: match &self.values {
                Values::Double(values) => size_of_val(&values[..]),
                Values::Single(values, _) => size_of_val(&values[..]),
            },
        }
    }
}

/// The numbers of the factor.
fn numeric<T: RealField + Copy + Default>(
    symbolic: &SymbolicCholesky<usize>,
    pattern: SymbolicSparseColMatRef<'_, usize>,
    matrix: &[T],
    par: Par,
) -> Result<Vec<T>, LinearError> {
    let mut values = Vec::new();
    values
        .try_reserve_exact(symbolic.len_val())
        .map_err(|e| LinearError::Factor(e.to_string()))?;
    values.resize(symbolic.len_val(), T::default());
    let mut memory =
        MemBuffer::try_new(symbolic.factorize_numeric_llt_scratch::<T>(par, Default::default()))
            .map_err(|e| LinearError::Factor(format!("{e:?}")))?;
    symbolic
        .factorize_numeric_llt(
            &mut values,
            SparseColMatRef::new(pattern, matrix),
            Side::Lower,
            Default::default(),
            par,
            MemStack::new(&mut memory),
            Default::default(),
        )
        .map_err(|e| LinearError::Indefinite {
            cause: format!("{e:?}"),
        })?;
    Ok(values)
}

/// `L L^T X = B` in place.
fn triangular<T: RealField + Copy>(
    symbolic: &SymbolicCholesky<usize>,
    values: &[T],
    columns: &mut [T],
    par: Par,
) {
    let n = symbolic.nrows();
    let count = columns.len() / n;
    let mut memory = MemBuffer::new(symbolic.solve_in_place_scratch::<T>(count, par));
    LltRef::new(symbolic, values).solve_in_place_with_conj(
        Conj::No,
        MatMut::from_column_major_slice_mut(columns, n, count),
        par,
        MemStack::new(&mut memory),
    );
}
