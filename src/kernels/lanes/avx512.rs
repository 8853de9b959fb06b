//! 512-bit lanes: AVX-512 F, BW, DQ, VL.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: the instruction set is enabled in the caller, and pointers hold what the shapes say"
)]

use super::Lanes;
use core::arch::x86_64::*;

/// Sixteen f32.
#[derive(Clone, Copy)]
pub(crate) struct Avx512(pub(crate) __m512);

// SAFETY (all functions): the trait's contract, AVX-512 enabled in the caller.
impl Lanes for Avx512 {
    const N: usize = 16;

    #[inline(always)]
    unsafe fn splat(x: f32) -> Self {
        unsafe { Self(_mm512_set1_ps(x)) }
    }
    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        unsafe { Self(_mm512_loadu_ps(from)) }
    }
    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { _mm512_storeu_ps(to, self.0) }
    }
    #[inline(always)]
    unsafe fn load_part(from: *const f32, count: usize) -> Self {
        unsafe { Self(_mm512_maskz_loadu_ps((1u16 << count) - 1, from)) }
    }
    #[inline(always)]
    unsafe fn store_part(self, to: *mut f32, count: usize) {
        unsafe { _mm512_mask_storeu_ps(to, (1u16 << count) - 1, self.0) }
    }
    #[inline(always)]
    unsafe fn load_f16(from: *const half::f16) -> Self {
        unsafe { Self(_mm512_cvtph_ps(_mm256_loadu_si256(from.cast()))) }
    }
    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        unsafe { Self(_mm512_add_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        unsafe { Self(_mm512_sub_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        unsafe { Self(_mm512_mul_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        unsafe { Self(_mm512_div_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn mul_add(self, a: Self, b: Self) -> Self {
        unsafe { Self(_mm512_fmadd_ps(self.0, a.0, b.0)) }
    }
    #[inline(always)]
    unsafe fn sqrt(self) -> Self {
        unsafe { Self(_mm512_sqrt_ps(self.0)) }
    }
    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        unsafe { Self(_mm512_max_ps(other.0, self.0)) }
    }
    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        unsafe { Self(_mm512_min_ps(other.0, self.0)) }
    }
    #[inline(always)]
    unsafe fn round(self) -> Self {
        unsafe {
            Self(_mm512_roundscale_ps::<
                { _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC },
            >(self.0))
        }
    }
    #[inline(always)]
    unsafe fn scale_by_power(self, exponent: Self) -> Self {
        unsafe { Self(_mm512_scalef_ps(self.0, exponent.0)) }
    }
    #[inline(always)]
    unsafe fn sums(four: [Self; 4]) -> [f32; 4] {
        unsafe {
            let [a, b, c, d] = four.map(|r| {
                _mm256_add_ps(
                    _mm512_castps512_ps256(r.0),
                    _mm512_extractf32x8_ps::<1>(r.0),
                )
            });
            let ab = _mm256_hadd_ps(a, b);
            let cd = _mm256_hadd_ps(c, d);
            let abcd = _mm256_hadd_ps(ab, cd);
            let sum = _mm_add_ps(
                _mm256_castps256_ps128(abcd),
                _mm256_extractf128_ps::<1>(abcd),
            );
            let mut out = [0.0; 4];
            _mm_storeu_ps(out.as_mut_ptr(), sum);
            out
        }
    }
    #[inline(always)]
    unsafe fn transpose(from: *const f32, row_offset: &[usize], to: *mut f32, stride: usize) {
        unsafe {
            let mut r = [_mm512_setzero_ps(); 16];
            for i in 0..16 {
                r[i] = _mm512_loadu_ps(from.add(row_offset[i]));
            }
            let mut s = r;
            for i in 0..8 {
                s[2 * i] = _mm512_unpacklo_ps(r[2 * i], r[2 * i + 1]);
                s[2 * i + 1] = _mm512_unpackhi_ps(r[2 * i], r[2 * i + 1]);
            }
            // r[4 g + c]: rows 4 g .. 4 g + 4 of column 4 q + c in each 128-bit quarter q.
            for g in 0..4 {
                let k = 4 * g;
                r[k] = _mm512_shuffle_ps::<0x44>(s[k], s[k + 2]);
                r[k + 1] = _mm512_shuffle_ps::<0xee>(s[k], s[k + 2]);
                r[k + 2] = _mm512_shuffle_ps::<0x44>(s[k + 1], s[k + 3]);
                r[k + 3] = _mm512_shuffle_ps::<0xee>(s[k + 1], s[k + 3]);
            }
            for c in 0..4 {
                let a = _mm512_shuffle_f32x4::<0x88>(r[c], r[4 + c]);
                let b = _mm512_shuffle_f32x4::<0xdd>(r[c], r[4 + c]);
                let d = _mm512_shuffle_f32x4::<0x88>(r[8 + c], r[12 + c]);
                let e = _mm512_shuffle_f32x4::<0xdd>(r[8 + c], r[12 + c]);
                let columns = [
                    _mm512_shuffle_f32x4::<0x88>(a, d),
                    _mm512_shuffle_f32x4::<0x88>(b, e),
                    _mm512_shuffle_f32x4::<0xdd>(a, d),
                    _mm512_shuffle_f32x4::<0xdd>(b, e),
                ];
                for (q, column) in columns.into_iter().enumerate() {
                    _mm512_storeu_ps(to.add((4 * q + c) * stride), column);
                }
            }
        }
    }
}
