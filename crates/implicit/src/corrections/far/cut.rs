//! The far field of a body that has been cut: that of the intact body, made anew in the chunks of which an element has changed.
//!
//! Clusters stay those of the intact body, with the same elements or what these have become, so
//! that their number and laws do not change with a cut. Weights and volumes are summed anew where
//! an element has changed; the table on the modes has what was lost taken off.

use std::ops::Range;

use super::{Borders, FarField, NINE, PackedChunks, WHAT};
use crate::bundle::Mesh;
use crate::corrections::body::Body;
use crate::error::Result;
use crate::memory;
use crate::prior::{Lost, LostElements};

/// An element of the intact body, and the corners that it or what it has become has.
pub type Corners = (u32, [u32; 4]);

/// The chunks that the elements of one chunk of the intact body are packed in.
struct Packed<'a> {
    /// The chunk of the intact body, with the elements that stay.
    first: usize,
    /// Chunks that cuts have made for the others.
    behind: Range<usize>,
    /// Of the cut body.
    body: &'a Body,
}

impl Packed<'_> {
    /// All of them, in the order in which their sums are made.
    fn chunks(&self) -> impl Iterator<Item = usize> + '_ {
        std::iter::once(self.first).chain(self.behind.clone())
    }
}

impl FarField {
    /// That of what this body has been cut to. `gone`: the elements that have changed; `new`: what they have become; `lost`: what they have lost.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn cut(
        &self,
        (body, mesh): (&Body, &Mesh),
        (gone, new): (&[Corners], &[Corners]),
        lost: &LostElements,
    ) -> Result<FarField> {
        let forces = &body.forces;
        // The cut body's chunks are those of the intact one, without the elements that changed, and
        // behind them chunks of what these became; `parents` says of which chunk each of the latter
        // is, ascending.
        let (count, parents) = (self.volumes.len(), forces.cut_chunks());
        let mut own = FarField {
            moduli: self.moduli,
            laws: self.laws.copied()?,
            group: self.group,
            volumes: memory::copied(&self.volumes, WHAT)?,
            packed: PackedChunks {
                volumes: memory::room(forces.chunk_count(), WHAT)?,
                boxes: memory::room(forces.chunk_count(), WHAT)?,
            },
            borders: Borders::room(count)?,
            on_modes: memory::copied(&self.on_modes, WHAT)?,
            elements_at: memory::room(mesh.node_count(), WHAT)?,
            cluster_of: memory::room(self.cluster_of.len() + new.len(), WHAT)?,
            edge_mm: self.edge_mm,
        };
        own.borders.reserve(self.borders.nodes.len())?;
        let packed = &mut own.packed;
        packed.volumes.extend_from_slice(&self.volumes);
        packed.volumes.resize(forces.chunk_count(), 0.0);
        packed.boxes.extend_from_slice(&self.packed.boxes);
        for chunk in count..forces.chunk_count() {
            packed.boxes.push(bounds(mesh, forces.chunk_nodes(chunk)));
        }
        own.elements_at.extend_from_slice(&self.elements_at);
        // A copy of a node begins with none; what became of the changed elements is counted below.
        own.elements_at.resize(mesh.node_count(), 0);
        for node in gone.iter().flat_map(|(_, corners)| corners) {
            own.elements_at[*node as usize] -= 1;
        }
        for node in new.iter().flat_map(|(_, corners)| corners) {
            own.elements_at[*node as usize] += 1;
        }
        own.cluster_of.extend_from_slice(&self.cluster_of);
        let clusters = new
            .iter()
            .map(|(parent, _)| self.cluster_of[*parent as usize]);
        own.cluster_of.extend(clusters);
        let is_changed = is_changed(self, gone, count)?;
        for (chunk, is_changed) in is_changed.into_iter().enumerate() {
            if is_changed {
                let from = count + parents.partition_point(|parent| (*parent as usize) < chunk);
                let to = count + parents.partition_point(|parent| *parent as usize <= chunk);
                let packed = Packed {
                    first: chunk,
                    behind: from..to,
                    body,
                };
                own.take_anew(&packed)?;
            } else {
                let (range, to) = (self.borders.range(chunk), &mut own.borders);
                to.reserve(range.len())?;
                to.nodes
                    .extend_from_slice(&self.borders.nodes[range.clone()]);
                to.weights.extend_from_slice(&self.borders.weights[range]);
            }
            own.borders.end_chunk();
        }
        // On the modes a cell that is still there moves as its element did.
        for one in &lost.list {
            own.lose(one, lost);
        }
        Ok(own)
    }

    /// Volumes of a chunk and of what its elements have become, and which nodes' displacements change their mean gradient.
    fn take_anew(&mut self, packed: &Packed<'_>) -> Result<()> {
        let forces = &packed.body.forces;
        // A node and a place in `parts`, in one number, which sorts faster than both with their part.
        let mut at: Vec<u64> = Vec::new();
        let mut parts: Vec<[f64; 3]> = Vec::new();
        let (mut whole, mut largest) = (0.0, 0.0f64);
        for chunk in packed.chunks() {
            let nodes = forces.chunk_nodes(chunk);
            let mut volume = 0.0;
            for (_, element) in forces.chunk_tetrahedra(chunk) {
                volume += element.volume;
                let [a, b, c] = element.gradients;
                let first = [0, 1, 2].map(|k| -(a[k] + b[k] + c[k]));
                for (corner, gradient) in element.corners.into_iter().zip([first, a, b, c]) {
                    let part = gradient.map(|value| element.volume * value);
                    largest = part
                        .iter()
                        .fold(largest, |most, value| most.max(value.abs()));
                    let key = u64::from(nodes[corner as usize]) << 32 | parts.len() as u64;
                    memory::push(&mut at, key, WHAT)?;
                    memory::push(&mut parts, part, WHAT)?;
                }
            }
            self.packed.volumes[chunk] = volume;
            whole += volume;
        }
        self.volumes[packed.first] = whole;
        // In the order of the nodes, and at each of the elements; a stable sort would ask for memory, and abort without.
        at.sort_unstable();
        for same in at.chunk_by(|a, b| a >> 32 == b >> 32) {
            let mut sum = [0.0; 3];
            for at in same {
                let part = &parts[*at as u32 as usize];
                sum.iter_mut()
                    .zip(part)
                    .for_each(|(sum, part)| *sum += part);
            }
            let node = (same[0] >> 32) as u32;
            let matters = sum.iter().any(|value| value.abs() > 1e-5 * largest);
            if matters && !packed.body.held.is[node as usize] {
                memory::push(&mut self.borders.nodes, node, WHAT)?;
                let weight = sum.map(|value| value as f32);
                memory::push(&mut self.borders.weights, weight, WHAT)?;
            }
        }
        Ok(())
    }

    /// Takes what an element has lost off the mean gradients on the modes. Which chunk of a cluster that is off does not matter: they are added.
    fn lose(&mut self, one: &Lost, lost: &LostElements) {
        let cluster = usize::from(self.cluster_of[one.element as usize]);
        let size = NINE * lost.modes;
        let first = self.chunks_of(cluster).start;
        let out = &mut self.on_modes[first * size..][..size];
        let [a, b, c] = one.gradients;
        let first = [0, 1, 2].map(|k| -(a[k] + b[k] + c[k]));
        for (node, gradient) in one.corners.into_iter().zip([first, a, b, c]) {
            let Some(rows) = lost.at(node) else { continue };
            for (at, out) in out.chunks_exact_mut(lost.modes).enumerate() {
                let (i, j) = (at / 3, at % 3);
                let weight = (one.volume * gradient[j]) as f32;
                for (out, value) in out.iter_mut().zip(&rows[i * lost.modes..][..lost.modes]) {
                    *out -= weight * value;
                }
            }
        }
    }
}

/// By chunk of the intact body: whether one of its elements may have changed. Chunks of a cluster go together.
fn is_changed(far: &FarField, gone: &[Corners], count: usize) -> Result<Vec<bool>> {
    let mut changed = memory::filled(count, false, WHAT)?;
    for (element, _) in gone {
        let cluster = usize::from(far.cluster_of[*element as usize]);
        for chunk in far.chunks_of(cluster) {
            changed[chunk] = true;
        }
    }
    Ok(changed)
}

/// The box of some nodes at rest, mm.
fn bounds(mesh: &Mesh, nodes: &[u32]) -> [[f32; 3]; 2] {
    let mut bounds = [[f32::MAX; 3], [f32::MIN; 3]];
    for &node in nodes {
        for (axis, x) in mesh.position(node).into_iter().enumerate() {
            bounds[0][axis] = bounds[0][axis].min(x);
            bounds[1][axis] = bounds[1][axis].max(x);
        }
    }
    bounds
}
