//! AVX2 and FMA: one register of 8 lanes.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: the instruction set is enabled in the caller, and pointers hold what the shapes say"
)]

use super::{CUBE_ROOT_GUESS, Lanes};
use std::arch::x86_64::*;

#[derive(Clone, Copy)]
pub struct Avx2(__m256);

/// One node.
#[inline(always)]
pub unsafe fn row(nodes: *const [f32; 4], index: u16) -> __m128 {
    unsafe { _mm_loadu_ps(nodes.cast::<f64>().add(index as usize).cast()) }
}

/// Adds to one node.
#[inline(always)]
pub unsafe fn add_row(nodes: *mut [f32; 4], index: u16, value: __m128) {
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

// SAFETY: see the trait; all intrinsics are AVX2 or FMA.
impl Lanes for Avx2 {
    const COUNT: usize = 8;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        unsafe { Self(_mm256_set1_ps(value)) }
    }

    #[inline(always)]
    unsafe fn load(source: *const f32) -> Self {
        unsafe { Self(_mm256_loadu_ps(source)) }
    }

    #[inline(always)]
    unsafe fn store(self, target: *mut f32) {
        unsafe { _mm256_storeu_ps(target, self.0) }
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
    unsafe fn mul_add(self, b: Self, c: Self) -> Self {
        unsafe { Self(_mm256_fmadd_ps(self.0, b.0, c.0)) }
    }

    #[inline(always)]
    unsafe fn neg_mul_add(self, b: Self, c: Self) -> Self {
        unsafe { Self(_mm256_fnmadd_ps(self.0, b.0, c.0)) }
    }

    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        unsafe { Self(_mm256_min_ps(self.0, other.0)) }
    }

    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        unsafe { Self(_mm256_max_ps(self.0, other.0)) }
    }

    #[inline(always)]
    unsafe fn inverse_cube_root_guess(self) -> Self {
        unsafe {
            let bits = _mm256_cvtepi32_ps(_mm256_castps_si256(self.0));
            let guess = _mm256_fnmadd_ps(
                bits,
                _mm256_set1_ps(1.0 / 3.0),
                _mm256_set1_ps(CUBE_ROOT_GUESS),
            );
            Self(_mm256_castsi256_ps(_mm256_cvttps_epi32(guess)))
        }
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
            let [Self(x), Self(y), Self(z)] = value;
            let xy01 = _mm256_unpacklo_ps(x, y);
            let xy23 = _mm256_unpackhi_ps(x, y);
            add_rows(nodes, index, 0, _mm256_shuffle_ps(xy01, z, 0x04));
            add_rows(nodes, index, 1, _mm256_shuffle_ps(xy01, z, 0x5E));
            add_rows(nodes, index, 2, _mm256_shuffle_ps(xy23, z, 0xA4));
            add_rows(nodes, index, 3, _mm256_shuffle_ps(xy23, z, 0xFE));
        }
    }
}
