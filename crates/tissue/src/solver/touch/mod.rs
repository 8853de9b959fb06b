//! Rigid tools in contact with the tissue: forces at samples of the touchable surface, solved inside every inner step.
//!
//! After the free update of an inner step the samples near a tool ([`contact::Samples`], the same that the runtime uses) must
//! lie outside of it. Forces on them are found by [`SWEEPS`] projected Gauss-Seidel sweeps over lumped masses, with accumulated
//! forces that are clamped to pushes and to Coulomb's cone; a step starts from the forces of the last one. Serial and in
//! a fixed order: the same bits for any number of threads. Forces are µN inside and mN in reports.

mod place;
mod row;
mod rows;
mod step;

use contact::{Body, Grasp, Pose, Samples, Search, Shape, Vector, pose};
use row::{Reached, Row};
use std::collections::BTreeMap;
use std::sync::Arc;

pub(super) use step::Access;

/// Projected Gauss-Seidel sweeps an inner step.
pub const SWEEPS: u32 = 4;
/// Forces are reported as their mean over this last part of a frame, s.
pub const REPORT_S: f64 = 0.002;
/// A tool may start this deep in the surface; deeper is refused, mm.
pub const START_DEPTH_MM: f32 = 0.5;
/// The pull that tears a grasp off is a mean over this time, s: one inner step's force is noisy.
const TEAR_S: f64 = 0.001;

/// A rigid tool.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Tool {
    pub shape: Shape,
    /// Coulomb's coefficient, 0 for none.
    pub friction: f32,
    /// Pull at which a grasp tears off, mN; 0: never.
    pub tear_off_mn: f32,
}

/// Where a tool goes in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolPose {
    /// At the end of the frame; positions on a line and rotations at even speed from the last one.
    pub pose: Pose,
    /// Whether it holds what it touched at the frame's start.
    pub grasp: bool,
}

/// What a tool felt in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolReport {
    /// Of the tissue on the tool, mN; mean over the last 2 ms of the frame.
    pub force: [f32; 3],
    /// About the tool's position, mN mm; the same mean.
    pub torque: [f32; 3],
    /// Samples that take part in that force.
    pub contacts: u32,
    /// Deepest sample at any inner step of the frame, mm.
    pub penetration_mm: f32,
    /// Work of the tool on the tissue since it was placed, mJ.
    pub work: f64,
    /// Samples that it holds at the end of the frame.
    pub held: u32,
    /// Its grasp tore off, in this frame or before; until it opens.
    pub torn: bool,
}

/// Force of a tool on a sample of the surface: the same mean as [`ToolReport::force`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleForce {
    pub tool: u32,
    /// Row of [`contact::Samples`]: a sample, or a point of the lattice that a thin tool touches.
    pub sample: u32,
    /// On the tissue, mN.
    pub force: [f32; 3],
}

/// What does not change while tools move.
struct Scene {
    samples: Samples,
    tools: Vec<(Tool, Body)>,
    /// By mesh node, mm.
    rest: Vec<Vector>,
    slot_of_node: Vec<u32>,
}

/// A tool's state.
#[derive(Clone, Debug)]
struct Held {
    from: Pose,
    to: Pose,
    /// Asked to grasp.
    closed: bool,
    grasp: Grasp,
    torn: bool,
    /// Mean pull of the bound samples, µN.
    pull: Vector,
    /// nJ.
    work: f64,
    /// Of the frame so far.
    penetration: f32,
    force: [f64; 3],
    torque: [f64; 3],
}

/// Tools and the forces between them and the tissue.
#[derive(Clone)]
pub(super) struct Touch {
    scene: Arc<Scene>,
    tools: Vec<Held>,
    search: Search,
    rows: Vec<Row>,
    /// Rows of the last search, for their forces.
    before: Vec<Row>,
    /// Nodes of the rows.
    reached: Vec<Reached>,
    /// By tool and row: sum of forces in the reported part of the frame, µN.
    sums: BTreeMap<(u32, u32), Vector>,
    steps: u32,
    dt: f64,
}

impl Touch {
    /// Nodes have been added, and lie elsewhere; the touchable faces are others. What is grasped is held on at the nodes that there were.
    pub fn follow(&mut self, positions: &[[f32; 3]], slot_of_node: &[u32], samples: Samples) {
        self.rows.clear();
        self.before.clear();
        self.reached.clear();
        self.sums.clear();
        self.search = Search::default();
        for tool in &mut self.tools {
            let rows: Vec<u32> = (tool.grasp.anchors().iter())
                .map(|anchor| anchor.sample)
                .collect();
            let found = contact::followed(&self.scene.samples, &samples, &rows);
            let found = found.unwrap_or_default();
            let renamed = |row| rows.binary_search(&row).ok().and_then(|at| *found.get(at)?);
            tool.grasp.rename(renamed);
            tool.torn |= tool.closed && tool.grasp.anchors().is_empty();
        }
        self.scene = Arc::new(Scene {
            samples,
            tools: self.scene.tools.clone(),
            rest: positions.iter().map(|p| Vector::from(*p)).collect(),
            slot_of_node: slot_of_node.to_vec(),
        });
    }

    pub fn tool_count(&self) -> usize {
        self.tools.len()
    }

    /// Starts a frame of `steps` inner steps of `dt` towards `poses`.
    pub fn begin(&mut self, poses: &[ToolPose], steps: u32, dt: f64) {
        self.steps = steps;
        self.dt = dt;
        self.sums.clear();
        for (tool, to) in self.tools.iter_mut().zip(poses) {
            tool.from = tool.to;
            tool.to = to.pose;
            tool.penetration = 0.0;
            tool.force = [0.0; 3];
            tool.torque = [0.0; 3];
            if !to.grasp {
                tool.torn = false;
                tool.grasp.open();
            }
            tool.closed = to.grasp;
        }
    }

    /// Where a tool is at a part of the frame.
    pub fn pose_at(&self, tool: u32, part: f32) -> Pose {
        let tool = &self.tools[tool as usize];
        pose::between(&tool.from, &tool.to, part)
    }

    /// A tool takes the force of a tie at a point in inner step `step`, µN.
    pub fn feel(&mut self, tool: u32, point: Vector, force: Vector, step: u32) {
        if step + self.reported() <= self.steps {
            return;
        }
        let arm = point - self.pose_at(tool, self.part(step)).translation;
        let torque = arm.cross(force);
        let tool = &mut self.tools[tool as usize];
        for k in 0..3 {
            tool.force[k] += f64::from(force[k]);
            tool.torque[k] += f64::from(torque[k]);
        }
    }

    /// Inner steps at the frame's end that reports are a mean of.
    fn reported(&self) -> u32 {
        ((REPORT_S / self.dt).round() as u32).clamp(1, self.steps)
    }

    /// What each tool felt in the frame that ended.
    pub fn reports(&self) -> Vec<ToolReport> {
        let part = 1e-3 / f64::from(self.reported());
        let mean = |sum: [f64; 3]| sum.map(|v| (v * part) as f32);
        let contacts = |index: u32| {
            let own = self.sums.range((index, 0)..=(index, u32::MAX));
            own.filter(|(_, force)| **force != Vector::ZERO).count() as u32
        };
        let tools = self.tools.iter().zip(0..);
        tools
            .map(|(tool, index)| ToolReport {
                force: mean(tool.force),
                torque: mean(tool.torque),
                contacts: contacts(index),
                penetration_mm: tool.penetration,
                work: tool.work * 1e-6,
                held: tool.grasp.anchors().len() as u32,
                torn: tool.torn,
            })
            .collect()
    }

    /// Forces at samples that are not zero, by tool and sample.
    pub fn sample_forces(&self) -> Vec<SampleForce> {
        let part = 1e-3 / self.reported() as f32;
        let loaded = self.sums.iter();
        loaded
            .filter(|(_, sum)| **sum != Vector::ZERO)
            .map(|(&(tool, sample), sum)| SampleForce {
                tool,
                sample,
                force: (*sum * part).to_array(),
            })
            .collect()
    }
}
