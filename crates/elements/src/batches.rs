//! Clusters packed into batches of 16, with the constants of their tetrahedra.
//!
//! Structure of arrays: the lane is the fastest index of each constant, so that a register loads
//! the same constant of neighbouring clusters. The constants are made in f64 from the rest shape
//! and rounded once. A batch is full but for the last of its chunk; lanes without a cluster repeat
//! the shape of another and have no stiffness, so that they give no force and no small det F.

use crate::cluster::{Cluster, Group, corners};
use crate::directions::Directions;
use crate::gradients::Gradients;
use crate::material::Material;
use crate::room::{collected, grow, push, room};
use crate::tetrahedra::Tetrahedra;
use crate::vector::{cross, dot};
use lanes::WIDTH;
use std::collections::{HashSet, TryReserveError};
use std::ops::Range;

/// Stands for a node or an element where there is none: in lanes and slots that only fill a batch or a cache line.
pub const PADDING: u32 = u32::MAX;

/// Batches of one kind of cluster.
#[derive(Default)]
pub struct Kind<const NODES: usize, const TETS: usize> {
    /// Constants and slots, a batch after another.
    pub batches: Vec<Cluster<NODES, TETS>>,
    /// A row a batch where a law of the body takes displacements or the material relaxes, else none.
    pub gradients: Vec<Gradients<TETS>>,
    /// A row a batch where a law of the body has fibres, else none.
    pub directions: Vec<Directions<TETS>>,
    /// Mesh elements of each batch; [`PADDING`] in padding lanes.
    pub elements: Vec<[[u32; WIDTH]; TETS]>,
}

/// One tetrahedron as the kernels see it.
pub struct Element {
    /// Its number in the mesh.
    pub number: u32,
    /// Twice the chunk-local slots of its corners.
    pub slots: [u16; 4],
    /// See `Cluster::bulk`.
    pub bulk: f32,
    /// Direction of its fibres at rest; zero where it has none.
    pub fibre: [f32; 3],
}

/// What the constants of a chunk's clusters are made from.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    /// By chunk-local slot, see `Partition::rest`.
    pub rest: &'a [[f32; 4]],
    /// Elements, stiffness and laws by number in the mesh.
    pub mesh: Tetrahedra<'a>,
    /// Its moduli go into the constants, times each element's stiffness.
    pub material: &'a Material,
    /// Whether gradients are asked for.
    pub gradients: bool,
    /// Whether directions of fibres are.
    pub directions: bool,
}

impl<const NODES: usize, const TETS: usize> Kind<NODES, TETS> {
    /// Packs groups into batches; `local` maps a mesh node to its chunk-local slot. Returns where they lie.
    ///
    /// # Errors
    /// No memory.
    pub fn push(
        &mut self,
        groups: &[Group<NODES, TETS>],
        source: Source,
        local: impl Fn(u32) -> u16,
    ) -> Result<Range<usize>, TryReserveError> {
        let start = self.batches.len();
        // The order within a chunk is free: sums of forces at a node follow it, and it depends on
        // the groups alone.
        let (groups, ends) = disjoint_batches(groups)?;
        grow(&mut self.batches, ends.len())?;
        grow(&mut self.elements, ends.len())?;
        if source.gradients {
            grow(&mut self.gradients, ends.len())?;
        }
        if source.directions {
            grow(&mut self.directions, ends.len())?;
        }
        let starts = std::iter::once(0).chain(ends.iter().copied());
        for (first, end) in starts.zip(&ends) {
            let groups = &groups[first..*end];
            let mut batch = Cluster::EMPTY;
            let mut elements = [[PADDING; WIDTH]; TETS];
            let mut gradients = Gradients::EMPTY;
            let mut directions = Directions::EMPTY;
            for lane in 0..WIDTH {
                // Beyond the last group its shape alone, without stiffness.
                let group = groups[lane.min(groups.len() - 1)];
                let slots = group.nodes.map(&local);
                for (row, slot) in batch.slots.iter_mut().zip(slots) {
                    row[lane] = 2 * slot;
                }
                for (tet, element) in group.tets.into_iter().enumerate() {
                    let [a, b, c] = corners::<NODES>(tet);
                    let [x, y, z] =
                        [0, 1, 2].map(|k| [0, a, b, c].map(|n| source.rest[slots[n] as usize][k]));
                    let (gradient, volume) =
                        shape_gradients([0, 1, 2, 3].map(|n| [x[n], y[n], z[n]]));
                    batch.inverse[tet][lane] = (1.0 / (6.0 * volume)) as f32;
                    if lane >= groups.len() {
                        gradients.set(tet, lane, gradient, 0.0);
                        continue;
                    }
                    let stiffness = f64::from(source.mesh.stiffness_of(element as usize));
                    gradients.set(tet, lane, gradient, volume.abs() * stiffness);
                    if source.directions {
                        let own = source.mesh.laws.fibre_of(element as usize);
                        directions.set((tet, lane), gradient, own, volume.abs() * stiffness);
                    }
                    // The order of the corners in a group may turn the element around.
                    // With the sign of a force on the node, so that the kernel adds without
                    // negating.
                    let factor = -source.material.shear_pa() * volume.abs() * stiffness;
                    for (row, [j, k]) in batch.springs[tet].iter_mut().zip(PAIRS) {
                        row[lane] = (factor * dot(gradient[j], gradient[k])) as f32;
                    }
                    let bulk = source.material.bulk_pa() / 6.0 * stiffness;
                    batch.bulk[tet][lane] = bulk.copysign(volume) as f32;
                    elements[tet][lane] = element;
                }
            }
            self.batches.push(batch);
            if source.gradients {
                self.gradients.push(gradients);
            }
            if source.directions {
                self.directions.push(directions);
            }
            self.elements.push(elements);
        }
        Ok(start..self.batches.len())
    }

    /// The elements of some batches.
    pub fn elements(&self, batches: Range<usize>) -> impl Iterator<Item = Element> + '_ {
        let lanes = (0..TETS).flat_map(|tet| (0..WIDTH).map(move |lane| (tet, lane)));
        batches
            .flat_map(move |batch| lanes.clone().map(move |(tet, lane)| (batch, tet, lane)))
            .filter(|(batch, tet, lane)| self.elements[*batch][*tet][*lane] != PADDING)
            .map(|(batch, tet, lane)| {
                let cluster = &self.batches[batch];
                let [a, b, c] = corners::<NODES>(tet);
                let slots = &cluster.slots;
                Element {
                    number: self.elements[batch][tet][lane],
                    slots: [
                        slots[0][lane],
                        slots[a][lane],
                        slots[b][lane],
                        slots[c][lane],
                    ],
                    bulk: cluster.bulk[tet][lane],
                    fibre: (self.directions.get(batch)).map_or([0.0; 3], |own| own.of(tet, lane)),
                }
            })
    }

    /// Directions of the fibres of some batches; empty where there are none.
    pub fn directions_of(&self, batches: &Range<usize>) -> &[Directions<TETS>] {
        self.directions.get(batches.clone()).unwrap_or_default()
    }

    /// Takes one cluster of another body's batches, with other slots, into the lane behind the `used` lanes of the last batch; returns how many are
    /// in use then.
    ///
    /// # Errors
    /// No memory.
    pub fn copy(
        &mut self,
        from: &Self,
        (batch, lane): (usize, usize),
        slots: [u16; NODES],
        used: usize,
    ) -> Result<usize, TryReserveError> {
        let at = used % WIDTH;
        if at == 0 {
            push(&mut self.batches, Cluster::EMPTY)?;
            push(&mut self.elements, [[PADDING; WIDTH]; TETS])?;
            if !from.gradients.is_empty() {
                push(&mut self.gradients, Gradients::EMPTY)?;
            }
            if !from.directions.is_empty() {
                push(&mut self.directions, Directions::EMPTY)?;
            }
        }
        if let (Some(own), Some(elements)) = (self.batches.last_mut(), self.elements.last_mut()) {
            let source = &from.batches[batch];
            own.copy_lane(source, lane, at);
            for (row, slot) in own.slots.iter_mut().zip(slots) {
                row[at] = 2 * slot;
            }
            for (own, source) in elements.iter_mut().zip(&from.elements[batch]) {
                own[at] = source[lane];
            }
        }
        if let Some(own) = self.gradients.last_mut() {
            own.copy_lane(&from.gradients[batch], lane, at);
        }
        if let Some(own) = self.directions.last_mut() {
            own.copy_lane(&from.directions[batch], lane, at);
        }
        Ok(at + 1)
    }

    /// Fills the last batch, whose first `used` lanes are in use, with the shape of the last of them, without stiffness.
    pub fn pad(&mut self, used: usize) {
        let Some(own) = self.batches.last_mut() else {
            return;
        };
        for lane in used..WIDTH {
            own.repeat_lane(used - 1, lane);
            if let Some(gradients) = self.gradients.last_mut() {
                gradients.repeat_lane(used - 1, lane);
            }
            if let Some(directions) = self.directions.last_mut() {
                directions.clear_lane(lane);
            }
        }
    }

    /// Takes all batches out; the room stays.
    pub fn clear(&mut self) {
        self.batches.clear();
        self.gradients.clear();
        self.directions.clear();
        self.elements.clear();
    }

    /// Clusters in the batches.
    ///
    /// A cluster has all of its elements or none, so its first tells.
    pub fn count(&self) -> usize {
        let lanes = self.elements.iter().flat_map(|batch| batch[0]);
        lanes.filter(|element| *element != PADDING).count()
    }

    /// Bytes of the batches.
    pub fn bytes(&self) -> usize {
        size_of_val(self.batches.as_slice())
            + size_of_val(self.gradients.as_slice())
            + size_of_val(self.directions.as_slice())
    }
}

/// The groups in batches of 16 that, while it lasts, share no node among them: their force additions then do not wait for each
/// other. Gives all, batch after batch, and where each ends.
fn disjoint_batches<const NODES: usize, const TETS: usize>(
    groups: &[Group<NODES, TETS>],
) -> Result<Batches<NODES, TETS>, TryReserveError> {
    let mut remaining = collected(groups.iter().copied())?;
    let mut all = room(groups.len())?;
    let mut ends = room(groups.len().div_ceil(WIDTH))?;
    let mut used = HashSet::new();
    used.try_reserve(NODES * WIDTH)?;
    while !remaining.is_empty() {
        let most = all.len() + WIDTH;
        used.clear();
        remaining.retain(|group| {
            // Taken in order: earlier groups, which are neighbours, go first where they can.
            if all.len() == most || group.nodes.iter().any(|n| used.contains(n)) {
                return true;
            }
            used.extend(group.nodes);
            all.push(*group);
            false
        });
        // Every batch but the last is full.
        let missing = (most - all.len()).min(remaining.len());
        all.extend(remaining.drain(..missing));
        ends.push(all.len());
    }
    Ok((all, ends))
}

/// Groups in the order in which they are packed, and where each batch of them ends.
type Batches<const NODES: usize, const TETS: usize> = (Vec<Group<NODES, TETS>>, Vec<usize>);

/// Entries of a symmetric matrix, in the order of [`Cluster::springs`].
const PAIRS: [[usize; 2]; 6] = [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];

/// Gradients of the shape functions of corners 1..=3 (1/mm) and the rest volume (mm³), in f64.
#[inline]
pub fn shape_gradients(corners: [[f32; 3]; 4]) -> ([[f64; 3]; 3], f64) {
    let mut edge = [[0.0; 3]; 3];
    for a in 0..3 {
        for k in 0..3 {
            edge[a][k] = f64::from(corners[a + 1][k]) - f64::from(corners[0][k]);
        }
    }
    let mut gradients = [
        cross(edge[1], edge[2]),
        cross(edge[2], edge[0]),
        cross(edge[0], edge[1]),
    ];
    let determinant = dot(edge[0], gradients[0]);
    let inverse = 1.0 / determinant;
    for value in gradients.as_flattened_mut() {
        *value *= inverse;
    }
    (gradients, determinant / 6.0)
}
