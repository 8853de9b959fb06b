//! The implicit step: what makes the next state where tools touch the tissue or forces act on it.
//!
//! | module | holds |
//! |---|---|
//! | [`contact`] | tools, the samples near them, their forces with friction at a given compliance of the tissue |
//! | [`corrections`] | BDF2 on the nonlinear elements, preconditioned L-BFGS around the contact, substeps, the error's estimate |
//!
//! A step in order is `docs/reference/step.md` of the repository. Lengths are mm; forces are mN outside of the solver and µN inside of it.

pub mod contact;
pub mod corrections;

// The layers below, under the names that the modules here know them by.
use ::{bundle, kernels, prior};
use ::field::{self, clock, error, memory, stored};
pub use error::{Error, Result};
