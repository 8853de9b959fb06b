//! Cells of a VTK piece: lists of nodes with a kind each, and what becomes of each kind.

use super::super::error::{Fault, fault};
use super::super::polygons;
use super::Piece;
pub use super::lists::{Lists, Role};

/// A cell of a piece.
pub struct Cell<'a> {
    /// Its row in arrays over cells.
    pub index: usize,
    role: Role,
    kind: u8,
    nodes: &'a [i64],
}

// VTK's numbers of kinds of cells.
const TRIANGLE: u8 = 5;
const STRIP: u8 = 6;
const POLYGON: u8 = 7;
const PIXEL: u8 = 8;
const QUAD: u8 = 9;
const TETRA: u8 = 10;
/// Higher orders of triangles, quadrilaterals and tetrahedra, by the quadratic, the Lagrange and the Bezier kind.
const TRIANGLES: [u8; 5] = [TRIANGLE, 22, 34, 69, 76];
const QUADS: [u8; 7] = [QUAD, 23, 28, 30, 37, 70, 77];
const TETRAHEDRA: [u8; 4] = [TETRA, 24, 71, 78];
/// Points and lines, and cells without any node.
const THIN: [u8; 10] = [0, 1, 2, 3, 4, 21, 35, 36, 68, 75];

impl Cell<'_> {
    /// Its nodes, of a piece whose points begin at `first`.
    pub fn nodes_from(&self, first: usize) -> Vec<u32> {
        let number = |&node: &i64| {
            let node = usize::try_from(node)
                .ok()
                .and_then(|n| n.checked_add(first));
            node.and_then(|n| u32::try_from(n).ok()).unwrap_or(u32::MAX)
        };
        self.nodes.iter().map(number).collect()
    }

    /// Whether it is a tetrahedron of any order.
    ///
    /// # Errors
    /// Any other volume, and a tetrahedron with fewer nodes than four.
    pub fn is_tetrahedron(&self) -> Result<bool, Fault> {
        if self.role != Role::Grid {
            return Ok(false);
        }
        if TETRAHEDRA.contains(&self.kind) {
            let count = self.nodes.len();
            if count < 4 || (self.kind == TETRA && count > 4) {
                return fault(format!(
                    "cell {} is a tetrahedron of {count} nodes",
                    self.index
                ));
            }
            return Ok(true);
        }
        let is_face = TRIANGLES.contains(&self.kind)
            || QUADS.contains(&self.kind)
            || [STRIP, POLYGON, PIXEL].contains(&self.kind);
        if is_face || THIN.contains(&self.kind) {
            return Ok(false);
        }
        Err(Fault::Kind {
            element: self.index,
            kind: format!("a VTK cell of type {}", name_of(self.kind)),
        })
    }

    /// Triangles of a face, of a higher order by its corners; none of a point or a line.
    pub fn triangles(&self, nodes: &[u32], positions: &[[f64; 3]]) -> Vec<[u32; 3]> {
        let strip = || {
            let three = |(at, w): (usize, &[u32])| match at % 2 {
                0 => [w[0], w[1], w[2]],
                _ => [w[1], w[0], w[2]],
            };
            nodes.windows(3).enumerate().map(three).collect()
        };
        let polygon = |corners: usize| {
            let corners = &nodes[..nodes.len().min(corners)];
            polygons::triangles(corners, positions)
        };
        match (self.role, self.kind) {
            (Role::Polygons, _) | (Role::Grid, POLYGON) => polygon(usize::MAX),
            (Role::Strips, _) | (Role::Grid, STRIP) => strip(),
            (Role::Grid, PIXEL) => match *nodes {
                [a, b, c, d] => polygons::triangles(&[a, b, d, c], positions),
                _ => Vec::new(),
            },
            (Role::Grid, kind) if TRIANGLES.contains(&kind) => polygon(3),
            (Role::Grid, kind) if QUADS.contains(&kind) => polygon(4),
            _ => Vec::new(),
        }
    }
}

/// The kinds that users meet, by name.
fn name_of(kind: u8) -> String {
    let name = match kind {
        11 => "voxel",
        12 | 25 | 29 | 33 | 72 | 79 => "hexahedron",
        13 | 26 | 31 | 32 | 73 | 80 => "wedge",
        14 | 27 | 38 | 74 | 81 => "pyramid",
        42 => "polyhedron",
        other => return other.to_string(),
    };
    format!("{kind} ({name})")
}

/// Visits all cells of a piece.
pub fn walk(
    piece: &Piece,
    mut visit: impl FnMut(Cell<'_>) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let mut index = 0;
    for (role, lists) in &piece.cells {
        if *role == Role::Grid && lists.ends.len() != piece.kinds.len() {
            return fault(format!(
                "{} cells have {} types",
                lists.ends.len(),
                piece.kinds.len()
            ));
        }
        let mut start = 0;
        for (cell, &end) in lists.ends.iter().enumerate() {
            let end = usize::try_from(end).unwrap_or(usize::MAX);
            let Some(nodes) = lists.nodes.get(start..end) else {
                return fault(format!("cell {cell} reaches beyond the list of nodes"));
            };
            start = end;
            visit(Cell {
                index,
                role: *role,
                kind: piece.kinds.get(cell).copied().unwrap_or(0),
                nodes,
            })?;
            index += 1;
        }
    }
    Ok(())
}
