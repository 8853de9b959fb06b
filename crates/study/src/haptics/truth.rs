//! The reference solver on the way that the tools took, a frame a millisecond.

use anyhow::Result;
use contact::{Pose, Vector};
use tissue::mesh::{Boundary, Mesh};
use tissue::solver::{Solver, SolverOptions, ToolPose};
use upt::Model;

use super::gesture::Site;
use super::play::Track;

/// Length of a frame, s.
pub const FRAME_S: f64 = 1e-3;

/// Forces on the tools by frame from time 0, N.
pub type Forces = Vec<Vec<Vector>>;

/// Runs the solver for `seconds`.
pub fn replay(
    model: &Model,
    mesh: &Mesh,
    boundary: Boundary,
    site: &Site,
    track: &Track,
    seconds: f64,
) -> Result<Forces> {
    let options = SolverOptions {
        material: model.manifest.material,
        ..SolverOptions::default()
    };
    let mut solver = Solver::new(mesh, boundary, options)?;
    let poses = |time: f64| -> Vec<Pose> {
        let at = |tool: usize| site.pose(tool, resample(track, time, |tick| tick.tools[tool].0));
        (0..site.tools.len()).map(at).collect()
    };
    solver.set_tools(mesh.samples(boundary), &site.tools, &poses(0.0))?;
    let mut forces = vec![vec![Vector::ZERO; site.tools.len()]];
    for frame in 1..(seconds / FRAME_S) as usize {
        let to = poses(frame as f64 * FRAME_S);
        let to: Vec<ToolPose> = to
            .into_iter()
            .map(|pose| ToolPose { pose, grasp: false })
            .collect();
        let report = solver.step_tools(&[], &to, FRAME_S)?;
        let felt = report.tools.iter();
        forces.push(felt.map(|felt| Vector::from(felt.force) * 1e-3).collect());
    }
    Ok(forces)
}

/// What a track has at a time, between its ticks on a line.
pub fn resample(track: &Track, time: f64, of: impl Fn(&super::play::Tick) -> Vector) -> Vector {
    let ticks = &track.ticks;
    let after = ticks.partition_point(|tick| tick.time_s <= time);
    let (before, after) = (after.saturating_sub(1), after.min(ticks.len() - 1));
    let (a, b) = (&ticks[before], &ticks[after]);
    let long = b.time_s - a.time_s;
    let part = match long > 0.0 {
        true => ((time - a.time_s) / long).clamp(0.0, 1.0) as f32,
        false => 0.0,
    };
    of(a) * (1.0 - part) + of(b) * part
}
