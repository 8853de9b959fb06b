//! What a file of VTK holds.

use super::lists::{Lists, Role};

/// A part of a data set.
#[derive(Default)]
pub struct Piece {
    pub points: Vec<[f64; 3]>,
    /// In the order in which arrays over cells count them.
    pub cells: Vec<(Role, Lists)>,
    /// VTK's number for the kind of each cell of a grid; empty for polydata.
    pub kinds: Vec<u8>,
    pub of_points: Vec<Array>,
    pub of_cells: Vec<Array>,
}

/// An array of one number a row.
pub struct Array {
    pub name: String,
    pub values: Vec<f64>,
}

/// What a file holds; arrays only where they are asked for.
pub struct DataSet {
    pub is_grid: bool,
    pub pieces: Vec<Piece>,
}
