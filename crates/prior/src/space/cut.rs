//! The modes of a body that has been cut: the intact body's, at its own nodes and copies, and what elements have lost taken off the products with them.
//!
//! The space does not grow with a cut. The modes `Phi` stay those of the intact body, a copy of a
//! node moves in them as its parent does, and `Phi^T K Phi` loses what the cut elements had. That
//! new lips can part is nothing that these modes know; the iterations find it.

use std::sync::Arc;

use super::{CoarseSpace, WHAT};
use crate::PriorTable;
use crate::lost::{Lost, LostElements};
use field::error::Result;
use field::memory;
use kernels::project::row_dots_in;

impl CoarseSpace {
    /// Reads the modes at the corners of elements that have lost something; `prior` is the intact body's.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn lost(&self, list: Vec<Lost>, prior: &PriorTable) -> Result<LostElements> {
        let corners = (list.iter()).flat_map(|lost| lost.corners.into_iter().zip(lost.is_free));
        let free = corners.filter(|(_, is_free)| *is_free);
        let mut nodes = memory::collected(4 * list.len(), free.map(|(node, _)| node), WHAT)?;
        nodes.sort_unstable();
        // Sorted and each once: [`LostElements::at`] searches by halving, and sums run in this
        // order.
        nodes.dedup();
        let modes = self.count();
        let mut rows = memory::zeros(3 * nodes.len() * modes, WHAT)?;
        let mut q = memory::zeros(prior.width(), WHAT)?;
        for (node, rows) in nodes.iter().zip(rows.chunks_exact_mut(3 * modes)) {
            self.read_node(prior, *node, &mut q, rows);
        }
        Ok(LostElements {
            list,
            nodes,
            rows,
            modes,
        })
    }

    /// The modes of a body that has been cut, with its own tables and the intact body's, whose node each of the contact nodes is or stems from.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn cut(
        &self,
        (intact, prior): (&PriorTable, &PriorTable),
        parent: impl Fn(u32) -> u32,
        lost: &LostElements,
    ) -> Result<CoarseSpace> {
        let count = self.count();
        let mut space = CoarseSpace {
            at_contact: Arc::clone(&self.at_contact),
            at_added: Vec::new(),
            rows: memory::copied(&self.rows, WHAT)?,
            modes: Arc::clone(&self.modes),
            stiffness: memory::copied(&self.stiffness, WHAT)?,
            mass: memory::copied(&self.mass, WHAT)?,
            frequency: memory::copied(&self.frequency, WHAT)?,
            inverses: match lost.list.is_empty() {
                true => Arc::clone(&self.inverses),
                false => Arc::default(),
            },
            keeps: true,
            isa: self.isa,
        };
        space.take_off(lost)?;
        // Nodes that a cut lays bare have no rows in the file. Those of a contact node are copied
        // from its parent's, others are read off the modes.
        let added = &prior.contact_nodes[intact.contact_nodes.len()..];
        space.at_added = memory::zeros(3 * added.len() * count, WHAT)?;
        let mut q = memory::zeros(prior.width(), WHAT)?;
        for (node, rows) in added.iter().zip(space.at_added.chunks_exact_mut(3 * count)) {
            let node = parent(*node);
            let column = intact.nearest_column[node as usize] as usize;
            match intact.contact_nodes.get(column) == Some(&node) {
                true => rows.copy_from_slice(&self.at_contact[3 * column * count..][..3 * count]),
                false => self.read_node(intact, node, &mut q, rows),
            }
        }
        Ok(space)
    }

    /// Takes what elements have lost off the products of the modes.
    fn take_off(&mut self, lost: &LostElements) -> Result<()> {
        let count = self.count();
        // `dK Phi` and the masses at the free corners.
        let (forces, masses) = lost.on_fields(count, |node, axis| {
            let rows = lost.at(node).unwrap_or_default();
            rows.iter().skip(axis * count).take(count).copied()
        })?;
        // Both products are symmetric: their upper halves, and what they are below.
        let rows = lost.rows.chunks_exact(count.max(1));
        for (at, (own, force)) in rows.zip(forces.chunks_exact(count.max(1))).enumerate() {
            let mass = masses[at / 3];
            for (i, value) in own.iter().enumerate() {
                let (k, m) = (*value, *value * mass);
                let stiffness = self.stiffness[i * count + i..][..count - i].iter_mut();
                for (entry, force) in stiffness.zip(&force[i..]) {
                    *entry -= k * force;
                }
                let masses = self.mass[i * count + i..][..count - i].iter_mut();
                for (entry, other) in masses.zip(&own[i..]) {
                    *entry -= m * other;
                }
            }
        }
        if !lost.nodes.is_empty() {
            for i in 0..count {
                for j in 0..i {
                    self.stiffness[i * count + j] = self.stiffness[j * count + i];
                    self.mass[i * count + j] = self.mass[j * count + i];
                }
            }
        }
        Ok(())
    }

    /// The modes at a node `[3,r]`; `q [Q]` is room, and zero.
    fn read_node(&self, prior: &PriorTable, node: u32, q: &mut [f32], rows: &mut [f32]) {
        // A node's rows of the basis reach the coordinates of its block alone, so nothing else of
        // the modes is read.
        let range = prior.coordinates_of(node);
        let modes = self.modes();
        for (axis, row) in rows.chunks_exact_mut(self.count().max(1)).enumerate() {
            q[range.clone()].fill(0.0);
            prior.add_row(node, [0, 1, 2].map(|k| f32::from(u8::from(k == axis))), q);
            let ranges = std::slice::from_ref(&range);
            row_dots_in(self.isa, modes, &self.rows, ranges, q, row);
        }
        q[range].fill(0.0);
    }

    /// Bytes that it shares with the space of the intact body.
    pub fn shared_bytes(&self) -> usize {
        memory::behind(&self.modes) + memory::behind(&self.at_contact)
    }
}
