//! The quasi-static response `L(c)` of a mesh to prescribed contact displacements.

use crate::mesh::Mesh;

use super::{Compliance, Factor, Lame, LinearError, Stiffness, compliance_columns};
use faer::linalg::solvers::{Llt, Solve};
use faer::{Mat, Side};

/// Forces that produce prescribed displacements.
#[derive(Debug, Clone)]
pub struct ContactForces {
    /// `[m,3]` row-major, mN.
    pub forces: Vec<f64>,
    /// Added to the diagonal, relative to its mean, because the block was singular (0 if it was not).
    pub regularisation: f64,
}

/// Factor of the compliance of a contact set with itself, `A_CC`.
#[derive(Debug, Clone)]
pub struct ContactFactor {
    llt: Llt<f64>,
    size: usize,
    /// Added to the diagonal, relative to its mean, because the block was singular (0 if it was not).
    pub regularisation: f64,
}

impl ContactFactor {
    /// Factorises the block of `rows` (indices into the compliance's nodes).
    ///
    /// A block that is not positive definite gets `1e-9 .. 1e-3` of its mean diagonal added.
    ///
    /// # Errors
    /// The block stays singular.
    pub fn new(compliance: &Compliance, rows: &[usize]) -> Result<Self, LinearError> {
        let stride = 3 * compliance.nodes.len();
        let size = 3 * rows.len();
        let dof = |i: usize| 3 * rows[i / 3] + i % 3;
        let mean = (0..size)
            .map(|i| compliance.block[dof(i) * stride + dof(i)])
            .sum::<f64>()
            / size.max(1) as f64;
        for regularisation in [0.0, 1e-9, 1e-6, 1e-3] {
            let block = Mat::from_fn(size, size, |i, j| {
                let diagonal = if i == j { regularisation * mean } else { 0.0 };
                compliance.block[dof(i) * stride + dof(j)] + diagonal
            });
            if let Ok(llt) = block.llt(Side::Lower) {
                return Ok(Self {
                    llt,
                    size,
                    regularisation,
                });
            }
        }
        Err(LinearError::Indefinite {
            cause: "the compliance of the contact nodes is singular".to_string(),
        })
    }

    /// Forces `[3m]` (mN) that move the contact nodes by `vectors [3m]` (mm).
    ///
    /// # Panics
    /// If `vectors` is shorter than the block.
    pub fn forces(&self, vectors: &[f64]) -> Vec<f64> {
        let right = Mat::from_fn(self.size, 1, |i, _| vectors[i]);
        let solved = self.llt.solve(&right);
        (0..self.size).map(|i| solved[(i, 0)]).collect()
    }
}

/// `f = A_CC^-1 c` for `rows` of the compliance (indices into its nodes) and vectors `c` `[m,3]`, mm.
///
/// # Errors
/// Numbers of rows and vectors differ; the block stays singular (see [`ContactFactor::new`]).
pub fn contact_forces(
    compliance: &Compliance,
    rows: &[usize],
    vectors: &[[f64; 3]],
) -> Result<ContactForces, LinearError> {
    if rows.len() != vectors.len() {
        return Err(LinearError::Count {
            nodes: rows.len(),
            vectors: vectors.len(),
        });
    }
    let factor = ContactFactor::new(compliance, rows)?;
    Ok(ContactForces {
        forces: factor.forces(vectors.as_flattened()),
        regularisation: factor.regularisation,
    })
}

/// A mesh with its factor and the mutual compliance of the nodes that may be touched.
pub struct LinearElastic {
    stiffness: Stiffness,
    factor: Factor,
    compliance: Compliance,
}

impl LinearElastic {
    /// Assembles, factorises and solves for the compliance of `contact_nodes` (ascending, not held).
    ///
    /// # Errors
    /// See [`LinearError`].
    pub fn new(
        mesh: &Mesh,
        held: &[u32],
        contact_nodes: &[u32],
        lame: Lame,
        threads: usize,
    ) -> Result<Self, LinearError> {
        let stiffness = Stiffness::assemble(mesh, held, lame)?;
        let factor = Factor::new(&stiffness, &mesh.positions, threads)?;
        let compliance = compliance_columns(&stiffness, &factor, contact_nodes, 48, |_, _| Ok(()))?;
        Ok(Self {
            stiffness,
            factor,
            compliance,
        })
    }

    /// The mutual compliance of the contact nodes.
    pub fn compliance(&self) -> &Compliance {
        &self.compliance
    }

    /// `L(c)` `[K,3]`, mm: zero at held nodes, exactly `c` at the contact nodes (up to round-off).
    ///
    /// Contact nodes without a compliance column are ignored and returned as the second value.
    ///
    /// # Errors
    /// Numbers of nodes and vectors differ; a singular contact block.
    pub fn response(
        &self,
        nodes: &[u32],
        vectors: &[[f32; 3]],
    ) -> Result<(Vec<[f32; 3]>, Vec<u32>), LinearError> {
        if nodes.len() != vectors.len() {
            return Err(LinearError::Count {
                nodes: nodes.len(),
                vectors: vectors.len(),
            });
        }
        let mut rows = Vec::new();
        let mut prescribed = Vec::new();
        let mut ignored = Vec::new();
        for (&node, vector) in nodes.iter().zip(vectors) {
            match self.compliance.nodes.binary_search(&node) {
                Ok(row) => {
                    rows.push(row);
                    prescribed.push(vector.map(f64::from));
                }
                Err(_) => ignored.push(node),
            }
        }
        let mut field = vec![[0.0f32; 3]; self.stiffness.free.index.len()];
        if rows.is_empty() {
            return Ok((field, ignored));
        }
        let forces = contact_forces(&self.compliance, &rows, &prescribed)?.forces;
        let mut solution = vec![0.0; self.stiffness.dofs()];
        for (at, &row) in rows.iter().enumerate() {
            let node = self.compliance.nodes[row];
            let free = self.stiffness.free.get(node).ok_or(LinearError::Contact {
                node,
                nodes: field.len(),
            })?;
            solution[3 * free..3 * free + 3].copy_from_slice(&forces[3 * at..3 * at + 3]);
        }
        self.factor.solve(&mut solution);
        for (free, &node) in self.stiffness.free.nodes.iter().enumerate() {
            for axis in 0..3 {
                field[node as usize][axis] = solution[3 * free + axis] as f32;
            }
        }
        Ok((field, ignored))
    }
}
