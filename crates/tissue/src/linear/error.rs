//! What can go wrong in linear elasticity, each with the index that caused it.

use thiserror::Error;

/// Errors of [`crate::linear`].
#[derive(Debug, Error)]
pub enum LinearError {
    /// A tetrahedron names a node that does not exist.
    #[error("tetrahedron {tet} names node {node}, but the mesh has {nodes} nodes")]
    Node { tet: usize, node: u32, nodes: usize },
    /// A tetrahedron is inverted or flat.
    #[error(
        "tetrahedron {tet} has volume {volume:.3e} mm³: repair the mesh (`upt mesh info` lists such elements)"
    )]
    Volume { tet: usize, volume: f64 },
    /// Young's modulus or Poisson's ratio outside of their ranges.
    #[error("material {field} = {value}: {expected}")]
    Material {
        field: &'static str,
        value: f64,
        expected: &'static str,
    },
    /// Nothing is held, so the stiffness is singular.
    #[error("no node is held: a static response needs a held set (`fixed` of the mesh)")]
    NothingHeld,
    /// A free node belongs to no tetrahedron.
    #[error("node {node} belongs to no tetrahedron: remove it from the mesh")]
    Loose { node: usize },
    /// The factorisation failed: a part of the mesh is not connected to a held node.
    #[error(
        "the stiffness is not positive definite ({cause}): a component of the mesh has no held node"
    )]
    Indefinite { cause: String },
    /// The factor does not fit in memory.
    #[error("sparse factorisation: {0}")]
    Factor(String),
    /// A contact node is held or does not exist.
    #[error("contact node {node} is held or is not one of the mesh's {nodes} nodes")]
    Contact { node: u32, nodes: usize },
    /// Prescribed displacements and nodes differ in number.
    #[error("{nodes} contact nodes but {vectors} contact vectors")]
    Count { nodes: usize, vectors: usize },
    /// More natural modes than the mesh can have.
    #[error(
        "{asked} natural modes of {dofs} free degrees of freedom are too many; ask for fewer than half as many modes as degrees of freedom"
    )]
    Modes { asked: usize, dofs: usize },
    /// The iteration for the natural modes ended early.
    #[error("only {found} of {asked} natural modes converged; ask for fewer")]
    NotConverged { asked: usize, found: usize },
    /// The caller wanted no more of it.
    #[error("stopped before its end")]
    Stopped,
    /// A sink of columns failed.
    #[error("writing compliance columns: {0}")]
    Sink(#[from] std::io::Error),
}
