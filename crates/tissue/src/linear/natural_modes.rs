//! Natural modes of the held body: `K phi = omega² M phi`, the lowest frequencies.
//!
//! Krylov-Schur (`faer`) on `M^1/2 K^-1 M^1/2`, whose largest eigenvalues are the lowest `1 / omega²`: one solve with the
//! factor an iteration, so it costs as much as a few hundred compliance columns and no other factorisation.

use super::{Factor, LinearError, Stiffness};
use crate::mesh::{Mesh, tet_volume};
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::matrix_free::LinOp;
use faer::matrix_free::eigen::{partial_self_adjoint_eigen, partial_self_adjoint_eigen_scratch};
use faer::{Col, Mat, MatMut, MatRef, Par};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

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
    for tet in &mesh.tets {
        let share = 0.25e-9 * density_kg_m3 * tet_volume(&mesh.positions, *tet);
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

/// Unwinds out of an iteration that knows no other end.
struct Stopped;

impl std::fmt::Debug for Flexibility<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Flexibility of {} dofs", self.root.len())
    }
}

impl LinOp<f64> for Flexibility<'_> {
    fn apply_scratch(&self, _columns: usize, _par: Par) -> StackReq {
        StackReq::EMPTY
    }

    fn nrows(&self) -> usize {
        self.root.len()
    }

    fn ncols(&self) -> usize {
        self.root.len()
    }

    fn apply(
        &self,
        mut out: MatMut<'_, f64>,
        right: MatRef<'_, f64>,
        _par: Par,
        _stack: &mut MemStack,
    ) {
        for column in 0..right.ncols() {
            if !(self.go_on)() {
                resume_unwind(Box::new(Stopped));
            }
            let mut values: Vec<f64> = (self.root.iter().enumerate())
                .map(|(row, root)| root * right[(row, column)])
                .collect();
            self.factor.solve(&mut values);
            for (row, (root, value)) in self.root.iter().zip(&values).enumerate() {
                out[(row, column)] = root * value;
            }
        }
    }

    fn conj_apply(
        &self,
        out: MatMut<'_, f64>,
        right: MatRef<'_, f64>,
        par: Par,
        stack: &mut MemStack,
    ) {
        self.apply(out, right, par, stack);
    }
}

/// The `count` lowest natural modes of `mesh` with the held nodes that `stiffness` was assembled without.
///
/// `go_on` is asked before every solve. Memory: the factor and `4 count` vectors of its size.
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
    // Any start that no mode is orthogonal to: a fixed sequence, so that the modes are the same every time.
    let start = Col::<f64>::from_fn(n, |row| {
        let bits = (row as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11;
        bits as f64 / (1u64 << 53) as f64 - 0.5
    });
    let start = &start * faer::Scale(1.0 / start.norm_l2());
    let mut memory = MemBuffer::new(partial_self_adjoint_eigen_scratch::<f64>(
        &operator,
        count,
        Par::Seq,
        Default::default(),
    ));
    let mut vectors = Mat::<f64>::zeros(n, count);
    let mut values = vec![0.0; count];
    // What is half written where it stops is dropped below.
    let found = catch_unwind(AssertUnwindSafe(|| {
        partial_self_adjoint_eigen(
            vectors.as_mut(),
            &mut values,
            &operator,
            start.as_ref(),
            1e-9,
            Par::Seq,
            MemStack::new(&mut memory),
            Default::default(),
        )
        .n_converged_eigen
    }));
    let found = match found {
        Ok(found) => found,
        Err(cause) if cause.is::<Stopped>() => return Err(LinearError::Stopped),
        Err(cause) => resume_unwind(cause),
    };
    if found < count || values.iter().any(|&value| value.is_nan() || value <= 0.0) {
        return Err(LinearError::NotConverged {
            asked: count,
            found,
        });
    }
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| values[b].total_cmp(&values[a]));
    let width = 3 * mesh.node_count();
    let mut modes = vec![0.0; count * width];
    for (mode, &column) in modes.chunks_exact_mut(width).zip(&order) {
        for (at, &node) in free.iter().enumerate() {
            for axis in 0..3 {
                let row = 3 * at + axis;
                mode[3 * node as usize + axis] = vectors[(row, column)] / root[row];
            }
        }
    }
    Ok(NaturalModes {
        frequency: order.iter().map(|&i| values[i].powf(-0.5)).collect(),
        modes,
    })
}
