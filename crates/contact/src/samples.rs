//! Where contact is looked at: points on the nodes, edges and faces of the touchable surface.
//!
//! A sample is a fixed combination of at most three nodes, a row of `B`: its displacement is `B u`, and a force `f` on it is
//! `B^T f` on the nodes. Neighbours are at most [`SPACING_MM`] apart at rest, and each point occurs once: an edge's
//! samples belong to the first face that has it. Positions, faces and spacing alone decide the samples and their order, so
//! the reference solver and the runtime see the same ones.

use parry3d::math::Vector;
use std::collections::{HashSet, TryReserveError};

/// Largest distance between neighbouring samples, mm: with 2.8 mm errors are seven times larger, with nodes alone 500
/// times.
pub const SPACING_MM: f32 = 1.7;

/// A point of the surface: nodes and weights that sum to 1. Unused places repeat the first node with weight 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    pub nodes: [u32; 3],
    pub weights: [f32; 3],
}

impl Sample {
    /// The sample's value of a nodal field: positions, displacements, velocities.
    #[inline]
    pub fn gather(&self, field: impl Fn(u32) -> Vector) -> Vector {
        let [a, b, c] = self.nodes;
        let [u, v, w] = self.weights;
        field(a) * u + field(b) * v + field(c) * w
    }

    /// Nodes with a weight that is not zero, with it.
    pub fn entries(&self) -> impl Iterator<Item = (u32, f32)> + '_ {
        let entries = self.nodes.iter().copied().zip(self.weights);
        entries.filter(|(_, weight)| *weight != 0.0)
    }
}

/// All samples of a surface, grouped by face.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    rows: Vec<Sample>,
    /// Distinct nodes of the faces, ascending.
    nodes: Vec<u32>,
    /// Places in `nodes` of each face's corners.
    corners: Vec<[u32; 3]>,
    /// Samples of face `f` are `rows[offsets[f]..offsets[f + 1]]`.
    offsets: Vec<u32>,
}

impl Samples {
    /// Samples `faces` (mesh nodes) of a mesh with rest positions `[K,3]`, at most `spacing_mm` apart. Samples with no node
    /// but `held` ones cannot move and are left out.
    ///
    /// Panics when a face names a node that `positions` does not have, and where there is no memory: see [`Samples::try_new`].
    pub fn new(
        positions: &[[f32; 3]],
        faces: impl IntoIterator<Item = [u32; 3]>,
        held: &[u32],
        spacing_mm: f32,
    ) -> Self {
        let faces: Vec<[u32; 3]> = faces.into_iter().collect();
        match Self::try_new(positions, &faces, held, spacing_mm) {
            Ok(samples) => samples,
            Err(error) => panic!("the samples of the surface: {error}"),
        }
    }

    /// As [`Samples::new`].
    ///
    /// Panics when a face names a node that `positions` does not have.
    ///
    /// # Errors
    /// No memory.
    pub fn try_new(
        positions: &[[f32; 3]],
        faces: &[[u32; 3]],
        held: &[u32],
        spacing_mm: f32,
    ) -> Result<Self, TryReserveError> {
        let (mut nodes, mut corners, mut offsets) = (Vec::new(), Vec::new(), Vec::new());
        nodes.try_reserve_exact(3 * faces.len())?;
        corners.try_reserve_exact(faces.len())?;
        offsets.try_reserve_exact(faces.len() + 1)?;
        nodes.extend_from_slice(faces.as_flattened());
        nodes.sort_unstable();
        nodes.dedup();
        let place = |node: u32| nodes.partition_point(|n| *n < node) as u32;
        corners.extend(faces.iter().map(|face| face.map(place)));
        let mut builder = Builder {
            positions,
            spacing: f64::from(spacing_mm),
            held: HashSet::new(),
            seen_nodes: HashSet::new(),
            seen_edges: HashSet::new(),
            rows: Vec::new(),
        };
        builder.held.try_reserve(held.len())?;
        builder.held.extend(held);
        builder.seen_nodes.try_reserve(nodes.len())?;
        builder.seen_edges.try_reserve(3 * faces.len())?;
        offsets.push(0);
        for face in faces {
            builder.face(*face)?;
            offsets.push(builder.rows.len() as u32);
        }
        Ok(Self {
            rows: builder.rows,
            nodes,
            corners,
            offsets,
        })
    }

    /// The same of rows `domain` of a mesh's boundary triangles `surface`.
    ///
    /// Panics when `domain` names a row that `surface` does not have.
    pub fn of_domain(
        positions: &[[f32; 3]],
        surface: &[[u32; 3]],
        domain: &[u32],
        held: &[u32],
        spacing_mm: f32,
    ) -> Self {
        let faces = domain.iter().map(|row| surface[*row as usize]);
        Self::new(positions, faces, held, spacing_mm)
    }

    /// All samples.
    pub fn rows(&self) -> &[Sample] {
        &self.rows
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Distinct nodes of the sampled faces, ascending.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Number of sampled faces.
    pub fn face_count(&self) -> usize {
        self.corners.len()
    }

    /// Places in [`Samples::nodes`] of a face's corners.
    pub fn corners(&self, face: usize) -> [u32; 3] {
        self.corners[face]
    }

    /// The face that a sample belongs to.
    pub fn face_of(&self, sample: u32) -> usize {
        self.offsets.partition_point(|start| *start <= sample) - 1
    }

    /// Samples that belong to a face, as a range of [`Samples::rows`].
    pub fn of_face(&self, face: usize) -> std::ops::Range<usize> {
        self.offsets[face] as usize..self.offsets[face + 1] as usize
    }
}

struct Builder<'a> {
    positions: &'a [[f32; 3]],
    spacing: f64,
    held: HashSet<u32>,
    seen_nodes: HashSet<u32>,
    seen_edges: HashSet<(u32, u32)>,
    rows: Vec<Sample>,
}

impl Builder<'_> {
    fn face(&mut self, face: [u32; 3]) -> Result<(), TryReserveError> {
        for node in face {
            if self.seen_nodes.insert(node) {
                self.push([node; 3], [1.0, 0.0, 0.0])?;
            }
        }
        let mut longest = 0.0f64;
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            // By node number, so that an edge looks the same from both sides.
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
        Ok(())
    }

    fn push(&mut self, nodes: [u32; 3], weights: [f32; 3]) -> Result<(), TryReserveError> {
        let sample = Sample { nodes, weights };
        if sample.entries().any(|(node, _)| !self.held.contains(&node)) {
            self.rows.try_reserve(1)?;
            self.rows.push(sample);
        }
        Ok(())
    }

    fn length(&self, a: u32, b: u32) -> f64 {
        let (a, b) = (self.positions[a as usize], self.positions[b as usize]);
        let square = |k: usize| (f64::from(a[k]) - f64::from(b[k])).powi(2);
        (square(0) + square(1) + square(2)).sqrt()
    }

    fn parts(&self, length: f64) -> usize {
        (length / self.spacing).ceil().max(1.0) as usize
    }
}
