//! 256-bit lanes: AVX2 with FMA and F16C.
//!
//! Most instructions of AVX2 that move lanes about work within the two 128-bit halves of a register
//! and never across them. So four rows of four numbers that are to become columns are loaded as
//! rows 0 and 4 of one register, 1 and 5 of the next, and so on: an unpack and a shuffle of the
//! halves then yield lanes 0 to 3 in the low half and 4 to 7 in the high one, in their order and
//! without a crossing. Gathers, scatters and transposes below all do it that way.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: the instruction set is enabled in the caller, and pointers hold what the shapes say"
)]

use super::{DenseLanes, FunctionLanes, Lanes, NodeLanes, ROOT_OF_HALF};
use core::arch::x86_64::*;

/// Eight f32.
#[derive(Clone, Copy)]
pub struct Avx2(__m256);

/// A mask for AVX2's masked loads and stores: the sign bit is set in the first `count` lanes. The
/// lanes behind are not accessed at all, so that they may lie beyond the end of an allocation.
#[inline(always)]
unsafe fn first(count: usize) -> __m256i {
    // SAFETY: see the trait.
    unsafe {
        let index = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
        _mm256_cmpgt_epi32(_mm256_set1_epi32(count as i32), index)
    }
}

/// Loads one node, `[x, y, z, w]`. The index counts half nodes (8 bytes), so that the address is
/// one operand of the load: x86 scales an index by 8, but not by 16.
#[inline(always)]
pub(super) unsafe fn row(nodes: *const [f32; 4], index: u16) -> __m128 {
    unsafe { _mm_loadu_ps(nodes.cast::<f64>().add(index as usize).cast()) }
}

/// Adds to one node in memory. All four components are added, so `value`'s fourth decides what
/// becomes of the node's: nobody reads it after a scatter.
#[inline(always)]
pub(super) unsafe fn add_row(nodes: *mut [f32; 4], index: u16, value: __m128) {
    unsafe {
        let target: *mut f32 = nodes.cast::<f64>().add(index as usize).cast();
        _mm_storeu_ps(target, _mm_add_ps(_mm_loadu_ps(target), value));
    }
}

/// Rows `first` and `first + 4` in the two 128-bit halves.
#[inline(always)]
unsafe fn rows(nodes: *const [f32; 4], index: *const u16, first: usize) -> __m256 {
    unsafe {
        let low = _mm256_castps128_ps256(row(nodes, *index.add(first)));
        _mm256_insertf128_ps(low, row(nodes, *index.add(first + 4)), 1)
    }
}

/// Adds the halves of `value` to the nodes of elements `first` and `first + 4`, one after the
/// other: where both elements share the node, the second addition has to see the first.
#[inline(always)]
unsafe fn add_rows(nodes: *mut [f32; 4], index: *const u16, first: usize, value: __m256) {
    unsafe {
        add_row(nodes, *index.add(first), _mm256_castps256_ps128(value));
        add_row(
            nodes,
            *index.add(first + 4),
            _mm256_extractf128_ps(value, 1),
        );
    }
}

/// Forces by axis, turned to one row of four a node: rows 0 and 4 in the halves of the first
/// register, 1 and 5 in those of the second, 2 and 6, 3 and 7. Fourth components are copies of `z`.
#[inline(always)]
unsafe fn forces(value: [Avx2; 3]) -> [__m256; 4] {
    unsafe {
        let [Avx2(x), Avx2(y), Avx2(z)] = value;
        let xy01 = _mm256_unpacklo_ps(x, y);
        let xy23 = _mm256_unpackhi_ps(x, y);
        [
            _mm256_shuffle_ps(xy01, z, 0x04),
            _mm256_shuffle_ps(xy01, z, 0x5E),
            _mm256_shuffle_ps(xy23, z, 0xA4),
            _mm256_shuffle_ps(xy23, z, 0xFE),
        ]
    }
}

// SAFETY (all functions): the traits' contract, AVX2, FMA and F16C enabled in the caller.
impl Lanes for Avx2 {
    const COUNT: usize = 8;
    const FUSED: bool = true;

    #[inline(always)]
    unsafe fn splat(x: f32) -> Self {
        unsafe { Self(_mm256_set1_ps(x)) }
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        unsafe { Self(_mm256_loadu_ps(from)) }
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { _mm256_storeu_ps(to, self.0) }
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        unsafe { Self(_mm256_add_ps(self.0, other.0)) }
    }

    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        unsafe { Self(_mm256_sub_ps(self.0, other.0)) }
    }

    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        unsafe { Self(_mm256_mul_ps(self.0, other.0)) }
    }

    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        unsafe { Self(_mm256_div_ps(self.0, other.0)) }
    }

    #[inline(always)]
    unsafe fn mul_add(self, a: Self, b: Self) -> Self {
        unsafe { Self(_mm256_fmadd_ps(self.0, a.0, b.0)) }
    }

    #[inline(always)]
    unsafe fn neg_mul_add(self, b: Self, c: Self) -> Self {
        unsafe { Self(_mm256_fnmadd_ps(self.0, b.0, c.0)) }
    }

    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        // `vminps` answers with its second operand where one is a NaN or both are zeros. With
        // `self` in that place the result is what the trait promises: a NaN in `self` stays, one in
        // `other` does not come in.
        unsafe { Self(_mm256_min_ps(other.0, self.0)) }
    }

    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        unsafe { Self(_mm256_max_ps(other.0, self.0)) }
    }
}

// SAFETY (all functions): the traits' contract, AVX2, FMA and F16C enabled in the caller.
impl FunctionLanes for Avx2 {
    #[inline(always)]
    unsafe fn sqrt(self) -> Self {
        unsafe { Self(_mm256_sqrt_ps(self.0)) }
    }

    #[inline(always)]
    unsafe fn round(self) -> Self {
        unsafe {
            Self(_mm256_round_ps::<
                { _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC },
            >(self.0))
        }
    }

    #[inline(always)]
    unsafe fn scale_by_power(self, exponent: Self) -> Self {
        unsafe {
            // The power of two is written as a number: its biased exponent alone, with no mantissa.
            let biased = _mm256_add_epi32(_mm256_cvtps_epi32(exponent.0), _mm256_set1_epi32(127));
            let power = _mm256_castsi256_ps(_mm256_slli_epi32::<23>(biased));
            Self(_mm256_mul_ps(self.0, power))
        }
    }

    #[inline(always)]
    unsafe fn split(self) -> [Self; 2] {
        unsafe {
            // Bits of a positive number grow as the number does, and a step of one in the exponent
            // is a step of `2^23` in them. Counting such steps from the root of a half gives the
            // power.
            let bits = _mm256_castps_si256(self.0);
            let power =
                _mm256_srai_epi32::<23>(_mm256_sub_epi32(bits, _mm256_set1_epi32(ROOT_OF_HALF)));
            let rest = _mm256_sub_epi32(bits, _mm256_slli_epi32::<23>(power));
            [
                Self(_mm256_castsi256_ps(rest)),
                Self(_mm256_cvtepi32_ps(power)),
            ]
        }
    }

    #[inline(always)]
    unsafe fn below(self, limit: Self, then: Self, otherwise: Self) -> Self {
        unsafe {
            let mask = _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, limit.0);
            Self(_mm256_blendv_ps(otherwise.0, then.0, mask))
        }
    }

    #[inline(always)]
    unsafe fn all_below(self, limit: Self) -> bool {
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, limit.0)) == 0xFF }
    }
}

// SAFETY (all functions): the traits' contract, AVX2, FMA and F16C enabled in the caller.
impl DenseLanes for Avx2 {
    #[inline(always)]
    unsafe fn load_part(from: *const f32, count: usize) -> Self {
        unsafe { Self(_mm256_maskload_ps(from, first(count))) }
    }

    #[inline(always)]
    unsafe fn store_part(self, to: *mut f32, count: usize) {
        unsafe { _mm256_maskstore_ps(to, first(count), self.0) }
    }

    #[inline(always)]
    unsafe fn load_f16(from: *const half::f16) -> Self {
        unsafe { Self(_mm256_cvtph_ps(_mm_loadu_si128(from.cast()))) }
    }

    #[inline(always)]
    unsafe fn sums(four: [Self; 4]) -> [f32; 4] {
        unsafe {
            // `hadd` adds neighbours within each half: after two of them a half holds the four sums
            // of its lanes, and adding the halves gives
            // `((0 + 1) + (2 + 3)) + ((4 + 5) + (6 + 7))`.
            let [a, b, c, d] = four.map(|r| r.0);
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
            // The classic 8 x 8: pairs of rows, then pairs of pairs within the halves, then the
            // halves.
            let mut r = [_mm256_setzero_ps(); 8];
            for i in 0..8 {
                r[i] = _mm256_loadu_ps(from.add(row_offset[i]));
            }
            let mut s = r;
            for i in 0..4 {
                s[2 * i] = _mm256_unpacklo_ps(r[2 * i], r[2 * i + 1]);
                s[2 * i + 1] = _mm256_unpackhi_ps(r[2 * i], r[2 * i + 1]);
            }
            for i in 0..2 {
                let k = 4 * i;
                r[k] = _mm256_shuffle_ps::<0x44>(s[k], s[k + 2]);
                r[k + 1] = _mm256_shuffle_ps::<0xee>(s[k], s[k + 2]);
                r[k + 2] = _mm256_shuffle_ps::<0x44>(s[k + 1], s[k + 3]);
                r[k + 3] = _mm256_shuffle_ps::<0xee>(s[k + 1], s[k + 3]);
            }
            for i in 0..4 {
                let low = _mm256_permute2f128_ps::<0x20>(r[i], r[i + 4]);
                let high = _mm256_permute2f128_ps::<0x31>(r[i], r[i + 4]);
                _mm256_storeu_ps(to.add(i * stride), low);
                _mm256_storeu_ps(to.add((i + 4) * stride), high);
            }
        }
    }
}

// SAFETY (all functions): the traits' contract, AVX2, FMA and F16C enabled in the caller.
impl NodeLanes for Avx2 {
    #[inline(always)]
    unsafe fn bits_as_numbers(self) -> Self {
        unsafe { Self(_mm256_cvtepi32_ps(_mm256_castps_si256(self.0))) }
    }

    #[inline(always)]
    unsafe fn numbers_as_bits(self) -> Self {
        unsafe { Self(_mm256_castsi256_ps(_mm256_cvttps_epi32(self.0))) }
    }

    #[inline(always)]
    unsafe fn fourth(self) -> Self {
        unsafe { Self(_mm256_permute_ps(self.0, 0xFF)) }
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
            let xy01 = _mm256_unpacklo_ps(r0, r1);
            let xy23 = _mm256_unpacklo_ps(r2, r3);
            let zw01 = _mm256_unpackhi_ps(r0, r1);
            let zw23 = _mm256_unpackhi_ps(r2, r3);
            [
                Self(_mm256_shuffle_ps(xy01, xy23, 0x44)),
                Self(_mm256_shuffle_ps(xy01, xy23, 0xEE)),
                Self(_mm256_shuffle_ps(zw01, zw23, 0x44)),
                Self(_mm256_shuffle_ps(zw01, zw23, 0xEE)),
            ]
        }
    }

    #[inline(always)]
    unsafe fn scatter_add(nodes: *mut [f32; 4], index: *const u16, value: [Self; 3]) {
        unsafe {
            for (i, row) in forces(value).into_iter().enumerate() {
                add_rows(nodes, index, i, row);
            }
        }
    }

    #[inline(always)]
    unsafe fn scatter_add_in_order(nodes: *mut [f32; 4], index: *const u16, value: [Self; 3]) {
        unsafe {
            // All low halves before all high ones: elements 0 to 7 in their order, as lanes of four
            // have it.
            let rows = forces(value);
            for (i, row) in rows.into_iter().enumerate() {
                add_row(nodes, *index.add(i), _mm256_castps256_ps128(row));
            }
            for (i, row) in rows.into_iter().enumerate() {
                add_row(nodes, *index.add(4 + i), _mm256_extractf128_ps(row, 1));
            }
        }
    }
}
