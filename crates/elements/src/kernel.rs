//! The element law on batches of 16 clusters of tetrahedra: positions in, nodal forces added.
//!
//! With the deformed edges `e_k = x_k - x_0` of a tetrahedron as columns of `D`, those at rest of `D0`, and
//! `G = (D0^T D0)^-1`, the neo-Hookean law
//! `P = mu J^(-2/3) F + [kappa (J - 1) - mu/3 J^(-5/3) I1] cof F`
//! needs no deformation gradient: `J = det D / det D0`, `I1 = sum_jk G_jk e_j . e_k`, and the forces on corners
//! 1 to 3 are the columns of
//! `-V mu J^(-2/3) D G - V / det D0 [kappa (J - 1) - mu/3 J^(-5/3) I1] cof D`:
//! springs along the edges and a pressure on the faces.
//!
//! A law that depends on `I2`, too, has springs that change with the shape: with the products `E = D^T D` of the edges,
//! `F F^T F` becomes `D G E G`, `I2 = (I1² - tr (E G)²) / 2`, and the springs are `f1 G + f2 (I1 G - G E G)` ([`crate::laws`]).
//!
//! All tetrahedra of a cluster share the edge of its nodes 0 and 1 ([`Cluster`]), so edges, their dot products and
//! most cross products serve two or more of them, spring constants of a pair of nodes add up before they meet
//! the edge, each node is gathered once and its forces meet in registers.
//!
//! `J^(-1/3)` comes from an integer guess and a polynomial, to f32 accuracy, without log or division.
//! A batch goes through three short loops (shape, moduli, forces) with a buffer between them: the iterations of
//! each are independent and overlap, where one long loop would wait for its own cube root.
//!
//! No closures here or in `lanes`: a closure does not take on its caller's
//! instruction set, and every vector operation in it would become a call.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: the instruction set is enabled in the caller, and pointers hold what the shapes say"
)]

use crate::cluster::{Cluster, corners};
use crate::lanes::{Lanes, WIDTH, prefetch};
use crate::laws::{Isochoric, Law};

/// Floating-point operations of one cluster in [`add_forces`], a fused multiply-add counted as two.
pub fn flops(nodes: usize, tets: usize, law: &Law) -> usize {
    match law {
        Law::NeoHookean(law) => flops_of(*law, nodes, tets),
        Law::MooneyRivlin(law) => flops_of(*law, nodes, tets),
    }
}

fn flops_of<M: Isochoric>(_: M, nodes: usize, tets: usize) -> usize {
    let ring = nodes - 2;
    // Edges, their squares and what they share with the edge 0-1: cross and dot products.
    let shape = 3 * (nodes - 1) + 5 * (nodes - 1) + 14 * ring;
    // E G, its square's trace, G E G, both invariants, springs.
    let second = if M::SECOND { 45 + 10 + 30 + 10 + 22 } else { 0 };
    // A face's cross and dot product, determinant, invariant; root 15, coefficients 6 and the law's; spring constants 12.
    let tet = 9 + 5 + 5 + 12 + 15 + 6 + M::FLOPS + 12 + second;
    // Springs along the edges from nodes 0 and 1, along the face's third edge, pressure on three corners.
    let forces = 6 * (nodes - 1) + 12 * ring + tets * (12 + 18);
    // Balance and addition to the nodes.
    shape + tets * tet + forces + 3 * (nodes - 1) + 3 * nodes
}

/// `x^(-1/3)` for positive `x`, relative error about 1e-7.
#[inline(always)]
pub unsafe fn inverse_cube_root<L: Lanes>(x: L) -> L {
    unsafe {
        let y = x.inverse_cube_root_guess();
        // y (1 - e)^(-1/3) with e = 1 - x y^3: a Chebyshev fit over -0.121..0.091, the guess's whole range.
        let e = y.mul(y).neg_mul_add(y.mul(x), L::splat(1.0));
        let series = e
            .mul_add(L::splat(0.117_032_66), L::splat(0.145_538_02))
            .mul_add(e, L::splat(0.172_930_58))
            .mul_add(e, L::splat(0.222_216_78))
            .mul_add(e, L::splat(0.333_333_13))
            .mul_add(e, L::splat(1.0));
        y.mul(series)
    }
}

/// A vector of 16 elements.
type Vectors = [[f32; WIDTH]; 3];

/// What a batch keeps between the loops; a cluster of few nodes leaves the ends unused.
#[repr(C, align(64))]
#[derive(Clone, Copy)]
pub struct Shape {
    /// `e_k`, mm; row `k - 1`.
    edge: [Vectors; 5],
    /// `e_1 x e_k`, mm²; row `k - 2`.
    across: [Vectors; 4],
    /// `e_b x e_c` of a tetrahedron's corners, mm².
    face: [Vectors; 4],
    /// det D, mm³; then the springs' factor `J^(-2/3)`, unless the law has `I2`.
    determinant: [[f32; WIDTH]; 4],
    /// `-mu V I1`, nJ; then the factor of cof D, Pa.
    invariant: [[f32; WIDTH]; 4],
    /// Sum of the corners' fourth component: nodal dilatation, where it is used.
    dilatation: [[f32; WIDTH]; 4],
    /// Of a law with `I2`: `E = D^T D`, mm², entries as those of [`Cluster::springs`]; then its springs, µN/mm.
    products: [[[f32; WIDTH]; 6]; 4],
}

impl Shape {
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
unsafe fn load<L: Lanes>(row: &[f32; WIDTH], first: usize) -> L {
    unsafe { L::load(row.as_ptr().add(first)) }
}

#[inline(always)]
unsafe fn store<L: Lanes>(value: L, row: &mut [f32; WIDTH], first: usize) {
    unsafe { value.store(row.as_mut_ptr().add(first)) }
}

#[inline(always)]
unsafe fn store_vector<L: Lanes>(value: [L; 3], rows: &mut Vectors, first: usize) {
    unsafe {
        for i in 0..3 {
            store(value[i], &mut rows[i], first);
        }
    }
}

#[inline(always)]
unsafe fn cross<L: Lanes>(a: [L; 3], b: [L; 3]) -> [L; 3] {
    unsafe {
        [
            a[2].neg_mul_add(b[1], a[1].mul(b[2])),
            a[0].neg_mul_add(b[2], a[2].mul(b[0])),
            a[1].neg_mul_add(b[0], a[0].mul(b[1])),
        ]
    }
}

#[inline(always)]
unsafe fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    unsafe { a[2].mul_add(b[2], a[1].mul_add(b[1], a[0].mul(b[0]))) }
}

/// Edges from node 0 of the clusters from lane `first` on (entry 0 is zero), and the nodes' fourth components.
#[inline(always)]
unsafe fn edges<L: Lanes, const NODES: usize, const TETS: usize>(
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

/// Gathers the nodes and fills `out`.
#[inline(always)]
unsafe fn shape<
    L: Lanes,
    M: Isochoric,
    const NODES: usize,
    const TETS: usize,
    const AVERAGED: bool,
>(
    cluster: &Cluster<NODES, TETS>,
    first: usize,
    nodes: *const [f32; 4],
    out: &mut Shape,
) {
    unsafe {
        let zero = L::splat(0.0);
        let (edge, fourth) = edges::<L, NODES, TETS>(cluster, first, nodes);
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
            if M::SECOND {
                let products = [square[1], along[b], along[c], square[b], between, square[c]];
                for k in 0..6 {
                    store(products[k], &mut out.products[tet][k], first);
                }
            }
            let mixed = load::<L>(&m[4], first).mul(between);
            let mixed = load::<L>(&m[2], first).mul_add(along[c], mixed);
            let mixed = load::<L>(&m[1], first).mul_add(along[b], mixed);
            let own = load::<L>(&m[5], first).mul(square[c]);
            let own = load::<L>(&m[3], first).mul_add(square[b], own);
            let own = load::<L>(&m[0], first).mul_add(square[1], own);
            let invariant = mixed.mul_add(L::splat(2.0), own);
            store(invariant, &mut out.invariant[tet], first);
            if AVERAGED {
                let sum = fourth[0].add(fourth[1]).add(fourth[b]).add(fourth[c]);
                store(sum, &mut out.dilatation[tet], first);
            }
        }
    }
}

/// Where row `j`, column `k` of a symmetric matrix is in the order of [`Cluster::springs`].
const ENTRY: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// Turns determinant, invariant and products into the factors of springs and pressure; returns det F.
#[inline(always)]
unsafe fn moduli<
    L: Lanes,
    M: Isochoric,
    const NODES: usize,
    const TETS: usize,
    const AVERAGED: bool,
>(
    (law, bulk_over_shear): (M, f32),
    cluster: &Cluster<NODES, TETS>,
    tet: usize,
    first: usize,
    shape: &mut Shape,
) -> L {
    unsafe {
        let determinant = load::<L>(&shape.determinant[tet], first);
        let inverse = load::<L>(&cluster.inverse[tet], first);
        let ratio = determinant.mul(inverse);
        let root = inverse_cube_root(ratio.max(L::splat(1e-3)));
        let loss = if AVERAGED {
            load::<L>(&shape.dilatation[tet], first).mul(L::splat(-0.25))
        } else {
            determinant.neg_mul_add(inverse, L::splat(1.0))
        };
        let bulk = load::<L>(&cluster.bulk[tet], first);
        let pressure = bulk.mul(loss);
        let invariant = load::<L>(&shape.invariant[tet], first);
        let factor = if M::SECOND {
            // -1 / (mu V), 1/nJ, by way of the square so that padding lanes give zero.
            let scale = bulk
                .mul(inverse)
                .mul(L::splat(-bulk_over_shear))
                .div(bulk.mul(bulk).max(L::splat(f32::MIN_POSITIVE)));
            let volume = springs::<L, M, NODES, TETS>(
                law,
                [invariant.mul(scale), scale, root],
                cluster,
                tet,
                first,
                shape,
            );
            let sum = bulk.mul(L::splat(-1.0 / bulk_over_shear)).mul(volume[1]);
            volume[0].neg_mul_add(sum, pressure)
        } else {
            let slopes = law.lane_slopes(inverse.mul(invariant), inverse, root);
            store(slopes.first, &mut shape.determinant[tet], first);
            slopes.volume[0].neg_mul_add(slopes.volume[1], pressure)
        };
        store(factor, &mut shape.invariant[tet], first);
        ratio
    }
}

/// Of a law with `I2`: puts the springs in place of the edges' products; returns the two factors of `-dw/dJ`.
#[inline(always)]
unsafe fn springs<L: Lanes, M: Isochoric, const NODES: usize, const TETS: usize>(
    law: M,
    [invariant, scale, root]: [L; 3],
    cluster: &Cluster<NODES, TETS>,
    tet: usize,
    first: usize,
    shape: &mut Shape,
) -> [L; 2] {
    unsafe {
        let zero = L::splat(0.0);
        let (mut e, mut g) = ([zero; 6], [zero; 6]);
        for k in 0..6 {
            e[k] = load(&shape.products[tet][k], first);
            g[k] = load(&cluster.springs[tet][k], first);
        }
        // E G and the trace of its square, both with the factor -mu V of G.
        let mut product = [[zero; 3]; 3];
        for j in 0..3 {
            for k in 0..3 {
                let sum = e[ENTRY[j][0]].mul(g[ENTRY[0][k]]);
                let sum = e[ENTRY[j][1]].mul_add(g[ENTRY[1][k]], sum);
                product[j][k] = e[ENTRY[j][2]].mul_add(g[ENTRY[2][k]], sum);
            }
        }
        let mixed = product[0][1].mul(product[1][0]);
        let mixed = product[0][2].mul_add(product[2][0], mixed);
        let mixed = product[1][2].mul_add(product[2][1], mixed);
        let mut trace = mixed.add(mixed);
        for j in 0..3 {
            trace = product[j][j].mul_add(product[j][j], trace);
        }
        let squares = scale
            .mul(scale)
            .neg_mul_add(trace, invariant.mul(invariant));
        let slopes = law.lane_slopes(invariant, squares.mul(L::splat(0.5)), root);
        let own = slopes.second.mul_add(invariant, slopes.first);
        let less = slopes.second.mul(scale);
        for j in 0..3 {
            for k in j..3 {
                // G E G, with the square of the factor.
                let sum = g[ENTRY[j][0]].mul(product[0][k]);
                let sum = g[ENTRY[j][1]].mul_add(product[1][k], sum);
                let sum = g[ENTRY[j][2]].mul_add(product[2][k], sum);
                let spring = less.neg_mul_add(sum, own.mul(g[ENTRY[j][k]]));
                store(spring, &mut shape.products[tet][ENTRY[j][k]], first);
            }
        }
        slopes.volume
    }
}

/// Adds a spring to a sum: the stored one times its factor, or one that the law has made anew.
#[inline(always)]
unsafe fn add_spring<L: Lanes, M: Isochoric>(factor: L, spring: L, sum: L) -> L {
    unsafe {
        if M::SECOND {
            sum.add(spring)
        } else {
            factor.mul_add(spring, sum)
        }
    }
}

/// What pulls at the nodes of a cluster: spring constants (µN/mm) summed over its tetrahedra, and the factors of cof D (Pa).
struct Pull<L, const NODES: usize, const TETS: usize> {
    /// Node 1 with itself (entry 1), and of the others each with itself.
    own: [L; NODES],
    /// Of each node with node 1.
    along: [L; NODES],
    /// Of a tetrahedron's corners b and c.
    face: [L; TETS],
    factor: [L; TETS],
}

/// Adds the forces to the nodes.
#[inline(always)]
unsafe fn scatter<L: Lanes, M: Isochoric, const NODES: usize, const TETS: usize>(
    cluster: &Cluster<NODES, TETS>,
    first: usize,
    shape: &Shape,
    forces: *mut [f32; 4],
) {
    unsafe {
        let zero = L::splat(0.0);
        let mut pull = Pull {
            own: [zero; NODES],
            along: [zero; NODES],
            face: [zero; TETS],
            factor: [zero; TETS],
        };
        for tet in 0..TETS {
            let [_, b, c] = corners::<NODES>(tet);
            let by = load::<L>(&shape.determinant[tet], first);
            let m = if M::SECOND {
                &shape.products[tet]
            } else {
                &cluster.springs[tet]
            };
            pull.own[1] = add_spring::<L, M>(by, load(&m[0], first), pull.own[1]);
            pull.along[b] = add_spring::<L, M>(by, load(&m[1], first), pull.along[b]);
            pull.along[c] = add_spring::<L, M>(by, load(&m[2], first), pull.along[c]);
            pull.own[b] = add_spring::<L, M>(by, load(&m[3], first), pull.own[b]);
            pull.own[c] = add_spring::<L, M>(by, load(&m[5], first), pull.own[c]);
            let face = load::<L>(&m[4], first);
            pull.face[tet] = if M::SECOND { face } else { by.mul(face) };
            pull.factor[tet] = load(&shape.invariant[tet], first);
        }
        // The forces of an element are in balance: what the other nodes get is taken from node 0.
        let mut rest = [zero; 3];
        add_node::<L, NODES, TETS, 1>(cluster, first, shape, &pull, forces, &mut rest);
        add_node::<L, NODES, TETS, 2>(cluster, first, shape, &pull, forces, &mut rest);
        add_node::<L, NODES, TETS, 3>(cluster, first, shape, &pull, forces, &mut rest);
        if NODES > 4 {
            add_node::<L, NODES, TETS, 4>(cluster, first, shape, &pull, forces, &mut rest);
        }
        if NODES > 5 {
            add_node::<L, NODES, TETS, 5>(cluster, first, shape, &pull, forces, &mut rest);
        }
        L::scatter_add(forces, cluster.slots[0].as_ptr().add(first), rest);
    }
}

/// Adds the force on one node, and takes it from `rest`. The node is a constant so that its neighbours are, too.
#[inline(always)]
unsafe fn add_node<L: Lanes, const NODES: usize, const TETS: usize, const NODE: usize>(
    cluster: &Cluster<NODES, TETS>,
    first: usize,
    shape: &Shape,
    pull: &Pull<L, NODES, TETS>,
    forces: *mut [f32; 4],
    rest: &mut [L; 3],
) {
    unsafe {
        let mut force = [L::splat(0.0); 3];
        for i in 0..3 {
            force[i] = pull.own[NODE].mul(load(&shape.edge[NODE - 1][i], first));
            if NODE == 1 {
                for k in 2..NODES {
                    let edge = load::<L>(&shape.edge[k - 1][i], first);
                    force[i] = pull.along[k].mul_add(edge, force[i]);
                }
            } else {
                let edge = load::<L>(&shape.edge[0][i], first);
                force[i] = pull.along[NODE].mul_add(edge, force[i]);
            }
            for tet in 0..TETS {
                let [_, b, c] = corners::<NODES>(tet);
                let factor = pull.factor[tet];
                if NODE == 1 {
                    force[i] = factor.mul_add(load(&shape.face[tet][i], first), force[i]);
                }
                if NODE == b {
                    let edge = load::<L>(&shape.edge[c - 1][i], first);
                    force[i] = pull.face[tet].mul_add(edge, force[i]);
                    force[i] = factor.neg_mul_add(load(&shape.across[c - 2][i], first), force[i]);
                }
                if NODE == c {
                    let edge = load::<L>(&shape.edge[b - 1][i], first);
                    force[i] = pull.face[tet].mul_add(edge, force[i]);
                    force[i] = factor.mul_add(load(&shape.across[b - 2][i], first), force[i]);
                }
            }
            rest[i] = rest[i].sub(force[i]);
        }
        L::scatter_add(forces, cluster.slots[NODE].as_ptr().add(first), force);
    }
}

/// Adds the forces (µN) of the clusters to `forces`, given positions (mm, from any origin); returns the smallest det F
/// seen.
///
/// With `AVERAGED` the relative change of volume is the mean of the corners' fourth component
/// instead of the element's `J - 1`. `law` comes with the material's bulk modulus over its shear modulus.
#[inline(always)]
pub unsafe fn add_forces<
    L: Lanes,
    M: Isochoric,
    const NODES: usize,
    const TETS: usize,
    const AVERAGED: bool,
>(
    law: (M, f32),
    clusters: &[Cluster<NODES, TETS>],
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
    buffer: &mut Shape,
) -> f32 {
    unsafe {
        let mut smallest = L::splat(f32::MAX);
        for cluster in clusters {
            for first in (0..WIDTH).step_by(L::COUNT) {
                shape::<L, M, NODES, TETS, AVERAGED>(cluster, first, nodes, buffer);
            }
            prefetch(std::ptr::from_ref(cluster).wrapping_add(1));
            for tet in 0..TETS {
                for first in (0..WIDTH).step_by(L::COUNT) {
                    let ratio =
                        moduli::<L, M, NODES, TETS, AVERAGED>(law, cluster, tet, first, buffer);
                    smallest = smallest.min(ratio);
                }
            }
            for first in (0..WIDTH).step_by(L::COUNT) {
                scatter::<L, M, NODES, TETS>(cluster, first, buffer, forces);
            }
        }
        let mut lanes = [f32::MAX; WIDTH];
        smallest.store(lanes.as_mut_ptr());
        lanes.into_iter().fold(f32::MAX, f32::min)
    }
}

/// Adds each element's current volume times its bulk modulus (nJ) to the third component of its corners' `forces`.
#[inline(always)]
pub unsafe fn add_volumes<L: Lanes, const NODES: usize, const TETS: usize>(
    clusters: &[Cluster<NODES, TETS>],
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
) {
    unsafe {
        let zero = L::splat(0.0);
        for cluster in clusters {
            for first in (0..WIDTH).step_by(L::COUNT) {
                let (edge, _) = edges::<L, NODES, TETS>(cluster, first, nodes);
                let mut sum = [zero; NODES];
                for tet in 0..TETS {
                    let [a, b, c] = corners::<NODES>(tet);
                    let determinant = dot(edge[a], cross(edge[b], edge[c]));
                    let volume = determinant.mul(load(&cluster.bulk[tet], first));
                    for corner in [0, a, b, c] {
                        sum[corner] = sum[corner].add(volume);
                    }
                }
                for (slots, volume) in cluster.slots.iter().zip(sum) {
                    let slots = slots.as_ptr().add(first);
                    L::scatter_add(forces, slots, [zero, zero, volume]);
                }
            }
        }
    }
}
