//! The samples that an inner step solves for: those near a tool, found anew every millisecond, and those that it holds.

use super::Touch;
use super::row::{Reached, Row};
use contact::grasp::REACH_MM;
use contact::{Placed, SKIN_MM, Vector, pose};

/// Inner steps between two searches.
pub(super) const SEARCH_STEPS: u32 = 10;

impl Touch {
    /// Finds the rows for the inner steps from `step` on; `position` is that of a mesh node.
    pub(super) fn look(&mut self, step: u32, position: impl Fn(u32) -> Vector) {
        let scene = self.scene.clone();
        let (from, to) = (self.part(step - 1), self.part(step - 1 + SEARCH_STEPS));
        let placed: Vec<Placed> = self
            .tools
            .iter()
            .zip(&scene.tools)
            .map(|(tool, (_, body))| {
                let start = pose::between(&tool.from, &tool.to, from);
                let end = pose::between(&tool.from, &tool.to, to);
                Placed {
                    body,
                    pose: start,
                    skin: SKIN_MM + body.motion(&start, &end),
                }
            })
            .collect();
        for (index, tool) in self.tools.iter_mut().enumerate() {
            if step == 1 && tool.closed && !tool.torn && tool.grasp.anchors().is_empty() {
                let (body, at) = (placed[index].body, &placed[index].pose);
                let closed = (tool.grasp).close(&scene.samples, body, at, REACH_MM, &position);
                closed.unwrap_or_else(|error| panic!("a grasp: {error}"));
            }
        }
        std::mem::swap(&mut self.rows, &mut self.before);
        self.rows.clear();
        let found = self.search.find(&scene.samples, &placed, &position);
        let mut candidates = found.iter().peekable();
        for (index, tool) in self.tools.iter().enumerate() {
            let index = index as u32;
            let anchors = tool.grasp.anchors();
            for anchor in anchors {
                self.rows
                    .push(row(&scene, index, anchor.sample, Some(anchor.place)));
            }
            while let Some(candidate) = candidates.next_if(|c| c.tool == index) {
                if tool.grasp.place(candidate.sample).is_none() {
                    self.rows.push(row(&scene, index, candidate.sample, None));
                }
            }
        }
        self.keep_pushed();
        for row in &mut self.rows {
            let is_wall = scene.samples.is_on_wall(row.sample);
            row.wall = is_wall.then(|| scene.samples.outward(row.sample, &position));
        }
        self.keep_forces();
        self.reached.clear();
        for row in &self.rows {
            for node in scene.samples.at(row.sample).nodes {
                self.reached.push(Reached {
                    slot: scene.slot_of_node[node as usize],
                    node,
                    gain: 0.0,
                    at: Vector::ZERO,
                    increment: Vector::ZERO,
                    earlier: Vector::ZERO,
                    change: Vector::ZERO,
                });
            }
        }
        self.reached.sort_unstable_by_key(|r| r.slot);
        self.reached.dedup_by_key(|r| r.slot);
        for row in &mut self.rows {
            row.nodes = scene.samples.at(row.sample).nodes.map(|node| {
                let slot = scene.slot_of_node[node as usize];
                self.reached.partition_point(|r| r.slot < slot) as u32
            });
        }
    }

    /// Keeps the points of the lattice that push, though another is nearer to the tool now.
    fn keep_pushed(&mut self) {
        let scene = &self.scene;
        let first = scene.samples.len() as u32;
        let pushed = |r: &&Row| r.sample >= first && r.force != Vector::ZERO;
        let kept = self.before.iter().filter(pushed);
        let kept = kept.map(|r| row(scene, r.tool, r.sample, None));
        let found = self.rows.len();
        self.rows.extend(kept);
        if self.rows.len() > found {
            self.rows.sort_by_key(|r| (r.tool, r.sample));
            self.rows.dedup_by_key(|r| (r.tool, r.sample));
        }
    }

    /// Gives rows that were there before the forces that they had.
    fn keep_forces(&mut self) {
        let key = |row: &Row| (row.tool, row.sample);
        self.before.sort_unstable_by_key(key);
        for row in &mut self.rows {
            if let Ok(at) = self.before.binary_search_by_key(&key(row), key) {
                row.force = self.before[at].force;
                row.last_gap = self.before[at].last_gap;
                row.last_slip = self.before[at].last_slip;
            }
        }
    }

    /// Part of the frame that has passed after `step`.
    pub(super) fn part(&self, step: u32) -> f32 {
        step as f32 / self.steps as f32
    }
}

fn row(scene: &super::Scene, tool: u32, sample: u32, bound: Option<Vector>) -> Row {
    Row {
        tool,
        sample,
        bound,
        nodes: [0; 4],
        weights: scene.samples.at(sample).weights,
        wall: None,
        force: Vector::ZERO,
        last_gap: None,
        last_slip: None,
        point: Vector::ZERO,
        normal: Vector::Y,
        gap: 0.0,
        slip: Vector::ZERO,
        carried: Vector::ZERO,
        gain: 0.0,
    }
}
