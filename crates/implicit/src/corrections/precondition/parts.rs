//! What the preconditioner is made of, for one length of step and one set of prescribed nodes.

use crate::corrections::whole::WholeSolve;
use crate::kernels::contact::ContactFactor;
use crate::kernels::rows::RowPlan;
use crate::memory::HeldBytes;

/// What inertia makes of the natural modes at the length of the steps, by mode.
#[derive(HeldBytes)]
pub struct Modal {
    /// What it takes off the static compliance: `(1/w² - 1/(w² + kappa)) / m`, mm/mN.
    pub inertial_compliance: Vec<f32>,
    /// `1 / (m (w² + kappa))`, mm/µN.
    pub moved_freely: Vec<f32>,
}

/// How fields lie on the block-wise bases.
#[derive(HeldBytes)]
pub struct Basis {
    /// Where each block of the basis begins in the coordinates.
    pub starts: Vec<usize>,
    /// All nodes, as rows of the basis.
    pub plan: RowPlan,
    /// Nodes of the domain, which tools touch.
    pub domain: RowPlan,
    pub domain_nodes: Vec<u32>,
}

/// The contact that is prescribed, on the prior's columns.
#[derive(HeldBytes)]
pub struct PrescribedContact {
    /// Contact dofs with columns, as rows of the prior's tables.
    pub dofs: Vec<u32>,
    /// Their columns, one for three of those.
    pub columns: Vec<u32>,
    /// `A_k,CC`.
    pub compliance: ContactFactor,
    /// `R^-T Phi_C [3m,r]` with `R^T R = A_k,CC`.
    pub whitened: Vec<f64>,
    /// A row of what inertia takes off the compliance, and the natural modes at the contact by mode `[n,3m]`.
    pub lost: Vec<f32>,
    pub natural: Vec<f32>,
    /// Displacements at the prescribed degrees of freedom, mm, and the forces that belong to them, mN.
    pub moved: Vec<f32>,
    pub forces: Vec<f32>,
    /// Rows of the tables that degrees of freedom have.
    pub stored: Vec<u32>,
    /// Scratch of what the compliance is gathered with.
    pub widened: Vec<f32>,
}

/// `Phi^T (K + kappa M) Phi` `[r,r]`: the coarse level.
#[derive(HeldBytes)]
pub struct Galerkin {
    /// Factor of `Psi^T (K + kappa M) Psi`, with the contact held.
    pub held: ContactFactor,
    /// Without contact.
    pub free: Vec<f64>,
    /// The latter in f32, for products, and its inverse: local iterations solve it many times and hold no contact in it.
    pub narrow: Vec<f32>,
    pub inverse: Vec<f32>,
}

/// The whole modes in the coarse level.
#[derive(Default, HeldBytes)]
pub struct WholeLevel {
    /// Made at the first step with a load.
    pub solve: Option<Box<WholeSolve>>,
    /// Whether the step has loads: then the whole modes are part of the coarse level.
    pub has_load: bool,
    /// The support groups that were let go when it was made.
    pub let_go: u64,
}
