//! What replaces a lattice tetrahedron that the surface cuts (Labelle and Shewchuk, figure 3).
//!
//! The inside part of a lattice tetrahedron is a tetrahedron, a pyramid or a triangular prism.
//! A quadrilateral on a lattice face is shared with the neighbour, so its diagonal follows from
//! that face alone ([`diagonal_from_first`]).

use super::lattice::Lattice;
use super::{Field, Stuffed, volume6};
use crate::mesh_quality::dihedral_angles;
use std::collections::HashMap;

/// Output nodes: lattice nodes and cut points that some tetrahedron uses, in order of first use.
struct Nodes<'a> {
    lattice: &'a Lattice,
    of_node: HashMap<usize, u32>,
    of_edge: HashMap<(usize, usize), u32>,
    out: Stuffed,
}

impl Nodes<'_> {
    fn node(&mut self, node: usize) -> u32 {
        *self.of_node.entry(node).or_insert_with(|| {
            self.out.positions.push(self.lattice.positions[node]);
            self.out.positions.len() as u32 - 1
        })
    }

    fn cut(&mut self, inside: usize, outside: usize) -> u32 {
        let edge = (inside.min(outside), inside.max(outside));
        *self.of_edge.entry(edge).or_insert_with(|| {
            let point = self.lattice.cut(inside, outside);
            self.out.positions.push(point);
            self.out.positions.len() as u32 - 1
        })
    }

    fn tet(&mut self, mut tet: [u32; 4]) {
        let [a, b, c, d] = tet.map(|node| self.out.positions[node as usize]);
        if volume6(a, b, c, d) < 0.0 {
            tet.swap(2, 3);
        }
        self.out.tets.push(tet);
    }

    /// A pyramid over the quadrilateral `a b c d` (in cyclic order), cut along `a c` or `b d`.
    fn pyramid(&mut self, apex: u32, [a, b, c, d]: [u32; 4], along_ac: bool) {
        if along_ac {
            self.tet([apex, a, b, c]);
            self.tet([apex, a, c, d]);
        } else {
            self.tet([apex, a, b, d]);
            self.tet([apex, b, c, d]);
        }
    }

    /// A prism with edges `top[i] bottom[i]`. `falls[i]` says that side `(i, i + 1)` is cut from
    /// `top[i]` to `bottom[i + 1]`, else from `top[i + 1]` to `bottom[i]`; not all three alike.
    fn prism(&mut self, top: [u32; 3], bottom: [u32; 3], falls: [bool; 3]) {
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let side = [top[j], top[k], bottom[k], bottom[j]];
            if falls[i] && !falls[k] {
                self.tet([top[i], bottom[0], bottom[1], bottom[2]]);
                self.pyramid(top[i], side, falls[j]);
                return;
            }
        }
        // Where a lattice was bisected the diagonals may run in a circle: then from a node within.
        let corners = [top, bottom].concat();
        let mut centre = [0.0; 3];
        for &node in &corners {
            let at = self.out.positions[node as usize];
            (0..3).for_each(|axis| centre[axis] += at[axis] / 6.0);
        }
        self.out.positions.push(centre);
        let apex = self.out.positions.len() as u32 - 1;
        self.tet([apex, top[0], top[1], top[2]]);
        self.tet([apex, bottom[0], bottom[1], bottom[2]]);
        for i in 0..3 {
            let j = (i + 1) % 3;
            self.pyramid(apex, [top[i], top[j], bottom[j], bottom[i]], falls[i]);
        }
    }
}

/// The diagonal of the quadrilateral on the lattice face `(first, second, outside)` whose first
/// two nodes are inside: true for the one from `first` to the cut point of `second`.
///
/// Where one cut edge is longer, the diagonal ends at the other edge's cut point. Where both are
/// as long, the parity rule: it leaves the node that has an even number of coordinates greater than
/// `outside`. Where that does not tell, which a uniform lattice never needs, it leaves the first made.
fn diagonal_from_first(lattice: &Lattice, first: usize, second: usize, outside: usize) -> bool {
    let longer = lattice.length2(first, outside) - lattice.length2(second, outside);
    if longer != 0 {
        return longer > 0;
    }
    let there = lattice.coordinates[outside];
    let even = |node: usize| {
        let here = lattice.coordinates[node];
        (0..3).filter(|&axis| here[axis] > there[axis]).count() % 2 == 0
    };
    if even(first) == even(second) {
        return first < second;
    }
    even(first)
}

/// Whether a tetrahedron whose nodes all lie on the surface is a piece of a wall: within, and no sliver.
fn between_sheets(lattice: &Lattice, field: &impl Field, tet: [u32; 4]) -> bool {
    let corners = tet.map(|node| lattice.positions[node as usize]);
    let centre = [0, 1, 2].map(|axis| corners.iter().map(|p| p[axis]).sum::<f64>() / 4.0);
    let [a, b, c, d] = corners;
    let shape = |angle: &f64| (10.0..160.0).contains(angle);
    tet.iter().all(|&node| lattice.values[node as usize] == 0.0)
        && field.value(centre) > 0.0
        && volume6(a, b, c, d) != 0.0
        && dihedral_angles(corners).iter().all(shape)
}

/// The tetrahedra of the inside; with `thin`, also those between two sheets of the surface.
pub fn fill(lattice: &Lattice, field: &impl Field, thin: bool) -> Stuffed {
    let mut nodes = Nodes {
        lattice,
        of_node: HashMap::new(),
        of_edge: HashMap::new(),
        out: Stuffed::default(),
    };
    for tet in &lattice.tets {
        let pick = |keep: fn(f64) -> bool| -> Vec<usize> {
            tet.iter()
                .map(|&node| node as usize)
                .filter(|&node| keep(lattice.values[node]))
                .collect()
        };
        let inside = pick(|value| value > 0.0);
        if inside.is_empty() {
            if thin && between_sheets(lattice, field, *tet) {
                let kept = tet.map(|node| nodes.node(node as usize));
                nodes.tet(kept);
            }
            continue;
        }
        let zero = pick(|value| value == 0.0);
        let outside = pick(|value| value < 0.0);
        replace(&mut nodes, &inside, &zero, &outside);
    }
    nodes.out
}

fn replace(nodes: &mut Nodes<'_>, inside: &[usize], zero: &[usize], outside: &[usize]) {
    let lattice = nodes.lattice;
    match (inside, outside) {
        (_, []) => {
            let kept: Vec<u32> = inside.iter().chain(zero).map(|&n| nodes.node(n)).collect();
            nodes.tet([kept[0], kept[1], kept[2], kept[3]]);
        }
        (&[p], _) => {
            let mut kept = vec![nodes.node(p)];
            kept.extend(zero.iter().map(|&n| nodes.node(n)));
            kept.extend(outside.iter().map(|&n| nodes.cut(p, n)));
            nodes.tet([kept[0], kept[1], kept[2], kept[3]]);
        }
        (&[p, q], &[n]) => {
            let apex = nodes.node(zero[0]);
            let base = [
                nodes.node(p),
                nodes.node(q),
                nodes.cut(q, n),
                nodes.cut(p, n),
            ];
            nodes.pyramid(apex, base, diagonal_from_first(lattice, p, q, n));
        }
        (&[p, q], &[n, m]) => {
            let top = [nodes.node(p), nodes.cut(p, n), nodes.cut(p, m)];
            let bottom = [nodes.node(q), nodes.cut(q, n), nodes.cut(q, m)];
            let near = diagonal_from_first(lattice, p, q, n);
            let far = !diagonal_from_first(lattice, p, q, m);
            // The third side is on the surface, so its diagonal is free: the shorter one, but
            // never one that makes the three run in a circle.
            let across = if near == far {
                !near
            } else {
                let length = |a: u32, b: u32| {
                    let (a, b) = (
                        nodes.out.positions[a as usize],
                        nodes.out.positions[b as usize],
                    );
                    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>()
                };
                length(top[1], bottom[2]) <= length(top[2], bottom[1])
            };
            nodes.prism(top, bottom, [near, across, far]);
        }
        (&[p, q, r], &[n]) => {
            let top = [nodes.node(p), nodes.node(q), nodes.node(r)];
            let bottom = [nodes.cut(p, n), nodes.cut(q, n), nodes.cut(r, n)];
            let falls = [(p, q), (q, r), (r, p)]
                .map(|(one, other)| diagonal_from_first(lattice, one, other, n));
            nodes.prism(top, bottom, falls);
        }
        _ => unreachable!("a tetrahedron has four nodes"),
    }
}
