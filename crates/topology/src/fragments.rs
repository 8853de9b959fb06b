//! Pieces that nothing holds.
//!
//! A piece is a connected component of the graph of living cells, with an edge wherever two cells
//! have a part of a face in common. A host may drop a loose piece or let it float; the solver needs
//! every piece that stays to be held somewhere.

use crate::TopologyError;
use crate::body::Body;
use crate::connect::Groups;
use crate::rest::OUTSIDE;
use crate::room::{filled, push, room};

/// Joined cells without a held node.
#[derive(Clone, Debug, PartialEq)]
pub struct Fragment {
    /// Mesh element and place in its list of cells.
    pub cells: Vec<(u32, u32)>,
    /// Ascending.
    pub nodes: Vec<u32>,
    /// What is left of it, mm³.
    pub volume_mm3: f64,
}

impl Body {
    /// The pieces of which no node is held, by the number of their first element. Where nothing is held the largest piece is the body.
    pub fn fragments(&self, is_held: impl Fn(u32) -> bool) -> Result<Vec<Fragment>, TopologyError> {
        let pieces = self.pieces()?;
        let holds = |piece: &Fragment| piece.nodes.iter().any(|node| is_held(*node));
        let body = match pieces.iter().any(holds) {
            true => None,
            false => (pieces.iter().enumerate())
                .max_by(|a, b| a.1.volume_mm3.total_cmp(&b.1.volume_mm3))
                .map(|(at, _)| at),
        };
        let loose = pieces.into_iter().enumerate();
        let loose = loose.filter(|(at, piece)| Some(*at) != body && !holds(piece));
        Ok(loose.map(|(_, piece)| piece).collect())
    }

    /// All pieces of joined living cells.
    pub fn pieces(&self) -> Result<Vec<Fragment>, TopologyError> {
        let mesh = self.mesh();
        let count = mesh.element_count() as u32;
        // The number of each element's first cell, all cells of the body counted through.
        let mut starts: Vec<u32> = room(count as usize + 1)?;
        starts.push(0);
        for element in 0..count {
            let own = self.cells.get(&element).map_or(1, Vec::len) as u32;
            starts.push(starts[element as usize] + own);
        }
        // Dead cells have numbers, too, but join nothing and give no piece.
        let mut groups = Groups::new(starts[count as usize] as usize)?;
        for element in 0..count {
            for (face, &over) in mesh.neighbours(element).iter().enumerate() {
                // Each face between two elements once.
                if over == OUTSIDE || over < element {
                    continue;
                }
                let (first, other) = (starts[element as usize], starts[over as usize]);
                if !self.cells.contains_key(&element) && !self.cells.contains_key(&over) {
                    groups.join(first, other);
                    continue;
                }
                for (a, cell) in self.cells(element).iter().enumerate() {
                    for (b, next) in self.cells(over).iter().enumerate() {
                        if self.is_joined((element, cell), face, over, next) {
                            groups.join(first + a as u32, other + b as u32);
                        }
                    }
                }
            }
        }
        // By group: its place among the pieces, and `u32::MAX` before its first living cell.
        let mut place = filled(u32::MAX, starts[count as usize] as usize)?;
        let mut pieces: Vec<Fragment> = Vec::new();
        for element in 0..count {
            for (at, cell) in self.cells(element).iter().enumerate() {
                if !cell.is_alive {
                    continue;
                }
                let group = groups.of(starts[element as usize] + at as u32) as usize;
                if place[group] == u32::MAX {
                    place[group] = pieces.len() as u32;
                    pieces.push(Fragment {
                        cells: Vec::new(),
                        nodes: Vec::new(),
                        volume_mm3: 0.0,
                    });
                }
                let piece = &mut pieces[place[group] as usize];
                push(&mut piece.cells, (element, at as u32))?;
                for node in cell.nodes {
                    push(&mut piece.nodes, node)?;
                }
                piece.volume_mm3 += cell.share * cell.kept * mesh.volume(element);
            }
        }
        // A node was listed once for each of its cells.
        for piece in &mut pieces {
            piece.nodes.sort_unstable();
            piece.nodes.dedup();
        }
        Ok(pieces)
    }
}
