//! Forces of a law in principal stretches: displacements in, nodal forces added.
//!
//! From `H = sum_k u_k g_k` of the corners' displacements and the gradients of their shape functions everything is of the size of the
//! strain ([`crate::principal`] has the equations), so f32 loses no digits at small ones: `P = cof F (T / J + kappa (J - 1))`, and the force on
//! corner `k` is `-V P g_k`.

use super::shape::{add_balanced, dot, edges, load};
use super::stretches::{Eigenvalues, LaneTerms, Strain, deviator};
use crate::cluster::{Cluster, corners};
use crate::gradients::Gradients;
use lanes::{NodeLanes, WIDTH};

/// `|J|` at least in `T / J`, as in f64, so that the force of a flat element is finite.
const LEAST_DET: f32 = crate::tetrahedron::LEAST_DET as f32;

/// `H` of one tetrahedron, rows, from the differences of its corners' displacements.
#[inline(always)]
pub(super) unsafe fn gradient<L: NodeLanes>(
    rows: &[[f32; WIDTH]; 9],
    first: usize,
    edge: [[L; 3]; 3],
) -> [[L; 3]; 3] {
    unsafe {
        let mut h = edge;
        for j in 0..3 {
            let (a, b, c) = (
                load::<L>(&rows[j], first),
                load::<L>(&rows[3 + j], first),
                load::<L>(&rows[6 + j], first),
            );
            for i in 0..3 {
                h[i][j] = edge[2][i].mul_add(c, edge[1][i].mul_add(b, edge[0][i].mul(a)));
            }
        }
        h
    }
}

/// `cof F` and `J - 1` of `F = 1 + H`: `cof F = 1 + tr H - H^T + cof H`, `J - 1 = tr H + tr cof H + det H`.
#[inline(always)]
pub(super) unsafe fn volume<L: NodeLanes>(h: &[[L; 3]; 3]) -> ([[L; 3]; 3], L) {
    unsafe {
        let mut cofactor = [[h[0][0]; 3]; 3];
        for i in 0..3 {
            let (p, q) = ((i + 1) % 3, (i + 2) % 3);
            for j in 0..3 {
                let (r, s) = ((j + 1) % 3, (j + 2) % 3);
                cofactor[i][j] = h[p][s].neg_mul_add(h[q][r], h[p][r].mul(h[q][s]));
            }
        }
        let trace = h[0][0].add(h[1][1]).add(h[2][2]);
        let minors = cofactor[0][0].add(cofactor[1][1]).add(cofactor[2][2]);
        let determinant = dot(h[0], cofactor[0]);
        // Each summand is of the size of the strain or smaller: no digits cancel against the 1 of
        // `det F`.
        let change = trace.add(minors.add(determinant));
        for i in 0..3 {
            for j in 0..3 {
                cofactor[i][j] = cofactor[i][j].sub(h[j][i]);
            }
            cofactor[i][i] = cofactor[i][i].add(trace).add(L::splat(1.0));
        }
        (cofactor, change)
    }
}

/// The differences of the displacements of a tetrahedron's corners.
#[inline(always)]
pub(super) unsafe fn of_corners<L: NodeLanes, const NODES: usize>(
    tet: usize,
    edge: &[[L; 3]; NODES],
) -> [[L; 3]; 3] {
    let [a, b, c] = corners::<NODES>(tet);
    [edge[a], edge[b], edge[c]]
}

/// Adds the forces (µN) of the clusters to `forces`, given displacements (mm); returns the smallest det F. `averaged` as for
/// [`super::add_forces`].
#[inline(always)]
pub unsafe fn add_forces_of_stretches<L: Eigenvalues, const NODES: usize, const TETS: usize>(
    law: &LaneTerms,
    averaged: bool,
    (clusters, gradients): (&[Cluster<NODES, TETS>], &[Gradients<TETS>]),
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
) -> f32 {
    unsafe {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let mut smallest = L::splat(f32::MAX);
        for (cluster, gradients) in clusters.iter().zip(gradients) {
            for first in (0..WIDTH).step_by(L::COUNT) {
                let (edge, fourth) = edges::<L, NODES, TETS>(cluster, first, nodes);
                // The dilatation of an element as the mean over its corners, whose values the pass
                // over volumes has made.
                let mut mean = [zero; TETS];
                if averaged {
                    for tet in 0..TETS {
                        let [a, b, c] = corners::<NODES>(tet);
                        let sum = fourth[0].add(fourth[a]).add(fourth[b]).add(fourth[c]);
                        mean[tet] = sum.mul(L::splat(0.25));
                    }
                }
                let mut force = [[zero; 3]; NODES];
                for tet in 0..TETS {
                    let [a, b, c] = corners::<NODES>(tet);
                    let rows = &gradients.rows[tet];
                    let h = gradient(rows, first, of_corners(tet, &edge));
                    let (cofactor, change) = volume(&h);
                    let det = change.add(one);
                    smallest = det.min(smallest);
                    // Away from zero on the side on which it is.
                    let bounded = det.below(
                        zero,
                        det.min(L::splat(-LEAST_DET)),
                        det.max(L::splat(LEAST_DET)),
                    );
                    // Averaged over the corners' nodes it does not lock nearly incompressible
                    // tetrahedra.
                    let dilatation = if averaged { mean[tet] } else { change };
                    // Both with the sign of a force on the tissue, and the volume.
                    let volume = zero.sub(load::<L>(&gradients.volume[tet], first));
                    let scale = volume.div(bounded);
                    let pressure = volume.mul(dilatation).mul(L::splat(law.bulk_pa));
                    let t = deviator(law, &Strain::new(&h));
                    let mut inner = [[zero; 3]; 3];
                    for i in 0..3 {
                        for j in 0..3 {
                            inner[i][j] = t[crate::principal::PLACE[i][j]].mul(scale);
                        }
                        inner[i][i] = inner[i][i].add(pressure);
                    }
                    // `P = cof F (T / J + kappa (J - 1))`, row by row; `inner` is symmetric.
                    let mut stress = inner;
                    for i in 0..3 {
                        for j in 0..3 {
                            stress[i][j] = dot(cofactor[i], inner[j]);
                        }
                    }
                    for (corner, node) in [a, b, c].into_iter().enumerate() {
                        let g = [
                            load::<L>(&rows[3 * corner], first),
                            load::<L>(&rows[3 * corner + 1], first),
                            load::<L>(&rows[3 * corner + 2], first),
                        ];
                        for i in 0..3 {
                            force[node][i] = force[node][i].add(dot(stress[i], g));
                        }
                    }
                }
                add_balanced(cluster, first, force, forces);
            }
        }
        let mut lanes = [f32::MAX; WIDTH];
        smallest.store(lanes.as_mut_ptr());
        lanes.into_iter().fold(f32::MAX, f32::min)
    }
}

/// As [`super::add_volumes`], from displacements.
#[inline(always)]
pub unsafe fn add_volumes_of_stretches<L: NodeLanes, const NODES: usize, const TETS: usize>(
    bulk_pa: f32,
    (clusters, gradients): (&[Cluster<NODES, TETS>], &[Gradients<TETS>]),
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
) {
    unsafe {
        let zero = L::splat(0.0);
        for (cluster, gradients) in clusters.iter().zip(gradients) {
            for first in (0..WIDTH).step_by(L::COUNT) {
                let (edge, _) = edges::<L, NODES, TETS>(cluster, first, nodes);
                // Each corner gets the whole volume, times the bulk modulus: the dilatation of a
                // node is made of the sum over its elements.
                let mut sum = [zero; NODES];
                for tet in 0..TETS {
                    let [a, b, c] = corners::<NODES>(tet);
                    let rows = &gradients.rows[tet];
                    let (_, change) = volume(&gradient(rows, first, of_corners(tet, &edge)));
                    // Volume at rest times `1 + (J - 1)`.
                    let rest = load::<L>(&gradients.volume[tet], first).mul(L::splat(bulk_pa));
                    let volume = rest.mul_add(change, rest);
                    for corner in [0, a, b, c] {
                        sum[corner] = sum[corner].add(volume);
                    }
                }
                for node in 0..NODES {
                    let slots = cluster.slots[node].as_ptr().add(first);
                    L::scatter_add(forces, slots, [zero, zero, sum[node]]);
                }
            }
        }
    }
}
