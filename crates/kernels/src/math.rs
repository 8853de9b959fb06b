//! The two transcendental functions of the network, in f32: exact GELU
//! `x Phi(x) = x/2 (1 + erf(x / sqrt 2))` and `2^x`; and the product that is added at once.

use lanes::{DenseLanes, Lanes};

/// `a b + c` in f64, rounded once where the lanes `V` do that in one instruction.
#[inline(always)]
pub(super) fn fused<V: Lanes>(a: f64, b: f64, c: f64) -> f64 {
    match V::FUSED {
        true => a.mul_add(b, c),
        false => a * b + c,
    }
}

/// `GELU(x) = x/2 (1 + erf(x / sqrt 2))`: the readable reference.
pub fn gelu(x: f32) -> f32 {
    0.5 * x * (1.0 + libm::erff(x * std::f32::consts::FRAC_1_SQRT_2))
}

/// Beyond this `|x|`, `erf(x / sqrt 2)` is 1 in f32.
const ERF_END: f32 = 5.6;
/// `erf(x / sqrt 2) = x P(x²) / Q(x²)` on `|x| <= 5.6`: minimax fit, relative error 2e-8
/// before rounding.
const ERF_P: [f32; 6] = [
    7.978_845e-1,
    6.832_335e-2,
    9.385_802e-3,
    3.429_579e-4,
    1.264_651_3e-5,
    4.442_446_3e-8,
];
/// The denominator has no zero on the interval, so one division a lane is safe.
const ERF_Q: [f32; 6] = [
    1.0,
    2.522_967e-1,
    2.881_41e-2,
    1.899_776e-3,
    7.424_788e-5,
    1.179_667_5e-6,
];
/// `2^f` on `|f| <= 1/2`, relative error 2e-9 before rounding.
const EXP2: [f32; 7] = [
    1.0,
    6.931_472e-1,
    2.402_264_7e-1,
    5.550_328_8e-2,
    9.618_489e-3,
    1.339_993_1e-3,
    1.534_580_7e-4,
];

/// A polynomial of each lane, from the highest coefficient down; `coefficients` begin with the constant.
///
/// # Safety
/// See [`Lanes`].
#[inline(always)]
unsafe fn horner<V: DenseLanes, const M: usize>(coefficients: &[f32; M], x: V) -> V {
    // SAFETY: see `Lanes`.
    unsafe {
        let mut sum = V::splat(coefficients[M - 1]);
        for &c in coefficients[..M - 1].iter().rev() {
            sum = sum.mul_add(x, V::splat(c));
        }
        sum
    }
}

/// Exact GELU of each lane.
///
/// # Safety
/// See [`Lanes`].
#[inline(always)]
pub(crate) unsafe fn gelu_lanes<V: DenseLanes>(x: V) -> V {
    // SAFETY: the caller's.
    unsafe {
        // Clamped for the fraction alone: beyond the end `erf` is one, and the factor `x / 2` is
        // not.
        let end = x.max(V::splat(-ERF_END)).min(V::splat(ERF_END));
        let square = end.mul(end);
        let erf = end.mul(horner(&ERF_P, square)).div(horner(&ERF_Q, square));
        let half = x.mul(V::splat(0.5));
        half.mul_add(erf, half)
    }
}

/// `2^x` of each lane for `x <= 127`; below -126 it gives 2^-126, a NaN stays a NaN.
///
/// # Safety
/// See [`Lanes`].
#[inline(always)]
pub(crate) unsafe fn exp2_lanes<V: DenseLanes>(x: V) -> V {
    // SAFETY: the caller's.
    unsafe {
        let x = x.max(V::splat(-126.0));
        let whole = x.round();
        // `x = n + f`: the polynomial takes `f`, and `2^n` is written into the exponent, exactly.
        horner(&EXP2, x.sub(whole)).scale_by_power(whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lanes::{Isa, by_isa};

    unsafe fn gelu_body<V: DenseLanes>(x: &[f32], out: &mut [f32]) {
        for (x, out) in x.chunks(V::COUNT).zip(out.chunks_mut(V::COUNT)) {
            // SAFETY: the parts are as long as said.
            unsafe {
                let y = if x.len() == V::COUNT {
                    V::load(x.as_ptr())
                } else {
                    V::load_part(x.as_ptr(), x.len())
                };
                if x.len() == V::COUNT {
                    gelu_lanes(y).store(out.as_mut_ptr());
                } else {
                    gelu_lanes(y).store_part(out.as_mut_ptr(), out.len());
                }
            }
        }
    }
    fn gelu_scalar(x: &[f32], out: &mut [f32]) {
        for (x, out) in x.iter().zip(out) {
            *out = gelu(*x);
        }
    }
    by_isa! { fn gelu_slice(x: &[f32], out: &mut [f32]) = gelu_body, gelu_scalar; }

    unsafe fn exp2_body<V: DenseLanes>(x: &[f32], out: &mut [f32]) {
        for (x, out) in x.chunks_exact(V::COUNT).zip(out.chunks_exact_mut(V::COUNT)) {
            // SAFETY: whole registers.
            unsafe { exp2_lanes(V::load(x.as_ptr())).store(out.as_mut_ptr()) }
        }
    }
    fn exp2_scalar(x: &[f32], out: &mut [f32]) {
        for (x, out) in x.iter().zip(out) {
            *out = x.exp2();
        }
    }
    by_isa! { fn exp2_slice(x: &[f32], out: &mut [f32]) = exp2_body, exp2_scalar; }

    fn exact_gelu(x: f64) -> f64 {
        0.5 * x * (1.0 + libm::erf(x / 2f64.sqrt()))
    }

    #[test]
    fn gelu_is_exact_to_f32_on_every_isa() {
        let x: Vec<f32> = (-120_003..=120_000).map(|i| i as f32 * 1e-4).collect();
        let mut y = vec![0.0; x.len()];
        for isa in Isa::available() {
            gelu_slice(isa, &x, &mut y);
            let worst = x
                .iter()
                .zip(&y)
                .map(|(&x, &y)| {
                    (f64::from(y) - exact_gelu(f64::from(x))).abs() / f64::from(x).abs().max(1.0)
                })
                .fold(0.0, f64::max);
            println!("gelu {}: {worst:.2e}", isa.name());
            assert!(worst < 2.5e-7, "{}: {worst:e}", isa.name());
        }
    }

    #[test]
    fn gelu_of_extremes() {
        let x = [0.0, -0.0, 1e30, -1e30, f32::NAN, f32::INFINITY, 40.0, -40.0];
        let mut y = [9.0; 8];
        for isa in Isa::available() {
            gelu_slice(isa, &x, &mut y);
            for (&x, &y) in x.iter().zip(&y).filter(|(x, _)| x.is_finite()) {
                let limit = x.abs() * 1.2e-7;
                assert!((y - x.max(0.0)).abs() <= limit, "{} {x} {y}", isa.name());
            }
            assert!(y[4].is_nan());
            assert_eq!(y[5], f32::INFINITY);
        }
    }

    #[test]
    fn exp2_is_exact_to_f32_on_every_isa() {
        let x: Vec<f32> = (-12_600..=400).map(|i| i as f32 * 1e-2).collect();
        let x = &x[..x.len() / 16 * 16];
        let mut y = vec![0.0; x.len()];
        for isa in Isa::available() {
            exp2_slice(isa, x, &mut y);
            let worst = x
                .iter()
                .zip(&y)
                .map(|(&x, &y)| (f64::from(y) / f64::from(x).exp2() - 1.0).abs())
                .fold(0.0, f64::max);
            assert!(worst < 2e-7, "{}: {worst:e}", isa.name());
        }
    }
}
