//! Local refinement of a lattice: tetrahedra are bisected at their longest edges, and with them all
//! others around such an edge, so that no node ends in the middle of a face.
//!
//! Two bisections of a BCC tetrahedron give a sixth of a cube (Kuhn's), and from then on every third one gives
//! the same shapes at half the size, so angles stay bounded (Maubach 1995).

use super::lattice::{Lattice, MOST_NODES};
use super::{Field, StuffError, volume6};
use std::collections::HashMap;

/// Shortest edge that is bisected, in the lattice's units: its midpoint must have whole coordinates.
const SHORTEST: i64 = 4;

const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Tetrahedra around each edge, by its lower and higher node.
struct Edges(HashMap<[u32; 2], Vec<u32>>);

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Edges {
    fn of(tets: &[[u32; 4]]) -> Self {
        let mut edges = Self(HashMap::with_capacity(2 * tets.len()));
        (0..tets.len()).for_each(|tet| edges.add(tets[tet], tet as u32));
        edges
    }

    fn add(&mut self, tet: [u32; 4], index: u32) {
        for [i, j] in EDGES {
            self.0.entry(key(tet[i], tet[j])).or_default().push(index);
        }
    }

    fn remove(&mut self, tet: [u32; 4], index: u32) {
        for [i, j] in EDGES {
            if let Some(around) = self.0.get_mut(&key(tet[i], tet[j])) {
                around.retain(|&other| other != index);
            }
        }
    }
}

/// Bisects tetrahedra for which `too_large` holds, until it holds of none: of their corners, and of the spacing at which a uniform
/// lattice has tetrahedra of their volume, mm.
pub fn refine(
    lattice: &mut Lattice,
    field: &impl Field,
    spacing: f64,
    too_large: impl Fn([[f64; 3]; 4], f64) -> bool,
) -> Result<(), StuffError> {
    let mut edges = Edges::of(&lattice.tets);
    let mut next = 0;
    // Halves are appended, and looked at in their turn; a bisected tetrahedron becomes one of its halves.
    while next < lattice.tets.len() {
        let tet = lattice.tets[next];
        let (length2, edge) = longest(lattice, tet);
        let corners = tet.map(|node| lattice.positions[node as usize]);
        if lattice.values.len() as f64 > MOST_NODES {
            return Err(StuffError::TooLarge(lattice.values.len() as u64, spacing));
        }
        let [a, b, c, d] = corners;
        let size = (2.0 * volume6(a, b, c, d).abs()).cbrt();
        if length2 >= SHORTEST.pow(2) && too_large(corners, size) {
            bisect(lattice, &mut edges, field, edge)?;
        } else {
            next += 1;
        }
    }
    Ok(())
}

/// The longest edge and the square of its length; of equals the one with the lowest nodes.
fn longest(lattice: &Lattice, tet: [u32; 4]) -> (i64, [u32; 2]) {
    let edges = EDGES.map(|[i, j]| key(tet[i], tet[j]));
    let lengths = edges.map(|[a, b]| (lattice.length2(a as usize, b as usize), [a, b]));
    let longer = |one: (i64, [u32; 2]), other: (i64, [u32; 2])| {
        if (other.0, one.1) > (one.0, other.1) {
            other
        } else {
            one
        }
    };
    lengths.into_iter().reduce(longer).unwrap_or(lengths[0])
}

/// Bisects an edge, after longer edges of the tetrahedra around it.
fn bisect(
    lattice: &mut Lattice,
    edges: &mut Edges,
    field: &impl Field,
    edge: [u32; 2],
) -> Result<(), StuffError> {
    let [a, b] = edge;
    let own = lattice.length2(a as usize, b as usize);
    let mut waiting = vec![(edge, own)];
    while let Some(&(edge, own)) = waiting.last() {
        let around = edges.0.get(&edge).map_or(&[][..], Vec::as_slice);
        let longer = around
            .iter()
            .map(|&tet| longest(lattice, lattice.tets[tet as usize]))
            .find(|&(length2, _)| length2 > own);
        match longer {
            Some((length2, first)) => waiting.push((first, length2)),
            None => {
                waiting.pop();
                split(lattice, edges, field, edge)?;
            }
        }
    }
    Ok(())
}

/// Puts a node in the middle of an edge and halves the tetrahedra around it.
fn split(
    lattice: &mut Lattice,
    edges: &mut Edges,
    field: &impl Field,
    [a, b]: [u32; 2],
) -> Result<(), StuffError> {
    let (from, to) = (
        lattice.coordinates[a as usize],
        lattice.coordinates[b as usize],
    );
    let middle = lattice.add(field, [0, 1, 2].map(|axis| (from[axis] + to[axis]) / 2))?;
    let around = edges.0.remove(&key(a, b)).unwrap_or_default();
    for index in around {
        let whole = lattice.tets[index as usize];
        let half = |out: u32| whole.map(|node| if node == out { middle } else { node });
        edges.remove(whole, index);
        for (tet, at) in [(half(b), index), (half(a), lattice.tets.len() as u32)] {
            if at as usize == lattice.tets.len() {
                lattice.tets.push(tet);
            } else {
                lattice.tets[at as usize] = tet;
            }
            edges.add(tet, at);
        }
    }
    Ok(())
}
