//! Tools in a snapshot: where they were, with which forces samples are pushed, what is grasped.

use ::contact::{Pose, Rotation, Vector, grasp::Anchor};

use super::bytes::{Reader, Writer};
use crate::contact::past::{Force, Held};
use crate::contact::{MAX_TOOLS, Past, Problem};
use crate::error::{Error, Result};
use crate::scene::core::Core;

fn bad(what: &str) -> Error {
    Error::Snapshot(format!("holds {what} that no scene has"))
}

impl Core {
    /// Bytes of the tools' part at most.
    pub(super) fn most_tool_bytes(&self) -> usize {
        // A sample may be pushed and held by each of the tools; more than all samples once is never seen.
        let faces = self.mesh.domain_faces.len() / 3;
        64 * MAX_TOOLS + 4096 + 16 * 64 * faces
    }

    pub(super) fn save_tools(&self, w: &mut Writer) {
        let Some(problem) = &self.problem else {
            w.u32(0);
            return;
        };
        let past = &problem.past;
        w.u32(1 + past.tools.len() as u32);
        for held in &past.tools {
            let [x, y, z] = held.pose.translation.to_array();
            let [a, b, c, d] = held.pose.rotation.to_array();
            w.floats(&[x, y, z, a, b, c, d, f32::from(held.closed)]);
            w.u32(held.grasp.anchors().len() as u32);
            for anchor in held.grasp.anchors() {
                w.u32(anchor.sample);
                w.floats(&anchor.place.to_array());
            }
        }
        w.u32(past.forces.len() as u32);
        for force in &past.forces {
            w.u32(force.tool);
            w.u32(force.sample);
            w.floats(&force.force.to_array());
        }
    }

    /// Reads and checks; none where the scene had no tools.
    pub(super) fn read_tools(&self, r: &mut Reader<'_>) -> Result<Option<Past>> {
        let Some(count) = r.u32()?.checked_sub(1) else {
            return Ok(None);
        };
        if count as usize > MAX_TOOLS {
            return Err(bad("a number of instruments"));
        }
        let samples = self.model.samples()?.len() as u32;
        let mut past = Past::with_room(samples.min(1024) as usize)?;
        for _ in 0..count {
            let numbers = r.floats(8)?;
            let [x, y, z, a, b, c, d, closed] = numbers[..] else {
                return Err(bad("a pose"));
            };
            let pose = Pose::from_parts(Vector::new(x, y, z), Rotation::from_array([a, b, c, d]));
            if (pose.rotation.length() - 1.0).abs() > 1e-2 {
                return Err(bad("a rotation"));
            }
            let held = r.u32()?;
            let mut anchors = Vec::new();
            for _ in 0..held.min(samples) {
                let sample = r.u32()?;
                let place = r.floats(3)?;
                anchors.push(Anchor {
                    sample,
                    place: Vector::from_slice(&place),
                });
            }
            let ascends = anchors
                .windows(2)
                .all(|pair| pair[0].sample < pair[1].sample);
            if held > samples || !ascends || anchors.iter().any(|a| a.sample >= samples) {
                return Err(bad("a grasp"));
            }
            let mut tool = Held {
                pose,
                closed: closed != 0.0,
                ..Held::default()
            };
            tool.grasp.restore(anchors);
            past.tools.push(tool);
        }
        for _ in 0..r.u32()? {
            let (tool, sample) = (r.u32()?, r.u32()?);
            let force = Vector::from_slice(&r.floats(3)?);
            let force = Force {
                tool,
                sample,
                force,
            };
            let ascends = past
                .forces
                .last()
                .is_none_or(|last| last.key() < force.key());
            if tool >= count || sample >= samples || !ascends {
                return Err(bad("a force"));
            }
            past.forces.push(force);
        }
        Ok(Some(past))
    }

    /// Takes another past; gives the one that was there.
    pub(super) fn swap_tools(&mut self, past: Option<Past>) -> Result<Option<Past>> {
        match (&mut self.problem, past) {
            (Some(problem), Some(past)) => Ok(Some(std::mem::replace(&mut problem.past, past))),
            (Some(problem), None) => {
                let old = problem.past.clone();
                problem.past.clear();
                Ok(Some(old))
            }
            (none, Some(past)) => {
                let mut problem = Problem::new(self.model.samples()?)?;
                problem.past = past;
                *none = Some(Box::new(problem));
                Ok(None)
            }
            (None, None) => Ok(None),
        }
    }
}
