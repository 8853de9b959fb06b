//! Placing tools: what is refused before anything moves.

use super::{Held, START_DEPTH_MM, Scene, Tool, ToolPose, Touch};
use crate::solver::{Solver, SolverError};
use contact::{Body, Grasp, Pose, Samples, Search, Vector};
use elements::vector::{cross, dot, subtract};
use std::collections::BTreeMap;
use std::sync::Arc;

impl Solver {
    /// Gives the solver tools, each at the pose that it starts from; later frames move them
    /// ([`Solver::step_tools`]). Tools given before are gone. `samples` are those of the mesh's touchable
    /// surface ([`crate::mesh::Mesh::samples`]).
    ///
    /// # Errors
    /// [`SolverError::Tool`] for a shape, friction or pose that no tool can have, or one that starts more than 0.5 mm deep in
    /// the tissue as it is now. The tools are then as before.
    pub fn set_tools(
        &mut self,
        samples: Samples,
        tools: &[Tool],
        poses: &[Pose],
    ) -> Result<(), SolverError> {
        if tools.len() != poses.len() {
            return Err(SolverError::ToolCount {
                tools: tools.len(),
                poses: poses.len(),
            });
        }
        let mut bodies = Vec::new();
        for (index, tool) in tools.iter().enumerate() {
            let fail = |reason: String| SolverError::Tool { index, reason };
            let body = Body::new(&tool.shape).map_err(|error| fail(error.to_string()))?;
            for (field, value) in [
                ("friction", tool.friction),
                ("tear_off_mn", tool.tear_off_mn),
            ] {
                if !(value.is_finite() && value >= 0.0) {
                    return Err(fail(format!(
                        "`{field}` is {value}; it must be zero or positive"
                    )));
                }
            }
            check_pose(index, &poses[index])?;
            self.check_start(&samples, index, &body, &poses[index])?;
            bodies.push((tool.clone(), body));
        }
        let held = poses.iter().map(|pose| Held {
            from: *pose,
            to: *pose,
            closed: false,
            grasp: Grasp::default(),
            torn: false,
            pull: Vector::ZERO,
            work: 0.0,
            penetration: 0.0,
            force: [0.0; 3],
            torque: [0.0; 3],
        });
        let touch = Touch {
            tools: held.collect(),
            search: Search::default(),
            rows: Vec::new(),
            before: Vec::new(),
            reached: Vec::new(),
            sums: BTreeMap::new(),
            steps: 1,
            dt: self.dt,
            scene: Arc::new(Scene {
                samples,
                tools: bodies,
                rest: self.positions.iter().map(|p| Vector::from(*p)).collect(),
                slot_of_node: self.partition.slot_of_node.clone(),
            }),
        };
        self.touch = (!tools.is_empty()).then_some(touch);
        Ok(())
    }

    /// One pose a tool, each finite.
    pub(in crate::solver) fn check_tools(&self, poses: &[ToolPose]) -> Result<(), SolverError> {
        let tools = self.touch.as_ref().map_or(0, Touch::tool_count);
        if tools != poses.len() {
            return Err(SolverError::ToolCount {
                tools,
                poses: poses.len(),
            });
        }
        let mut poses = poses.iter().enumerate();
        poses.try_for_each(|(index, to)| check_pose(index, &to.pose))
    }

    fn check_start(
        &self,
        samples: &Samples,
        index: usize,
        body: &Body,
        pose: &Pose,
    ) -> Result<(), SolverError> {
        let fail = |reason: String| Err(SolverError::Tool { index, reason });
        let position = |node: u32| {
            let slot = self.partition.slot_of_node[node as usize] as usize;
            let [x, y, z, _] = self.fields.displacement[slot].0;
            Vector::from(self.positions[node as usize]) + Vector::new(x, y, z)
        };
        let mut deepest = (0.0f32, Vector::ZERO);
        for sample in samples.rows() {
            let point = sample.gather(position);
            let depth = -body.nearest_at(pose, point).distance;
            if depth > deepest.0 {
                deepest = (depth, point);
            }
        }
        if deepest.0 > START_DEPTH_MM {
            let [x, y, z] = deepest.1.to_array();
            return fail(format!(
                "starts {:.2} mm deep in the tissue, at [{x:.1}, {y:.1}, {z:.1}] mm; start it outside, {START_DEPTH_MM} mm deep at most",
                deepest.0
            ));
        }
        for probe in body.probes() {
            let point = pose.transform_point(probe);
            if let Some(element) = self.element_at(point, position) {
                let [x, y, z] = point.to_array();
                return fail(format!(
                    "starts inside the tissue: [{x:.1}, {y:.1}, {z:.1}] mm lies in element {element}; start it outside"
                ));
            }
        }
        Ok(())
    }

    /// An element that a point lies in.
    fn element_at(&self, point: Vector, position: impl Fn(u32) -> Vector) -> Option<usize> {
        let wide = |v: Vector| v.to_array().map(f64::from);
        let point = wide(point);
        self.tets.iter().position(|tet| {
            let corners = tet.map(|node| wide(position(node)));
            let beyond = |k: usize| {
                let below = corners.iter().all(|c| c[k] < point[k]);
                below || corners.iter().all(|c| c[k] > point[k])
            };
            if (0..3).any(beyond) {
                return false;
            }
            let volume = |a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]| {
                dot(subtract(b, a), cross(subtract(c, a), subtract(d, a)))
            };
            let [a, b, c, d] = corners;
            let parts = [
                volume(point, b, c, d),
                volume(a, point, c, d),
                volume(a, b, point, d),
                volume(a, b, c, point),
            ];
            parts.iter().all(|v| *v >= 0.0)
        })
    }
}

fn check_pose(index: usize, pose: &Pose) -> Result<(), SolverError> {
    contact::pose::checked(pose.translation.to_array(), pose.rotation.to_array())
        .map(|_| ())
        .map_err(|error| SolverError::Tool {
            index,
            reason: error.to_string(),
        })
}
