//! The second loop of a batch: how strongly springs and pressure pull, by the law and the change of volume.
//!
//! It reads `det D` and `-mu V I1` of each tetrahedron and puts in their place the factor of the
//! springs and the factor of `cof D`, so that the third loop needs no law. Everything that a law
//! differs in is here; the first loop and the third are the same code for laws of one kind.

use super::shape::{Shape, load, store};
use crate::cluster::Cluster;
use crate::laws::{Grows, Isochoric, Law, MooneyRivlin};
use lanes::{NodeLanes, WIDTH};

/// `x^(-1/3)` for positive `x`, relative error about 1e-7.
#[inline(always)]
pub(super) unsafe fn inverse_cube_root<L: NodeLanes>(x: L) -> L {
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

/// Where row `j`, column `k` of a symmetric matrix is in the order of [`Cluster::springs`].
const ENTRY: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];

/// What the second loop is made of: a law, or one of several.
pub trait SecondLoop: Copy {
    /// As of [`Isochoric`].
    const SECOND: bool;

    /// The loop over a batch; returns the smallest det F in each lane.
    unsafe fn moduli<L: NodeLanes, const NODES: usize, const TETS: usize, const AVERAGED: bool>(
        self,
        bulk_over_shear: f32,
        cluster: &Cluster<NODES, TETS>,
        shape: &mut Shape,
    ) -> L;
}

impl<M: Isochoric> SecondLoop for M {
    const SECOND: bool = M::SECOND;

    #[inline(always)]
    unsafe fn moduli<L: NodeLanes, const NODES: usize, const TETS: usize, const AVERAGED: bool>(
        self,
        bulk_over_shear: f32,
        cluster: &Cluster<NODES, TETS>,
        shape: &mut Shape,
    ) -> L {
        unsafe {
            let mut smallest = L::splat(f32::MAX);
            for tet in 0..TETS {
                for first in (0..WIDTH).step_by(L::COUNT) {
                    let law = (self, bulk_over_shear);
                    let ratio =
                        moduli::<L, M, NODES, TETS, AVERAGED>(law, cluster, tet, first, shape);
                    smallest = ratio.min(smallest);
                }
            }
            smallest
        }
    }
}

/// Laws with `I2`: the first and the third loop are the same code.
#[derive(Clone, Copy)]
pub enum Seconds {
    /// Constant moduli on `I1` and `I2`.
    MooneyRivlin(MooneyRivlin),
    /// A modulus that grows with `I1`.
    Grows(Grows),
}

impl Seconds {
    /// `law`, where its kernel is one of these.
    pub fn of(law: Law) -> Option<Self> {
        match law {
            Law::NeoHookean(_) | Law::Ogden(_) | Law::Fibred(_) => None,
            Law::MooneyRivlin(law) => Some(Self::MooneyRivlin(law)),
            Law::Yeoh(law) => Some(Self::Grows(Grows::Yeoh(law))),
            Law::VerondaWestmann(law) => Some(Self::Grows(Grows::VerondaWestmann(law))),
        }
    }
}

impl SecondLoop for Seconds {
    const SECOND: bool = true;

    #[inline(always)]
    unsafe fn moduli<L: NodeLanes, const NODES: usize, const TETS: usize, const AVERAGED: bool>(
        self,
        bulk_over_shear: f32,
        cluster: &Cluster<NODES, TETS>,
        shape: &mut Shape,
    ) -> L {
        unsafe {
            match self {
                Self::MooneyRivlin(law) => SecondLoop::moduli::<L, NODES, TETS, AVERAGED>(
                    law,
                    bulk_over_shear,
                    cluster,
                    shape,
                ),
                Self::Grows(law) => SecondLoop::moduli::<L, NODES, TETS, AVERAGED>(
                    law,
                    bulk_over_shear,
                    cluster,
                    shape,
                ),
            }
        }
    }
}

/// Turns determinant, invariant and products into the factors of springs and pressure; returns det F.
#[inline(always)]
unsafe fn moduli<
    L: NodeLanes,
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
        // An element that is flat or turned inside out has the isochoric factor of a thin one:
        // finite, and the pressure, which takes `J` as it is, drives it back.
        let root = inverse_cube_root(L::splat(1e-3).max(ratio));
        // `1 - J`, or minus the mean of the four corners' dilatation.
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
                .div(L::splat(f32::MIN_POSITIVE).max(bulk.mul(bulk)));
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
            // In place: the determinant is not needed any more, and the third loop reads the factor
            // there.
            store(slopes.first, &mut shape.determinant[tet], first);
            slopes.volume[0].neg_mul_add(slopes.volume[1], pressure)
        };
        store(factor, &mut shape.invariant[tet], first);
        ratio
    }
}

/// Of a law with `I2`: puts the springs in place of the edges' products; returns the two factors of `-dw/dJ`.
#[inline(always)]
unsafe fn springs<L: NodeLanes, M: Isochoric, const NODES: usize, const TETS: usize>(
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
        // `I1^2 - tr (E G)^2 = 2 I2`; `invariant` has its factor `-mu V` divided out already.
        let squares = scale
            .mul(scale)
            .neg_mul_add(trace, invariant.mul(invariant));
        let slopes = law.lane_slopes(invariant, squares.mul(L::splat(0.5)), root);
        // `f1 G + f2 (I1 G - G E G)`, see `kernel.rs`.
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
