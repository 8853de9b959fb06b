//! Which samples a hand is told of: those that its tool pushes or holds, and the nearest to where it may be before the next state.

use std::sync::Arc;

use ::contact::{Body, Placed, Pose, Samples, Search};

use super::stepped::Stepped;
use crate::contact::{PUT_MM, vector};
use crate::error::Result;
use crate::haptics::snapshot::MOST_SAMPLES;
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the haptics of a scene";
/// Samples this near to the tool are published, mm: what it may reach before the next step. At 20
/// ms a step that is a hand of 0.3 m/s; a quicker one widens it, see [`NearSamples::find`].
const REACH_MM: f32 = 6.0;

/// The tool as the scene's list has it.
#[derive(HeldBytes)]
pub(super) struct FeltTool {
    /// Its place in the list of the scene's tools: forces and grasps of that place are its own.
    pub(super) instrument: u32,
    #[held(skip)]
    pub(super) body: Body,
    /// Coulomb's coefficient.
    pub(super) friction: f32,
    /// Whether it holds what it touches: then its anchors are published, too.
    pub(super) grasps: bool,
}

/// Which samples are published.
#[derive(HeldBytes)]
pub(super) struct NearSamples {
    /// All samples of the body's surface.
    #[held(skip)]
    pub(super) samples: Arc<Samples>,
    pub(super) search: Search,
    /// Nearest samples by distance, mm, and row, at most [`MOST_SAMPLES`], and their rows alone, in the same order. A sample that is pushed or held has
    /// the least distance, so that it is never left out.
    pub(super) found: Vec<(f32, u32)>,
    pub(super) sampled: Vec<u32>,
}

impl NearSamples {
    /// The samples that are pushed or held by the tool, and the nearest to where the hand is now.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn find(
        &mut self,
        step: &Stepped<'_>,
        tool: &FeltTool,
        ties: impl Iterator<Item = u32> + Clone,
        [last, pose]: [&Pose; 2],
    ) -> Result<()> {
        self.found.clear();
        memory::fit(&mut self.found, ties.clone().count(), WHAT)?;
        self.found.extend(ties.map(|row| (f32::MIN, row)));
        let index = tool.instrument as usize;
        if let Some(problem) = step.problem {
            let past = &problem.past;
            let anchors = past.tools.get(index).map(|held| held.grasp.anchors().len());
            let more = past.forces.len() + anchors.unwrap_or(0);
            memory::reserve(&mut self.found, more, WHAT)?;
            let own = problem.past.forces.iter();
            let own = own.filter(|force| force.tool == tool.instrument);
            self.found.extend(own.map(|force| (f32::MIN, force.sample)));
            if let Some(held) = problem.past.tools.get(index)
                && tool.grasps
            {
                let anchors = held.grasp.anchors().iter();
                self.found
                    .extend(anchors.map(|anchor| (f32::MIN, anchor.sample)));
            }
        }
        // A quick hand is elsewhere before the next state: what lies on its way, if it goes on as it did, is within reach too.
        let ahead = pose.translation - last.translation;
        let on = |part: f32| Pose::from_parts(pose.translation + ahead * part, pose.rotation);
        let is_quick = ahead.length() > REACH_MM;
        let position = |node| vector(step.rest, node) + vector(step.u, node);
        // One that starts suddenly may be at the nearest part of the surface before the next state.
        let nodes = self.samples.all_nodes().iter();
        let gaps = nodes.map(|node| tool.body.nearest_at(pose, position(*node)).distance);
        let gap = gaps.fold(f32::MAX, f32::min);
        let gap = if gap <= PUT_MM { gap.max(0.0) } else { 0.0 };
        let placed = Placed {
            body: &tool.body,
            pose: if is_quick { on(0.5) } else { *pose },
            skin: REACH_MM + gap.max(if is_quick { 0.5 * ahead.length() } else { 0.0 }),
        };
        let near = self.search.find(&self.samples, &[placed], position);
        memory::reserve(&mut self.found, near.len(), WHAT)?;
        let body = &tool.body;
        let near = near.iter().map(|near| {
            let ways = (0..=8).map(|part| on(part as f32 / 8.0));
            let distance = match is_quick {
                true => ways.fold(f32::MAX, |least, pose| {
                    least.min(body.nearest_at(&pose, near.point).distance)
                }),
                false => near.distance,
            };
            (distance, near.sample)
        });
        self.found.extend(near);
        // Of equals the pushed one comes first, and stays.
        self.found
            .sort_unstable_by(|a, b| a.1.cmp(&b.1).then(a.0.total_cmp(&b.0)));
        self.found.dedup_by_key(|found| found.1);
        self.found
            .sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        self.found.truncate(MOST_SAMPLES);
        self.found.sort_unstable_by_key(|found| found.1);
        Ok(())
    }
}
