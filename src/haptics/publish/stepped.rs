//! A published state, as hands are told of it.

use crate::contact::ContactProblem;
use crate::corrections::{Corrections, Integrator, Motion};
use crate::kernels::Compute;
use crate::prior::PriorTable;

/// A published state.
pub struct Stepped<'a> {
    pub compute: Compute<'a>,
    pub prior: &'a PriorTable,
    pub corrections: &'a Corrections,
    pub motion: &'a Motion,
    pub problem: Option<&'a ContactProblem>,
    /// `[K,3]`, mm.
    pub rest: &'a [f32],
    pub u: &'a [f32],
    /// Time that the step took, s.
    pub took_s: f64,
    /// Length of a step, s, and damping, 1/s.
    pub integrator: Integrator,
    /// Support groups that are let go, a bit each.
    pub let_go: u64,
}
