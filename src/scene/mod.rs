//! [`Scene`]: a tissue that is stepped. One thread at a time; a call while another thread steps it is [`Error::Busy`].

use std::sync::Arc;
use std::time::Duration;

use crate::error::{Error, Result};
use crate::model::Model;
use crate::options::SceneOptions;
use crate::stats::SceneStats;

/// The collision field `c` of a step: what the instruments impose at its end.
#[derive(Debug, Clone, Copy)]
pub enum Contact<'a> {
    /// No contact.
    None,
    /// `[K,3]`, mm, zero but at nodes in contact.
    Dense(&'a [f32]),
    /// Nodes in contact and their displacement.
    Sparse {
        /// Node indices, each at most once, in any order.
        nodes: &'a [u32],
        /// `[m,3]`, mm.
        vectors: &'a [f32],
    },
}

/// Inputs of a step.
#[derive(Debug, Clone, Copy)]
pub struct StepInput<'a> {
    /// Current displacement `[K,3]`, mm; `None` takes the scene's own state.
    pub displacement: Option<&'a [f32]>,
    /// Collision field.
    pub contact: Contact<'a>,
}

/// What has become of a submitted step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// It has finished, or nothing was submitted since the last one finished.
    Done,
    /// It has not finished.
    Pending,
}

/// A tissue that is stepped. All methods take `&self`; concurrent use gives [`Error::Busy`], never a wait.
pub struct Scene {}

impl Scene {
    /// Makes a scene at rest.
    pub fn new(model: Arc<Model>, options: &SceneOptions) -> Result<Scene> {
        let _ = (model, options);
        Err(Error::Unsupported("scene".into()))
    }
    /// The model of this scene.
    pub fn model(&self) -> &Arc<Model> {
        unreachable!("a scene cannot be made yet")
    }
    /// Back to rest.
    pub fn reset(&self) -> Result<()> {
        Ok(())
    }
    /// One step of `dt`; `out` is `[n,3]` (n: `K`, or the region's count).
    pub fn step(&self, input: StepInput<'_>, out: Option<&mut [f32]>) -> Result<()> {
        let _ = (input, out);
        Ok(())
    }
    /// The last published state, `[n,3]`, mm, region order.
    pub fn read(&self, out: &mut [f32]) -> Result<()> {
        let _ = out;
        Ok(())
    }
    /// Nodes of the scene's mesh, `K`.
    pub fn node_count(&self) -> usize {
        0
    }
    /// Nodes of `read` (`K`, or the region's count).
    pub fn region_count(&self) -> usize {
        0
    }
    /// Restricts output to these nodes (any order); `None` is all nodes.
    pub fn set_region(&self, nodes: Option<&[u32]>) -> Result<()> {
        let _ = nodes;
        Ok(())
    }
    /// Displacement `[n,3]` of any nodes in the last state.
    pub fn decode(&self, nodes: &[u32], out: &mut [f32]) -> Result<()> {
        let _ = (nodes, out);
        Ok(())
    }
    /// Attaches points `[n,3]` in rest mm; `None` detaches.
    pub fn attach_points(&self, points: Option<&[f32]>) -> Result<()> {
        let _ = points;
        Ok(())
    }
    /// Number of attached points.
    pub fn point_count(&self) -> usize {
        0
    }
    /// Displacement `[n,3]` at the attached points in the last state.
    pub fn read_points(&self, out: &mut [f32]) -> Result<()> {
        let _ = out;
        Ok(())
    }
    /// Between the state before (`alpha` 0) and the last state (1), region order.
    pub fn sample(&self, alpha: f64, out: &mut [f32]) -> Result<()> {
        let _ = (alpha, out);
        Ok(())
    }
    /// As [`Scene::sample`], at the attached points.
    pub fn sample_points(&self, alpha: f64, out: &mut [f32]) -> Result<()> {
        let _ = (alpha, out);
        Ok(())
    }
    /// Starts a step on the scene's worker.
    pub fn submit(&self, nodes: &[u32], vectors: &[f32]) -> Result<()> {
        let _ = (nodes, vectors);
        Ok(())
    }
    /// Whether the submitted step has finished; its error, once.
    pub fn poll(&self) -> Result<Progress> {
        Ok(Progress::Done)
    }
    /// Waits for the submitted step at most `timeout`.
    pub fn wait(&self, timeout: Duration) -> Result<Progress> {
        let _ = timeout;
        Ok(Progress::Done)
    }
    /// A snapshot from which the scene resumes to the bit.
    pub fn save(&self) -> Result<Vec<u8>> {
        Ok(Vec::new())
    }
    /// Restores a snapshot.
    pub fn restore(&self, bytes: &[u8]) -> Result<()> {
        let _ = bytes;
        Ok(())
    }
    /// Statistics of the last step; never blocks on a step in flight.
    pub fn stats(&self) -> SceneStats {
        unreachable!("a scene cannot be made yet")
    }
    /// Nodes in contact in the last step, in the host's order, and `[m,3]` their displacements, mm.
    pub fn last_contacts(&self) -> Result<(Vec<u32>, Vec<f32>)> {
        Ok((Vec::new(), Vec::new()))
    }
}
