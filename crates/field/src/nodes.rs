//! Fields over the nodes: what a displacement may be, and a sparse set of nodes with a vector each, ascending, checked.
//!
//! A [`ContactSet`] is the one form in which a step knows its contact, whether the host gave a
//! dense field, a list or tools. It is ascending, so that look-ups halve, two sets merge in one
//! pass, and factors are known again by their list of nodes.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::memory::HeldBytes;
use crate::{memory, stored};

/// Displacements beyond this are refused as input, mm: a kilometre is metres that were given for
/// millimetres, or garbage.
pub const INPUT_LIMIT: f32 = 1e6;

/// What there is no memory for, where there is none.
const CONTACTS: &str = "a step's contacts";

/// Nodes in contact and what is imposed there.
#[derive(Debug, Default, HeldBytes, Serialize, Deserialize)]
pub struct ContactSet {
    /// Ascending.
    #[serde(with = "stored")]
    pub nodes: Vec<u32>,
    /// `[m,3]`, mm.
    #[serde(with = "stored")]
    pub vectors: Vec<f32>,
    /// Place of each entry in the host's list; ascending in a restored state.
    #[serde(skip)]
    pub order: Vec<u32>,
}

impl ContactSet {
    /// Room for every node of the mesh, so that a step allocates nothing.
    pub fn with_capacity(node_count: usize) -> Result<ContactSet> {
        Ok(ContactSet {
            nodes: memory::room(node_count, CONTACTS)?,
            vectors: memory::room(3 * node_count, CONTACTS)?,
            order: memory::room(node_count, CONTACTS)?,
        })
    }

    /// Nodes in contact.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// No contact.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Empties the set.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.vectors.clear();
        self.order.clear();
    }

    /// Checks what was read for a mesh of `node_count` nodes.
    pub fn admit(&mut self, node_count: usize) -> Result<()> {
        let mut set = ContactSet::default();
        match set.take_sparse(&self.nodes, &self.vectors, node_count) {
            Ok(()) => *self = set,
            Err(error @ Error::OutOfMemory(_)) => return Err(error),
            Err(error) => return Err(Error::Snapshot(error.to_string())),
        }
        Ok(())
    }

    /// A copy.
    pub fn copy(&self) -> Result<ContactSet> {
        Ok(ContactSet {
            nodes: memory::copied(&self.nodes, CONTACTS)?,
            vectors: memory::copied(&self.vectors, CONTACTS)?,
            order: memory::copied(&self.order, CONTACTS)?,
        })
    }

    /// Copies another set.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn copy_from(&mut self, other: &ContactSet) -> Result<()> {
        memory::replace(&mut self.nodes, &other.nodes, CONTACTS)?;
        memory::replace(&mut self.vectors, &other.vectors, CONTACTS)?;
        memory::replace(&mut self.order, &other.order, CONTACTS)
    }

    /// Takes nodes, ascending, each where `field [K,3]` has it.
    /// There is room for every node, so nothing is allocated.
    pub fn take_nodes(&mut self, nodes: &[u32], field: &[f32]) {
        self.clear();
        for &node in nodes {
            let at = 3 * node as usize;
            self.order.push(self.nodes.len() as u32);
            self.nodes.push(node);
            self.vectors.extend_from_slice(&field[at..at + 3]);
        }
    }

    /// What is imposed at a node.
    /// None where the node is not in contact.
    pub fn at(&self, node: u32) -> Option<[f32; 3]> {
        let i = self.nodes.binary_search(&node).ok()?;
        Some([
            self.vectors[3 * i],
            self.vectors[3 * i + 1],
            self.vectors[3 * i + 2],
        ])
    }

    /// Largest `|c|`, mm.
    pub fn max_push(&self) -> f32 {
        self.vectors
            .chunks_exact(3)
            .map(|c| c[0] * c[0] + c[1] * c[1] + c[2] * c[2])
            .fold(0.0, f32::max)
            .sqrt()
    }

    /// Takes the nodes of a field `[K,3]` that is not zero there.
    ///
    /// # Errors
    /// [`Error::Argument`], [`Error::NonFinite`], [`Error::OutOfMemory`].
    /// Zeros of either sign are no contact.
    pub fn take_dense(&mut self, field: &[f32], node_count: usize) -> Result<()> {
        self.clear();
        if field.len() != 3 * node_count {
            return Err(Error::Argument(format!(
                "collision has {} floats, must have 3 K = {}",
                field.len(),
                3 * node_count
            )));
        }
        let touched = |c: &[f32]| c[0] != 0.0 || c[1] != 0.0 || c[2] != 0.0;
        // Counted first, so that room is asked for once and before anything is pushed.
        let count = field.chunks_exact(3).filter(|c| touched(c)).count();
        for list in [&mut self.nodes, &mut self.order] {
            memory::reserve(list, count, CONTACTS)?;
        }
        memory::reserve(&mut self.vectors, 3 * count, CONTACTS)?;
        for (node, c) in field.chunks_exact(3).enumerate() {
            if touched(c) {
                check("collision", node, c)?;
                self.order.push(self.nodes.len() as u32);
                self.nodes.push(node as u32);
                self.vectors.extend_from_slice(c);
            }
        }
        Ok(())
    }

    /// Takes nodes in any order, each at most once, with a vector each `[m,3]`.
    ///
    /// # Errors
    /// [`Error::Argument`], [`Error::NonFinite`], [`Error::OutOfMemory`].
    pub fn take_sparse(&mut self, nodes: &[u32], vectors: &[f32], node_count: usize) -> Result<()> {
        self.clear();
        if vectors.len() != 3 * nodes.len() {
            return Err(Error::Argument(format!(
                "contact_vectors has {} floats, must have 3 per node, {}",
                vectors.len(),
                3 * nodes.len()
            )));
        }
        check_count("contact_count", nodes.len() as u64, node_count)?;
        for list in [&mut self.nodes, &mut self.order] {
            memory::reserve(list, nodes.len(), CONTACTS)?;
        }
        memory::reserve(&mut self.vectors, vectors.len(), CONTACTS)?;
        for (at, (&node, c)) in nodes.iter().zip(vectors.chunks_exact(3)).enumerate() {
            if node as usize >= node_count {
                return Err(Error::Argument(format!(
                    "contact_nodes[{at}] is {node}, the mesh has {node_count} nodes"
                )));
            }
            check("contact_vectors", at, c)?;
            self.order.push(at as u32);
        }
        // Hosts mostly give ascending lists, which need no sort.
        if nodes.windows(2).any(|pair| pair[0] >= pair[1]) {
            self.order.sort_unstable_by_key(|&at| nodes[at as usize]);
        }
        for &at in &self.order {
            let at = at as usize;
            if self.nodes.last() == Some(&nodes[at]) {
                return Err(Error::Argument(format!(
                    "contact_nodes holds node {} twice",
                    nodes[at]
                )));
            }
            self.nodes.push(nodes[at]);
            self.vectors.extend_from_slice(&vectors[3 * at..3 * at + 3]);
        }
        Ok(())
    }
}

/// A list of nodes that are named once each is no longer than the mesh.
pub fn check_count(name: &str, count: u64, node_count: usize) -> Result<()> {
    if count <= node_count as u64 {
        return Ok(());
    }
    Err(Error::Argument(format!(
        "{name} is {count}, the mesh has {node_count} nodes"
    )))
}

/// Finite and of a size that can be a displacement or a place.
pub fn check(what: &str, at: usize, c: &[f32]) -> Result<()> {
    if !(c[0].is_finite() && c[1].is_finite() && c[2].is_finite()) {
        return Err(Error::NonFinite(format!(
            "{what}: element {at} is not finite"
        )));
    }
    if c.iter().any(|x| x.abs() > INPUT_LIMIT) {
        return Err(Error::Argument(format!(
            "{what}: element {at} is larger than {INPUT_LIMIT} mm; units are mm"
        )));
    }
    Ok(())
}

/// Checks a displacement field `[K,3]` given by the host.
pub fn check_displacement(field: &[f32], node_count: usize) -> Result<()> {
    if field.len() != 3 * node_count {
        return Err(Error::Argument(format!(
            "displacement has {} floats, must have 3 K = {}",
            field.len(),
            3 * node_count
        )));
    }
    // One pass that vectorises; the place is only looked for when something is wrong.
    let worst = field
        .iter()
        .fold(0u32, |m, x| m.max(x.to_bits() & 0x7fff_ffff));
    if worst > INPUT_LIMIT.to_bits() {
        for (node, u) in field.chunks_exact(3).enumerate() {
            check("displacement", node, u)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sparse_input_is_sorted_and_its_order_kept() {
        let mut set = ContactSet::default();
        let vectors = [5., 0., 0., 2., 0., 0., 9., 0., 0.];
        set.take_sparse(&[5, 2, 9], &vectors, 10).unwrap();
        assert_eq!(set.nodes, [2, 5, 9]);
        assert_eq!(set.order, [1, 0, 2]);
        assert_eq!(set.at(5), Some([5.0, 0.0, 0.0]));
        assert_eq!(set.at(3), None);
        assert_eq!(set.max_push(), 9.0);
    }

    #[test]
    fn dense_and_sparse_input_give_the_same_set() {
        let mut dense = vec![0.0; 12];
        dense[4] = -0.0;
        dense[9] = 1.0;
        let (mut a, mut b) = (ContactSet::default(), ContactSet::default());
        a.take_dense(&dense, 4).unwrap();
        b.take_sparse(&[3], &[1.0, 0.0, 0.0], 4).unwrap();
        assert_eq!((a.nodes, a.vectors), (b.nodes, b.vectors));
    }

    #[test]
    fn bad_input_is_named() {
        let mut set = ContactSet::default();
        let mut status = |nodes: &[u32], vectors: &[f32]| {
            set.take_sparse(nodes, vectors, 4).unwrap_err().status()
        };
        assert_eq!(status(&[4], &[0.0; 3]), -2);
        assert_eq!(status(&[1, 1], &[0.0; 6]), -2);
        assert_eq!(status(&[1], &[0.0; 2]), -2);
        assert_eq!(status(&[1], &[f32::NAN, 0.0, 0.0]), -6);
        assert_eq!(status(&[1], &[1e30, 0.0, 0.0]), -2);
        assert_eq!(
            check_displacement(&[0.0, f32::INFINITY, 0.0], 1)
                .unwrap_err()
                .status(),
            -6
        );
        assert!(check_displacement(&[0.0, 1.0, -3.0], 1).is_ok());
    }
}
