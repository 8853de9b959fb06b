//! Which samples are near which tool.
//!
//! A face all of whose corners lie on one side of the box around a tool has no sample in it, since samples lie between their
//! corners however the tissue is deformed. So a search is a box test a node, a mask a face, and the exact distance for
//! the few samples that are left. Tools in their order, samples ascending: the same candidates in the same order each
//! time. Buffers are reused: no allocation once they have grown.

use crate::body::Body;
use crate::samples::Samples;
use parry3d::math::{Pose, Vector};
use std::collections::TryReserveError;

/// How far from a tool samples are looked at, in addition to its motion, mm.
pub const SKIN_MM: f32 = 1.0;

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
    /// By place in `Samples::nodes`: sides of the box that the node is beyond.
    beyond: Vec<u8>,
    found: Vec<Candidate>,
}

impl Search {
    /// Room for what one tool finds at most, so that no search of it allocates.
    ///
    /// # Errors
    /// No memory.
    pub fn with_room(samples: &Samples) -> Result<Self, TryReserveError> {
        let mut search = Self::default();
        search.beyond.try_reserve_exact(samples.nodes().len())?;
        search.found.try_reserve_exact(samples.len())?;
        Ok(search)
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.beyond.capacity() + size_of::<Candidate>() * self.found.capacity()
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
            let (low, high) = tool.body.bounds(&tool.pose, tool.skin);
            self.beyond.clear();
            let sides = |node: &u32| {
                let p = position(*node);
                p.cmplt(low).bitmask() as u8 | (p.cmpgt(high).bitmask() as u8) << 3
            };
            self.beyond.extend(samples.nodes().iter().map(sides));
            for face in 0..samples.face_count() {
                let [a, b, c] = samples.corners(face).map(|n| self.beyond[n as usize]);
                if a & b & c != 0 {
                    continue;
                }
                for row in samples.of_face(face) {
                    let point = samples.rows()[row].gather(&position);
                    if point.cmplt(low).any() || point.cmpgt(high).any() {
                        continue;
                    }
                    let nearest = tool.body.nearest_at(&tool.pose, point);
                    if nearest.distance <= tool.skin {
                        self.found.push(Candidate {
                            tool: index as u32,
                            sample: row as u32,
                            point,
                            distance: nearest.distance,
                            normal: nearest.normal,
                        });
                    }
                }
            }
        }
        &self.found
    }

    /// What the last search found.
    pub fn found(&self) -> &[Candidate] {
        &self.found
    }
}
