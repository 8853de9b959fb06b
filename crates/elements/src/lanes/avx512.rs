//! AVX-512F: one register of 16 lanes; gathers are 128-bit loads and in-register transposes.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: the instruction set is enabled in the caller, and pointers hold what the shapes say"
)]

use super::avx2::{add_row, row};
use super::{CUBE_ROOT_GUESS, Lanes, WIDTH};
use std::arch::x86_64::*;

#[derive(Clone, Copy)]
pub struct Avx512(__m512);

/// Rows `i`, `i + 4`, `i + 8`, `i + 12` in the four 128-bit parts.
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

// SAFETY: see the trait; all intrinsics are AVX-512F.
impl Lanes for Avx512 {
    const COUNT: usize = WIDTH;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        unsafe { Self(_mm512_set1_ps(value)) }
    }

    #[inline(always)]
    unsafe fn load(source: *const f32) -> Self {
        unsafe { Self(_mm512_loadu_ps(source)) }
    }

    #[inline(always)]
    unsafe fn store(self, target: *mut f32) {
        unsafe { _mm512_storeu_ps(target, self.0) }
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
    unsafe fn mul_add(self, b: Self, c: Self) -> Self {
        unsafe { Self(_mm512_fmadd_ps(self.0, b.0, c.0)) }
    }

    #[inline(always)]
    unsafe fn neg_mul_add(self, b: Self, c: Self) -> Self {
        unsafe { Self(_mm512_fnmadd_ps(self.0, b.0, c.0)) }
    }

    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        unsafe { Self(_mm512_min_ps(self.0, other.0)) }
    }

    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        unsafe { Self(_mm512_max_ps(self.0, other.0)) }
    }

    #[inline(always)]
    unsafe fn inverse_cube_root_guess(self) -> Self {
        unsafe {
            let bits = _mm512_cvtepi32_ps(_mm512_castps_si512(self.0));
            let guess = _mm512_fnmadd_ps(
                bits,
                _mm512_set1_ps(1.0 / 3.0),
                _mm512_set1_ps(CUBE_ROOT_GUESS),
            );
            Self(_mm512_castsi512_ps(_mm512_cvttps_epi32(guess)))
        }
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
