//! Where the tissue is while contact is solved, and where it was when the step began.

use ::contact::Vector;

/// Where the tissue is, `[K,3]` each.
#[derive(Clone, Copy)]
pub struct State<'a> {
    /// Rest positions, mm.
    pub rest: &'a [f32],
    /// Displacements, mm; empty: none.
    pub u: &'a [f32],
    /// Displacements at the start of the step, mm; empty: none.
    pub start: &'a [f32],
}

/// A node's row of a field `[K,3]`.
pub fn vector(field: &[f32], node: u32) -> Vector {
    let at = 3 * node as usize;
    Vector::new(field[at], field[at + 1], field[at + 2])
}

impl State<'_> {
    /// Where a node is, mm; at rest where `u` is empty.
    pub fn position(&self, node: u32) -> Vector {
        self.place(self.u, node)
    }

    /// Where a node was when the step began.
    pub fn position_before(&self, node: u32) -> Vector {
        self.place(self.start, node)
    }

    /// Where a node is under the displacements `u`, mm.
    fn place(&self, u: &[f32], node: u32) -> Vector {
        match u.is_empty() {
            true => vector(self.rest, node),
            false => vector(self.rest, node) + vector(u, node),
        }
    }
}
