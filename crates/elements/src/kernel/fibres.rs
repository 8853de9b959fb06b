//! Forces of fibres: displacements or positions in, nodal forces added to those of the matrix.
//!
//! `w = H a` is a sum over the corners of displacement times slope along the fibres; from positions the same sum is `F a`, less `a`. So `x = 2 a.w + w.w`, and the force
//! on corner `k` is `-V 2 psi'(x) (a + w) (g_k . a)`.

use super::shape::{add_balanced, dot, edges, load};
use crate::cluster::{Cluster, corners};
use crate::directions::Directions;
use crate::laws::Fibred;
use lanes::functions::exp_m1;
use lanes::{FunctionLanes, NodeLanes, WIDTH};

/// The numbers of a family of fibres in lanes.
#[derive(Clone, Copy)]
pub struct LaneFibres {
    /// `2 k1`, Pa.
    twice_pa: f32,
    /// Exponent of the law, without unit.
    k2: f32,
    /// Where the exponential ends.
    end: f32,
}

impl LaneFibres {
    /// In a matrix of a shear modulus, Pa.
    pub fn new(fibres: &Fibred, shear_pa: f64) -> Self {
        Self {
            twice_pa: (2.0 * fibres.k1_over_mu * shear_pa) as f32,
            k2: fibres.k2 as f32,
            end: fibres.end() as f32,
        }
    }

    /// `2 psi'` at `x`, Pa.
    #[inline(always)]
    unsafe fn pull<L: FunctionLanes>(&self, x: L) -> L {
        unsafe {
            let one = L::splat(1.0);
            // Slack fibres do not push.
            let x = x.max(L::splat(0.0));
            // Beyond `end` the exponential goes on as its tangent: no finite stretch overflows.
            let within = x.min(L::splat(self.end));
            let y = within.mul(within).mul(L::splat(self.k2));
            let slope = y.add(y).add(one);
            let length = x.sub(within).mul_add(slope, within);
            exp_m1(y).add(one).mul(length).mul(L::splat(self.twice_pa))
        }
    }

    /// `2 psi'` of an element with the direction `a` whose fibres have become `a + w`, Pa.
    #[inline(always)]
    pub(super) unsafe fn pull_of<L: NodeLanes>(&self, a: [L; 3], w: [L; 3]) -> L {
        unsafe {
            let along = dot(a, w);
            self.pull(along.add(along).add(dot(w, w)))
        }
    }
}

/// The direction of the fibres of tetrahedron `tet`.
#[inline(always)]
pub(super) unsafe fn direction<L: NodeLanes, const TETS: usize>(
    directions: &Directions<TETS>,
    tet: usize,
    first: usize,
) -> [L; 3] {
    unsafe {
        let rows = &directions.direction[tet];
        [
            load(&rows[0], first),
            load(&rows[1], first),
            load(&rows[2], first),
        ]
    }
}

/// Adds the forces (µN) of the clusters' fibres to `forces`, given displacements (mm), or `from_positions` positions.
#[inline(always)]
pub unsafe fn add_forces_of_fibres<L: NodeLanes, const NODES: usize, const TETS: usize>(
    fibres: &LaneFibres,
    from_positions: bool,
    (clusters, directions): (&[Cluster<NODES, TETS>], &[Directions<TETS>]),
    nodes: *const [f32; 4],
    forces: *mut [f32; 4],
) {
    unsafe {
        let zero = L::splat(0.0);
        // The sum over positions gives `F a`, over displacements `H a`: one multiply-add serves
        // both.
        let rest = L::splat(if from_positions { 1.0 } else { 0.0 });
        for (cluster, directions) in clusters.iter().zip(directions) {
            for first in (0..WIDTH).step_by(L::COUNT) {
                let (edge, _) = edges::<L, NODES, TETS>(cluster, first, nodes);
                let mut force = [[zero; 3]; NODES];
                for tet in 0..TETS {
                    let [a, b, c] = corners::<NODES>(tet);
                    let slope = [
                        load::<L>(&directions.slopes[tet][0], first),
                        load::<L>(&directions.slopes[tet][1], first),
                        load::<L>(&directions.slopes[tet][2], first),
                    ];
                    let own: [L; 3] = direction(directions, tet, first);
                    let (mut w, mut image) = (own, own);
                    for i in 0..3 {
                        let sum = edge[b][i].mul_add(slope[1], edge[a][i].mul(slope[0]));
                        let sum = edge[c][i].mul_add(slope[2], sum);
                        w[i] = rest.neg_mul_add(own[i], sum);
                        image[i] = own[i].add(w[i]);
                    }
                    let volume = load::<L>(&directions.volume[tet], first);
                    let pull = fibres.pull_of(own, w).mul(volume);
                    for (corner, node) in [a, b, c].into_iter().enumerate() {
                        let scale = pull.mul(slope[corner]);
                        for i in 0..3 {
                            force[node][i] = scale.neg_mul_add(image[i], force[node][i]);
                        }
                    }
                }
                add_balanced(cluster, first, force, forces);
            }
        }
    }
}
