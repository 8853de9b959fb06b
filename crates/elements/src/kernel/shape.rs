//! The first loop of a batch: nodes gathered, and what the edges of its tetrahedra have between them.
//!
//! Whatever does not depend on the law: edges, their cross and dot products, `det D` and the
//! invariant `I1 = sum_jk G_jk e_j . e_k`. The stored springs are `-mu V G`, so the sum over them
//! is `-mu V I1`, an energy in nJ.

use crate::cluster::{Cluster, corners};
use lanes::{NodeLanes, WIDTH};

/// A vector of 16 elements.
type Vectors = [[f32; WIDTH]; 3];

/// What a batch keeps between the loops; a cluster of few nodes leaves the ends unused.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
pub struct Shape {
    /// `e_k`, mm; row `k - 1`.
    pub(super) edge: [Vectors; 5],
    /// `e_1 x e_k`, mm²; row `k - 2`.
    pub(super) across: [Vectors; 4],
    /// `e_b x e_c` of a tetrahedron's corners, mm².
    pub(super) face: [Vectors; 4],
    /// det D, mm³; then the springs' factor `J^(-2/3)`, unless the law has `I2`.
    pub(super) determinant: [[f32; WIDTH]; 4],
    /// `-mu V I1`, nJ; then the factor of cof D, Pa.
    pub(super) invariant: [[f32; WIDTH]; 4],
    /// Sum of the corners' fourth component: nodal dilatation, where it is used.
    pub(super) dilatation: [[f32; WIDTH]; 4],
    /// Of a law with `I2`: `E = D^T D`, mm², entries as those of [`Cluster::springs`]; then its springs, µN/mm.
    pub(super) products: [[[f32; WIDTH]; 6]; 4],
}

impl Shape {
    /// Zeros; each batch writes what it reads.
    pub const EMPTY: Self = Self {
        edge: [[[0.0; WIDTH]; 3]; 5],
        across: [[[0.0; WIDTH]; 3]; 4],
        face: [[[0.0; WIDTH]; 3]; 4],
        determinant: [[0.0; WIDTH]; 4],
        invariant: [[0.0; WIDTH]; 4],
        dilatation: [[0.0; WIDTH]; 4],
        products: [[[0.0; WIDTH]; 6]; 4],
    };
}

#[inline(always)]
pub(super) unsafe fn load<L: NodeLanes>(row: &[f32; WIDTH], first: usize) -> L {
    unsafe { L::load(row.as_ptr().add(first)) }
}

#[inline(always)]
pub(super) unsafe fn store<L: NodeLanes>(value: L, row: &mut [f32; WIDTH], first: usize) {
    unsafe { value.store(row.as_mut_ptr().add(first)) }
}

#[inline(always)]
pub(super) unsafe fn store_vector<L: NodeLanes>(value: [L; 3], rows: &mut Vectors, first: usize) {
    unsafe {
        for i in 0..3 {
            store(value[i], &mut rows[i], first);
        }
    }
}

#[inline(always)]
pub(super) unsafe fn cross<L: NodeLanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    unsafe {
        [
            a[2].neg_mul_add(b[1], a[1].mul(b[2])),
            a[0].neg_mul_add(b[2], a[2].mul(b[0])),
            a[1].neg_mul_add(b[0], a[0].mul(b[1])),
        ]
    }
}

#[inline(always)]
pub(super) unsafe fn dot<L: NodeLanes>(a: [L; 3], b: [L; 3]) -> L {
    unsafe { a[2].mul_add(b[2], a[1].mul_add(b[1], a[0].mul(b[0]))) }
}

/// Edges from node 0 of the clusters from lane `first` on (entry 0 is zero), and the nodes' fourth components.
#[inline(always)]
pub(super) unsafe fn edges<L: NodeLanes, const NODES: usize, const TETS: usize>(
    cluster: &Cluster<NODES, TETS>,
    first: usize,
    nodes: *const [f32; 4],
) -> ([[L; 3]; NODES], [L; NODES]) {
    unsafe {
        let zero = L::splat(0.0);
        let mut edge = [[zero; 3]; NODES];
        let mut fourth = [zero; NODES];
        let [x, y, z, w] = L::gather(nodes, cluster.slots[0].as_ptr().add(first));
        fourth[0] = w;
        for node in 1..NODES {
            let value = L::gather(nodes, cluster.slots[node].as_ptr().add(first));
            edge[node] = [value[0].sub(x), value[1].sub(y), value[2].sub(z)];
            fourth[node] = value[3];
        }
        (edge, fourth)
    }
}

/// Gathers the nodes and fills `out`: its `products` of a law with `I2`, its `dilatation` where the nodes' is `averaged`.
#[inline(always)]
pub(super) unsafe fn shape<
    L: NodeLanes,
    const SECOND: bool,
    const NODES: usize,
    const TETS: usize,
>(
    cluster: &Cluster<NODES, TETS>,
    first: usize,
    nodes: *const [f32; 4],
    averaged: bool,
    out: &mut Shape,
) {
    unsafe {
        let zero = L::splat(0.0);
        let (edge, fourth) = edges::<L, NODES, TETS>(cluster, first, nodes);
        if averaged {
            for tet in 0..TETS {
                let [_, b, c] = corners::<NODES>(tet);
                let sum = fourth[0].add(fourth[1]).add(fourth[b]).add(fourth[c]);
                store(sum, &mut out.dilatation[tet], first);
            }
        }
        let mut square = [zero; NODES];
        let mut along = [zero; NODES];
        for k in 1..NODES {
            store_vector(edge[k], &mut out.edge[k - 1], first);
            square[k] = dot(edge[k], edge[k]);
        }
        for k in 2..NODES {
            store_vector(cross(edge[1], edge[k]), &mut out.across[k - 2], first);
            along[k] = dot(edge[1], edge[k]);
        }
        for tet in 0..TETS {
            let [_, b, c] = corners::<NODES>(tet);
            let face = cross(edge[b], edge[c]);
            store_vector(face, &mut out.face[tet], first);
            store(dot(edge[1], face), &mut out.determinant[tet], first);
            let m = &cluster.springs[tet];
            let between = dot(edge[b], edge[c]);
            if SECOND {
                let products = [square[1], along[b], along[c], square[b], between, square[c]];
                for k in 0..6 {
                    store(products[k], &mut out.products[tet][k], first);
                }
            }
            // Off-diagonal entries count twice.
            let mixed = load::<L>(&m[4], first).mul(between);
            let mixed = load::<L>(&m[2], first).mul_add(along[c], mixed);
            let mixed = load::<L>(&m[1], first).mul_add(along[b], mixed);
            let own = load::<L>(&m[5], first).mul(square[c]);
            let own = load::<L>(&m[3], first).mul_add(square[b], own);
            let own = load::<L>(&m[0], first).mul_add(square[1], own);
            let invariant = mixed.mul_add(L::splat(2.0), own);
            store(invariant, &mut out.invariant[tet], first);
        }
    }
}

/// Adds forces on the corners of lanes from `first` on, µN, those of node 0 being what balances the others.
///
/// # Safety
/// The instruction set of `L` is there; the slots lie within `forces`.
#[inline(always)]
pub(super) unsafe fn add_balanced<L: NodeLanes, const NODES: usize, const TETS: usize>(
    cluster: &Cluster<NODES, TETS>,
    first: usize,
    mut force: [[L; 3]; NODES],
    forces: *mut [f32; 4],
) {
    unsafe {
        for node in 1..NODES {
            for i in 0..3 {
                force[0][i] = force[0][i].sub(force[node][i]);
            }
        }
        for node in 0..NODES {
            let slots = cluster.slots[node].as_ptr().add(first);
            L::scatter_add(forces, slots, force[node]);
        }
    }
}
