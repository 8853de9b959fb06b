//! The rows of a contact problem: samples near tools, and their gaps and slips at a state of the tissue.

use ::contact::{Body, Contact, LEAN, Law, Nearest, Pose, Samples, Vector, pose};

use super::buried::Buried;
use super::past::Held;
use super::state::State;
use super::ties::{Placed, Pulling, tie_of};
use super::tool::Tool;
use crate::memory::HeldBytes;

/// Samples that one solve may have: what a tool as large as the organ touches beyond these is left to the next solve.
pub(super) const MOST_ROWS: usize = 256;
/// Tissue that is farther from a tool is not pushed by it, mm.
pub(super) const OPEN_MM: f32 = 0.5;
/// What lacks memory.
pub(super) const WHAT: &str = "the contact of instruments";

/// Longest way out of a tool, or to its far side, mm.
const THROUGH_MM: f32 = 45.0;
/// What lies deeper inside of a tool at the start of a step comes out by this much a step, mm.
const RECOVERY_MM: f32 = 3.0;
/// A sample no deeper than this in a tool has not been gone through by it, mm, ...
const SHALLOW_MM: f32 = 0.5;
/// ... nor one from which the way back through the tool is more than this many times its depth: that way grazes the tool's side.
const LONG_WAY: f32 = 4.0;
/// A way that comes no nearer than this to the box around a tool does not graze it, mm.
const GRAZED_MM: f32 = 0.1;
/// A force this near (cosine) to the normal of a broad tool's nearest face comes from there, friction and all.
const SAME_FACE: f32 = 0.7;

/// A sample that is looked at.
#[derive(Clone, Copy, Debug, HeldBytes)]
pub(super) struct Row {
    pub(super) tool: u32,
    pub(super) sample: u32,
    pub(super) force: Vector,
    pub(super) point: Vector,
    /// Neither pushed nor held, and farther from its tool than [`::contact::SKIN_MM`].
    pub(super) far: bool,
    /// From its tool, where too many rows are ranked by it, mm.
    pub(super) gap: f32,
    /// Of the tissue's surface, outward.
    pub(super) outward: Vector,
    /// It is on a wall that a blade has laid open.
    pub(super) is_wall: bool,
}

/// A tool on its way from one pose to another, and a sample that it may touch.
pub struct Pair<'a> {
    pub body: &'a Body,
    /// Coulomb's coefficient.
    pub friction: f32,
    pub from: &'a Pose,
    pub now: &'a Pose,
    /// Place of a held sample in the tool's frame.
    pub anchor: Option<Vector>,
    /// The tool was put where it is: nobody knows which way it came.
    pub put: bool,
    /// The tool is so quick or thin that it may go past a sample between two looks.
    pub swept: bool,
    /// The tool lies in the tissue: unit direction of the shortest way out.
    pub way_out: Option<Vector>,
    /// The sample is on a wall that a blade has laid open.
    pub is_wall: bool,
}

impl Pair<'_> {
    /// Gap and slip of a sample that was at `start` and is at `point`, on a surface with normal `outward`, under `force` so far.
    ///
    /// It comes out of the tool where it is nearest to its surface, unless the tool has gone through the tissue's surface there: then
    /// into the tissue, the way that the tool came, to the tool's far side, be the tool still there or farther on.
    pub fn contact(&self, point: Vector, start: Vector, outward: Vector, force: Vector) -> Contact {
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
        let carried = self
            .now
            .transform_point(self.from.inverse_transform_point(start));
        if let Some(out) = self.way_out
            && normal.dot(out) > -LEAN
        {
            let way = self.body.way_through(self.now, point, -out, THROUGH_MM);
            match way {
                Some(way) => (normal, gap) = (-out, -way),
                None if force == Vector::ZERO => return RELEASED,
                None => {}
            }
        } else if self.is_wall {
            let Some(nearest) = self.body.nearest_at_wall(self.now, point, outward) else {
                return RELEASED;
            };
            (normal, gap) = (nearest.normal, nearest.distance);
        } else if let Some((face, depth)) = (self.pierced(point, start, outward, gap))
            .or_else(|| self.turned(point, outward, force, &nearest))
        {
            (normal, gap) = (face, -depth);
        } else if normal.dot(outward) > LEAN {
            let pushed = force != Vector::ZERO;
            let leaves = match self.swept {
                true => (carried - start).dot(outward) > 0.0,
                false => (self.now.translation - self.from.translation).dot(outward) > 0.0,
            };
            let passed = match self.swept && gap >= 0.0 {
                true => self.passed(point, start, outward),
                false => None,
            };
            if !pushed && (leaves || (gap >= 0.0 && passed.is_none())) {
                return RELEASED;
            }
            if let Some((back, way)) = passed {
                (normal, gap) = (back, -way);
            } else if gap < 0.0 || (self.swept && force.dot(outward) < 0.0) {
                let way = self.body.way_through(self.now, point, -outward, THROUGH_MM);
                let length = way.unwrap_or(THROUGH_MM);
                let back = force.dot(outward) < -force.dot(normal)
                    && length <= self.moved(point, start) + RECOVERY_MM;
                if back || (gap < 0.0 && (self.put || self.went(point, start, length))) {
                    let Some(way) = way else {
                        return RELEASED;
                    };
                    (normal, gap) = (-outward, -way);
                }
            }
        }
        Contact {
            law: Law::Touch {
                friction: self.friction,
            },
            normal,
            gap,
            slip: point - start - (carried - start),
        }
    }

    /// Where a thin tool, or a broad one in a quick step, has pierced the surface at a sample that lies inside of it: the normal where it
    /// entered, and how far ago. By the shortest way the surface would come out at the tool's side.
    fn pierced(
        &self,
        point: Vector,
        start: Vector,
        outward: Vector,
        gap: f32,
    ) -> Option<(Vector, f32)> {
        let enters = self.body.pierces() || (self.swept && self.body.is_broad());
        if gap >= 0.0 || !enters {
            return None;
        }
        let [now, then] = [(self.now, point), (self.from, start)]
            .map(|(pose, point)| pose.inverse_transform_point(point));
        let (entry, normal) = self.body.entry(then, now)?;
        let face = self.now.rotation * normal;
        let depth = (entry - now).dot(normal);
        (face.dot(outward) < -LEAN && depth > 0.0).then_some((face, depth))
    }

    /// The face of a broad tool that pushes a sample inside of it, where another has become nearer, and how deep the sample lies behind it:
    /// what a blade presses on does not slip round its edge, unless it leaves the blade there.
    fn turned(
        &self,
        point: Vector,
        outward: Vector,
        force: Vector,
        nearest: &Nearest,
    ) -> Option<(Vector, f32)> {
        if nearest.distance >= 0.0 || !self.body.is_broad() {
            return None;
        }
        let pushed = force.try_normalize()?;
        if nearest.normal.dot(pushed) > SAME_FACE {
            return None;
        }
        let way = (self.body).way_out(self.now, point, pushed, 2.0 * self.body.size())?;
        let out = point + pushed * way;
        let face = self.body.nearest_at(self.now, out).normal;
        let depth = (out - point).dot(face);
        (face.dot(outward) < -LEAN && depth > 0.0).then_some((face, depth))
    }

    /// Where the tool has gone past a sample and on into the tissue since the sample was at `start`: the direction back along its way as the
    /// tool sees it, and how far it is back to the tool's far side.
    fn passed(&self, point: Vector, start: Vector, outward: Vector) -> Option<(Vector, f32)> {
        let [now, then] = [(self.now, point), (self.from, start)]
            .map(|(pose, point)| pose.inverse_transform_point(point));
        let way = self.now.rotation * (then - now);
        if way.dot(outward) >= 0.0 || self.body.nearest(then).distance < -SHALLOW_MM {
            return None;
        }
        let back = way.try_normalize()?;
        let length = way.length() + SHALLOW_MM;
        Some((back, self.body.way_through(self.now, point, back, length)?))
    }

    /// Whether a sample that is clear of the tool and not pushed may be in contact with it: the tool lies in the tissue, or the way back from the sample to
    /// where it was, as the tool sees it, crosses the box around the tool.
    pub(super) fn may_reach(&self, point: Vector, start: Vector) -> bool {
        if self.way_out.is_some() {
            return true;
        }
        if !self.swept {
            return false;
        }
        let [now, then] = [(self.now, point), (self.from, start)]
            .map(|(pose, point)| pose.inverse_transform_point(point));
        let way = then - now;
        let back = way + way.normalize_or_zero() * SHALLOW_MM;
        let (low, high) = self.body.bounds(&Pose::IDENTITY, GRAZED_MM);
        // The parts of the way that are between the two planes of each axis.
        let [from, to] = [low, high].map(|side| (side - now) / back);
        let enters = from.min(to).max_element();
        let leaves = from.max(to).min_element();
        // Along an axis, or where the way has no length, nothing is known.
        let is_known = enters.is_finite() && leaves.is_finite();
        !is_known || (enters <= leaves && enters <= 1.0 && leaves >= 0.0)
    }

    /// Whether a sample may have come `way` into the tool since it was at `start`, or lay in it already.
    fn went(&self, point: Vector, start: Vector, way: f32) -> bool {
        let depth = -self.body.nearest_at(self.from, start).distance;
        let lay_in_it = depth > SHALLOW_MM && way <= LONG_WAY * depth;
        lay_in_it || way <= self.moved(point, start) + SHALLOW_MM
    }

    /// How far a sample has come since it was at `start`, as the tool sees it, mm.
    fn moved(&self, point: Vector, start: Vector) -> f32 {
        let [now, then] = [(self.now, point), (self.from, start)]
            .map(|(pose, point)| pose.inverse_transform_point(point));
        now.distance(then)
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
    /// Which of them were put there in this step.
    pub put: &'a [bool],
    /// Which of them are quick or thin.
    pub swept: &'a [bool],
    /// Those that lie in the tissue.
    pub buried: &'a [Option<Buried>],
    /// What each holds.
    pub held: &'a [Held],
    pub samples: &'a Samples,
    pub state: State<'a>,
    /// The part of their way that they have gone.
    pub part: f32,
    pub pulling: Pulling<'a>,
}

impl Moving<'_> {
    /// Gap and slip of a row at its point. What lay deep inside of the tool when the step began may stay so, but for [`RECOVERY_MM`].
    pub(super) fn measure(&self, row: &Row) -> Contact {
        if let Some(index) = tie_of(row.sample) {
            let tie = self.pulling.ties.get(index).map(Placed::row);
            let start = tie.unwrap_or_default();
            let start = start.gather(|node| self.state.position_before(node));
            let contact = self.pulling.contact(index, row.point, start, self.part);
            return contact.unwrap_or(RELEASED);
        }
        let mut contact = self.contact(row, self.part);
        if contact.gap < 0.0 {
            let sample = self.samples.at(row.sample);
            let point = sample.gather(|node| self.state.position_before(node));
            let then = self.contact(&Row { point, ..*row }, 0.0);
            contact.gap += (-then.gap - RECOVERY_MM).max(0.0);
        }
        contact
    }

    /// The same, with the tool at part `part` of its way and nothing allowed.
    pub(super) fn contact(&self, row: &Row, part: f32) -> Contact {
        let index = row.tool as usize;
        let Some(tool) = self.tools.get(index) else {
            return RELEASED;
        };
        let before = &self.before[index];
        let pair = Pair {
            body: &tool.body,
            friction: tool.friction,
            from: before,
            now: &pose::between(before, &tool.pose, part),
            anchor: self.held[index].grasp.place(row.sample),
            put: self.put[index],
            swept: self.swept[index],
            way_out: self.buried[index]
                .filter(|buried| row.sample == buried.row || buried.out.dot(row.outward) > 0.5)
                .map(|buried| buried.out),
            is_wall: row.is_wall,
        };
        let sample = self.samples.at(row.sample);
        let start = sample.gather(|node| self.state.position_before(node));
        pair.contact(row.point, start, row.outward, row.force)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::contact::Shape;

    /// A plate, 20 by 2 by 20 mm, that went from height `from` to height `to`, and a sample that did not move: its contact.
    fn plate(from: f32, to: f32, at: Vector, outward: Vector, force: Vector, put: bool) -> Contact {
        slab(1.0, [from, to], at, outward, force, put)
    }

    /// A plate of half the thickness `half`.
    fn slab(
        half: f32,
        [from, to]: [f32; 2],
        at: Vector,
        outward: Vector,
        force: Vector,
        put: bool,
    ) -> Contact {
        let half_extents = [10.0, half, 10.0];
        let body = Body::new(&Shape::Box { half_extents }).unwrap();
        let pose = |height| Pose::from_translation(Vector::new(0.0, height, 0.0));
        let pair = Pair {
            body: &body,
            friction: 0.0,
            from: &pose(from),
            now: &pose(to),
            anchor: None,
            put,
            swept: !put,
            way_out: None,
            is_wall: false,
        };
        pair.contact(at, at, outward, force)
    }

    #[test]
    fn a_surface_that_a_tool_went_through_comes_back_the_way_it_came() {
        // From above the surface at 0 to 0.6 below it: the near way out is up, out of the tissue.
        let contact = plate(1.5, -0.6, Vector::ZERO, Vector::Y, Vector::ZERO, false);
        assert_eq!(contact.normal, -Vector::Y);
        assert!((contact.gap + 1.6).abs() < 1e-2, "{contact:?}");
        // And goes on so while it is pushed, and where the tool was put there.
        for (force, put) in [(-Vector::Y, false), (Vector::ZERO, true)] {
            let contact = plate(-0.6, -0.6, Vector::ZERO, Vector::Y, force, put);
            assert_eq!(contact.normal, -Vector::Y, "{contact:?}");
        }
    }

    #[test]
    fn a_surface_in_front_of_a_quick_slab_is_pushed_on_and_not_past_its_edge() {
        // The slab's front is 1.2 mm behind the sample, its edge 0.2 mm beside it.
        let at = Vector::new(9.8, 0.0, 0.0);
        let contact = slab(2.0, [2.5, 0.8], at, Vector::Y, Vector::ZERO, false);
        assert_eq!(contact.normal, -Vector::Y);
        assert!((contact.gap + 1.2).abs() < 1e-2, "{contact:?}");
    }

    #[test]
    fn what_a_slab_pushes_does_not_slip_round_its_edge() {
        // It lies 0.5 mm behind the front and 0.2 mm from the edge.
        let at = Vector::new(9.8, -1.5, 0.0);
        let contact = slab(2.0, [0.0; 2], at, Vector::Y, -Vector::Y, false);
        assert_eq!(contact.normal, -Vector::Y);
        assert!((contact.gap + 0.5).abs() < 1e-2, "{contact:?}");
        // Nothing has pushed it yet: the edge is nearer.
        let contact = slab(2.0, [0.0; 2], at, Vector::Y, Vector::ZERO, false);
        assert_eq!(contact.normal, Vector::X, "{contact:?}");
    }

    #[test]
    fn a_surface_that_leans_over_an_edge_is_pushed_off_it_and_not_through_the_tool() {
        // It lies 0.05 mm deep at the side of the plate and its normal has come round: across the plate it would be 19 mm.
        let (at, outward) = (
            Vector::new(9.95, 0.0, 0.0),
            Vector::new(0.3, 0.0, 1.0).normalize(),
        );
        for force in [Vector::ZERO, Vector::X] {
            let contact = plate(0.0, 0.0, at, outward, force, false);
            assert_eq!(contact.normal, Vector::X);
            assert!((contact.gap + 0.05).abs() < 1e-4, "{contact:?}");
        }
        // What a tool reaches from within the tissue is not pushed out of it.
        let (at, outward) = (Vector::new(0.0, 0.9, 0.0), Vector::Y);
        let contact = plate(-0.1, 0.0, at, outward, Vector::ZERO, false);
        assert_eq!(contact.gap, f32::MAX);
    }
}
