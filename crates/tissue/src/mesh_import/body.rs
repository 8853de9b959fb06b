//! What a file holds: tetrahedra or a surface, and what its reader did to get there.

use super::error::{Fault, fault};
use super::{RawSurface, RawTets, Repair, far};

/// Tetrahedra or a surface.
pub enum Body {
    Tets(RawTets),
    Surface(RawSurface),
}

/// A file's content.
pub struct Read {
    pub body: Body,
    /// What was left out, listed with the repairs.
    pub notes: Vec<Repair>,
}

impl From<RawSurface> for Read {
    fn from(surface: RawSurface) -> Self {
        Self {
            body: Body::Surface(surface),
            notes: Vec::new(),
        }
    }
}

/// Gathers tetrahedra of the first and of higher orders. Of the latter the four corners stay, which every format lists first.
#[derive(Default)]
pub struct TetList {
    tets: Vec<[u32; 4]>,
    /// Nodes on edges, on faces and inside, with repeats.
    between: Vec<u32>,
    higher: usize,
    first_higher: usize,
}

impl TetList {
    /// Adds one by its nodes, at least four.
    pub fn add(&mut self, nodes: &[u32]) {
        let Some((&corners, between)) = nodes.split_first_chunk::<4>() else {
            return;
        };
        if !between.is_empty() {
            if self.higher == 0 {
                self.first_higher = self.tets.len();
            }
            self.higher += 1;
            self.between.extend_from_slice(between);
        }
        self.tets.push(corners);
    }

    /// The tetrahedra with the nodes of the file, of which those between corners are left out.
    pub fn finish(self, positions: Vec<[f64; 3]>, none: &str) -> Result<Read, Fault> {
        let mut raw = RawTets {
            positions,
            tets: self.tets,
        };
        if raw.tets.is_empty() {
            return fault(none);
        }
        far::check(&raw.positions, raw.tets.iter().flatten().copied())?;
        let mut notes = Vec::new();
        if self.higher > 0 {
            notes.push(Repair {
                what: "tetrahedra of higher order read by their four corners",
                count: self.higher,
                first: self.first_higher,
            });
            let mut drop = vec![false; raw.positions.len()];
            for node in self.between {
                if let Some(drop) = drop.get_mut(node as usize) {
                    *drop = true;
                }
            }
            for &node in raw.tets.iter().flatten() {
                if let Some(drop) = drop.get_mut(node as usize) {
                    *drop = false;
                }
            }
            leave_out(&mut raw, &drop);
        }
        Ok(Read {
            body: Body::Tets(raw),
            notes,
        })
    }
}

/// Drops nodes; a number out of range stays out of range.
fn leave_out(raw: &mut RawTets, drop: &[bool]) {
    let mut kept = 0;
    let renumbered: Vec<u32> = drop
        .iter()
        .map(|drop| {
            kept += u32::from(!drop);
            kept.wrapping_sub(1)
        })
        .collect();
    let mut flags = drop.iter();
    raw.positions.retain(|_| flags.next() == Some(&false));
    for node in raw.tets.iter_mut().flatten() {
        *node = renumbered.get(*node as usize).copied().unwrap_or(u32::MAX);
    }
}
