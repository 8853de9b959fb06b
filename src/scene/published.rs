//! What other threads may read of a scene while a step is in flight: the last states, region order, statistics.

use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

use crate::error::{Error, Result};
use crate::memory::{self, HeldBytes};
use crate::output::Output;
use crate::stats::SceneStats;

pub(super) const SCENE: &str = "a scene's states";

/// Nothing panics while it writes: what a poisoned lock holds is whole.
pub(super) fn lock_read(published: &RwLock<Published>) -> RwLockReadGuard<'_, Published> {
    published.read().unwrap_or_else(PoisonError::into_inner)
}

/// As [`lock_read`].
pub(super) fn lock_write(published: &RwLock<Published>) -> RwLockWriteGuard<'_, Published> {
    published.write().unwrap_or_else(PoisonError::into_inner)
}

/// Which body a scene has: operations lead from one to the next, `reset` and `restore` to another one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BodyNumber {
    /// Changes with each reset and each restored snapshot that puts another body in the place of the one before.
    pub line: u64,
    /// Changes with each operation, too.
    pub change: u64,
}

/// One published state.
#[derive(Debug, Clone, Default, HeldBytes)]
pub struct Frame {
    /// `[K,3]`, mm; valid at the planned nodes.
    pub field: Vec<f32>,
    /// `[n,3]`, mm, at the attached points.
    pub points: Vec<f32>,
}

impl Frame {
    /// Rest, without points.
    pub fn rest(node_count: usize) -> Result<Frame> {
        Ok(Frame {
            field: memory::zeros(3 * node_count, SCENE)?,
            points: Vec::new(),
        })
    }

    /// The list that a view shows, `[n,3]`, mm, all nodes of the mesh or all points.
    fn values(&self, view: View) -> &[f32] {
        match view {
            View::Points => &self.points,
            View::Region => &self.field,
            // No buffer has passed `check_len`.
            View::Surface => &[],
        }
    }

    /// Copies the points, or the nodes of `region` (`None`: all), to `out`.
    fn copy(&self, view: View, region: Option<&[u32]>, out: Output<'_, f32>) {
        let from = self.values(view);
        match region {
            Some(region) if view == View::Region => {
                let from = from.as_chunks::<3>().0;
                out.write_rows(region.iter().map(|&node| from[node as usize]));
            }
            _ => out.copy_from(from),
        }
    }
}

/// What is shown of a state.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum View {
    /// The region's nodes, in the host's order; all nodes where there is no region.
    #[default]
    Region,
    /// The attached points.
    Points,
    /// The vertices of the body's surface as [`SceneSurface::update`](crate::SceneSurface::update) left it, each from its place at rest: in frames
    /// between steps. Where they are in the last state [`SceneSurface::positions`](crate::SceneSurface::positions) tells.
    Surface,
}

/// The model of a cut body, for those who read its states.
#[derive(Clone)]
pub struct CutModel(pub std::sync::Arc<crate::model::Model>);

impl std::fmt::Debug for CutModel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("CutModel")
    }
}

/// Contact at nodes in the last step.
#[derive(Debug)]
pub struct ShownContact {
    /// In the host's order.
    pub nodes: Vec<u32>,
    /// `[m,3]`, mm.
    pub vectors: Vec<f32>,
}

/// The body of the published states.
#[derive(Debug)]
pub struct ShownBody {
    pub number: BodyNumber,
    /// Its model, where it has been cut.
    pub cut: Option<CutModel>,
}

/// The published part of a scene.
#[derive(Debug)]
pub struct Published {
    /// The last state.
    pub last: Frame,
    /// The state before.
    pub before: Frame,
    /// The state before that; kept for cubic sampling only.
    pub earlier: Option<Frame>,
    /// The host's region in its order; `None` is every node.
    pub region: Option<Vec<u32>>,
    /// Statistics of the last step.
    pub stats: SceneStats,
    pub contact: ShownContact,
    /// What the tools of the last step were told, and the samples that push them.
    pub tools: crate::contact::ContactReport,
    /// What frames between steps are made of, from the first that a host asks for.
    pub frame_state: Option<super::frame_state::FrameState>,
    /// The body that they are states of.
    pub body: ShownBody,
    /// The attached points.
    pub attached: std::sync::Arc<super::points::AttachedPoints>,
}

impl Published {
    /// Nodes or points of a view.
    pub fn count(&self, view: View) -> usize {
        match (view, &self.region) {
            (View::Surface, _) => 0,
            (View::Points, _) => self.last.points.len() / 3,
            (View::Region, Some(region)) => region.len(),
            (View::Region, None) => self.last.field.len() / 3,
        }
    }

    /// The size that a host's buffer must have.
    pub fn check_len(&self, view: View, len: usize) -> Result<()> {
        let want = 3 * self.count(view);
        if view == View::Surface {
            return Err(Error::Unsupported(
                "the surface of a state is upt_scene_read_surface_positions; only frames between steps have it as a view".into(),
            ));
        }
        if view == View::Points && want == 0 {
            return Err(Error::State(
                "no points are attached; attach them first".into(),
            ));
        }
        if len == want {
            return Ok(());
        }
        let what = match view {
            View::Points => "the attached points",
            View::Region | View::Surface => "the region's nodes",
        };
        Err(Error::Argument(format!(
            "out has {len} floats, must have {want}: 3 for each of {what}"
        )))
    }

    /// Copies the last state.
    pub fn read(&self, view: View, out: Output<'_, f32>) -> Result<()> {
        self.check_len(view, out.len())?;
        self.last.copy(view, self.region.as_deref(), out);
        Ok(())
    }

    /// Interpolates between the state before (`alpha` 0) and the last state (1). `alpha` is clamped to `[0, 1]`.
    pub fn sample(&self, view: View, alpha: f64, out: Output<'_, f32>) -> Result<()> {
        if !alpha.is_finite() {
            return Err(Error::NonFinite("alpha is not finite".into()));
        }
        self.check_len(view, out.len())?;
        let t = alpha.clamp(0.0, 1.0) as f32;
        if t == 1.0 {
            self.last.copy(view, self.region.as_deref(), out);
        } else if t == 0.0 {
            self.before.copy(view, self.region.as_deref(), out);
        } else if self.earlier.is_none() {
            self.each(view, out, |_, before, last| before + t * (last - before));
        } else {
            // Cubic Hermite: central difference at the state before, one-sided at the last.
            let (t2, t3) = (t * t, t * t * t);
            let (h00, h10) = (2.0 * t3 - 3.0 * t2 + 1.0, t3 - 2.0 * t2 + t);
            let (h01, h11) = (3.0 * t2 - 2.0 * t3, t3 - t2);
            self.each(view, out, |earlier, before, last| {
                h00 * before + h10 * 0.5 * (last - earlier) + h01 * last + h11 * (last - before)
            });
        }
        Ok(())
    }

    /// Combines the three states number by number, in the view's order; without an earlier state the one before stands for it.
    fn each(&self, view: View, out: Output<'_, f32>, combine: impl Fn(f32, f32, f32) -> f32) {
        let last = self.last.values(view);
        let before = self.before.values(view);
        let earlier = self.earlier.as_ref().unwrap_or(&self.before).values(view);
        match (&self.region, view) {
            (Some(region), View::Region) => {
                let [earlier, before, last] = [earlier, before, last].map(|v| v.as_chunks::<3>().0);
                out.write_rows(region.iter().map(|&node| {
                    let node = node as usize;
                    let (e, b, l) = (earlier[node], before[node], last[node]);
                    [0, 1, 2].map(|axis| combine(e[axis], b[axis], l[axis]))
                }));
            }
            _ => {
                let all = earlier.iter().zip(before).zip(last);
                out.write(all.map(|((&e, &b), &l)| combine(e, b, l)));
            }
        }
    }
}
