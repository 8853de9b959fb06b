//! What can be wrong with a file to import, and what a repair did about it.

use super::found_body::FoundBody;
use crate::mesh::MeshError;
use crate::stuffing::StuffError;
use std::path::PathBuf;

/// Nodes that are suggested at most.
const MOST_NODES: u64 = 500_000;

/// A file that cannot become a mesh.
#[derive(Debug, thiserror::Error)]
pub enum ImportError {
    #[error("{path}: {error}")]
    Io {
        path: PathBuf,
        error: std::io::Error,
    },
    #[error(
        "{path}: unknown extension; use .vtk, .vtu, .msh, .inp, .feb, .mesh, .node or .ele (tetrahedra), .stl, .obj, .ply, .off or .vtp (closed surface); label volumes (.nii, .nii.gz, .nrrd, .mha) are read by the commands `upt make` and `upt mesh import`"
    )]
    Extension { path: PathBuf },
    #[error("{path}: {reason}")]
    Format { path: PathBuf, reason: String },
    #[error(
        "{path}: element {element} is {kind}; only tetrahedra can be imported; mesh the volume again with tetrahedra"
    )]
    ElementKind {
        path: PathBuf,
        element: usize,
        kind: String,
    },
    #[error(
        "a surface must be filled; give the number of nodes (--nodes) or a spacing in mm (--spacing)"
    )]
    NoResolution,
    #[error(
        "scale {0} is not a positive number; give millimetres per unit of the file, such as 1000 for metres"
    )]
    Scale(f64),
    #[error(
        "the tetrahedra would {} the {volume_ml:.1} ml that the surface bounds: its thinnest place, {thickness_mm:.2} mm near {at:.1?} mm, \
         is thinner than they are; {}",
        match share {
            Some(share) if *share < 97.0 => format!("hold {share:.0} % of"),
            Some(_) => "leave holes in the walls of".to_owned(),
            None => "hold only a part of".to_owned(),
        },
        match nodes {
            0..=MOST_NODES => format!("give about --nodes {nodes}, or a thicker surface"),
            _ => "give a thicker surface, no number of nodes that can be simulated resolves it".to_owned(),
        }
    )]
    Thin {
        volume_ml: f64,
        /// Of the volume, %; none where it was not worth trying.
        share: Option<f64>,
        thickness_mm: f64,
        at: [f64; 3],
        nodes: u64,
    },
    #[error(
        "node {node} has a non-finite coordinate; repair the file, or drop its elements with --repair"
    )]
    NonFinite { node: usize },
    #[error("{element} {index} names node {node}, but there are {count} nodes")]
    NodeOutOfRange {
        element: &'static str,
        index: usize,
        node: u32,
        count: usize,
    },
    #[error(
        "tet {tet} is inverted (volume {volume_mm3:.3e} mm³), {count} in all; --repair swaps two of its nodes"
    )]
    Inverted {
        tet: usize,
        volume_mm3: f64,
        count: usize,
    },
    #[error(
        "tet {tet} is degenerate (volume {volume_mm3:.3e} mm³), {count} in all; --repair drops it, but meshing again (or --refill) is better"
    )]
    Degenerate {
        tet: usize,
        volume_mm3: f64,
        count: usize,
    },
    #[error("node {node} belongs to no tetrahedron, {count} in all; --repair drops them")]
    Unreferenced { node: usize, count: usize },
    #[error(
        "the file holds {} bodies, of which one can be simulated: {why}. A closed surface inside another bounds a void only if it faces \
         inward{}",
        bodies.len(),
        super::found_body::list(bodies)
    )]
    Bodies { why: String, bodies: Vec<FoundBody> },
    #[error("tets {first} and {second} have the same four nodes; --repair drops the second")]
    Duplicate { first: usize, second: usize },
    #[error(
        "the surface is open: edge {edge:?} of face {face} (at {at:?} mm) has no other face, {count} such edges; close it in a mesh editor"
    )]
    Open {
        edge: [u32; 2],
        face: usize,
        at: [f64; 3],
        count: usize,
    },
    #[error(
        "edge {edge:?} of face {face} (at {at:?} mm) has {faces} faces; a closed surface has two at each edge (--repair drops repeated faces)"
    )]
    SurfaceEdge {
        edge: [u32; 2],
        face: usize,
        at: [f64; 3],
        faces: usize,
    },
    #[error(
        "faces {first} and {second} run along edge {edge:?} in the same direction: one is turned inside out; --repair turns it"
    )]
    Orientation {
        first: usize,
        second: usize,
        edge: [u32; 2],
    },
    #[error("the surface is inside out (volume {volume_mm3:.3e} mm³); --repair turns it")]
    InsideOut { volume_mm3: f64 },
    #[error(
        "face {face} is degenerate: it names the same point twice, {count} in all; --repair drops it"
    )]
    DegenerateFace { face: usize, count: usize },
    #[error(
        "the surface passes through itself: an edge of face {first} goes {depth_mm:.2} mm through face {second} (at {at:?} mm), {count} \
         such places; re-mesh it or remove the overlap in a mesh editor (--repair accepts shallow places)"
    )]
    SelfCrossing {
        first: usize,
        second: usize,
        at: [f64; 3],
        depth_mm: f64,
        count: usize,
    },
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error(transparent)]
    Stuffing(#[from] StuffError),
}

/// What is wrong with the content of a file, which it does not name.
#[derive(Debug)]
pub(super) enum Fault {
    Text(String),
    /// A volume that is no tetrahedron.
    Kind {
        element: usize,
        kind: String,
    },
}

pub(super) fn fault<T>(reason: impl Into<String>) -> Result<T, Fault> {
    Err(Fault::Text(reason.into()))
}

impl From<String> for Fault {
    fn from(reason: String) -> Self {
        Self::Text(reason)
    }
}

impl Fault {
    /// With the name of its file.
    pub(super) fn of(self, path: &std::path::Path) -> ImportError {
        match self {
            Self::Text(reason) => ImportError::format(path, &reason),
            Self::Kind { element, kind } => ImportError::ElementKind {
                path: path.into(),
                element,
                kind: plain(&kind),
            },
        }
    }
}

/// One line without signs that a terminal acts on, whatever words of a file are in it.
fn plain(reason: &str) -> String {
    let shown = |c: char| if c.is_control() { '?' } else { c };
    reason.chars().take(1000).map(shown).collect()
}

impl ImportError {
    /// What is wrong with a file, in words.
    pub(super) fn format(path: &std::path::Path, reason: &str) -> Self {
        Self::Format {
            path: path.into(),
            reason: plain(reason),
        }
    }

    /// The refusal of a thin place with another number of nodes.
    pub(super) fn with_nodes(mut self, count: u64) -> Self {
        if let Self::Thin { nodes, .. } = &mut self {
            *nodes = count;
        }
        self
    }

    /// Whether the message names the file; the other faults are found after reading.
    pub fn names_file(&self) -> bool {
        matches!(
            self,
            Self::Io { .. }
                | Self::Extension { .. }
                | Self::Format { .. }
                | Self::ElementKind { .. }
        )
    }
}

/// A change that made a file importable; printed by `upt mesh import`.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Repair {
    /// What was done, in words.
    pub what: &'static str,
    /// How many elements.
    pub count: usize,
    /// The first of them, by its number in the file.
    pub first: usize,
}

impl std::fmt::Display for Repair {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}, first {}", self.what, self.count, self.first)
    }
}
