//! The boundary of a mesh.

use super::geometry::{at, cross, minus};
use super::node_set::unique;
use field::error::Result;
use field::memory::{self, HeldBytes};

const WHAT: &str = "a mesh";

/// The boundary of the intact body. A cut leaves it as it is: loads, regions and the envelope name its triangles.
#[derive(Debug, HeldBytes)]
pub struct Surface {
    /// Triangles `[F,3]`, outward.
    pub faces: Vec<u32>,
    /// Their nodes, ascending.
    pub nodes: Vec<u32>,
    /// A third of the area of each node's triangles `[K]`, mm^2.
    pub node_area: Vec<f32>,
}

impl Surface {
    /// That of a mesh with these triangles.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub(super) fn of(positions: &[f32], faces: Vec<u32>) -> Result<Surface> {
        Ok(Surface {
            node_area: node_area(positions, &faces)?,
            nodes: unique(memory::copied(&faces, WHAT)?),
            faces,
        })
    }

    /// The same boundary in a body with `count` nodes: copies that a cut made have no area of their own.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub(super) fn with_nodes(&self, count: usize) -> Result<Surface> {
        let mut node_area = memory::room(count, WHAT)?;
        node_area.extend_from_slice(&self.node_area);
        node_area.resize(count, 0.0);
        Ok(Surface {
            faces: memory::copied(&self.faces, WHAT)?,
            nodes: memory::copied(&self.nodes, WHAT)?,
            node_area,
        })
    }
}

/// Half of the cross product is a triangle's area, and each of its corners takes a third: the sum
/// over all nodes is the area of the surface. Sums are in f64 and rounded once.
fn node_area(positions: &[f32], faces: &[u32]) -> Result<Vec<f32>> {
    let count = positions.len() / 3;
    let mut area = memory::filled(count, 0.0f64, WHAT)?;
    for face in faces.chunks_exact(3) {
        let origin = at(positions, face[0]);
        let n = cross(
            minus(at(positions, face[1]), origin),
            minus(at(positions, face[2]), origin),
        );
        let third = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt() / 6.0;
        for &node in face {
            area[node as usize] += third;
        }
    }
    memory::collected(count, area.into_iter().map(|a| a as f32), WHAT)
}
