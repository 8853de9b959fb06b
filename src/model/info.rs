//! What a model is.

use crate::options::{Precision, Provider};

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
    /// Precision of the graphs that run: float32, float16 or int8.
    pub precision: Precision,
    /// Bytes held by the model.
    pub memory_bytes: u64,
    /// Wall time of opening, s.
    pub load_seconds: f64,
    /// [`crate::SceneOptions::step_s`] for a scene that presents and corrects as the bundle recommends, s; `dt` where the bundle recommends
    /// no other.
    pub frame_step_s: f64,
}
