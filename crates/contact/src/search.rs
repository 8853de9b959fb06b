//! Which samples are near which tool.
//!
//! A face all of whose corners lie on one side of the box around a tool has no sample in it, since samples lie between their
//! corners however the tissue is deformed. So a search is a box test a node, a mask a face, and the exact distance for
//! the few samples that are left. Where a face's samples are so far apart that the tool would sink between them
//! ([`Body::sinks_between`]) the nearest point of the face's lattice is a candidate too. Tools in their order, samples ascending: the same candidates in the same order each
//! time. Buffers are reused: no allocation once they have grown.

use crate::body::{Body, Nearest};
use crate::samples::{LATTICE, Samples};
use parry3d::math::{Pose, Vector};
use std::collections::TryReserveError;

/// How far from a tool samples are looked at, in addition to its motion, mm.
pub const SKIN_MM: f32 = 1.0;

/// What distances may be off by, mm.
const ROUNDING_MM: f32 = 0.01;

/// A tool where it is, and how far from it to look: [`SKIN_MM`] and its motion ([`Body::motion`]).
#[derive(Clone, Copy, Debug)]
pub struct Placed<'a> {
    pub body: &'a Body,
    pub pose: Pose,
    pub skin: f32,
}

/// A sample near a tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Place in the list of tools.
    pub tool: u32,
    /// Row of the samples.
    pub sample: u32,
    /// Where the sample is, mm.
    pub point: Vector,
    /// To the tool's surface, negative inside, mm.
    pub distance: f32,
    /// Out of the tool, unit length.
    pub normal: Vector,
}

/// A search's buffers.
#[derive(Clone, Debug, Default)]
pub struct Search {
    /// By place of a corner: sides of the box that it is beyond.
    beyond: Vec<u8>,
    /// Points of the lattice, which follow the samples.
    between: Vec<Candidate>,
    found: Vec<Candidate>,
}

impl Search {
    /// Room for what one tool finds at most, so that no search of it allocates.
    ///
    /// # Errors
    /// No memory.
    pub fn with_room(samples: &Samples) -> Result<Self, TryReserveError> {
        let mut search = Self::default();
        let corners = samples.nodes().len() + samples.inner_corners().len();
        search.beyond.try_reserve_exact(corners)?;
        // A point of the lattice a face.
        search.between.try_reserve_exact(samples.face_count())?;
        search
            .found
            .try_reserve_exact(samples.len() + samples.face_count())?;
        Ok(search)
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.beyond.capacity()
            + size_of::<Candidate>() * (self.found.capacity() + self.between.capacity())
    }

    /// Samples within each tool's skin; `position` gives a mesh node's present position, mm.
    pub fn find(
        &mut self,
        samples: &Samples,
        tools: &[Placed],
        position: impl Fn(u32) -> Vector,
    ) -> &[Candidate] {
        self.found.clear();
        for (index, tool) in tools.iter().enumerate() {
            self.between.clear();
            let (low, high) = tool.body.bounds(&tool.pose, tool.skin);
            self.beyond.clear();
            let sides =
                |p: Vector| p.cmplt(low).bitmask() as u8 | (p.cmpgt(high).bitmask() as u8) << 3;
            let nodes = samples.nodes().iter();
            self.beyond.extend(nodes.map(|node| sides(position(*node))));
            let inner = samples.inner_corners().iter();
            self.beyond
                .extend(inner.map(|corner| sides(corner.gather(&position))));
            for face in 0..samples.face_count() {
                let [a, b, c] = samples.corners(face).map(|n| self.beyond[n as usize]);
                if a & b & c != 0 || is_far(samples, face, tool, &position) {
                    continue;
                }
                let nearest = nearest_of_face(samples, face, tool, &position);
                let nearest = nearest.map(|(row, at, nearest)| candidate(index, row, at, nearest));
                self.between.extend(nearest);
                for row in samples.of_face(face) {
                    let point = samples.rows()[row].gather(&position);
                    if point.cmplt(low).any() || point.cmpgt(high).any() {
                        continue;
                    }
                    let nearest = tool.body.nearest_at(&tool.pose, point);
                    if nearest.distance <= tool.skin {
                        self.found
                            .push(candidate(index, row as u32, point, nearest));
                    }
                }
            }
            self.found.append(&mut self.between);
        }
        &self.found
    }

    /// What the last search found.
    pub fn found(&self) -> &[Candidate] {
        &self.found
    }
}

/// A sample near a tool, with the nearest point of the tool's surface.
fn candidate(tool: usize, sample: u32, point: Vector, nearest: Nearest) -> Candidate {
    Candidate {
        tool: tool as u32,
        sample,
        point,
        distance: nearest.distance,
        normal: nearest.normal,
    }
}

/// Whether no point of a face is within a tool's skin: distance changes by no more than the way.
fn is_far(samples: &Samples, face: usize, tool: &Placed, position: impl Fn(u32) -> Vector) -> bool {
    let corners = samples.corners(face);
    let corners = corners.map(|place| samples.corner_at(place, &position));
    let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
    let farthest = corners.map(|corner| corner.distance(middle));
    let farthest = farthest.into_iter().fold(ROUNDING_MM, f32::max);
    let distance = tool.body.nearest_at(&tool.pose, middle).distance;
    distance > tool.skin + farthest + ROUNDING_MM
}

/// The point of a face's lattice that is nearest to a tool, or deepest in it, and where it is; none beyond the tool's skin, or where
/// the face's samples suffice.
///
/// Distance to a convex body is a convex function of the place: from the best of a few points it is followed downhill, in steps
/// that become shorter, to a point from which no neighbour is nearer.
fn nearest_of_face(
    samples: &Samples,
    face: usize,
    tool: &Placed,
    position: impl Fn(u32) -> Vector,
) -> Option<(u32, Vector, Nearest)> {
    const FIRST: i32 = LATTICE as i32 / 4;
    const WAYS: [[i32; 2]; 6] = [[1, 0], [-1, 0], [0, 1], [0, -1], [1, -1], [-1, 1]];
    let [a, b, c] = samples
        .corners(face)
        .map(|place| samples.corner_at(place, &position));
    let longest = (b - a).length().max((c - a).length()).max((c - b).length());
    let spacing = samples.spacing(face, longest)?;
    if !tool.body.sinks_between(spacing) {
        return None;
    }
    let (along, across) = ((b - a) / LATTICE as f32, (c - a) / LATTICE as f32);
    let at = |[i, j]: [i32; 2]| {
        let point = a + along * i as f32 + across * j as f32;
        (point, tool.body.nearest_at(&tool.pose, point))
    };
    let mut best = ([0, 0], at([0, 0]));
    for i in 0..=4 {
        for j in 0..=4 - i {
            let place = [FIRST * i, FIRST * j];
            let found = at(place);
            if found.1.distance < best.1.1.distance {
                best = (place, found);
            }
        }
    }
    // No point of the face is farther than a step from one that was looked at.
    if best.1.1.distance - longest / 4.0 > tool.skin {
        return None;
    }
    let mut step = FIRST / 2;
    while step > 0 {
        let [i, j] = best.0;
        for [di, dj] in WAYS {
            let place = [i + step * di, j + step * dj];
            if place[0] < 0 || place[1] < 0 || place[0] + place[1] > LATTICE as i32 {
                continue;
            }
            let found = at(place);
            if found.1.distance < best.1.1.distance {
                best = (place, found);
            }
        }
        if best.0 == [i, j] {
            step /= 2;
        }
    }
    let (place, (point, nearest)) = best;
    if nearest.distance > tool.skin {
        return None;
    }
    let row = samples.lattice_row(face, place.map(|n| n as u32))?;
    Some((row, point, nearest))
}
