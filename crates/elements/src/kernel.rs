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
//! A batch goes through three short loops (shape, moduli, forces: a file each) with a buffer between them: the iterations of
//! each are independent and overlap, where one long loop would wait for its own cube root.
//!
//! No closures here or in `lanes`: a closure does not take on its caller's
//! instruction set, and every vector operation in it would become a call.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: the instruction set is enabled in the caller, and pointers hold what the shapes say"
)]

mod fibres;
mod forces;
mod gradients;
mod grown;
mod moduli;
mod relax;
mod shape;
mod stretches;

use crate::cluster::{Cluster, corners};
use crate::laws::{Isochoric, Law};
pub use fibres::{LaneFibres, add_forces_of_fibres};
use forces::scatter;
pub use gradients::{add_forces_of_stretches, add_volumes_of_stretches};
use lanes::{NodeLanes, WIDTH, prefetch};
pub use moduli::{SecondLoop, Seconds};
pub use relax::relax;
pub use shape::Shape;
use shape::{cross, dot, edges, load, shape};
pub use stretches::{Eigenvalues, LaneTerms, Strain, by_eigenvalues};

/// Floating-point operations of one cluster in `add_forces`, a fused multiply-add counted as two.
pub fn flops(nodes: usize, tets: usize, law: &Law) -> usize {
    match law {
        Law::NeoHookean(law) => flops_of(*law, nodes, tets),
        Law::MooneyRivlin(law) => flops_of(*law, nodes, tets),
        Law::Ogden(law) => flops_of_stretches(law.terms.len(), nodes, tets),
        Law::Yeoh(law) => flops_of(*law, nodes, tets),
        Law::VerondaWestmann(law) => flops_of(*law, nodes, tets),
        Law::Fibred(own) => flops(nodes, tets, &own.matrix.into()) + flops_of_fibres(nodes, tets),
    }
}

/// A law by invariants. Counted by hand from the three loops; benches print a rate over it.
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

/// The same kernel for a law in principal stretches, with even exponents of size 16 to 31.
fn flops_of_stretches(terms: usize, nodes: usize, tets: usize) -> usize {
    // H; cof F and J; A, D and its invariants; the inverse; stress and forces.
    let tet = 45 + 60 + 70 + 36 + 100;
    // Three squarings, a product, the root's power and the sum.
    let term = 4 * 42 + 4 + 24;
    3 * (nodes - 1) + tets * (tet + terms * term) + 3 * (nodes - 1) + 3 * nodes
}

/// What fibres take beside their matrix.
fn flops_of_fibres(nodes: usize, tets: usize) -> usize {
    // w and F a; x; the exponential 22, the pull; forces.
    let tet = 24 + 12 + 34 + 21;
    3 * (nodes - 1) + tets * tet + 3 * (nodes - 1) + 3 * nodes
}

/// Adds the forces (µN) of the clusters to `forces`, given positions (mm, from any origin); returns the smallest det F
/// seen.
///
/// Where `averaged`, the relative change of volume is the mean of the corners' fourth component
/// instead of the element's `J - 1`. `law` comes with the material's bulk modulus over its shear modulus.
#[inline(always)]
pub unsafe fn add_forces<L: NodeLanes, M: SecondLoop, const NODES: usize, const TETS: usize>(
    (law, bulk_over_shear): (M, f32),
    averaged: bool,
    clusters: &[Cluster<NODES, TETS>],
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
    buffer: &mut Shape,
) -> f32 {
    unsafe {
        let mut smallest = L::splat(f32::MAX);
        // `buffer` belongs to this call: each batch overwrites all that it reads.
        for cluster in clusters {
            for first in (0..WIDTH).step_by(L::COUNT) {
                if M::SECOND {
                    shape::<L, true, NODES, TETS>(cluster, first, nodes, averaged, buffer);
                } else {
                    shape::<L, false, NODES, TETS>(cluster, first, nodes, averaged, buffer);
                }
            }
            // The next batch's constants are a kilobyte or two that this loop alone would wait for.
            prefetch(std::ptr::from_ref(cluster).wrapping_add(1));
            // Two loops, since a branch within one would keep its iterations from overlapping.
            let least = if averaged {
                law.moduli::<L, NODES, TETS, true>(bulk_over_shear, cluster, buffer)
            } else {
                law.moduli::<L, NODES, TETS, false>(bulk_over_shear, cluster, buffer)
            };
            smallest = least.min(smallest);
            for first in (0..WIDTH).step_by(L::COUNT) {
                if M::SECOND {
                    scatter::<L, true, NODES, TETS>(cluster, first, buffer, forces);
                } else {
                    scatter::<L, false, NODES, TETS>(cluster, first, buffer, forces);
                }
            }
        }
        // Lanes meet at the very end. A smallest number does not depend on the order.
        let mut lanes = [f32::MAX; WIDTH];
        smallest.store(lanes.as_mut_ptr());
        lanes.into_iter().fold(f32::MAX, f32::min)
    }
}

/// Adds each element's current volume times its bulk modulus (nJ) to the third component of its corners' `forces`.
#[inline(always)]
/// Summed over a node's elements and compared with that at rest it gives the node's dilatation.
pub unsafe fn add_volumes<L: NodeLanes, const NODES: usize, const TETS: usize>(
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
