//! [`Model`]: a bundle made ready to step. Immutable, shared by scenes, safe from any thread.

use std::path::Path;
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::options::{IndexSet, ModelOptions, Precision, Provider};

/// The bundle kinds (values of `UPT_KIND_*`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(i32)]
pub enum Kind {
    /// A Universal Physics Transformer.
    Upt = 0,
    /// Linear elasticity with a learned correction in reduced coordinates.
    Reduced = 1,
}

/// What a model is.
#[derive(Debug, Clone, Copy)]
pub struct ModelInfo {
    /// Kind of the bundle.
    pub kind: Kind,
    /// Mesh nodes, `K`.
    pub node_count: u64,
    /// Tetrahedra.
    pub tet_count: u64,
    /// Boundary triangles.
    pub surface_face_count: u64,
    /// Nodes that instruments may touch.
    pub domain_node_count: u64,
    /// Nodes held at zero.
    pub held_node_count: u64,
    /// Supernodes; 0 for kind `reduced`.
    pub supernode_count: u64,
    /// Step, s.
    pub dt: f32,
    /// Largest push of the training data, mm.
    pub max_push_mm: f32,
    /// Where the latent stage runs.
    pub provider: Provider,
    /// Precision that runs.
    pub precision: Precision,
    /// Bytes held by the model.
    pub memory_bytes: u64,
    /// Wall time of opening, s.
    pub load_seconds: f64,
}

/// A bundle made ready to step.
pub struct Model {}

impl Model {
    /// Opens and validates the bundle in the folder `path`.
    pub fn open(path: &Path, options: &ModelOptions) -> Result<Arc<Model>> {
        let _ = options;
        Err(Error::Unsupported(path.display().to_string()))
    }

    /// What the model is.
    pub fn info(&self) -> ModelInfo {
        unreachable!("a model cannot be opened yet")
    }

    /// JSON: name, bundle hash, provider of each stage and why others were not taken.
    pub fn describe_json(&self) -> String {
        String::new()
    }

    /// Rest positions `[K,3]`, mm.
    pub fn positions(&self) -> &[f32] {
        &[]
    }

    /// A static index set.
    pub fn indices(&self, set: IndexSet) -> &[u32] {
        let _ = set;
        &[]
    }
}
