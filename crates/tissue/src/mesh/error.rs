//! What can be wrong with a mesh, each with the offending element and the fix.

use std::path::PathBuf;

/// A mesh that cannot be read or used.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    #[error("{path}: {source}")]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{path}: not a safetensors file ({reason})")]
    NotSafetensors { path: PathBuf, reason: String },
    #[error("{path}: field `{field}` {reason}")]
    Field {
        path: PathBuf,
        field: String,
        reason: String,
    },
    #[error("node {node} has a non-finite coordinate; repair the source mesh")]
    NonFinite { node: usize },
    #[error("`{field}` row {row} names node {node}, but the mesh has {count} nodes")]
    NodeOutOfRange {
        field: &'static str,
        row: usize,
        node: u32,
        count: usize,
    },
    #[error("tet {tet} names node {node} twice; remove the element")]
    RepeatedNode { tet: usize, node: u32 },
    #[error(
        "tet {tet} is inverted (volume {volume_mm3:.3e} mm³); swap two of its nodes or re-import with `upt mesh import`"
    )]
    InvertedTet { tet: usize, volume_mm3: f64 },
    #[error("tet {tet} is degenerate (volume {volume_mm3:.3e} mm³); re-mesh the region around it")]
    DegenerateTet { tet: usize, volume_mm3: f64 },
    #[error(
        "node {node} belongs to no tetrahedron ({count} such nodes); drop them, as `upt mesh import` does"
    )]
    UnreferencedNode { node: usize, count: usize },
    #[error("face of nodes {nodes:?} belongs to {count} tetrahedra; a mesh allows two at most")]
    OverusedFace { nodes: [u32; 3], count: usize },
    #[error(
        "surface row {row} (nodes {nodes:?}) is not an outward boundary face of the tetrahedra; rebuild `surface` with `upt mesh import`"
    )]
    NotBoundary { row: usize, nodes: [u32; 3] },
    #[error("the tetrahedra have {expected} boundary faces, but `surface` lists {found}")]
    SurfaceCount { expected: usize, found: usize },
    #[error("`domain` entry {index} names surface row {row}, but there are {count} rows")]
    DomainOutOfRange {
        index: usize,
        row: u32,
        count: usize,
    },
    #[error(
        "`{field}` must be ascending without repeats; entry {index} ({value}) is not above its predecessor"
    )]
    NotAscending {
        field: &'static str,
        index: usize,
        value: u32,
    },
    #[error("node {node} is in both `fixed` and `supported`; list it in `fixed` alone")]
    NotDisjoint { node: u32 },
    #[error(
        "`stiffness` of tet {tet} is {value}; it must be finite and positive (1 for the material's own)"
    )]
    Stiffness { tet: usize, value: f32 },
    #[error(
        "`stiffness` has {found} numbers, but there are {expected} tetrahedra; give one number per tetrahedron, or none"
    )]
    StiffnessCount { expected: usize, found: usize },
    #[error(transparent)]
    Laws(#[from] elements::MaterialError),
    #[error("the mesh has no {what}")]
    Empty { what: &'static str },
}
