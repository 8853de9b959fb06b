//! Elementary functions of f32 lanes, within two units in the last place (f32) over the ranges that each states.
//!
//! Each function brings its argument into a short interval, where a polynomial of a few terms is
//! good to f32, and puts back what was taken off: `e^x = 2^n e^r` with `|r| <= ln 2 / 2`,
//! `ln(2^n m) = n ln 2 + ln m` with `m` near one. There are no branches, as lanes cannot take
//! different ones: arguments beyond the range are clamped. The laws of the elements call them.
//!
//! Polynomials of the exponential and the logarithm: Moshier, *Cephes Mathematical Library*, `expf.c` and `logf.c`; of the arc
//! cosine: Abramowitz and Stegun, *Handbook of Mathematical Functions*, 4.4.46.

use crate::FunctionLanes;

/// `ln 2` in two parts, of which the first has nine bits: its product with a power of two's
/// exponent, which has eight, is exact in f32. The second carries the remaining digits, so that
/// `x - n ln 2` loses nothing where the two nearly cancel (Cody and Waite's reduction).
const LN2: [f32; 2] = [355.0 / 512.0, -2.121_944_4e-4];

/// `sum c_k x^k`, the coefficients from the highest power down.
///
/// # Safety
/// See [`crate::Lanes`].
#[inline(always)]
unsafe fn horner<L: FunctionLanes, const N: usize>(coefficients: [f32; N], x: L) -> L {
    // SAFETY: the caller's.
    unsafe {
        let mut sum = L::splat(coefficients[0]);
        for c in &coefficients[1..] {
            sum = sum.mul_add(x, L::splat(*c));
        }
        sum
    }
}

/// `e^x - 1` for `x` up to 88; below -87 it is -1. Accurate near zero, where `e^x` less one would not be.
///
/// # Safety
/// See [`crate::Lanes`].
#[inline(always)]
pub unsafe fn exp_m1<L: FunctionLanes>(x: L) -> L {
    // SAFETY: the caller's.
    unsafe {
        // Within these the exponent stays in -126..=127, which is what `scale_by_power` can write.
        let x = x.max(L::splat(-87.0)).min(L::splat(88.0));
        let whole = x.mul(L::splat(std::f32::consts::LOG2_E)).round();
        let rest = whole.neg_mul_add(L::splat(LN2[0]), x);
        let rest = whole.neg_mul_add(L::splat(LN2[1]), rest);
        // `(e^r - 1 - r) / r^2`, so that the leading term is `r` itself and keeps all of its bits.
        let series = horner(
            [
                1.987_569_1e-4,
                1.398_199_9e-3,
                8.333_452e-3,
                4.166_579_6e-2,
                0.166_666_65,
                0.5,
            ],
            rest,
        );
        // e^rest - 1, and then 2^whole (1 + that) - 1.
        let small = series.mul(rest).mul_add(rest, rest);
        let one = L::splat(1.0);
        let power = one.scale_by_power(whole);
        small.mul_add(power, power.sub(one))
    }
}

/// `ln(1 + x)` for `x` from -1 + 2^-23 to 1e30. Accurate near zero.
///
/// # Safety
/// See [`crate::Lanes`].
#[inline(always)]
pub unsafe fn ln_1p<L: FunctionLanes>(x: L) -> L {
    // SAFETY: the caller's.
    unsafe {
        let one = L::splat(1.0);
        // The smallest normal number in place of zero: a subnormal one has no exponent to split
        // off.
        let sum = x.add(one).max(L::splat(f32::MIN_POSITIVE));
        // What the sum has lost, and that over the sum: the logarithm's change to first order.
        let lost = x.sub(sum.sub(one));
        let [mantissa, power] = sum.split();
        // From the root of a half to that of two, so that `f` is between -0.3 and 0.42.
        let f = mantissa.sub(one);
        let square = f.mul(f);
        let series = horner(
            [
                7.037_683_6e-2,
                -0.115_146_1,
                0.116_769_984,
                -0.124_201_41,
                0.142_493_23,
                -0.166_680_58,
                0.200_007_15,
                -0.249_999_94,
                0.333_333_3,
            ],
            f,
        );
        let small = series.mul(square).mul(f);
        // The small terms are added first and `f` and the large part of `n ln 2` last.
        let small = power.mul_add(L::splat(LN2[1]), small);
        let small = square.mul_add(L::splat(-0.5), small);
        let small = small.add(lost.div(sum));
        power.mul_add(L::splat(LN2[0]), small.add(f))
    }
}

/// Cosine and sine of `acos(c) / 3` for `c` from -1 to 1, to 3e-7: the angle of a cubic's roots.
///
/// # Safety
/// See [`crate::Lanes`].
#[inline(always)]
pub unsafe fn third_of_angle<L: FunctionLanes>(c: L) -> [L; 2] {
    // SAFETY: the caller's.
    unsafe {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        // The formula is for arguments from 0 to 1; `acos(-c) = pi - acos(c)` gives the others.
        let size = c.max(zero.sub(c));
        let series = horner(
            [
                -1.262_491_1e-3,
                6.670_09e-3,
                -1.708_812_6e-2,
                3.089_188e-2,
                -5.017_430_5e-2,
                8.897_899e-2,
                -0.214_598_8,
                std::f32::consts::FRAC_PI_2,
            ],
            size,
        );
        let sharp = zero.max(one.sub(size)).sqrt().mul(series);
        let angle = c.below(zero, L::splat(std::f32::consts::PI).sub(sharp), sharp);
        let angle = angle.mul(L::splat(1.0 / 3.0));
        let square = angle.mul(angle);
        // Taylor's series: the angle is at most 60 degrees.
        let cosine = horner(
            [
                2.087_675_7e-9,
                -2.755_732e-7,
                2.480_158_7e-5,
                -1.388_888_9e-3,
                4.166_666_7e-2,
                -0.5,
                1.0,
            ],
            square,
        );
        let sine = horner(
            [
                -2.505_210_8e-8,
                2.755_731_9e-6,
                -1.984_127e-4,
                8.333_333e-3,
                -0.166_666_67,
                1.0,
            ],
            square,
        );
        [cosine, sine.mul(angle)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Isa, Lanes, Scalar, WIDTH, by_isa};

    /// Applies a function to whole registers.
    macro_rules! on_slices {
        ($name:ident, $body:ident, $scalar:ident, $function:expr) => {
            unsafe fn $body<V: FunctionLanes>(x: &[f32], out: &mut [f32]) {
                for (x, out) in x.chunks_exact(V::COUNT).zip(out.chunks_exact_mut(V::COUNT)) {
                    // SAFETY: whole registers.
                    unsafe { $function(V::load(x.as_ptr())).store(out.as_mut_ptr()) }
                }
            }
            fn $scalar(x: &[f32], out: &mut [f32]) {
                // SAFETY: plain arrays.
                unsafe { $body::<Scalar>(x, out) }
            }
            by_isa! { fn $name(x: &[f32], out: &mut [f32]) = $body, $scalar; }
        };
    }

    #[inline(always)]
    unsafe fn cosine<V: FunctionLanes>(c: V) -> V {
        // SAFETY: the caller's.
        unsafe { third_of_angle(c)[0] }
    }

    #[inline(always)]
    unsafe fn sine<V: FunctionLanes>(c: V) -> V {
        // SAFETY: the caller's.
        unsafe { third_of_angle(c)[1] }
    }

    on_slices!(exponential, exponential_body, exponential_scalar, exp_m1);
    on_slices!(logarithm, logarithm_body, logarithm_scalar, ln_1p);
    on_slices!(cosines, cosines_body, cosines_scalar, cosine);
    on_slices!(sines, sines_body, sines_scalar, sine);

    /// Every 97th f32 from the smallest normal one up to `end`, with both signs where `negative`.
    fn numbers(end: f32, negative: f32) -> Vec<f32> {
        let mut all: Vec<f32> = (f32::MIN_POSITIVE.to_bits()..=end.to_bits())
            .step_by(97)
            .map(f32::from_bits)
            .collect();
        let below: Vec<f32> = all.iter().filter(|x| **x <= negative).map(|x| -x).collect();
        all.extend(below);
        all.resize(all.len().next_multiple_of(WIDTH), 0.0);
        all
    }

    /// Units in the last place of `want` between the two.
    fn distance(got: f32, want: f64) -> f64 {
        let near = want as f32;
        let unit = f64::from(f32::from_bits(near.abs().to_bits() + 1)) - f64::from(near.abs());
        (f64::from(got) - want).abs() / unit
    }

    fn worst(
        isa: Isa,
        name: &str,
        f: fn(Isa, &[f32], &mut [f32]),
        exact: fn(f64) -> f64,
        x: &[f32],
    ) {
        let mut out = vec![0.0; x.len()];
        f(isa, x, &mut out);
        for (x, got) in x.iter().zip(&out) {
            let away = distance(*got, exact(f64::from(*x)));
            assert!(
                away <= 2.0,
                "{name} of {x} on {isa:?}: {got}, {away} units off"
            );
        }
    }

    #[test]
    fn exponential_and_logarithm_are_within_two_units() {
        for isa in Isa::available() {
            worst(
                isa,
                "exp_m1",
                exponential,
                f64::exp_m1,
                &numbers(80.0, 80.0),
            );
            worst(
                isa,
                "ln_1p",
                logarithm,
                f64::ln_1p,
                &numbers(1e30, 0.999_999),
            );
        }
    }

    #[test]
    fn beyond_its_range_the_exponential_stays_finite() {
        let x = [-1e30, -100.0, 100.0, 1e30].repeat(WIDTH / 4);
        for isa in Isa::available() {
            let mut out = vec![0.0; x.len()];
            exponential(isa, &x, &mut out);
            assert!(out.iter().all(|y| y.is_finite()), "{isa:?}: {out:?}");
            assert_eq!(out[0], -1.0, "{isa:?}");
        }
    }

    #[test]
    fn a_third_of_an_angle_is_that_of_f64() {
        let x: Vec<f32> = (0..=WIDTH * 5000)
            .map(|i| 2.0 * i as f32 / (WIDTH * 5000) as f32 - 1.0)
            .collect();
        let x = &x[1..];
        for isa in Isa::available() {
            let (mut cosine, mut sine) = (vec![0.0; x.len()], vec![0.0; x.len()]);
            cosines(isa, x, &mut cosine);
            sines(isa, x, &mut sine);
            for ((x, c), s) in x.iter().zip(&cosine).zip(&sine) {
                let angle = f64::from(*x).acos() / 3.0;
                let off = (f64::from(*c) - angle.cos()).abs();
                let off = off.max((f64::from(*s) - angle.sin()).abs());
                assert!(off < 3e-7, "{x} on {isa:?}: {off}");
            }
        }
    }

    #[test]
    fn numbers_split_and_lanes_are_chosen() {
        // SAFETY: plain arrays.
        unsafe {
            let number = <Scalar>::splat;
            let [rest, power] = number(-12.0)
                .below(number(0.0), number(12.0), number(1.0))
                .split();
            let mut out = [0.0; WIDTH];
            rest.store(out.as_mut_ptr());
            assert_eq!(out[0], 0.75);
            power.store(out.as_mut_ptr());
            assert_eq!(out[0], 4.0);
        }
    }
}
