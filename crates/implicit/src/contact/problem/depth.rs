//! How deep tools and tissue lie in each other.

use ::contact::{Placed, SPACING_MM, Vector};

use super::gauge::Gauge;
use super::surface::Surface;
use super::tie_set::TieSet;
use super::ways::ToolWays;
use crate::contact::past::{Force, Past};
use crate::contact::state::State;

/// Measures depths for a problem, which lends it room for searches.
pub struct Depths<'a> {
    pub surface: &'a mut Surface,
    pub ways: &'a ToolWays,
    pub tied: &'a TieSet,
    /// The end of the step being made.
    pub next: &'a Past,
}

impl Depths<'_> {
    /// How deep a tool lies in the tissue, mm; 0 where it does not.
    fn buried_by(&mut self, index: usize, state: State<'_>, part: f32) -> f32 {
        let body = &self.ways.tools[index].body;
        let pose = self.ways.pose(index, part);
        let found = self.surface.buried(body, &pose, state);
        found.map_or(0.0, |buried| buried.depth + body.radius())
    }

    /// How deep the tissue lies inside of a quick or thin tool that was clear of it when the step began, or the tool in the tissue, tools at
    /// part `part` of their ways, mm. A tool that was put there comes out over a few steps, however deep it lies.
    pub fn sunk(&mut self, state: State<'_>, part: f32) -> f32 {
        let mut deepest = 0.0f32;
        for index in 0..self.ways.tools.len() {
            if self.ways.may_lose[index] {
                deepest = deepest.max(self.depth(index, state, part));
            }
        }
        deepest
    }

    /// The same over what an iteration may leave: `thin_mm` for a round tool that pierces the surface before it has pushed it, `most_mm` for all others.
    pub fn over(&mut self, state: State<'_>, part: f32, [most_mm, thin_mm]: [f32; 2]) -> f32 {
        let mut most = 0.0f32;
        for index in 0..self.ways.tools.len() {
            if self.ways.may_lose[index] {
                let body = &self.ways.tools[index].body;
                let is_needle = body.pierces() && !body.has_point();
                let kept = if is_needle { thin_mm } else { most_mm };
                most = most.max(self.depth(index, state, part) / kept);
            }
        }
        most
    }

    /// How deep the tissue lies in one tool, mm, at part `part` of its way.
    pub fn depth(&mut self, index: usize, state: State<'_>, part: f32) -> f32 {
        let depth = self.deepest(index, state, part);
        // What pushes from outside is outside; but a thin tool's side may be pushed by what its tip has pierced.
        let is_thin = self.ways.tools[index].body.sinks_between(SPACING_MM);
        match !is_thin && self.gauge().pushes_from_outside(index, state, part) {
            true => depth,
            false => depth.max(self.buried_by(index, state, part)),
        }
    }

    /// How deep the deepest sample lies inside of a tool at part `part` of its way, or beyond it where the tool has passed, mm: the way that it
    /// has to come out. 0 where none does.
    pub fn deepest(&mut self, index: usize, state: State<'_>, part: f32) -> f32 {
        let placed = Placed {
            body: &self.ways.tools[index].body,
            pose: self.ways.pose(index, part),
            skin: 0.0,
        };
        let Surface {
            samples, search, ..
        } = &mut *self.surface;
        search.find(samples, &[placed], |node| state.position(node));
        let gauge = self.gauge();
        let moving = gauge.moving(state, part);
        let gap = |sample: u32, force: Vector| {
            let row = gauge.row(index as u32, sample, force, state);
            moving.contact(&row, part).gap
        };
        let forces = &self.next.forces;
        // Three kinds: samples inside of the tool, samples that it pushes and may have passed, and where it comes out itself.
        let inside = self.surface.search.found().iter().map(|candidate| {
            let key = (index as u32, candidate.sample);
            let place = forces.binary_search_by_key(&key, Force::key);
            let force = place.map_or(Vector::ZERO, |at| forces[at].force);
            // What no tool touches, because it is reached from within, lies in it all the same.
            (-gap(candidate.sample, force)).max(-candidate.distance)
        });
        let pushed = forces.iter().filter(|force| force.tool == index as u32);
        let pushed = pushed.map(|force| -gap(force.sample, force.force));
        let buried = self.ways.buried[index].map(|buried| -gap(buried.row, Vector::ZERO));
        inside.chain(pushed).chain(buried).fold(0.0, f32::max)
    }

    /// What rows are measured by, while the search keeps what it has found.
    fn gauge(&self) -> Gauge<'_> {
        Gauge {
            samples: &self.surface.samples,
            ways: self.ways,
            tied: self.tied,
            next: self.next,
        }
    }
}
