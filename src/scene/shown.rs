//! What a step decodes and shows: the nodes of the host's region, and the attached points.

use std::sync::Arc;

use super::plan::NodePlan;
use super::points::AttachedPoints;
use super::published::SCENE;
use crate::bundle::Mesh;
use crate::error::Result;
use crate::memory::{self, HeldBytes};
use crate::prior::PriorTable;

/// See the module.
#[derive(HeldBytes)]
pub struct Shown {
    /// The nodes that a step decodes: all, or those of the region and of the attached points' tetrahedra.
    pub plan: NodePlan,
    #[held(own)]
    pub points: Arc<AttachedPoints>,
    /// Tetrahedra whose four nodes are decoded, which the guard checks for inversion; empty where it does not check.
    pub tets: Vec<u32>,
}

impl Shown {
    /// Every node of a mesh, and no points.
    pub fn all(mesh: &Mesh, table: Option<&PriorTable>, checks_inversion: bool) -> Result<Shown> {
        Ok(Shown {
            plan: NodePlan::all(mesh.node_count(), table)?,
            points: Arc::default(),
            tets: match checks_inversion {
                true => memory::copied(&mesh.tets, SCENE)?,
                false => Vec::new(),
            },
        })
    }

    /// Whether each node of the mesh is decoded.
    pub fn has_all(&self, mesh: &Mesh) -> bool {
        self.plan.nodes().len() == mesh.node_count()
    }

    /// Whether two fields `[K,3]` are equal at the nodes that are decoded.
    pub fn is_equal(&self, mesh: &Mesh, one: &[f32], other: &[f32]) -> bool {
        if self.has_all(mesh) {
            return one == other;
        }
        self.plan.nodes().iter().all(|&node| {
            let at = 3 * node as usize;
            one[at..at + 3] == other[at..at + 3]
        })
    }
}
