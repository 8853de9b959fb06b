//! What the readers of a scene know of its tissue: what it is, and the states that steps have published.

use std::sync::{Arc, RwLock};

use super::published::Published;
use crate::bundle::Mesh;
use crate::corrections::Integrator;
use crate::model::Model;

/// Lent by a scene for a call.
#[derive(Clone, Copy)]
pub struct Tissue<'a> {
    pub published: &'a RwLock<Published>,
    pub model: &'a Arc<Model>,
    pub mesh: &'a Arc<Mesh>,
    /// Nodes of the mesh before any cut.
    pub intact_nodes: usize,
    /// The length of a step and the damping.
    pub integrator: Integrator,
}
