//! How deep tools and tissue lie in each other, and the way by which tools come into tissue that starts from rest.

use ::contact::{Placed, Pose, SPACING_MM, Vector, pose};

use super::{ContactProblem, OPEN_MM};
use crate::contact::buried::Buried;
use crate::contact::past::Force;
use crate::contact::rows::{Row, outward};
use crate::contact::state::State;

impl ContactProblem {
    /// Whether the tissue lies inside of a tool deeper than `depth_mm` anywhere on the tools' ways.
    pub fn is_penetrated(&mut self, state: State<'_>, depth_mm: f32) -> bool {
        let parts = self.parts();
        (0..self.tools.len()).any(|index| {
            let mut ways = (1..=parts).rev().map(|part| part as f32 / parts as f32);
            ways.any(|way| self.deepest(index, state, way) > depth_mm)
        })
    }

    /// How deep a tool lies in the tissue, mm; 0 where it does not.
    fn buried_by(&mut self, index: usize, state: State<'_>, part: f32) -> f32 {
        let tool = &self.tools[index];
        let pose = pose::between(&self.before[index], &tool.pose, part);
        let (samples, mesh, sides) = (&self.samples, &self.mesh, &mut self.sides);
        let found = Buried::find(&tool.body, &pose, samples, mesh, state, sides);
        found.map_or(0.0, |buried| buried.depth + tool.body.radius())
    }

    /// How deep the tissue lies inside of a quick or thin tool that was clear of it when the step began, or the tool in the tissue, tools at
    /// part `part` of their ways, mm. A tool that was put there comes out over a few steps, however deep it lies.
    pub fn sunk(&mut self, state: State<'_>, part: f32) -> f32 {
        let mut deepest = 0.0f32;
        for index in 0..self.tools.len() {
            if self.may_lose[index] {
                deepest = deepest.max(self.depth(index, state, part));
            }
        }
        deepest
    }

    /// How deep the tissue lies in one tool, mm, at part `part` of its way.
    pub(super) fn depth(&mut self, index: usize, state: State<'_>, part: f32) -> f32 {
        let depth = self.deepest(index, state, part);
        // What pushes from outside is outside; but a thin tool's side may be pushed by what its tip has pierced.
        let body = &self.tools[index].body;
        let is_thin = body.sinks_between(SPACING_MM);
        match !is_thin && self.pushes_from_outside(index, state, part) {
            true => depth,
            false => depth.max(self.buried_by(index, state, part)),
        }
    }

    /// Whether a sample of the surface lies inside of a tool where it was when the step began.
    pub(super) fn reaches(&mut self, index: usize, state: State<'_>) -> bool {
        let placed = Placed {
            body: &self.tools[index].body,
            pose: self.before[index],
            skin: 0.0,
        };
        let position = |node| state.position(node);
        !self
            .search
            .find(&self.samples, &[placed], position)
            .is_empty()
    }

    /// Whether forces of a tool are at its surface, and none where the tissue has left it.
    fn pushes_from_outside(&self, index: usize, state: State<'_>, part: f32) -> bool {
        let own = |force: &&Force| force.tool == index as u32;
        let mut forces = self.next.forces.iter().filter(own).peekable();
        let moving = self.moving(state, part);
        forces.peek().is_some()
            && forces.all(|force| moving.contact(&self.row_of(force, state), part).gap < OPEN_MM)
    }

    /// The row of a force.
    fn row_of(&self, force: &Force, state: State<'_>) -> Row {
        let sample = self.samples.at(force.sample);
        Row {
            tool: force.tool,
            sample: force.sample,
            force: force.force,
            far: false,
            gap: 0.0,
            point: sample.gather(|node| state.position(node)),
            outward: outward(&self.samples, force.sample, state),
        }
    }

    /// How deep the deepest sample lies inside of a tool at part `part` of its way, or beyond it where the tool has passed, mm: the way that it
    /// has to come out. 0 where none does.
    pub(super) fn deepest(&mut self, index: usize, state: State<'_>, part: f32) -> f32 {
        let tool = &self.tools[index];
        let at = pose::between(&self.before[index], &tool.pose, part);
        let placed = Placed {
            body: &tool.body,
            pose: at,
            skin: 0.0,
        };
        let search = &mut self.search;
        search.find(&self.samples, &[placed], |node| state.position(node));
        let moving = self.moving(state, part);
        let gap = |sample: u32, force: Vector| {
            let row = Row {
                tool: index as u32,
                sample,
                force,
                far: false,
                gap: 0.0,
                point: self.samples.at(sample).gather(|node| state.position(node)),
                outward: outward(&self.samples, sample, state),
            };
            moving.contact(&row, part).gap
        };
        let forces = &self.next.forces;
        // Three kinds: samples inside of the tool, samples that it pushes and may have passed, and where it comes out itself.
        let inside = self.search.found().iter().map(|candidate| {
            let key = (index as u32, candidate.sample);
            let place = forces.binary_search_by_key(&key, Force::key);
            let force = place.map_or(Vector::ZERO, |at| forces[at].force);
            // What no tool touches, because it is reached from within, lies in it all the same.
            (-gap(candidate.sample, force)).max(-candidate.distance)
        });
        let pushed = forces.iter().filter(|force| force.tool == index as u32);
        let pushed = pushed.map(|force| -gap(force.sample, force.force));
        let buried = self.buried[index].map(|buried| -gap(buried.row, Vector::ZERO));
        inside.chain(pushed).chain(buried).fold(0.0, f32::max)
    }

    /// The tissue starts from rest and without forces, and each tool outside of it: back where it came from, against its push, or where it
    /// comes out by the shortest way. Until [`ContactProblem::return_to_ways`] that is the tools' way.
    pub fn start_from_rest(&mut self, rest: &[f32]) {
        self.clear_forces();
        self.ways.clear();
        let ways = self.before.iter().zip(&self.put).zip(&self.buried);
        self.ways
            .extend(ways.map(|((before, put), buried)| (*before, *put, *buried)));
        let state = State {
            rest,
            u: &[],
            start: &[],
        };
        for (index, tool) in self.tools.iter().enumerate() {
            let (samples, mesh, sides) = (&self.samples, &self.mesh, &mut self.sides);
            let found = Buried::find(&tool.body, &tool.pose, samples, mesh, state, sides);
            // Out by its whole size, so that it comes back in from outside of all samples.
            let clear = tool.body.size() + OPEN_MM;
            let came = self.before[index].translation - tool.pose.translation;
            let own = self.past.forces.iter();
            let own = own.filter(|force| force.tool == index as u32);
            let pushed: Vector = own.map(|force| -force.force).sum();
            // A tool that is held still has come from nowhere: then the push it feels tells which side it is on.
            let came = if came.length() > OPEN_MM {
                came
            } else {
                pushed
            };
            let way = found.map_or(Vector::ZERO, |buried| {
                let back = came.try_normalize();
                let back = back.and_then(|back| buried.way_along(back, mesh, state, sides));
                let way = back.unwrap_or(buried.out * buried.depth);
                way + way.normalize_or_zero() * clear
            });
            self.before[index] = Pose::from_parts(tool.pose.translation + way, tool.pose.rotation);
            self.put[index] = false;
            self.buried[index] = None;
        }
    }

    /// The tools' ways are again those of the step.
    pub fn return_to_ways(&mut self) {
        for (index, (before, put, buried)) in self.ways.drain(..).enumerate() {
            self.before[index] = before;
            self.put[index] = put;
            self.buried[index] = buried;
        }
    }
}
