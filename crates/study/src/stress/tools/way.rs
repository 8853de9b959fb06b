//! The way of a tool to a place, and what the reference solver's tissue makes of it.

use anyhow::Result;
use contact::{Body, Pose, pose};
use tissue::solver::{Solver, SolverOptions, Tool, ToolPose, ToolReport};

use super::run::Hands;

/// A tool so far beneath the surface at rest must be met, mm.
const BENEATH_MM: f32 = 0.6;

/// The way of a tool to a place.
pub struct Way {
    pub tool: Tool,
    /// By step, and how high its end is then above the surface at rest, mm.
    pub poses: Vec<(ToolPose, f32)>,
    /// It leaps: a hand must feel it once the step has arrived.
    pub leaps: bool,
    /// It begins in the tissue: it must be told of in the first step and held in the last, and no frame or hand is asked.
    pub begins_in_tissue: bool,
}

impl Way {
    /// Where the tool is so many steps after the first, and whether it must be met there.
    pub fn at(&self, time: f32) -> (Pose, bool) {
        let last = self.poses.len() - 1;
        let step = (time as usize).min(last);
        let part = time - step as f32;
        let ((from, high), (to, low)) = (self.poses[step], self.poses[(step + 1).min(last)]);
        let height = high + (low - high) * part;
        let pose = pose::between(&from.pose, &to.pose, part);
        (pose, height <= -BENEATH_MM)
    }

    /// The first step at whose end it must be met.
    pub fn first(&self) -> usize {
        let met = |step: &usize| self.at(*step as f32).1;
        (0..self.poses.len()).find(met).unwrap_or(0)
    }

    /// How deep the tool lies in the solver's tissue, mm, by what the solver tells too, as of the library; none where its elements invert.
    pub fn true_depth(&self, hands: &mut Hands) -> Result<Option<f64>> {
        let mut solver = self.true_tissue(hands)?;
        let body = [Body::new(&self.tool.shape)?];
        let mut field = vec![[0.0; 3]; hands.field.len()];
        let mut deepest = 0.0f64;
        for (step, (at, _)) in self.poses.iter().enumerate().skip(1) {
            let Some(report) = stepped(&mut solver, at, hands.step_s)? else {
                return Ok(None);
            };
            if step >= self.first() {
                solver.displacement(&mut field);
                let depth = hands.yard.penetration(&field, &body, &[at.pose]);
                deepest = deepest.max(depth).max(report.penetration_mm.into());
            }
        }
        Ok(Some(deepest))
    }

    /// The longest time for which the solver's tissue has flown off the tool where it must be met, ms; none where its elements invert.
    pub fn true_miss(&self, hands: &mut Hands) -> Result<Option<usize>> {
        let mut solver = self.true_tissue(hands)?;
        let calls = (1e3 * hands.step_s).round() as usize;
        let (mut missed, mut most) = (0, 0);
        for call in 1..=self.poses.len() * calls {
            let (pose, beneath) = self.at(call as f32 / calls as f32);
            let at = ToolPose {
                pose,
                ..self.poses[0].0
            };
            let Some(report) = stepped(&mut solver, &at, 1e-3)? else {
                return Ok(None);
            };
            missed = match report.contacts > 0 || !beneath {
                true => 0,
                false => missed + 1,
            };
            most = most.max(missed);
        }
        Ok(Some(most))
    }

    /// The reference solver at rest, with the tool where its way begins.
    fn true_tissue(&self, hands: &Hands) -> Result<Solver> {
        let (mesh, boundary) = (&hands.bench.mesh, hands.bench.boundary);
        let options = SolverOptions {
            material: hands.bench.model.manifest.material,
            ..SolverOptions::default()
        };
        let mut solver = Solver::new(mesh, boundary, options)?;
        let (tools, start) = (std::slice::from_ref(&self.tool), [self.poses[0].0.pose]);
        solver.set_tools(mesh.samples(boundary), tools, &start)?;
        Ok(solver)
    }
}

/// What the solver tells of its one tool after a step to a pose; none where its elements invert.
fn stepped(solver: &mut Solver, at: &ToolPose, seconds: f64) -> Result<Option<ToolReport>> {
    match solver.step_tools(&[], &[*at], seconds) {
        Ok(report) => Ok(report.tools.first().copied()),
        Err(error) if error.is_load() => Ok(None),
        Err(error) => Err(error.into()),
    }
}
