//! A cheap look at the elements around the contact: whether a push has turned one inside out.
//!
//! REQ-023: An inverted element is told of, and where asked its state is refused.

use crate::bundle::{Mesh, volume};
use crate::error::Result;
use crate::memory::{self, HeldBytes};

const WHAT: &str = "the elements at the contact";

/// Elements around each node, made at the first contact.
#[derive(Debug, HeldBytes)]
pub struct ContactElements {
    /// Rows of `around` `[K+1]`.
    offsets: Vec<u32>,
    around: Vec<u32>,
}

impl ContactElements {
    /// Reads a mesh's elements.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(mesh: &Mesh) -> Result<ContactElements> {
        let count = mesh.node_count();
        let mut offsets = memory::filled(count + 1, 0u32, WHAT)?;
        for &node in &mesh.tets {
            offsets[node as usize + 1] += 1;
        }
        for node in 0..count {
            offsets[node + 1] += offsets[node];
        }
        let mut next = memory::copied(&offsets, WHAT)?;
        let mut around = memory::filled(mesh.tets.len(), 0u32, WHAT)?;
        for (at, &node) in mesh.tets.iter().enumerate() {
            let place = &mut next[node as usize];
            around[*place as usize] = (at / 4) as u32;
            *place += 1;
        }
        Ok(ContactElements { offsets, around })
    }

    /// Smallest det F of the elements around `nodes` at displacements `[K,3]`, 1 where there are none.
    pub fn smallest_det(&self, mesh: &Mesh, nodes: &[u32], u: &[f32]) -> f32 {
        let mut smallest = f32::INFINITY;
        for &node in nodes {
            let row =
                self.offsets[node as usize] as usize..self.offsets[node as usize + 1] as usize;
            for &tet in &self.around[row] {
                let tet = &mesh.tets[4 * tet as usize..][..4];
                let (mut rest, mut now) = ([0.0f32; 12], [0.0f32; 12]);
                for (corner, &node) in tet.iter().enumerate() {
                    for axis in 0..3 {
                        let at = 3 * node as usize + axis;
                        rest[3 * corner + axis] = mesh.positions[at];
                        now[3 * corner + axis] = mesh.positions[at] + u[at];
                    }
                }
                let corners = [0, 1, 2, 3];
                let det = volume(&now, &corners) / volume(&rest, &corners);
                smallest = smallest.min(det as f32);
            }
        }
        match smallest {
            f32::INFINITY => 1.0,
            det => det,
        }
    }
}
