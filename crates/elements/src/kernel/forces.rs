//! The third loop of a batch: forces on the nodes, in balance by construction.
//!
//! Forces on corners 1, b and c of a tetrahedron are the columns of `M E + factor cof D`, with the
//! spring constants `M = -V mu J^(-2/3) G` or those that a law with `I2` has made, and the columns
//! `e_b x e_c`, `e_c x e_1` and `e_1 x e_b` of `cof D`. Springs between the same two nodes are
//! added up over the tetrahedra first, so that each meets its edge once. Node 0 gets minus the sum
//! of the others: the balance of a cluster is exact to the rounding of that sum.

use super::shape::{Shape, load};
use crate::cluster::{Cluster, corners};
use lanes::NodeLanes;

/// Adds a spring to a sum: the stored one times its factor, or one that the law has made anew.
#[inline(always)]
unsafe fn add_spring<L: NodeLanes, const SECOND: bool>(factor: L, spring: L, sum: L) -> L {
    unsafe {
        if SECOND {
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
    /// `-V / det D0` times the bracket of the module's equation, with the sign of det D0.
    factor: [L; TETS],
}

/// Adds the forces to the nodes.
#[inline(always)]
pub(super) unsafe fn scatter<
    L: NodeLanes,
    const SECOND: bool,
    const NODES: usize,
    const TETS: usize,
>(
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
            // A law without `I2` has constant springs, which `by` scales; else they were made anew.
            let m = if SECOND {
                &shape.products[tet]
            } else {
                &cluster.springs[tet]
            };
            pull.own[1] = add_spring::<L, SECOND>(by, load(&m[0], first), pull.own[1]);
            pull.along[b] = add_spring::<L, SECOND>(by, load(&m[1], first), pull.along[b]);
            pull.along[c] = add_spring::<L, SECOND>(by, load(&m[2], first), pull.along[c]);
            pull.own[b] = add_spring::<L, SECOND>(by, load(&m[3], first), pull.own[b]);
            pull.own[c] = add_spring::<L, SECOND>(by, load(&m[5], first), pull.own[c]);
            let face = load::<L>(&m[4], first);
            pull.face[tet] = if SECOND { face } else { by.mul(face) };
            pull.factor[tet] = load(&shape.invariant[tet], first);
        }
        // The forces of an element are in balance: what the other nodes get is taken from node 0.
        let mut rest = [zero; 3];
        add_node::<L, NODES, TETS, 1>(cluster, first, shape, &pull, forces, &mut rest);
        add_node::<L, NODES, TETS, 2>(cluster, first, shape, &pull, forces, &mut rest);
        add_node::<L, NODES, TETS, 3>(cluster, first, shape, &pull, forces, &mut rest);
        // Written out, not a loop: each call has its node as a constant and keeps the branches that
        // concern it.
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
unsafe fn add_node<L: NodeLanes, const NODES: usize, const TETS: usize, const NODE: usize>(
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
                // `e_c x e_1` is minus the stored `e_1 x e_c`.
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
