//! What elements of a body have lost to cuts, as the tables on the modes take it.
//!
//! A cut takes elements away, or parts of them, so the stiffness and mass on the modes change by
//! `Phi^T dK Phi` and `Phi^T dM Phi`. Only the corners of such elements have a part in these
//! products: the modes are read there once, and each product is a sum over elements.

use field::error::Result;
use field::memory;

const WHAT: &str = "what a cut body has lost";

/// What an element of a cut body has lost.
pub struct Lost {
    /// Its number in the intact mesh.
    pub element: u32,
    /// Nodes of the intact mesh, in the order of its element list.
    pub corners: [u32; 4],
    /// By corner: false where the node is held, and so neither moves nor has rows.
    pub is_free: [bool; 4],
    /// Of its stiffness over the material's, times the rest volume, mm³.
    pub volume: f64,
    /// Of the shape functions of corners 1, 2, 3, 1/mm.
    pub gradients: [[f64; 3]; 3],
    /// µN/mm.
    pub stiffness: [[f64; 12]; 12],
    /// At each corner, g.
    pub mass: f64,
}

/// All of them, with the modes at their free corners.
pub struct LostElements {
    /// In any order; sums over it are made in this one.
    pub list: Vec<Lost>,
    /// Free corners, ascending.
    pub nodes: Vec<u32>,
    /// The modes there `[3 n,r]`.
    pub rows: Vec<f32>,
    /// `r`.
    pub modes: usize,
}

impl LostElements {
    /// The modes at a corner `[3,r]`; none where it is held.
    pub fn at(&self, node: u32) -> Option<&[f32]> {
        let at = self.nodes.binary_search(&node).ok()?;
        Some(&self.rows[3 * at * self.modes..][..3 * self.modes])
    }

    /// `dK V [3 n,m]` and what each corner has lost of its mass, g, for `m` fields of which `value` gives a node's, an axis' numbers.
    ///
    /// # Errors
    /// [`field::Error::OutOfMemory`].
    pub fn on_fields<I: Iterator<Item = f32>>(
        &self,
        count: usize,
        values: impl Fn(u32, usize) -> I,
    ) -> Result<(Vec<f32>, Vec<f32>)> {
        // Held corners are in no list and add nothing: their displacement is zero.
        let mut forces = memory::zeros(3 * self.nodes.len() * count, WHAT)?;
        let mut masses = memory::zeros(self.nodes.len(), WHAT)?;
        for own in &self.list {
            let places = own.corners.map(|node| self.nodes.binary_search(&node).ok());
            for (a, row) in places.iter().enumerate() {
                let Some(row) = row else { continue };
                masses[*row] += own.mass as f32;
                for (b, column) in places.iter().enumerate() {
                    let Some(column) = column else { continue };
                    for at in 0..9 {
                        let (i, j) = (at / 3, at % 3);
                        let part = own.stiffness[3 * a + i][3 * b + j] as f32;
                        let to = &mut forces[(3 * row + i) * count..][..count];
                        for (to, from) in to.iter_mut().zip(values(self.nodes[*column], j)) {
                            *to += part * from;
                        }
                    }
                }
            }
        }
        Ok((forces, masses))
    }
}
