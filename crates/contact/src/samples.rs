//! Where contact is looked at: points on the nodes, edges and faces of the touchable surface.
//!
//! A sample is a fixed combination of at most three nodes, a row of `B`: its displacement is `B u`, and a force `f` on it is
//! `B^T f` on the nodes. Neighbours are at most [`SPACING_MM`] apart at rest, and each point occurs once: an edge's
//! samples belong to the first face that has it. Positions, faces and spacing alone decide the samples and their order, so
//! the reference solver and the runtime see the same ones.
//!
//! A thin tool passes between samples, and a thicker one where the tissue is stretched. There a finer *lattice* of points is
//! touched too, [`LATTICE`] parts to an edge, whose rows are numbered after those of the samples and computed when asked for ([`Samples::at`], [`Samples::lattice_row`]).

use parry3d::math::Vector;
use std::collections::{HashSet, TryReserveError};

/// Largest distance between neighbouring samples, mm: with 2.8 mm errors are seven times larger, with nodes alone 500
/// times.
pub const SPACING_MM: f32 = 1.7;

/// Parts of a face's edge in the lattice: 0.06 mm on an edge of 4 mm.
pub const LATTICE: u32 = 64;
/// Numbers that a face's lattice takes up; those with `i + j > LATTICE` name no point.
const PER_FACE: u32 = (LATTICE + 1) * (LATTICE + 1);

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
    /// Faces at the node in place `n`, ascending: `around[starts[n]..starts[n + 1]]`.
    around: Vec<u32>,
    starts: Vec<u32>,
    /// Samples of face `f` are `rows[offsets[f]..offsets[f + 1]]`.
    offsets: Vec<u32>,
    /// Parts that the samples make of each face's longest edge.
    parts: Vec<u16>,
    /// Whether there is a lattice between them.
    has_lattice: bool,
}

impl Samples {
    /// Samples `faces` (mesh nodes) of a mesh with rest positions `[K,3]`, at most `spacing_mm` apart; with a larger spacing than
    /// [`SPACING_MM`] there is no lattice. Samples with no node but `held` ones cannot move and are left out.
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
        let (starts, around) = faces_at_nodes(&corners, nodes.len())?;
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
        let mut parts = Vec::new();
        parts.try_reserve_exact(faces.len())?;
        offsets.push(0);
        for face in faces {
            parts.push(builder.face(*face)?.min(usize::from(u16::MAX)) as u16);
            offsets.push(builder.rows.len() as u32);
        }
        Ok(Self {
            rows: builder.rows,
            nodes,
            corners,
            around,
            starts,
            offsets,
            parts,
            has_lattice: spacing_mm <= SPACING_MM,
        })
    }

    /// The samples of rows `domain` of a mesh's boundary triangles `surface`.
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

    /// The point of a row: a sample, or one of the lattice.
    ///
    /// Panics when there is no such row ([`Samples::is_row`]).
    #[inline]
    pub fn at(&self, row: u32) -> Sample {
        match self.rows.get(row as usize) {
            Some(sample) => *sample,
            None => {
                let (face, [i, j]) = self.lattice_place(row);
                let part = |n: u32| n as f32 / LATTICE as f32;
                Sample {
                    nodes: self.corners[face].map(|place| self.nodes[place as usize]),
                    weights: [part(LATTICE - i - j), part(i), part(j)],
                }
            }
        }
    }

    /// Whether a number is that of a sample or of a point of the lattice.
    pub fn is_row(&self, row: u32) -> bool {
        (row as usize) < self.rows.len() || {
            let (face, [i, j]) = self.lattice_place(row);
            face < self.corners.len() && i + j <= LATTICE
        }
    }

    /// The row of a face's lattice point with weights `(LATTICE - i - j, i, j) / LATTICE`; none on a surface with so many faces that
    /// the numbers do not suffice.
    pub fn lattice_row(&self, face: usize, [i, j]: [u32; 2]) -> Option<u32> {
        let face = u32::try_from(face).ok()?;
        let own = i * (LATTICE + 1) + j;
        let start = u32::try_from(self.rows.len()).ok()?;
        face.checked_mul(PER_FACE)?
            .checked_add(own)?
            .checked_add(start)
    }

    /// Face and place of a row of the lattice.
    fn lattice_place(&self, row: u32) -> (usize, [u32; 2]) {
        let row = row - self.rows.len() as u32;
        let own = row % PER_FACE;
        let (i, j) = (own / (LATTICE + 1), own % (LATTICE + 1));
        ((row / PER_FACE) as usize, [i, j])
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

    /// Faces with a corner at a place in [`Samples::nodes`], ascending.
    pub fn faces_at(&self, place: u32) -> &[u32] {
        let [from, to] = [place, place + 1].map(|n| self.starts[n as usize] as usize);
        &self.around[from..to]
    }

    /// How far apart the samples of a face are where its longest edge has become `longest` mm; none where that does not matter.
    pub fn spacing(&self, face: usize, longest: f32) -> Option<f32> {
        self.has_lattice
            .then(|| longest / f32::from(self.parts[face]))
    }

    /// The face that a row belongs to.
    pub fn face_of(&self, row: u32) -> usize {
        match (row as usize) < self.rows.len() {
            true => self.offsets.partition_point(|start| *start <= row) - 1,
            false => self.lattice_place(row).0,
        }
    }

    /// Samples that belong to a face, as a range of [`Samples::rows`].
    pub fn of_face(&self, face: usize) -> std::ops::Range<usize> {
        self.offsets[face] as usize..self.offsets[face + 1] as usize
    }
}

/// Where the faces of each node start in a list by node, and that list.
fn faces_at_nodes(
    corners: &[[u32; 3]],
    nodes: usize,
) -> Result<(Vec<u32>, Vec<u32>), TryReserveError> {
    let (mut starts, mut around) = (Vec::new(), Vec::new());
    starts.try_reserve_exact(nodes + 1)?;
    around.try_reserve_exact(3 * corners.len())?;
    starts.resize(nodes + 1, 0);
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

struct Builder<'a> {
    positions: &'a [[f32; 3]],
    spacing: f64,
    held: HashSet<u32>,
    seen_nodes: HashSet<u32>,
    seen_edges: HashSet<(u32, u32)>,
    rows: Vec<Sample>,
}

impl Builder<'_> {
    /// Gives the parts that it makes of the longest edge.
    fn face(&mut self, face: [u32; 3]) -> Result<usize, TryReserveError> {
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
        Ok(parts)
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
