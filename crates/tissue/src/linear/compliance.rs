//! Compliance columns of the contact nodes: the static response to a unit force at each of their
//! degrees of freedom, and their mutual block `A` (mm/mN).

use super::{Factor, LinearError, Stiffness};

/// Mutual compliance of the contact nodes.
#[derive(Debug, Clone)]
pub struct Compliance {
    /// Nodes, ascending.
    pub nodes: Vec<u32>,
    /// `[3D,3D]` row-major, symmetric, mm/mN; dof order `3 * node + axis`.
    pub block: Vec<f64>,
}

/// Solves for all columns of `nodes` (ascending, free), `batch` right-hand sides at a time.
///
/// `sink` receives `(first column, rows [count, 3K] f32)`, each row a whole-mesh field with zeros at
/// held nodes. Memory: the factor and two times `batch * 3K * 8` bytes.
///
/// # Errors
/// A held node among `nodes`; whatever the sink returns.
pub fn compliance_columns(
    stiffness: &Stiffness,
    factor: &Factor,
    nodes: &[u32],
    batch: usize,
    sink: impl FnMut(usize, &[f32]) -> Result<(), LinearError>,
) -> Result<Compliance, LinearError> {
    let none = |_, _: &mut [f32]| Ok(());
    remaining_columns(stiffness, factor, nodes, batch, 0, none, sink)
}

/// The same where the first `done` columns are known: `known` writes column `i` into its row `[3K]`.
///
/// Solves are made in the same batches as without them if `done` is a multiple of `batch`.
///
/// # Errors
/// A held node among `nodes`; whatever `known` or the sink returns.
pub fn remaining_columns(
    stiffness: &Stiffness,
    factor: &Factor,
    nodes: &[u32],
    batch: usize,
    done: usize,
    mut known: impl FnMut(usize, &mut [f32]) -> Result<(), LinearError>,
    mut sink: impl FnMut(usize, &[f32]) -> Result<(), LinearError>,
) -> Result<Compliance, LinearError> {
    let count = stiffness.free.index.len();
    let n = stiffness.dofs();
    let mut dofs = Vec::with_capacity(3 * nodes.len());
    for &node in nodes {
        let free = stiffness
            .free
            .get(node)
            .ok_or(LinearError::Contact { node, nodes: count })?;
        dofs.extend((0..3).map(|axis| 3 * free + axis));
    }
    let mut block = vec![0.0; dofs.len() * dofs.len()];
    let mut solution = Vec::new();
    let mut field = Vec::new();
    let done = done.min(dofs.len());
    field.resize(3 * count, 0.0);
    for column in 0..done {
        known(column, &mut field)?;
        for (row, &dof) in dofs.iter().enumerate() {
            let node = stiffness.free.nodes[dof / 3] as usize;
            block[row * dofs.len() + column] = f64::from(field[3 * node + dof % 3]);
        }
    }
    for first in (done..dofs.len()).step_by(batch.max(1)) {
        let last = (first + batch.max(1)).min(dofs.len());
        solution.clear();
        solution.resize((last - first) * n, 0.0);
        for (at, &dof) in dofs[first..last].iter().enumerate() {
            solution[at * n + dof] = 1.0;
        }
        // Columns are kept in float32.
        factor.solve_to(&mut solution, 1e-6);
        field.clear();
        field.resize((last - first) * 3 * count, 0.0f32);
        for (at, column) in solution.chunks_exact(n).enumerate() {
            let out = &mut field[at * 3 * count..(at + 1) * 3 * count];
            for (free, &node) in stiffness.free.nodes.iter().enumerate() {
                for axis in 0..3 {
                    out[3 * node as usize + axis] = column[3 * free + axis] as f32;
                }
            }
            for (row, &dof) in dofs.iter().enumerate() {
                block[row * dofs.len() + first + at] = column[dof];
            }
        }
        sink(first, &field)?;
    }
    for i in 0..dofs.len() {
        for j in 0..i {
            let mean = 0.5 * (block[i * dofs.len() + j] + block[j * dofs.len() + i]);
            block[i * dofs.len() + j] = mean;
            block[j * dofs.len() + i] = mean;
        }
    }
    Ok(Compliance {
        nodes: nodes.to_vec(),
        block,
    })
}
