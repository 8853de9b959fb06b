//! Reaction at the contact nodes from a displacement field, for haptics of a scene without a prior.
//!
//! The tissue pushes an instrument that holds node `a` with `-sum f_a` over the elements around it, `f_a` the derivative of
//! their strain energy ([`elements::stress`]); inertia and damping of the node itself are left out. Forces are mN, lengths mm,
//! moduli Pa (1 Pa mm² = 1e-3 mN); all arithmetic in f64.
//!
//! REQ-043: The force of contact is the reference solver's reaction for the same state.

#[cfg(test)]
mod tests;

use crate::error::{Error, Result};
use crate::memory;
use elements::{Tetrahedra, Tetrahedron};

pub use elements::Moduli;

/// What is known of the elements around the nodes that can be in contact; made once a mesh.
#[derive(Debug)]
pub struct ReactionForces {
    /// By number of a law, see [`elements::Laws`].
    moduli: Vec<Moduli>,
    elements: Vec<Tetrahedron>,
    /// Number of each element's law.
    law: Vec<u8>,
    /// Rows of `around`, one a mesh node (empty for nodes that cannot be in contact).
    offsets: Vec<u32>,
    around: Vec<u32>,
    /// Entry in the asked list plus one, for a node that is asked for; 0 otherwise.
    entry_of_node: Vec<u32>,
    /// Last call that visited the element.
    visited: Vec<u32>,
    call: u32,
}

/// How the forces came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ForceReport {
    /// Elements that were used.
    pub elements: usize,
    /// Of these, inverted ones (`det F <= 0`): forces near them mean little.
    pub inverted: usize,
}

/// Row `node` of `[K,3]`.
fn row_of(values: &[f32], node: u32) -> [f64; 3] {
    [0, 1, 2].map(|axis| f64::from(values[3 * node as usize + axis]))
}

const WHAT: &str = "the elements' forces";

impl ReactionForces {
    /// Adjacency and gradients of the elements that touch `nodes` (the surface's, say).
    ///
    /// Tetrahedra of positive volume with checked laws, `nodes` below `K`, the material's moduli.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn new(body: Tetrahedra<'_>, nodes: &[u32], moduli: Moduli) -> Result<Self> {
        let node_count = body.positions.len();
        let mut wanted = memory::filled(node_count, false, WHAT)?;
        nodes.iter().for_each(|&node| wanted[node as usize] = true);
        let touched = || {
            let all = body.tets.iter().enumerate();
            all.filter(|(_, tet)| tet.iter().any(|&node| wanted[node as usize]))
        };
        let elements = touched().map(|(index, &corners)| {
            let rest = corners.map(|node| body.positions[node as usize].map(f64::from));
            Tetrahedron::new(corners, rest, f64::from(body.stiffness_of(index)))
                .along(body.laws.fibre_of(index))
        });
        let elements = memory::collected(touched().count(), elements, WHAT)?;
        let numbers = touched().map(|(index, _)| body.laws.number_of(index));
        let law = memory::collected(elements.len(), numbers, WHAT)?;
        let others = body.laws.regions.iter().map(|region| Moduli {
            law: region.law,
            ..moduli
        });
        let all = std::iter::once(moduli).chain(others);
        let moduli = memory::collected(body.laws.regions.len() + 1, all, WHAT)?;
        let mut offsets = memory::filled(node_count + 1, 0u32, WHAT)?;
        let touches = || {
            elements.iter().enumerate().flat_map(|(e, element)| {
                let nodes = element.corners.into_iter().map(|node| node as usize);
                nodes.filter(|&n| wanted[n]).map(move |n| (e as u32, n))
            })
        };
        touches().for_each(|(_, node)| offsets[node + 1] += 1);
        for node in 0..node_count {
            offsets[node + 1] += offsets[node];
        }
        let mut around = memory::filled(offsets[node_count] as usize, 0, WHAT)?;
        let mut next = memory::copied(&offsets, WHAT)?;
        for (element, node) in touches() {
            around[next[node] as usize] = element;
            next[node] += 1;
        }
        Ok(Self {
            moduli,
            law,
            visited: memory::filled(elements.len(), 0, WHAT)?,
            elements,
            offsets,
            around,
            entry_of_node: memory::filled(node_count, 0, WHAT)?,
            call: 0,
        })
    }

    /// Appends the nodes of the elements around `nodes` (whose displacement [`Self::reaction`] reads) to
    /// `out`, ascending, each once. A node that is out of range is skipped.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn neighbourhood(&self, nodes: &[u32], out: &mut Vec<u32>) -> Result<()> {
        for &node in nodes {
            if let Some(row) = self.offsets.get(node as usize..node as usize + 2) {
                let around = &self.around[row[0] as usize..row[1] as usize];
                memory::tried(out.try_reserve(4 * around.len()), WHAT)?;
                out.extend(
                    around
                        .iter()
                        .flat_map(|&e| self.elements[e as usize].corners),
                );
            }
        }
        out.sort_unstable();
        out.dedup();
        Ok(())
    }

    /// Force of the tissue on the instrument at each of `nodes`, mN, to `out [m,3]`.
    ///
    /// `displacement [K,3]` mm. Elements are summed in a fixed order. No allocation.
    ///
    /// # Errors
    /// [`Error::Argument`] for a wrong length, a node out of range or twice in the list;
    /// [`Error::NonFinite`] for a displacement that is not finite at an element used; `out` is then unspecified.
    pub fn reaction(
        &mut self,
        displacement: &[f32],
        nodes: &[u32],
        out: &mut [f32],
    ) -> Result<ForceReport> {
        let node_count = self.entry_of_node.len();
        if displacement.len() != 3 * node_count || out.len() != 3 * nodes.len() {
            return Err(Error::Argument(format!(
                "reaction: displacement has {} numbers and out {}; they must have {} and {}",
                displacement.len(),
                out.len(),
                3 * node_count,
                3 * nodes.len()
            )));
        }
        let mut listed = 0;
        let mut result = Ok(());
        for (entry, &node) in nodes.iter().enumerate() {
            match self.entry_of_node.get_mut(node as usize) {
                Some(slot) if *slot == 0 => *slot = entry as u32 + 1,
                found => {
                    let cause = if found.is_some() {
                        "twice"
                    } else {
                        "not a node"
                    };
                    result = Err(Error::Argument(format!("reaction: node {node} is {cause}")));
                    break;
                }
            }
            listed += 1;
        }
        let report = result.and_then(|()| self.sum(displacement, nodes, out));
        for &node in &nodes[..listed] {
            self.entry_of_node[node as usize] = 0;
        }
        report
    }

    fn sum(&mut self, displacement: &[f32], nodes: &[u32], out: &mut [f32]) -> Result<ForceReport> {
        if self.call == u32::MAX {
            self.visited.fill(0);
            self.call = 0;
        }
        self.call += 1;
        out.fill(0.0);
        let mut report = ForceReport {
            elements: 0,
            inverted: 0,
        };
        for &node in nodes {
            let row =
                self.offsets[node as usize] as usize..self.offsets[node as usize + 1] as usize;
            for &e in &self.around[row] {
                if std::mem::replace(&mut self.visited[e as usize], self.call) == self.call {
                    continue;
                }
                let element = &self.elements[e as usize];
                let state =
                    element.deformation(element.corners.map(|node| row_of(displacement, node)));
                let moduli = self.moduli[usize::from(self.law[e as usize])];
                let (forces, det) = (element.forces(&state, moduli), state.det);
                if !det.is_finite() {
                    return Err(Error::NonFinite(format!(
                        "reaction: displacement around node {node} is not finite"
                    )));
                }
                report.elements += 1;
                report.inverted += usize::from(det <= 0.0);
                for (corner, force) in element.corners.iter().zip(forces) {
                    let entry = self.entry_of_node[*corner as usize] as usize;
                    if entry > 0 {
                        for axis in 0..3 {
                            out[3 * (entry - 1) + axis] -= (1e-3 * force[axis]) as f32;
                        }
                    }
                }
            }
        }
        Ok(report)
    }
}
