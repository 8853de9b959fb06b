//! Sparse Cholesky of the stiffness (`faer`, supernodal) and solves with many right-hand sides.

use super::{LinearError, Stiffness, nested_dissection};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::Perm;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// `K = L L^T` of the free degrees of freedom.
pub struct Factor {
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    par: Par,
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
    /// Factorises with nested dissection on `positions` (all nodes of the mesh, mm). `threads` 0 means all.
    ///
    /// # Errors
    /// [`LinearError::Indefinite`] where a component of the mesh has no held node,
    /// [`LinearError::Factor`] when memory does not suffice.
    pub fn new(
        stiffness: &Stiffness,
        positions: &[[f32; 3]],
        threads: usize,
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
        let matrix = SparseColMatRef::new(pattern, &stiffness.values[..]);
        let symbolic = factorize_symbolic_cholesky(
            pattern,
            Side::Lower,
            SymmetricOrdering::Custom(perm.as_ref()),
            CholeskySymbolicParams::default(),
        )
        .map_err(|e| LinearError::Factor(format!("{e:?}")))?;
        let mut values = Vec::new();
        values
            .try_reserve_exact(symbolic.len_val())
            .map_err(|e| LinearError::Factor(e.to_string()))?;
        values.resize(symbolic.len_val(), 0.0);
        let mut memory = MemBuffer::try_new(
            symbolic.factorize_numeric_llt_scratch::<f64>(par, Default::default()),
        )
        .map_err(|e| LinearError::Factor(format!("{e:?}")))?;
        symbolic
            .factorize_numeric_llt(
                &mut values,
                matrix,
                Side::Lower,
                Default::default(),
                par,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(|e| LinearError::Indefinite {
                cause: format!("{e:?}"),
            })?;
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
        let llt = LltRef::new(&self.symbolic, &self.values);
        let mut memory =
            MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(count, self.par));
        llt.solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(columns, n, count),
            self.par,
            MemStack::new(&mut memory),
        );
    }

    /// Sizes, for logs and tables.
    pub fn stats(&self, stiffness: &Stiffness) -> FactorStats {
        FactorStats {
            dofs: stiffness.dofs(),
            stiffness_entries: stiffness.values.len(),
            factor_entries: self.symbolic.len_val(),
        }
    }
}
