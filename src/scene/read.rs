//! What a scene shows: its states at the region and at the attached points, the contacts of its last step, statistics.

use super::Scene;
use super::published::View;
use super::published::lock_read;
use crate::error::Result;
use crate::output::Output;
use crate::stats::{SceneStats, SceneTiming};

impl Scene {
    /// The last published state, `[n,3]`, mm, region order.
    pub fn read(&self, out: &mut [f32]) -> Result<()> {
        self.read_to(View::Region, out.into())
    }

    /// Nodes of `read` (`K`, or the region's count).
    pub fn region_count(&self) -> usize {
        lock_read(&self.shared.published).count(View::Region)
    }

    /// Number of attached points.
    pub fn point_count(&self) -> usize {
        lock_read(&self.shared.published).count(View::Points)
    }

    /// The last published state at the region's nodes or the attached points, `[n,3]`.
    ///
    /// # Errors
    /// [`Error::State`](crate::Error::State) where no points are attached.
    pub fn read_view(&self, view: View, out: &mut [f32]) -> Result<()> {
        self.read_to(view, out.into())
    }

    /// Between the state before (`alpha` 0) and the last state (1), region order. `alpha` is clamped to `[0, 1]`.
    ///
    /// What is shown is up to one `dt` old: at `alpha` 0 the state before, at 1 the newest.
    pub fn sample(&self, alpha: f64, out: &mut [f32]) -> Result<()> {
        self.sample_to(View::Region, alpha, out.into())
    }

    /// As [`Scene::sample`], at the region's nodes or the attached points.
    ///
    /// # Errors
    /// As [`Scene::read_view`].
    pub fn sample_view(&self, view: View, alpha: f64, out: &mut [f32]) -> Result<()> {
        self.sample_to(view, alpha, out.into())
    }

    /// Displacement `[n,3]` of any nodes in the last state.
    ///
    /// # Errors
    /// [`Error::State`](crate::Error::State) before the first step.
    pub fn decode(&self, nodes: &[u32], out: &mut [f32]) -> Result<()> {
        self.decode_to(Some(nodes), out.into())
    }

    /// The last published state at the region or the points, into memory that need not be initialised.
    pub(crate) fn read_to(&self, view: View, out: Output<'_, f32>) -> Result<()> {
        lock_read(&self.shared.published).read(view, out)
    }

    /// [`Scene::sample`] at the region or the points, into memory that need not be initialised.
    pub(crate) fn sample_to(&self, view: View, alpha: f64, out: Output<'_, f32>) -> Result<()> {
        lock_read(&self.shared.published).sample(view, alpha, out)
    }

    /// [`Scene::decode`] into memory that need not be initialised; `None`: all nodes.
    pub(crate) fn decode_to(&self, nodes: Option<&[u32]>, out: Output<'_, f32>) -> Result<()> {
        self.core()?
            .call(|core, published| core.decode(published, nodes, out))
    }

    /// Whether an output for the region or the points has `len` floats.
    ///
    /// # Errors
    /// [`crate::Error::Argument`]; [`crate::Error::State`] where no points are attached.
    pub(crate) fn check_len(&self, view: View, len: usize) -> Result<()> {
        lock_read(&self.shared.published).check_len(view, len)
    }

    /// Statistics of the last step.
    pub fn stats(&self) -> SceneStats {
        let mut stats = lock_read(&self.shared.published).stats;
        stats.poisoned = self.shared.is_poisoned();
        stats.memory_bytes += (self.presenter_bytes()
            + self.surface().held_bytes()
            + self.shared.record.held_bytes()) as u64;
        stats
    }

    /// How long the last step and its stages took.
    pub fn timing(&self) -> SceneTiming {
        let stats = lock_read(&self.shared.published).stats;
        SceneTiming {
            step_count: stats.step_count,
            ..stats.timing
        }
    }

    /// Nodes in contact in the last step, in the host's order, and `[m,3]` their displacements, mm.
    pub fn last_contacts(&self) -> Result<(Vec<u32>, Vec<f32>)> {
        let shared = lock_read(&self.shared.published);
        Ok((shared.contact.nodes.clone(), shared.contact.vectors.clone()))
    }
}
