//! What relaxation leaves of earlier stresses: the history of each element goes on, and its forces are added ([`crate::StressHistory`] has the equations).
//!
//! `S_iso = C^-1 T` with the deviator `T` of [`super::stretches`], for every law, and what its fibres pull with; the force of a stress `S` on corner `k` is `-V F S g_k`.

use super::fibres::{LaneFibres, direction};
use super::gradients::{gradient, of_corners, volume};
use super::shape::{dot, edges, load};
use super::stretches::{Eigenvalues, LaneTerms, Strain, deviator, product};
use crate::cluster::{Cluster, corners};
use crate::directions::Directions;
use crate::gradients::Gradients;
use crate::principal::PLACE;
use crate::stress_step::{SIX, StressStep};
use lanes::{NodeLanes, WIDTH};

/// An element below this det F keeps the stress that it had: what it has now says nothing about the
/// tissue, and would be remembered for as long as its slowest branch.
const SOUND_DET: f32 = 0.05;
/// Bytes of a line of the cache: what one prefetch asks for.
const LINE: usize = 64;
/// `J²` at least: the square of the least `|J|` of [`super::gradients`].
const LEAST_SQUARE: f32 = 1e-4;

/// `C^-1 T` from `cof F`, `det F` and `T`, Pa.
///
/// `C^-1 = (cof F)^T cof F / J²`, so that no matrix is inverted: of `J²` the least value keeps a
/// flat element finite.
#[inline(always)]
unsafe fn second_piola<L: NodeLanes>(cofactor: &[[L; 3]; 3], det: L, t: &[L; 6]) -> [L; 6] {
    unsafe {
        let scale = L::splat(1.0).div(det.mul(det).max(L::splat(LEAST_SQUARE)));
        let mut inverse = [det; 6];
        let mut at = 0;
        for i in 0..3 {
            for j in i..3 {
                let sum =
                    cofactor[1][i].mul_add(cofactor[1][j], cofactor[0][i].mul(cofactor[0][j]));
                inverse[at] = cofactor[2][i].mul_add(cofactor[2][j], sum).mul(scale);
                at += 1;
            }
        }
        product(&inverse, t)
    }
}

/// Adds the stress of fibres, `2 psi' a (x) a`, Pa.
///
/// `F a = a + H a`: from `H` a small stretch keeps its digits in f32.
#[inline(always)]
unsafe fn add_fibres<L: NodeLanes, const TETS: usize>(
    fibres: &LaneFibres,
    (directions, tet, first): (&Directions<TETS>, usize, usize),
    h: &[[L; 3]; 3],
    out: &mut [L; 6],
) {
    unsafe {
        let a: [L; 3] = direction(directions, tet, first);
        let w = [dot(h[0], a), dot(h[1], a), dot(h[2], a)];
        let pull = fibres.pull_of(a, w);
        let mut at = 0;
        for i in 0..3 {
            for j in i..3 {
                out[at] = pull.mul(a[i]).mul_add(a[j], out[at]);
                at += 1;
            }
        }
    }
}

/// Asks for `lines` of the cache that lie `bytes` behind what is at hand.
#[inline(always)]
fn ahead<T>(at: *const T, bytes: usize, lines: usize) {
    let start = at.cast::<u8>().wrapping_add(bytes);
    (0..lines).for_each(|line| lanes::prefetch(start.wrapping_add(LINE * line)));
}

/// Clusters with their gradients, and with the directions of their fibres or none.
type Batches<'a, const NODES: usize, const TETS: usize> = (
    &'a [Cluster<NODES, TETS>],
    &'a [Gradients<TETS>],
    &'a [Directions<TETS>],
);

/// Takes the stresses at displacements (mm) into the `history` of the clusters, and adds the forces (µN) of the first `ROWS` rows of weights.
///
/// `history` holds `[batch, tet, count + 1, 6, 16]` numbers, Pa: of each tetrahedron `S_iso` of the
/// state before, then the `q_i`. They are read and written in one pass, so a call takes the history
/// exactly one state further and must not be repeated for the same state.
#[inline(always)]
pub unsafe fn relax<L: Eigenvalues, const NODES: usize, const TETS: usize, const ROWS: usize>(
    (law, fibres): (&LaneTerms, Option<&LaneFibres>),
    step: &StressStep,
    (clusters, gradients, directions): Batches<'_, NODES, TETS>,
    history: *mut f32,
    nodes: *const [f32; 4],
    forces: [*mut [f32; 4]; 2],
) {
    unsafe {
        let zero = L::splat(0.0);
        let row = SIX * WIDTH;
        let mut history = history;
        for (batch, (cluster, gradients)) in clusters.iter().zip(gradients).enumerate() {
            // What is remembered is more than caches hold, and no core waits for it where it is asked for a batch ahead.
            ahead(cluster.slots.as_ptr(), size_of_val(cluster), NODES / 2 + 1);
            for first in (0..WIDTH).step_by(L::COUNT) {
                let (edge, _) = edges::<L, NODES, TETS>(cluster, first, nodes);
                let mut force = [[[zero; 3]; NODES]; ROWS];
                for tet in 0..TETS {
                    let [a, b, c] = corners::<NODES>(tet);
                    let rows = &gradients.rows[tet];
                    let h = gradient(rows, first, of_corners(tet, &edge));
                    let (cofactor, change) = volume(&h);
                    let det = change.add(L::splat(1.0));
                    let t = deviator(law, &Strain::new(&h));
                    let mut now = second_piola(&cofactor, det, &t);
                    if let (Some(fibres), Some(own)) = (fibres, directions.get(batch)) {
                        add_fibres(fibres, (own, tet, first), &h, &mut now);
                    }
                    let own = history.add(tet * (step.count + 1) * row + first);
                    if first == 0 {
                        // One tetrahedron's history of the next batch, while this one's is worked
                        // on.
                        let lines = (step.count + 1) * SIX;
                        ahead(own, 4 * TETS * lines * WIDTH, lines);
                        ahead(rows.as_ptr(), size_of_val(gradients), rows.len());
                        ahead(&raw const gradients.volume[tet], size_of_val(gradients), 1);
                    }
                    let volume = zero.sub(load::<L>(&gradients.volume[tet], first));
                    let mut sums = [[zero; SIX]; ROWS];
                    for k in 0..SIX {
                        let before = L::load(own.add(k * WIDTH));
                        // A NaN in `det` fails the comparison and goes on into the stress; the
                        // guard finds it.
                        let now = det.below(L::splat(SOUND_DET), before, now[k]);
                        now.store(own.add(k * WIDTH));
                        let change = now.sub(before);
                        for side in 0..ROWS {
                            sums[side][k] = now.mul(L::splat(step.weights[side][0]));
                        }
                        for branch in 0..step.count {
                            let at = own.add((branch + 1) * row + k * WIDTH);
                            let kept = L::load(at).mul(L::splat(step.decay[branch]));
                            let q = change.mul_add(L::splat(step.gain[branch]), kept);
                            q.store(at);
                            for side in 0..ROWS {
                                let weight = L::splat(step.weights[side][branch + 1]);
                                sums[side][k] = q.mul_add(weight, sums[side][k]);
                            }
                        }
                        for side in 0..ROWS {
                            sums[side][k] = sums[side][k].mul(volume);
                        }
                    }
                    for side in 0..ROWS {
                        // `F S = S + H S`: forces act on the deformed element.
                        let symmetric = |i: usize, j: usize| sums[side][PLACE[i][j]];
                        let mut pushed = [[zero; 3]; 3];
                        for i in 0..3 {
                            for j in 0..3 {
                                let along = [0, 1, 2].map(|k| symmetric(k, j));
                                pushed[i][j] = symmetric(i, j).add(dot(h[i], along));
                            }
                        }
                        for (corner, node) in [a, b, c].into_iter().enumerate() {
                            let g = [
                                load::<L>(&rows[3 * corner], first),
                                load::<L>(&rows[3 * corner + 1], first),
                                load::<L>(&rows[3 * corner + 2], first),
                            ];
                            for i in 0..3 {
                                let sum = &mut force[side][node][i];
                                *sum = sum.add(dot(pushed[i], g));
                            }
                        }
                    }
                }
                for side in 0..ROWS {
                    for node in 1..NODES {
                        for i in 0..3 {
                            force[side][0][i] = force[side][0][i].sub(force[side][node][i]);
                        }
                    }
                    for node in 0..NODES {
                        let slots = cluster.slots[node].as_ptr().add(first);
                        L::scatter_add(forces[side], slots, force[side][node]);
                    }
                }
            }
            history = history.add(TETS * (step.count + 1) * row);
        }
    }
}
