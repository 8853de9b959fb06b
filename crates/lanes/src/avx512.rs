//! 512-bit lanes: AVX-512 F, BW, DQ, VL. Gathers are 128-bit loads and in-register transposes.
//!
//! The gather instruction of the set would load one number a time, and a node's four are wanted
//! together: sixteen loads of a whole node and a transpose do the work of 64 such accesses. As in
//! [`super::avx2`], shuffles stay within 128-bit parts, so the rows are laid out four apart.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: the instruction set is enabled in the caller, and pointers hold what the shapes say"
)]

use super::avx2::{add_row, row};
use super::{DenseLanes, FunctionLanes, Lanes, NodeLanes, ROOT_OF_HALF};
use core::arch::x86_64::*;

/// Sixteen f32.
#[derive(Clone, Copy)]
pub struct Avx512(pub __m512);

/// Rows `first`, `first + 4`, `first + 8`, `first + 12` in the four 128-bit parts.
#[inline(always)]
unsafe fn rows(nodes: *const [f32; 4], index: *const u16, first: usize) -> __m512 {
    unsafe {
        let low = _mm256_insertf128_ps(
            _mm256_castps128_ps256(row(nodes, *index.add(first))),
            row(nodes, *index.add(first + 4)),
            1,
        );
        let high = _mm256_insertf128_ps(
            _mm256_castps128_ps256(row(nodes, *index.add(first + 8))),
            row(nodes, *index.add(first + 12)),
            1,
        );
        _mm512_castpd_ps(_mm512_insertf64x4(
            _mm512_castpd256_pd512(_mm256_castps_pd(low)),
            _mm256_castps_pd(high),
            1,
        ))
    }
}

/// Adds the four 128-bit parts to the nodes of elements `first`, `first + 4`, ...
#[inline(always)]
unsafe fn add_rows(nodes: *mut [f32; 4], index: *const u16, first: usize, value: __m512) {
    unsafe {
        add_row(nodes, *index.add(first), _mm512_castps512_ps128(value));
        add_row(
            nodes,
            *index.add(first + 4),
            _mm512_extractf32x4_ps(value, 1),
        );
        add_row(
            nodes,
            *index.add(first + 8),
            _mm512_extractf32x4_ps(value, 2),
        );
        add_row(
            nodes,
            *index.add(first + 12),
            _mm512_extractf32x4_ps(value, 3),
        );
    }
}

// SAFETY (all functions): the traits' contract, AVX-512 enabled in the caller.
impl Lanes for Avx512 {
    const COUNT: usize = 16;
    const FUSED: bool = true;

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
    unsafe fn neg_mul_add(self, b: Self, c: Self) -> Self {
        unsafe { Self(_mm512_fnmadd_ps(self.0, b.0, c.0)) }
    }

    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        unsafe { Self(_mm512_min_ps(other.0, self.0)) }
    }

    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        unsafe { Self(_mm512_max_ps(other.0, self.0)) }
    }
}

// SAFETY (all functions): the traits' contract, AVX-512 enabled in the caller.
impl FunctionLanes for Avx512 {
    #[inline(always)]
    unsafe fn sqrt(self) -> Self {
        unsafe { Self(_mm512_sqrt_ps(self.0)) }
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
        // One instruction does what the other sets build from the bits of an exponent, and has no
        // limits of range.
    }

    #[inline(always)]
    unsafe fn split(self) -> [Self; 2] {
        unsafe {
            let bits = _mm512_castps_si512(self.0);
            let power =
                _mm512_srai_epi32::<23>(_mm512_sub_epi32(bits, _mm512_set1_epi32(ROOT_OF_HALF)));
            let rest = _mm512_sub_epi32(bits, _mm512_slli_epi32::<23>(power));
            [
                Self(_mm512_castsi512_ps(rest)),
                Self(_mm512_cvtepi32_ps(power)),
            ]
        }
    }

    #[inline(always)]
    unsafe fn below(self, limit: Self, then: Self, otherwise: Self) -> Self {
        unsafe {
            let mask = _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, limit.0);
            Self(_mm512_mask_blend_ps(mask, otherwise.0, then.0))
        }
    }

    #[inline(always)]
    unsafe fn all_below(self, limit: Self) -> bool {
        unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, limit.0) == u16::MAX }
    }
}

// SAFETY (all functions): the traits' contract, AVX-512 enabled in the caller.
impl DenseLanes for Avx512 {
    #[inline(always)]
    unsafe fn load_part(from: *const f32, count: usize) -> Self {
        unsafe { Self(_mm512_maskz_loadu_ps((1u16 << count) - 1, from)) }
        // `count < 16`, so the shift is in range; masked lanes are not accessed.
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
    unsafe fn sums(four: [Self; 4]) -> [f32; 4] {
        unsafe {
            // No closure: it would not take on the instruction set.
            let mut halves = [_mm256_setzero_ps(); 4];
            for i in 0..4 {
                halves[i] = _mm256_add_ps(
                    _mm512_castps512_ps256(four[i].0),
                    _mm512_extractf32x8_ps::<1>(four[i].0),
                );
            }
            // Lanes 0 to 7 plus lanes 8 to 15 first; from there it is the tree of AVX2. A sum over
            // sixteen lanes therefore has other bits than one over eight.
            let [a, b, c, d] = halves;
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

// SAFETY (all functions): the traits' contract, AVX-512 enabled in the caller.
impl NodeLanes for Avx512 {
    #[inline(always)]
    unsafe fn bits_as_numbers(self) -> Self {
        unsafe { Self(_mm512_cvtepi32_ps(_mm512_castps_si512(self.0))) }
    }

    #[inline(always)]
    unsafe fn numbers_as_bits(self) -> Self {
        unsafe { Self(_mm512_castsi512_ps(_mm512_cvttps_epi32(self.0))) }
    }

    #[inline(always)]
    unsafe fn fourth(self) -> Self {
        unsafe { Self(_mm512_permute_ps(self.0, 0xFF)) }
    }

    #[inline(always)]
    unsafe fn gather(nodes: *const [f32; 4], index: *const u16) -> [Self; 4] {
        unsafe {
            let [r0, r1, r2, r3] = [
                rows(nodes, index, 0),
                rows(nodes, index, 1),
                rows(nodes, index, 2),
                rows(nodes, index, 3),
            ];
            let xy01 = _mm512_unpacklo_ps(r0, r1);
            let xy23 = _mm512_unpacklo_ps(r2, r3);
            let zw01 = _mm512_unpackhi_ps(r0, r1);
            let zw23 = _mm512_unpackhi_ps(r2, r3);
            [
                Self(_mm512_shuffle_ps(xy01, xy23, 0x44)),
                Self(_mm512_shuffle_ps(xy01, xy23, 0xEE)),
                Self(_mm512_shuffle_ps(zw01, zw23, 0x44)),
                Self(_mm512_shuffle_ps(zw01, zw23, 0xEE)),
            ]
        }
    }

    #[inline(always)]
    unsafe fn scatter_add(nodes: *mut [f32; 4], index: *const u16, value: [Self; 3]) {
        unsafe {
            // The order is 0, 4, 8, 12, 1, 5, ...: fixed, but not that of the elements. Portable
            // models never run on these lanes ([`crate::Portable`]).
            let [Self(x), Self(y), Self(z)] = value;
            let xy01 = _mm512_unpacklo_ps(x, y);
            let xy23 = _mm512_unpackhi_ps(x, y);
            add_rows(nodes, index, 0, _mm512_shuffle_ps(xy01, z, 0x04));
            add_rows(nodes, index, 1, _mm512_shuffle_ps(xy01, z, 0x5E));
            add_rows(nodes, index, 2, _mm512_shuffle_ps(xy23, z, 0xA4));
            add_rows(nodes, index, 3, _mm512_shuffle_ps(xy23, z, 0xFE));
        }
    }
}
