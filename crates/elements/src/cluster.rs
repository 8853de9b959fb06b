//! Tetrahedra that share nodes, grouped so that a node is gathered once for several of them.
//!
//! Three kinds: an *octahedron* is four tetrahedra around an edge (six nodes instead of
//! sixteen corners; the cells of a BCC lattice, so three quarters of a stuffed mesh), a
//! *pair* shares a face (five instead of eight), and what is left is single.

use crate::room::{collected, filled, push, room};
use lanes::WIDTH;
use std::collections::{HashMap, TryReserveError};

/// Sixteen clusters of one kind, structure of arrays. All tetrahedra of a cluster share the edge of its nodes 0 and 1.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Cluster<const NODES: usize, const TETS: usize> {
    /// `springs[t]`: `-mu V G`, µN/mm, entries 11, 12, 13, 22, 23, 33 in the order of `corners(t)`, with the rest
    /// volume `V` and `G = (D0^T D0)^-1` of the rest edges from node 0. Zero in padding lanes.
    pub springs: [[[f32; WIDTH]; 6]; TETS],
    /// `1 / det D0`, 1/mm³; negative where the corners turn the other way.
    pub inverse: [[f32; WIDTH]; TETS],
    /// `kappa / 6`, Pa, with the sign of det D0. Zero in padding lanes.
    ///
    /// Both moduli carry the element's stiffness over the material's.
    pub bulk: [[f32; WIDTH]; TETS],
    /// Twice the chunk-local slot of each node (see `lanes`). Padding lanes repeat another lane's.
    pub slots: [[u16; WIDTH]; NODES],
}

impl<const NODES: usize, const TETS: usize> Cluster<NODES, TETS> {
    /// Without any element.
    pub const EMPTY: Self = Self {
        springs: [[[0.0; WIDTH]; 6]; TETS],
        inverse: [[0.0; WIDTH]; TETS],
        bulk: [[0.0; WIDTH]; TETS],
        slots: [[0; WIDTH]; NODES],
    };

    /// Takes the constants of another batch's cluster, not its slots.
    pub fn copy_lane(&mut self, source: &Self, lane: usize, at: usize) {
        for tet in 0..TETS {
            for (own, source) in self.springs[tet].iter_mut().zip(&source.springs[tet]) {
                own[at] = source[lane];
            }
            self.inverse[tet][at] = source.inverse[tet][lane];
            self.bulk[tet][at] = source.bulk[tet][lane];
        }
    }

    /// Lane `at` becomes the shape and the slots of another batch's cluster, without stiffness.
    pub fn take_shape(&mut self, source: &Self, lane: usize, at: usize) {
        for row in self.springs.as_flattened_mut() {
            row[at] = 0.0;
        }
        for tet in 0..TETS {
            self.inverse[tet][at] = source.inverse[tet][lane];
            self.bulk[tet][at] = 0.0;
        }
        for (own, source) in self.slots.iter_mut().zip(&source.slots) {
            own[at] = source[lane];
        }
    }

    /// Lane `at` becomes the shape and the slots of `lane`, without stiffness.
    pub fn repeat_lane(&mut self, lane: usize, at: usize) {
        for row in self.springs.as_flattened_mut() {
            row[at] = 0.0;
        }
        for tet in 0..TETS {
            self.inverse[tet][at] = self.inverse[tet][lane];
            self.bulk[tet][at] = 0.0;
        }
        for row in &mut self.slots {
            row[at] = row[lane];
        }
    }
}

/// Four tetrahedra around the edge of nodes 0 and 1; nodes 2 to 5 are the ring.
pub type Octahedra = Cluster<6, 4>;
/// Two tetrahedra with the common face 0, 1, 2.
pub type Pairs = Cluster<5, 2>;
pub type Singles = Cluster<4, 1>;

/// Nodes of a cluster that tetrahedron `tet` has in addition to node 0.
#[inline(always)]
pub const fn corners<const NODES: usize>(tet: usize) -> [usize; 3] {
    if NODES == 6 {
        [1, 2 + tet, 2 + (tet + 1) % 4]
    } else {
        [1, 2, 3 + tet]
    }
}

/// One cluster of a mesh, before it is packed: nodes and elements in the order of [`Cluster`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Group<const NODES: usize, const TETS: usize> {
    pub nodes: [u32; NODES],
    pub tets: [u32; TETS],
}

/// The clusters of some elements of a mesh; each element is in one of them.
#[derive(Default)]
pub struct Groups {
    pub octahedra: Vec<Group<6, 4>>,
    pub pairs: Vec<Group<5, 2>>,
    pub singles: Vec<Group<4, 1>>,
}

impl Groups {
    /// Groups `elements`: octahedra around the longest edges first, then pairs, elements with the fewest
    /// free neighbours first. Depends on the mesh alone.
    ///
    /// # Errors
    /// No memory.
    pub fn new(
        elements: &[u32],
        tets: &[[u32; 4]],
        positions: &[[f32; 3]],
    ) -> Result<Self, TryReserveError> {
        let mut groups = Self::default();
        let mut left = collected(elements.iter().copied())?;
        left.sort_unstable();
        let mut taken = filled(left.len(), false)?;
        for (edge, ring) in closed_edges(elements, tets, positions)? {
            let places = ring.tets.map(|e| left.partition_point(|other| *other < e));
            if places.iter().all(|at| !taken[*at]) {
                for at in places {
                    taken[at] = true;
                }
                let [a, b] = edge;
                let [p, q, r, s] = ring.nodes;
                let group = Group {
                    nodes: [a, b, p, q, r, s],
                    tets: ring.tets,
                };
                push(&mut groups.octahedra, group)?;
            }
        }
        let mut taken = taken.into_iter();
        left.retain(|_| taken.next() == Some(false));
        groups.pair_up(&left, tets)?;
        Ok(groups)
    }

    fn pair_up(&mut self, elements: &[u32], tets: &[[u32; 4]]) -> Result<(), TryReserveError> {
        let mut of_face: HashMap<[u32; 3], usize> = HashMap::new();
        of_face.try_reserve(4 * elements.len())?;
        let mut neighbours = filled(elements.len(), Neighbours::default())?;
        for (index, element) in elements.iter().enumerate() {
            for skip in 0..4 {
                let face = face_without(tets[*element as usize], skip);
                if let Some(other) = of_face.insert(face, index) {
                    neighbours[index].push(other);
                    neighbours[other].push(index);
                }
            }
        }
        let mut order = collected(0..elements.len())?;
        order.sort_unstable_by_key(|index| (neighbours[*index].count, *index));
        let mut taken = filled(elements.len(), false)?;
        for index in order {
            if taken[index] {
                continue;
            }
            taken[index] = true;
            let around = |i: usize| neighbours[i].all().iter();
            let free = |i: &usize| around(*i).filter(|n| !taken[**n]).count();
            let partner = around(index)
                .copied()
                .filter(|n| !taken[*n])
                .min_by_key(|n| (free(n), *n));
            let first = tets[elements[index] as usize];
            match partner {
                None => {
                    let group = Group {
                        nodes: first,
                        tets: [elements[index]],
                    };
                    push(&mut self.singles, group)?;
                }
                Some(partner) => {
                    taken[partner] = true;
                    let second = tets[elements[partner] as usize];
                    let [a, b] = [(first, second), (second, first)].map(|(own, other)| {
                        let apex = own.iter().position(|n| !other.contains(n));
                        apex.unwrap_or_default()
                    });
                    let [p, q, r] = face_without(first, a);
                    let group = Group {
                        nodes: [p, q, r, first[a], second[b]],
                        tets: [elements[index], elements[partner]],
                    };
                    push(&mut self.pairs, group)?;
                }
            }
        }
        Ok(())
    }
}

/// Elements across the faces of one: two a face at most, the one before it that has the face and the one after it.
#[derive(Clone, Copy, Default)]
struct Neighbours {
    list: [usize; 8],
    count: usize,
}

impl Neighbours {
    fn push(&mut self, index: usize) {
        self.list[self.count] = index;
        self.count += 1;
    }

    fn all(&self) -> &[usize] {
        &self.list[..self.count]
    }
}

/// Four elements around an edge, in the order of the ring's nodes.
struct Ring {
    nodes: [u32; 4],
    tets: [u32; 4],
}

/// Edges that exactly four of the elements close around, longest first.
fn closed_edges(
    elements: &[u32],
    tets: &[[u32; 4]],
    positions: &[[f32; 3]],
) -> Result<Vec<([u32; 2], Ring)>, TryReserveError> {
    // Each element's edges, and its place among the elements.
    let mut around = room(6 * elements.len())?;
    for (place, element) in elements.iter().enumerate() {
        let mut nodes = tets[*element as usize];
        nodes.sort_unstable();
        for a in 0..3 {
            around.extend((a + 1..4).map(|b| ([nodes[a], nodes[b]], place as u32)));
        }
    }
    around.sort_unstable();
    let length = |[a, b]: [u32; 2]| -> f32 {
        let (a, b) = (positions[a as usize], positions[b as usize]);
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
    };
    let mut edges = Vec::new();
    for same in around.chunk_by(|a, b| a.0 == b.0) {
        let edge = same[0].0;
        if let &[(_, a), (_, b), (_, c), (_, d)] = same
            && let Some(ring) = close(
                edge,
                [a, b, c, d].map(|place| elements[place as usize]),
                tets,
            )
        {
            push(&mut edges, (edge, ring))?;
        }
    }
    // Ties in ascending order of the edge's nodes.
    edges.sort_unstable_by(|(a, _), (b, _)| length(*b).total_cmp(&length(*a)).then(a.cmp(b)));
    Ok(edges)
}

/// Walks around the edge; `None` unless four elements close a ring of four nodes.
fn close(edge: [u32; 2], elements: [u32; 4], tets: &[[u32; 4]]) -> Option<Ring> {
    let sides = elements.map(|element| {
        let mut others = tets[element as usize]
            .into_iter()
            .filter(|n| !edge.contains(n));
        [others.next(), others.next()].map(Option::unwrap_or_default)
    });
    let start = sides[0][0];
    let (mut nodes, mut ring) = ([start; 4], [elements[0]; 4]);
    let mut at = sides[0][1];
    let mut left = [true; 4];
    left[0] = false;
    for k in 1..4 {
        nodes[k] = at;
        let index = (1..4).find(|i| left[*i] && sides[*i].contains(&at))?;
        left[index] = false;
        ring[k] = elements[index];
        let [p, q] = sides[index];
        at = if p == at { q } else { p };
    }
    (at == start).then_some(Ring { nodes, tets: ring })
}

/// Nodes of the face opposite corner `skip`, ascending.
fn face_without(tet: [u32; 4], skip: usize) -> [u32; 3] {
    let mut face = [
        tet[(skip + 1) % 4],
        tet[(skip + 2) % 4],
        tet[(skip + 3) % 4],
    ];
    face.sort_unstable();
    face
}

#[cfg(test)]
mod tests {
    use super::*;
    use tissue::mesh::{Mesh, box_phantom};

    fn volume(mesh: &Mesh, nodes: [u32; 4]) -> f64 {
        crate::batches::shape_gradients(nodes.map(|n| mesh.positions[n as usize])).1
    }

    /// Checks one kind: the nodes that [`corners`] names are those of the mesh's element.
    fn check<const NODES: usize, const TETS: usize>(
        groups: &[Group<NODES, TETS>],
        mesh: &Mesh,
        seen: &mut [bool],
    ) {
        for group in groups {
            for (tet, element) in group.tets.into_iter().enumerate() {
                assert!(
                    !seen[element as usize],
                    "element {element} is in two clusters"
                );
                seen[element as usize] = true;
                let [a, b, c] = corners::<NODES>(tet).map(|corner| group.nodes[corner]);
                let mut nodes = [group.nodes[0], a, b, c];
                let difference =
                    volume(mesh, nodes).abs() - volume(mesh, mesh.tets[element as usize]);
                assert!(difference.abs() < 1e-6 * volume(mesh, nodes).abs());
                nodes.sort_unstable();
                let mut wanted = mesh.tets[element as usize];
                wanted.sort_unstable();
                assert_eq!(nodes, wanted, "element {element}");
            }
        }
    }

    #[test]
    fn every_element_is_in_one_cluster_with_its_own_nodes() {
        let mesh = box_phantom([30.0, 40.0, 50.0], [5, 6, 7]).unwrap();
        let elements: Vec<u32> = (0..mesh.tets.len() as u32).collect();
        let groups = Groups::new(&elements, &mesh.tets, &mesh.positions).unwrap();
        let mut seen = vec![false; mesh.tets.len()];
        check(&groups.octahedra, &mesh, &mut seen);
        check(&groups.pairs, &mesh, &mut seen);
        check(&groups.singles, &mesh, &mut seen);
        assert!(seen.into_iter().all(|seen| seen));
    }

    #[test]
    fn four_tets_around_an_edge_are_an_octahedron() {
        // The edge 0-1 with the ring 2, 3, 4, 5, and one more tet on a face of the ring.
        let positions = [
            [0.0, 0.0, -1.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, -1.0, 0.0],
            [1.0, 1.0, 1.0],
        ];
        let tets = [
            [0, 1, 4, 5],
            [0, 1, 2, 3],
            [3, 1, 0, 4],
            [0, 5, 1, 2],
            [1, 2, 3, 6],
        ];
        let groups = Groups::new(&[0, 1, 2, 3, 4], &tets, &positions).unwrap();
        assert_eq!(
            (
                groups.octahedra.len(),
                groups.pairs.len(),
                groups.singles.len()
            ),
            (1, 0, 1)
        );
        let nodes = groups.octahedra[0].nodes;
        assert_eq!(nodes[..2], [0, 1]);
        for k in 0..4 {
            // Neighbours in the ring share a tet with the edge; opposite nodes do not.
            let [p, q] = [nodes[2 + k], nodes[2 + (k + 1) % 4]];
            assert!(
                tets.iter()
                    .any(|tet| [0, 1, p, q].iter().all(|n| tet.contains(n)))
            );
        }
    }

    #[test]
    fn two_tets_with_a_common_face_are_a_pair() {
        let tets = [[0, 1, 2, 3], [1, 2, 3, 4]];
        let positions = [[0.0; 3]; 5];
        let groups = Groups::new(&[0, 1], &tets, &positions).unwrap();
        assert_eq!(
            groups.pairs,
            [Group {
                nodes: [1, 2, 3, 0, 4],
                tets: [0, 1]
            }]
        );
    }
}
