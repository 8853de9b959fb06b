//! Linear elasticity of the same mesh: stiffness, factorisation, compliance and the
//! quasi-static response to prescribed contact displacements.
//!
//! The material is the small-strain limit of the reference's compressible neo-Hookean law
//! `S = mu J^(-2/3) (I - I1/3 C^-1) + kappa J (J - 1) C^-1`, that is `mu = E / (2 (1 + nu))`,
//! `kappa = E / (3 (1 - 2 nu))`, `lambda = kappa - 2 mu / 3`.
//!
//! With the stiffness `K` of the free degrees of freedom and the contact degrees of freedom `C`,
//! the static field that passes through prescribed displacements `c` is (Schur complement)
//!
//! ```text
//! A = K^-1,   f = A_CC^-1 c,   L(c) = A[:, C] f
//! ```
//!
//! Units: mm, mN, so stresses are mN/mm² (1 Pa = 1e-3 mN/mm²) and compliances mm/mN.

mod block_basis;
mod columns_file;
mod compliance;
mod error;
mod factor;
mod material;
mod natural_modes;
mod ordering;
mod refined;
mod response;
mod stiffness;

pub use block_basis::{Basis, Blocks, leading_directions};
pub use columns_file::{ColumnsError, ColumnsFile};
pub use compliance::{Compliance, compliance_columns, remaining_columns};
pub use error::LinearError;
pub use factor::{Factor, FactorStats};
pub use material::Lame;
pub use natural_modes::{NaturalModes, natural_modes};
pub use ordering::nested_dissection;
pub use response::{ContactFactor, ContactForces, LinearElastic, contact_forces};
pub use stiffness::{FreeNodes, Stiffness};

#[cfg(test)]
mod tests;
