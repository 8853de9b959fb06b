//! What elements of a body have lost to cuts, as the tables on the modes take it.

/// What an element of a cut body has lost.
pub struct Lost {
    /// Its number in the intact mesh.
    pub element: u32,
    pub corners: [u32; 4],
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
}
