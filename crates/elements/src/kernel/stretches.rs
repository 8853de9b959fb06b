//! The deviator `T = dev sum mu Cbar^(alpha / 2)` in f32 lanes ([`crate::principal`] has the equations).
//!
//! Two ways. Even exponents are powers of a matrix: with `X = (1 + D)^-1 - 1 = (D² - D - J2 - x) / (1 + x)` for negative ones and
//! `X = D` for positive ones, `(1 + X)^n - 1` comes by squaring, `X_(a+b) = X_a + X_b + X_a X_b`, without eigenvalues or transcendental
//! functions. Any other exponent, and every lane in which a stretch comes near the cap, takes eigenvalues of `D` and divided
//! differences. A lane's result does not depend on the others.

use super::grown::grown;
use super::moduli::inverse_cube_root;
use crate::laws::{CAP, Grows, Law, MOST_TERMS};
use lanes::NodeLanes;
use lanes::functions::{exp_m1, ln_1p, third_of_angle};

/// `e^3`, where the exponential goes on as its tangent.
const CAPPED: f32 = 20.085_537;
/// Eigenvalues of `D` closer than this have a derivative in place of a difference: below it the
/// rounding of a difference in f32 weighs more than the error of the derivative at the middle,
/// which falls with the square of the gap. [`crate::principal`] has a smaller one for f64.
const COINCIDENT: f32 = 2e-3;
/// With all of them closer than this the series is more accurate.
const SMALL: f32 = 4e-3;
/// Least value of `det (1 + D)`.
const LEAST: f32 = 1e-6;

/// The terms of a law as the kernel reads them.
#[derive(Clone, Copy)]
pub struct LaneTerms {
    /// `mu`, Pa.
    mu: [f32; MOST_TERMS],
    /// Exponents of the stretches.
    alpha: [f32; MOST_TERMS],
    /// `alpha / 2`, where all are whole numbers.
    power: [i32; MOST_TERMS],
    /// Terms that there are; what is behind them is zero.
    count: usize,
    /// Whether they are.
    whole: bool,
    /// `kappa`, Pa.
    pub bulk_pa: f32,
    /// How the first term grows with the shape; the second is then of exponent -2.
    grows: Option<Grows>,
}

impl LaneTerms {
    /// Of a law with the material's moduli, Pa.
    pub fn new(law: &Law, [shear_pa, bulk_pa]: [f64; 2]) -> Self {
        let stretches = law.stretches(0.0);
        let mut out = Self {
            mu: [0.0; MOST_TERMS],
            alpha: [0.0; MOST_TERMS],
            power: [0; MOST_TERMS],
            count: stretches.terms.len(),
            whole: true,
            bulk_pa: bulk_pa as f32,
            grows: law.grows(),
        };
        for (at, term) in stretches.terms.iter().enumerate() {
            out.mu[at] = (shear_pa * term.mu_pa) as f32;
            out.alpha[at] = term.alpha as f32;
            out.power[at] = (term.alpha / 2.0) as i32;
            out.whole &= f64::from(out.power[at]) * 2.0 == term.alpha;
        }
        out
    }
}

/// `D` of some elements and what follows from it.
pub struct Strain<L> {
    /// 11, 12, 13, 22, 23, 33.
    d: [L; 6],
    /// `D²`.
    square: [L; 6],
    /// `D:D / 2`, the size of the strain squared.
    j2: L,
    /// `det D`.
    j3: L,
    /// `det (1 + D) - 1`.
    x: L,
}

impl<L: NodeLanes> Strain<L> {
    /// From `H = F - 1`, rows.
    #[inline(always)]
    pub unsafe fn new(h: &[[L; 3]; 3]) -> Self {
        unsafe {
            let mut a = [h[0][0]; 6];
            let mut at = 0;
            for i in 0..3 {
                for j in i..3 {
                    let sum = h[0][i].mul_add(h[0][j], h[i][j].add(h[j][i]));
                    let sum = h[1][i].mul_add(h[1][j], sum);
                    a[at] = h[2][i].mul_add(h[2][j], sum);
                    at += 1;
                }
            }
            let t = a[0].add(a[3]).add(a[5]).mul(L::splat(1.0 / 3.0));
            // `C = (1 + t)(1 + D)` with the mean `t` of the diagonal of `C - 1`: `D` has no trace,
            // and the factor cancels in `Cbar`.
            let scale = L::splat(1.0).div(t.add(L::splat(1.0)).max(L::splat(LEAST)));
            for k in [0, 3, 5] {
                a[k] = a[k].sub(t);
            }
            for k in 0..6 {
                a[k] = a[k].mul(scale);
            }
            let square = product(&a, &a);
            let j2 = square[0].add(square[3]).add(square[5]).mul(L::splat(0.5));
            let j3 = a[0].mul(a[4].neg_mul_add(a[4], a[3].mul(a[5])));
            let j3 = a[1].neg_mul_add(a[4].neg_mul_add(a[2], a[1].mul(a[5])), j3);
            let j3 = a[2].mul_add(a[3].neg_mul_add(a[2], a[1].mul(a[4])), j3);
            Self {
                x: j3.sub(j2).max(L::splat(LEAST - 1.0)),
                d: a,
                square,
                j2,
                j3,
            }
        }
    }
}

/// The product of two symmetric matrices that commute.
#[inline(always)]
pub(super) unsafe fn product<L: NodeLanes>(a: &[L; 6], b: &[L; 6]) -> [L; 6] {
    unsafe {
        [
            a[2].mul_add(b[2], a[1].mul_add(b[1], a[0].mul(b[0]))),
            a[2].mul_add(b[4], a[1].mul_add(b[3], a[0].mul(b[1]))),
            a[2].mul_add(b[5], a[1].mul_add(b[4], a[0].mul(b[2]))),
            a[4].mul_add(b[4], a[3].mul_add(b[3], a[1].mul(b[1]))),
            a[4].mul_add(b[5], a[3].mul_add(b[4], a[1].mul(b[2]))),
            a[5].mul_add(b[5], a[4].mul_add(b[4], a[2].mul(b[2]))),
        ]
    }
}

/// `(1 + a)(1 + b) - 1`.
#[inline(always)]
unsafe fn joined<L: NodeLanes>(a: &[L; 6], b: &[L; 6]) -> [L; 6] {
    unsafe {
        let mut out = product(a, b);
        for k in 0..6 {
            out[k] = out[k].add(a[k].add(b[k]));
        }
        out
    }
}

/// `(1 + x)^n - 1` for `n >= 1`.
#[inline(always)]
unsafe fn power<L: NodeLanes>(x: [L; 6], n: u32) -> [L; 6] {
    unsafe {
        let mut out = x;
        // From the second highest bit down; the highest is `x` itself.
        for bit in (0..n.ilog2()).rev() {
            out = joined(&out, &out);
            if n >> bit & 1 == 1 {
                out = joined(&out, &x);
            }
        }
        out
    }
}

/// `x^n` for `n >= 1`.
#[inline(always)]
unsafe fn scalar_power<L: NodeLanes>(x: L, n: u32) -> L {
    unsafe {
        let mut out = x;
        for bit in (0..n.ilog2()).rev() {
            out = out.mul(out);
            if n >> bit & 1 == 1 {
                out = out.mul(x);
            }
        }
        out
    }
}

/// Lanes that have [`by_eigenvalues`] as one function of their instruction set. Inlined into every kernel it was a third of the library.
///
/// # Safety
/// As [`NodeLanes`].
pub trait Eigenvalues: NodeLanes {
    /// Whether [`deviator`] is one function, too: lanes for which its code is long, and a call nothing.
    const APART: bool;

    unsafe fn by_eigenvalues(law: &LaneTerms, strain: &Strain<Self>) -> [Self; 6];
}

/// `T`, Pa.
#[inline(always)]
pub unsafe fn deviator<L: Eigenvalues>(law: &LaneTerms, strain: &Strain<L>) -> [L; 6] {
    unsafe {
        if L::APART {
            deviator_apart(law, strain)
        } else {
            deviator_within(law, strain)
        }
    }
}

/// Not for lanes of an instruction set: as a function of its own it would not be compiled for that.
#[inline(never)]
unsafe fn deviator_apart<L: Eigenvalues>(law: &LaneTerms, strain: &Strain<L>) -> [L; 6] {
    unsafe { deviator_within(law, strain) }
}

#[inline(always)]
unsafe fn deviator_within<L: Eigenvalues>(law: &LaneTerms, strain: &Strain<L>) -> [L; 6] {
    unsafe {
        if let Some(grows) = law.grows {
            let both = [&strain.d, &strain.square];
            return grown(grows, [law.mu[0], law.mu[1]], both, [strain.j2, strain.x]);
        }
        if !law.whole {
            return L::by_eigenvalues(law, strain);
        }
        let (t, largest) = by_powers(law, strain);
        let limit = L::splat(CAPPED);
        if largest.all_below(limit) {
            return t;
        }
        let mut out = L::by_eigenvalues(law, strain);
        for k in 0..6 {
            out[k] = largest.below(limit, t[k], out[k]);
        }
        out
    }
}

/// `T` of even exponents, and the largest trace of a power of `Cbar`: below `e^3` no stretch is at the cap.
#[inline(always)]
unsafe fn by_powers<L: NodeLanes>(law: &LaneTerms, strain: &Strain<L>) -> ([L; 6], L) {
    unsafe {
        let zero = L::splat(0.0);
        let whole = strain.x.add(L::splat(1.0));
        // (1 + x)^(-1/3), and its inverse.
        let root = inverse_cube_root(whole);
        let back = whole.mul(root).mul(root);
        let mut inverse = strain.d;
        let by = L::splat(1.0).div(whole);
        let both = strain.j2.add(strain.x);
        for k in 0..6 {
            inverse[k] = strain.square[k].sub(strain.d[k]);
        }
        for k in [0, 3, 5] {
            inverse[k] = inverse[k].sub(both);
        }
        for k in 0..6 {
            inverse[k] = inverse[k].mul(by);
        }
        let mut sum = [zero; 6];
        let mut largest = zero;
        for at in 0..law.count {
            let n = law.power[at].unsigned_abs();
            let (base, scale) = if law.power[at] < 0 {
                (inverse, back)
            } else {
                (strain.d, root)
            };
            let scale = scalar_power(scale, n);
            let mut r = power(base, n);
            let trace = r[0].add(r[3]).add(r[5]);
            largest = trace.add(L::splat(3.0)).mul(scale).max(largest);
            let middle = trace.mul(L::splat(1.0 / 3.0));
            for k in [0, 3, 5] {
                r[k] = r[k].sub(middle);
            }
            let scale = scale.mul(L::splat(law.mu[at]));
            for k in 0..6 {
                sum[k] = scale.mul_add(r[k], sum[k]);
            }
        }
        (sum, largest)
    }
}

/// `sum mu (phi(alpha s) - 1)` and `sum mu alpha phi'(alpha s)`.
#[inline(always)]
unsafe fn pull<L: NodeLanes>(law: &LaneTerms, s: L) -> [L; 2] {
    unsafe {
        let cap = L::splat(CAP as f32);
        let (mut force, mut rise) = (L::splat(0.0), L::splat(0.0));
        for at in 0..law.count {
            let (mu, alpha) = (L::splat(law.mu[at]), L::splat(law.alpha[at]));
            let y = alpha.mul(s);
            let small = exp_m1(y.min(cap));
            let beyond = L::splat(0.0).max(y.sub(cap));
            let slope = small.add(L::splat(1.0));
            force = mu.mul_add(beyond.mul_add(slope, small), force);
            rise = mu.mul(alpha).mul_add(slope, rise);
        }
        [force, rise]
    }
}

/// `(f(a) - f(b)) / (a - b)` for eigenvalues `a >= b` of `D` and the pulls there; `log` is a third of `ln (1 + x)`.
#[inline(always)]
unsafe fn difference<L: NodeLanes>(
    law: &LaneTerms,
    log: L,
    [a, b]: [L; 2],
    [at_a, at_b]: [L; 2],
) -> L {
    unsafe {
        let gap = a.sub(b);
        let limit = L::splat(COINCIDENT);
        let middle = a.add(b).mul(L::splat(0.5)).max(L::splat(LEAST - 1.0));
        let s = ln_1p(middle).sub(log).mul(L::splat(0.5));
        let slope = pull(law, s)[1].div(middle.add(middle).add(L::splat(2.0)));
        gap.below(limit, slope, at_a.sub(at_b).div(gap.max(limit)))
    }
}

/// `T` of any exponents.
#[inline(always)]
pub unsafe fn by_eigenvalues<L: NodeLanes>(law: &LaneTerms, strain: &Strain<L>) -> [L; 6] {
    unsafe {
        let zero = L::splat(0.0);
        let third = L::splat(1.0 / 3.0);
        let (j2, j3) = (strain.j2, strain.j3);
        let r = j2.mul(third).sqrt();
        let cube = r.mul(r).mul(r).max(L::splat(1e-30));
        let cosine = j3.mul(L::splat(0.5)).div(cube);
        let cosine = cosine.max(L::splat(-1.0)).min(L::splat(1.0));
        // The three roots of the cubic `l³ - J2 l - J3 = 0` of a matrix without a trace, as twice
        // `r = sqrt(J2 / 3)` times cosines 120 degrees apart.
        let [c, s] = third_of_angle(cosine);
        let first = r.add(r).mul(c);
        // 2 r cos(angle + 120 degrees).
        let last = r.mul(zero.sub(c).sub(s.mul(L::splat(1.732_050_8))));
        let middle = zero.sub(first).sub(last);
        let log = ln_1p(strain.x).mul(third);
        let least = L::splat(LEAST - 1.0);
        let half = L::splat(0.5);
        let at_first = pull(law, ln_1p(first.max(least)).sub(log).mul(half))[0];
        let at_middle = pull(law, ln_1p(middle.max(least)).sub(log).mul(half))[0];
        let at_last = pull(law, ln_1p(last.max(least)).sub(log).mul(half))[0];
        let upper = difference(law, log, [first, middle], [at_first, at_middle]);
        let lower = difference(law, log, [middle, last], [at_middle, at_last]);
        let small = L::splat(SMALL);
        let span = first.sub(last);
        // Newton's form of the quadratic in `D` that has `T`'s eigenvalues at those of `D`: the
        // coefficients of `D` and of `D²`.
        let squared = upper.sub(lower).div(span.max(small));
        let own = squared.mul_add(last, upper);
        let near = series(law, j2, j3, log);
        let own = span.below(small, near[0], own);
        let squared = span.below(small, near[1], squared);
        let mut out = strain.d;
        for k in 0..6 {
            out[k] = squared.mul_add(strain.square[k], own.mul(strain.d[k]));
        }
        let mean = squared.mul(j2).mul(L::splat(2.0 / 3.0));
        for k in [0, 3, 5] {
            out[k] = out[k].sub(mean);
        }
        out
    }
}

/// See [`crate::laws::Stretches::series`]; `log` is a third of `ln (1 + x)`.
#[inline(always)]
unsafe fn series<L: NodeLanes>(law: &LaneTerms, j2: L, j3: L, log: L) -> [L; 2] {
    unsafe {
        let mut out = [L::splat(0.0); 2];
        for at in 0..law.count {
            let p = 0.5 * law.alpha[at];
            let second = p * (p - 1.0) / 2.0;
            let third = second * (p - 2.0) / 3.0;
            let fourth = third * (p - 3.0) / 4.0;
            let c = exp_m1(log.mul(L::splat(-p))).add(L::splat(1.0));
            let c = c.mul(L::splat(law.mu[at]));
            let first = j2.mul_add(L::splat(third), L::splat(p));
            let first = j3.mul_add(L::splat(fourth), first);
            out[0] = c.mul_add(first, out[0]);
            let next = j2.mul_add(L::splat(fourth), L::splat(second));
            out[1] = c.mul_add(next, out[1]);
        }
        out
    }
}
