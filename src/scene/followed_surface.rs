//! What a scene keeps of the surface that a host follows.

use super::published::BodyNumber;

/// The surface that a host follows.
pub struct Followed {
    pub surface: topology::Surface,
    /// The body that it is of.
    pub body: BodyNumber,
    /// Of each vertex, mm.
    pub rest: Vec<[f32; 3]>,
    /// Slots that the last update has changed.
    pub changed: Vec<u32>,
}

impl Followed {
    /// Bytes of the heap, nearly: a vertex is in the list, in the map by nodes and in `rest`, a triangle in two lists.
    pub fn held_bytes(&self) -> usize {
        160 * self.rest.len() + 20 * self.surface.triangles.len()
    }
}
