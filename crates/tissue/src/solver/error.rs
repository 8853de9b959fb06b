//! Why a simulation could not start or go on.

use crate::material::MaterialError;
use crate::mesh::MeshError;

/// A solver failure; the solver's state is then that of the last whole frame.
#[derive(Debug, thiserror::Error)]
pub enum SolverError {
    #[error(transparent)]
    Material(#[from] MaterialError),
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error("no memory for the elements of the mesh: {0}")]
    Memory(#[from] std::collections::TryReserveError),
    #[error(
        "instruction set {0:?} is not available on this processor; leave `isa` unset to detect"
    )]
    IsaUnavailable(lanes::Isa),
    #[error("cannot start {threads} solver threads: {reason}")]
    Threads { threads: usize, reason: String },
    #[error("solver option `{field}` is {value}; it must be {wanted}")]
    Option {
        field: &'static str,
        value: f64,
        wanted: &'static str,
    },
    #[error(transparent)]
    Topology(#[from] topology::TopologyError),
    #[error("tools[{index}]: {reason}")]
    Tool { index: usize, reason: String },
    #[error(
        "{poses} poses for {tools} tools; give each tool one pose (`step_frame` alone moves no tools)"
    )]
    ToolCount { tools: usize, poses: usize },
    #[error("ties[{index}]: {reason}")]
    Tie { index: usize, reason: String },
    #[error("loads.{field} {reason}")]
    Load { field: String, reason: String },
    #[error("contact entry {index} (node {node}): {reason}")]
    Contact {
        index: usize,
        node: u32,
        reason: &'static str,
    },
    #[error(
        "t = {time_s:.4} s: the inner step of {step_ms:.4} ms is above {allowed_ms:.4} ms, the stable part of the critical step {critical_ms:.4} ms; ask for a shorter step or allow substeps"
    )]
    StepTooLong {
        time_s: f64,
        step_ms: f64,
        allowed_ms: f64,
        critical_ms: f64,
    },
    #[error(
        "t = {time_s:.4} s: element {element} inverted (det F {det_f:.3}) with an inner step of {step_ms:.4} ms; the load is beyond what this mesh can carry: push less, slower, or on more faces"
    )]
    Inverted {
        time_s: f64,
        element: usize,
        det_f: f64,
        step_ms: f64,
    },
    #[error(
        "t = {time_s:.4} s: diverged at node {node} near element {element} ({cause}) with an inner step of {step_ms:.4} ms"
    )]
    Diverged {
        time_s: f64,
        node: usize,
        element: usize,
        cause: &'static str,
        step_ms: f64,
    },
}

impl SolverError {
    /// Whether the load is more than the mesh can carry, so that the frames before it are sound.
    pub fn is_load(&self) -> bool {
        matches!(self, Self::Inverted { .. } | Self::Diverged { .. })
    }
}
