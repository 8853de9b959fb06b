//! Where contact is looked at: points on the nodes, edges and faces of the touchable surface.
//!
//! A sample is a fixed combination of at most four nodes, a row of `B`: its displacement is `B u`, and a force `f` on it is
//! `B^T f` on the nodes. On faces of elements it has three at most; where a blade has gone through elements it lies inside of one. Neighbours are at most
//! [`SPACING_MM`] apart at rest, and each point occurs once: an edge's samples belong to the first face that has it. Positions, faces and spacing alone
//! decide the samples and their order, so the reference solver and the runtime see the same ones.
//!
//! A thin tool passes between samples, and a thicker one where the tissue is stretched. There a finer *lattice* of points is
//! touched too, [`LATTICE`] parts to an edge, whose rows are numbered after those of the samples and computed when asked for ([`Samples::at`], [`Samples::lattice_row`]).

mod build;

use crate::sample::{Sample, between};
use build::{Builder, faces_at};
use parry3d::math::Vector;
use std::collections::{HashSet, TryReserveError};

/// Largest distance between neighbouring samples, mm: with 2.8 mm errors are seven times larger, with nodes alone 500
/// times.
pub const SPACING_MM: f32 = 1.7;

/// Parts of a face's edge in the lattice: 0.06 mm on an edge of 4 mm.
pub const LATTICE: u32 = 64;
/// Numbers that a face's lattice takes up; those with `i + j > LATTICE` name no point.
const PER_FACE: u32 = (LATTICE + 1) * (LATTICE + 1);

/// What of a surface is not whole faces of elements, because a blade has gone through them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pieces<'a> {
    /// Nodes of one element and weights, as those of a [`Sample`].
    pub corners: &'a [([u32; 4], [f32; 4])],
    /// Corners of each triangle, outward.
    pub triangles: &'a [[u32; 3]],
    /// Triangles from here on are walls: a blade has gone through elements there.
    pub first_wall: usize,
}

/// Corners that are no nodes.
#[derive(Clone, Debug, Default, PartialEq)]
struct Inner {
    /// They follow the nodes in the numbers of places.
    points: Vec<Sample>,
    /// Nodes of faces and of `points`, ascending; none where there are no `points`.
    nodes: Vec<u32>,
    /// Faces from here on are walls.
    first_wall: usize,
}

/// All samples of a surface, grouped by face.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    rows: Vec<Sample>,
    /// Distinct nodes that are corners of faces, ascending.
    nodes: Vec<u32>,
    /// Corners that are no nodes: places from `nodes.len()` on.
    inner: Inner,
    /// Places of each face's corners.
    corners: Vec<[u32; 3]>,
    /// Faces at the corner in place `n`, ascending: `around[starts[n]..starts[n + 1]]`.
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
        Self::with_pieces(positions, faces, Pieces::default(), held, spacing_mm)
    }

    /// The same with what is not whole faces: these follow.
    ///
    /// Panics when a face or a corner names a node that `positions` does not have.
    ///
    /// # Errors
    /// No memory.
    pub fn with_pieces(
        positions: &[[f32; 3]],
        faces: &[[u32; 3]],
        pieces: Pieces<'_>,
        held: &[u32],
        spacing_mm: f32,
    ) -> Result<Self, TryReserveError> {
        let (mut nodes, mut corners, mut offsets) = (Vec::new(), Vec::new(), Vec::new());
        let count = faces.len() + pieces.triangles.len();
        nodes.try_reserve_exact(3 * faces.len() + pieces.corners.len())?;
        corners.try_reserve_exact(count)?;
        offsets.try_reserve_exact(count + 1)?;
        nodes.extend_from_slice(faces.as_flattened());
        // A corner with one node is that node.
        let is_node = |weights: &[f32; 4]| weights[1..] == [0.0; 3];
        let single = pieces.corners.iter().filter(|corner| is_node(&corner.1));
        nodes.extend(single.map(|corner| corner.0[0]));
        nodes.sort_unstable();
        nodes.dedup();
        let place = |node: u32| nodes.partition_point(|n| *n < node) as u32;
        corners.extend(faces.iter().map(|face| face.map(place)));
        let mut inner = Inner {
            first_wall: faces.len() + pieces.first_wall,
            ..Inner::default()
        };
        let mut places = Vec::new();
        places.try_reserve_exact(pieces.corners.len())?;
        inner.points.try_reserve_exact(pieces.corners.len())?;
        for &(own, weights) in pieces.corners {
            places.push(match is_node(&weights) {
                true => place(own[0]),
                false => {
                    inner.points.push(Sample {
                        nodes: own,
                        weights,
                    });
                    (nodes.len() + inner.points.len() - 1) as u32
                }
            });
        }
        corners.extend((pieces.triangles.iter()).map(|own| own.map(|at| places[at as usize])));
        if !inner.points.is_empty() {
            let all = nodes.len() + 4 * inner.points.len();
            inner.nodes.try_reserve_exact(all)?;
            inner.nodes.extend_from_slice(&nodes);
            let of_points = inner.points.iter().flat_map(|point| point.nodes);
            inner.nodes.extend(of_points);
            inner.nodes.sort_unstable();
            inner.nodes.dedup();
        }
        let (starts, around) = faces_at(&corners, nodes.len() + inner.points.len())?;
        let mut builder = Builder {
            positions,
            corners: (&nodes, &inner.points),
            spacing: f64::from(spacing_mm),
            held: HashSet::new(),
            seen_corners: HashSet::new(),
            seen_edges: HashSet::new(),
            rows: Vec::new(),
        };
        builder.held.try_reserve(held.len())?;
        builder.held.extend(held);
        builder.seen_corners.try_reserve(starts.len())?;
        builder.seen_edges.try_reserve(3 * count)?;
        let mut parts = Vec::new();
        parts.try_reserve_exact(count)?;
        offsets.push(0);
        for face in &corners {
            parts.push(builder.face(*face)?.min(usize::from(u16::MAX)) as u16);
            offsets.push(builder.rows.len() as u32);
        }
        Ok(Self {
            rows: builder.rows,
            nodes,
            inner,
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
                let weights = [part(LATTICE - i - j), part(i), part(j)];
                between(
                    (&self.nodes, &self.inner.points),
                    self.corners[face],
                    weights,
                )
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

    /// Distinct nodes that are corners of the sampled faces, ascending.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Distinct nodes that samples have, ascending: those of corners, and those around corners that are no nodes.
    pub fn all_nodes(&self) -> &[u32] {
        match self.inner.nodes.is_empty() {
            true => &self.nodes,
            false => &self.inner.nodes,
        }
    }

    /// Corners that are no nodes: their places follow those of the nodes.
    pub fn inner_corners(&self) -> &[Sample] {
        &self.inner.points
    }

    /// Where the corner in a place is; `position` gives a node's.
    #[inline]
    pub fn corner_at(&self, place: u32, position: impl Fn(u32) -> Vector) -> Vector {
        match self.nodes.get(place as usize) {
            Some(node) => position(*node),
            None => self.inner.points[place as usize - self.nodes.len()].gather(position),
        }
    }

    /// The tissue's outward normal at a row; `position` gives a node's.
    pub fn outward(&self, row: u32, position: impl Fn(u32) -> Vector) -> Vector {
        let corners = self.corners[self.face_of(row)];
        let [a, b, c] = corners.map(|place| self.corner_at(place, &position));
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Whether a blade has laid walls open.
    pub fn has_walls(&self) -> bool {
        self.inner.first_wall < self.face_count()
    }

    /// Whether a face is a wall that a blade has laid open.
    pub fn is_wall(&self, face: usize) -> bool {
        face >= self.inner.first_wall
    }

    /// Whether a row is on one.
    pub fn is_on_wall(&self, row: u32) -> bool {
        self.has_walls() && self.is_wall(self.face_of(row))
    }

    /// Number of sampled faces.
    pub fn face_count(&self) -> usize {
        self.corners.len()
    }

    /// Places of a face's corners: of [`Samples::nodes`], and then of [`Samples::inner_corners`].
    pub fn corners(&self, face: usize) -> [u32; 3] {
        self.corners[face]
    }

    /// Faces with a corner at a place, ascending.
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
