//! How the samples of a surface are made, face by face.
//!
//! Corners are samples, edges are cut into equal parts no longer than the spacing, and the inside
//! of a face is cut by the parts of its longest edge. An edge is cut the same way from both of its
//! faces, so no sample is made twice and none is missing between two faces.

use crate::sample::{Sample, between};
use parry3d::math::Vector;
use std::collections::{HashSet, TryReserveError};

/// Where the faces of each place start in a list by place, and that list.
pub(super) fn faces_at(
    corners: &[[u32; 3]],
    places: usize,
) -> Result<(Vec<u32>, Vec<u32>), TryReserveError> {
    let (mut starts, mut around) = (Vec::new(), Vec::new());
    starts.try_reserve_exact(places + 1)?;
    around.try_reserve_exact(3 * corners.len())?;
    starts.resize(places + 1, 0);
    around.resize(3 * corners.len(), 0);
    for place in corners.as_flattened() {
        starts[*place as usize] += 1;
    }
    let mut end = 0;
    for start in &mut starts {
        end += *start;
        *start = end;
    }
    // From the last face back: each goes before the one that is there.
    for (face, corners) in corners.iter().enumerate().rev() {
        for place in corners {
            let at = &mut starts[*place as usize];
            *at -= 1;
            around[*at as usize] = face as u32;
        }
    }
    Ok((starts, around))
}

/// Makes the samples of faces, each corner and each edge once: neighbours share theirs.
pub(super) struct Builder<'a> {
    pub positions: &'a [[f32; 3]],
    /// Those that are nodes, and the others.
    pub corners: (&'a [u32], &'a [Sample]),
    /// Edges are cut into parts of this length at most, mm at rest.
    pub spacing: f64,
    /// Nodes that cannot move: a sample of such nodes alone is left out, since no contact moves it.
    pub held: HashSet<u32>,
    /// Places whose sample is made, or was left out.
    pub seen_corners: HashSet<u32>,
    /// Edges, the smaller place first, whose samples are made.
    pub seen_edges: HashSet<(u32, u32)>,
    /// The samples in the order of the faces that made them: corners, edges, inside.
    pub rows: Vec<Sample>,
}

impl Builder<'_> {
    /// Of the places of a face's corners. Gives the parts that it makes of the longest edge.
    pub fn face(&mut self, face: [u32; 3]) -> Result<usize, TryReserveError> {
        for place in face {
            if self.seen_corners.insert(place) {
                self.push([place; 3], [1.0, 0.0, 0.0])?;
            }
        }
        let mut longest = 0.0f64;
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            // By number, so that an edge looks the same from both sides.
            let (a, b) = (a.min(b), a.max(b));
            let length = self.length(a, b);
            longest = longest.max(length);
            if self.seen_edges.insert((a, b)) {
                let parts = self.parts(length);
                for i in 1..parts {
                    let t = i as f32 / parts as f32;
                    self.push([a, b, a], [1.0 - t, t, 0.0])?;
                }
            }
        }
        let parts = self.parts(longest);
        let part = |i: usize| i as f32 / parts as f32;
        for i in 1..parts {
            for j in 1..parts - i {
                self.push(face, [part(parts - i - j), part(i), part(j)])?;
            }
        }
        Ok(parts)
    }

    /// Adds the sample at weights on a face's places, unless all its nodes are held.
    fn push(&mut self, places: [u32; 3], weights: [f32; 3]) -> Result<(), TryReserveError> {
        let sample = between(self.corners, places, weights);
        if sample.entries().any(|(node, _)| !self.held.contains(&node)) {
            self.rows.try_reserve(1)?;
            self.rows.push(sample);
        }
        Ok(())
    }

    /// Length of an edge at rest, mm.
    fn length(&self, a: u32, b: u32) -> f64 {
        let (a, b) = (self.at(a), self.at(b));
        let square = |k: usize| (f64::from(a[k]) - f64::from(b[k])).powi(2);
        (square(0) + square(1) + square(2)).sqrt()
    }

    /// Where a corner is at rest.
    fn at(&self, place: u32) -> [f32; 3] {
        let (nodes, points) = self.corners;
        match nodes.get(place as usize) {
            Some(node) => self.positions[*node as usize],
            None => {
                let own = points[place as usize - nodes.len()];
                let at = own.gather(|node| Vector::from(self.positions[node as usize]));
                at.to_array()
            }
        }
    }

    /// Parts of an edge of this length, at least one.
    fn parts(&self, length: f64) -> usize {
        (length / self.spacing).ceil().max(1.0) as usize
    }
}
