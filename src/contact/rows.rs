//! The rows of a contact problem: samples near the tools, and their gaps and slips at a state of the tissue.

use ::contact::{Body, Contact, Law, Placed, Pose, SKIN_MM, Samples, Vector, pose};

use super::past::Held;
use super::problem::Problem;
use super::tool::{MAX_TOOLS, Tool};

/// Samples that one solve may have: what a tool as large as the organ touches beyond these is left to the next solve.
const MOST_ROWS: usize = 256;
/// Longest way through a tool, mm.
const THROUGH_MM: f32 = 30.0;
/// A tool's normal may lean this much (cosine) to the outside of the tissue; beyond, the tool reaches the sample from within.
const LEAN: f32 = 0.2;

/// Where the tissue is, `[K,3]` each.
#[derive(Clone, Copy)]
pub struct State<'a> {
    /// Rest positions, mm.
    pub rest: &'a [f32],
    /// Displacements, mm.
    pub u: &'a [f32],
    /// Displacements at the start of the step, mm.
    pub start: &'a [f32],
}

pub(crate) fn vector(field: &[f32], node: u32) -> Vector {
    let at = 3 * node as usize;
    Vector::new(field[at], field[at + 1], field[at + 2])
}

impl State<'_> {
    pub(crate) fn position(&self, node: u32) -> Vector {
        vector(self.rest, node) + vector(self.u, node)
    }
}

/// A sample that is looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    pub(super) tool: u32,
    pub(super) sample: u32,
    pub(super) force: Vector,
    pub(super) point: Vector,
    /// Of the tissue's surface, outward.
    pub(super) outward: Vector,
}

impl Problem {
    /// Fills `rows`: samples near the tools at part `part` of their way, those that are pushed, and those that are held. `wide`
    /// looks as far as the tools move.
    pub(super) fn look(&mut self, state: State<'_>, part: f32, wide: bool) {
        let mut placed: [Option<Placed>; MAX_TOOLS] = [const { None }; MAX_TOOLS];
        for (place, (tool, from)) in placed.iter_mut().zip(self.tools.iter().zip(&self.before)) {
            let motion = match wide {
                true => tool.body.motion(from, &tool.pose),
                false => 0.0,
            };
            *place = Some(Placed {
                body: &tool.body,
                pose: pose::between(from, &tool.pose, part),
                skin: SKIN_MM + motion,
            });
        }
        self.rows.clear();
        let row = |tool: u32, sample: u32, force: Vector| Row {
            tool,
            sample,
            force,
            point: Vector::ZERO,
            outward: Vector::ZERO,
        };
        for (index, placed) in placed.iter().flatten().enumerate() {
            let found = self
                .search
                .find(&self.samples, std::slice::from_ref(placed), |node| {
                    state.position(node)
                });
            let found = found
                .iter()
                .map(|c| row(index as u32, c.sample, Vector::ZERO));
            self.rows.extend(found);
            let anchors = self.next.tools[index].grasp.anchors().iter();
            self.rows
                .extend(anchors.map(|anchor| row(index as u32, anchor.sample, Vector::ZERO)));
        }
        let pushed = self.next.forces.iter();
        self.rows
            .extend(pushed.map(|force| row(force.tool, force.sample, force.force)));
        // Those with a force come first of their equals, and stay.
        self.rows
            .sort_unstable_by_key(|row| (row.tool, row.sample, row.force == Vector::ZERO));
        self.rows.dedup_by_key(|row| (row.tool, row.sample));
        for row in &mut self.rows {
            let sample = self.samples.rows()[row.sample as usize];
            row.point = sample.gather(|node| state.position(node));
            row.outward = outward(&self.samples, row.sample, state);
        }
        if self.rows.len() > MOST_ROWS {
            self.keep_nearest(part);
        }
    }

    /// Keeps [`MOST_ROWS`] rows: those with a force first, then those deepest inside of their tool.
    fn keep_nearest(&mut self, part: f32) {
        let depth = |row: &Row| match self.tools.get(row.tool as usize) {
            Some(tool) => {
                let from = &self.before[row.tool as usize];
                let pose = pose::between(from, &tool.pose, part);
                tool.body.nearest_at(&pose, row.point).distance
            }
            None => f32::MAX,
        };
        let rank = |row: &Row| (row.force == Vector::ZERO, depth(row), row.sample);
        self.rows.sort_unstable_by(|a, b| {
            let ((a0, a1, a2), (b0, b1, b2)) = (rank(a), rank(b));
            a0.cmp(&b0).then(a1.total_cmp(&b1)).then(a2.cmp(&b2))
        });
        self.rows.truncate(MOST_ROWS);
        self.rows.sort_unstable_by_key(|row| (row.tool, row.sample));
    }

    /// How deep the deepest sample lies inside of a tool at a pose, mm; not positive where none does.
    pub(super) fn deepest(&mut self, index: usize, at: &Pose, state: State<'_>) -> f32 {
        let tool = &self.tools[index];
        let placed = Placed {
            body: &tool.body,
            pose: *at,
            skin: 0.0,
        };
        let samples = &self.samples;
        let found = self
            .search
            .find(samples, &[placed], |node| state.position(node));
        let mut deepest = 0.0f32;
        for candidate in found {
            let outward = outward(samples, candidate.sample, state);
            let depth = match candidate.normal.dot(outward) > LEAN {
                true => tool.body.way_out(at, candidate.point, -outward, THROUGH_MM),
                false => Some(-candidate.distance),
            };
            deepest = deepest.max(depth.unwrap_or(0.0));
        }
        deepest
    }
}

/// The tissue's outward normal at the face of a sample.
pub(crate) fn outward(samples: &Samples, sample: u32, state: State<'_>) -> Vector {
    let corners = samples.corners(samples.face_of(sample));
    let [a, b, c] = corners.map(|at| state.position(samples.nodes()[at as usize]));
    (b - a).cross(c - a).normalize_or_zero()
}

/// A tool on its way from one pose to another, and a sample that it may touch.
pub(crate) struct Pair<'a> {
    pub(crate) body: &'a Body,
    /// Coulomb's coefficient.
    pub(crate) friction: f32,
    pub(crate) from: &'a Pose,
    pub(crate) now: &'a Pose,
    /// Place of a held sample in the tool's frame.
    pub(crate) anchor: Option<Vector>,
    /// Depth that may stay, mm.
    pub(crate) allowed: f32,
}

impl Pair<'_> {
    /// Gap and slip of a sample that was at `start` and is at `point`, on a surface with normal `outward`, `pushed` so far or not.
    pub(crate) fn contact(
        &self,
        point: Vector,
        start: Vector,
        outward: Vector,
        pushed: bool,
    ) -> Contact {
        let nearest = self.body.nearest_at(self.now, point);
        if let Some(place) = self.anchor {
            return Contact {
                law: Law::Bound,
                normal: nearest.normal,
                gap: 0.0,
                slip: point - self.now.transform_point(place),
            };
        }
        let (mut normal, mut gap) = (nearest.normal, nearest.distance);
        if normal.dot(outward) > LEAN {
            let advance = self.now.translation - self.from.translation;
            let from_within = !pushed && advance.dot(outward) > 0.0;
            let way = match gap < 0.0 && !from_within {
                true => self.body.way_out(self.now, point, -outward, THROUGH_MM),
                false => None,
            };
            let Some(way) = way else {
                return RELEASED;
            };
            (normal, gap) = (-outward, -way);
        }
        let carried = self
            .now
            .transform_point(self.from.inverse_transform_point(start));
        Contact {
            law: Law::Touch {
                friction: self.friction,
            },
            normal,
            gap: gap + self.allowed,
            slip: point - start - (carried - start),
        }
    }
}

/// A sample that no tool touches.
const RELEASED: Contact = Contact {
    law: Law::Touch { friction: 0.0 },
    normal: Vector::X,
    gap: f32::MAX,
    slip: Vector::ZERO,
};

/// The tools of a step on their way, over the tissue's surface.
pub(super) struct Moving<'a> {
    pub tools: &'a [Tool],
    /// Where they were at the start of the step.
    pub before: &'a [Pose],
    /// How far inside each may be, mm.
    pub allowed: &'a [f32],
    /// What each holds.
    pub held: &'a [Held],
    pub samples: &'a Samples,
    pub state: State<'a>,
    /// The part of their way that they have gone.
    pub part: f32,
}

impl Moving<'_> {
    /// Gap and slip of a row at its point.
    pub(super) fn measure(&self, row: &Row) -> Contact {
        let index = row.tool as usize;
        let Some(tool) = self.tools.get(index) else {
            return RELEASED;
        };
        let before = &self.before[index];
        let pair = Pair {
            body: &tool.body,
            friction: tool.friction,
            from: before,
            now: &pose::between(before, &tool.pose, self.part),
            anchor: self.held[index].grasp.place(row.sample),
            allowed: self.allowed[index],
        };
        let sample = self.samples.rows()[row.sample as usize];
        let State { rest, start, .. } = self.state;
        let start = sample.gather(|node| vector(rest, node) + vector(start, node));
        pair.contact(row.point, start, row.outward, row.force != Vector::ZERO)
    }
}
