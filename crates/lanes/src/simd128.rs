//! 128-bit lanes: SIMD of WebAssembly. A multiply-add rounds twice, so that the same module gives the same bits everywhere.
//!
//! The fused form of `relaxed-simd` may round once or twice as the browser likes, and software that
//! rounds once took 37 % of a step (docs/decisions/025-web.md). A module is compiled with simd128
//! or without; it cannot ask at run time, so there is nothing to detect.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: the module is compiled with the feature, and pointers hold what the shapes say"
)]

use super::{DenseLanes, FunctionLanes, Lanes, NodeLanes, ROOT_OF_HALF};
use core::arch::wasm32::*;

/// Four f32.
#[derive(Clone, Copy)]
pub struct Simd128(v128);

/// Transposes four rows to four columns, and back.
#[inline(always)]
fn transposed(rows: [v128; 4]) -> [v128; 4] {
    let a = i32x4_shuffle::<0, 4, 1, 5>(rows[0], rows[1]);
    let b = i32x4_shuffle::<2, 6, 3, 7>(rows[0], rows[1]);
    let c = i32x4_shuffle::<0, 4, 1, 5>(rows[2], rows[3]);
    let d = i32x4_shuffle::<2, 6, 3, 7>(rows[2], rows[3]);
    [
        i64x2_shuffle::<0, 2>(a, c),
        i64x2_shuffle::<1, 3>(a, c),
        i64x2_shuffle::<0, 2>(b, d),
        i64x2_shuffle::<1, 3>(b, d),
    ]
}

// SAFETY (all functions): the traits' contract; the module is compiled with the feature.
impl Lanes for Simd128 {
    const COUNT: usize = 4;
    const FUSED: bool = false;

    #[inline(always)]
    unsafe fn splat(x: f32) -> Self {
        Self(f32x4_splat(x))
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        unsafe { Self(v128_load(from.cast())) }
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { v128_store(to.cast(), self.0) }
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        Self(f32x4_add(self.0, other.0))
    }

    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        Self(f32x4_sub(self.0, other.0))
    }

    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        Self(f32x4_mul(self.0, other.0))
    }

    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        Self(f32x4_div(self.0, other.0))
    }

    #[inline(always)]
    unsafe fn mul_add(self, a: Self, b: Self) -> Self {
        Self(f32x4_add(f32x4_mul(self.0, a.0), b.0))
    }

    #[inline(always)]
    unsafe fn neg_mul_add(self, a: Self, b: Self) -> Self {
        Self(f32x4_sub(b.0, f32x4_mul(self.0, a.0)))
    }

    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        // `pmin` is `other < self ? other : self`, the trait's rule; the plain `min` lets any NaN
        // through.
        Self(f32x4_pmin(self.0, other.0))
    }

    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        Self(f32x4_pmax(self.0, other.0))
    }
}

// SAFETY (all functions): the traits' contract; the module is compiled with the feature.
impl FunctionLanes for Simd128 {
    #[inline(always)]
    unsafe fn sqrt(self) -> Self {
        Self(f32x4_sqrt(self.0))
    }

    #[inline(always)]
    unsafe fn round(self) -> Self {
        Self(f32x4_nearest(self.0))
    }

    #[inline(always)]
    unsafe fn scale_by_power(self, exponent: Self) -> Self {
        let biased = i32x4_add(i32x4_trunc_sat_f32x4(exponent.0), i32x4_splat(127));
        Self(f32x4_mul(self.0, i32x4_shl(biased, 23)))
    }

    #[inline(always)]
    unsafe fn split(self) -> [Self; 2] {
        let power = i32x4_shr(i32x4_sub(self.0, i32x4_splat(ROOT_OF_HALF)), 23);
        let rest = i32x4_sub(self.0, i32x4_shl(power, 23));
        [Self(rest), Self(f32x4_convert_i32x4(power))]
    }

    #[inline(always)]
    unsafe fn below(self, limit: Self, then: Self, otherwise: Self) -> Self {
        let mask = f32x4_lt(self.0, limit.0);
        Self(v128_bitselect(then.0, otherwise.0, mask))
    }

    #[inline(always)]
    unsafe fn all_below(self, limit: Self) -> bool {
        i32x4_all_true(f32x4_lt(self.0, limit.0))
    }
}

// SAFETY (all functions): the traits' contract; the module is compiled with the feature.
impl DenseLanes for Simd128 {
    #[inline(always)]
    unsafe fn load_part(from: *const f32, count: usize) -> Self {
        let mut lanes = [0.0f32; 4];
        unsafe {
            core::ptr::copy_nonoverlapping(from, lanes.as_mut_ptr(), count);
            Self::load(lanes.as_ptr())
        }
    }

    #[inline(always)]
    unsafe fn store_part(self, to: *mut f32, count: usize) {
        let mut lanes = [0.0f32; 4];
        unsafe {
            self.store(lanes.as_mut_ptr());
            core::ptr::copy_nonoverlapping(lanes.as_ptr(), to, count);
        }
    }

    /// One after another: no instruction widens. Tables are widened when they are opened.
    #[inline(always)]
    unsafe fn load_f16(from: *const half::f16) -> Self {
        let wide: [f32; 4] = core::array::from_fn(|i| unsafe { *from.add(i) }.to_f32());
        unsafe { Self::load(wide.as_ptr()) }
    }

    #[inline(always)]
    unsafe fn sums(four: [Self; 4]) -> [f32; 4] {
        let [a, b, c, d] = transposed(four.map(|r| r.0));
        let mut out = [0.0; 4];
        unsafe { Self(f32x4_add(f32x4_add(a, b), f32x4_add(c, d))).store(out.as_mut_ptr()) };
        out
    }

    #[inline(always)]
    unsafe fn transpose(from: *const f32, row_offset: &[usize], to: *mut f32, stride: usize) {
        let row = |i: usize| unsafe { v128_load(from.add(row_offset[i]).cast()) };
        let columns = transposed([row(0), row(1), row(2), row(3)]);
        for (i, column) in columns.into_iter().enumerate() {
            unsafe { v128_store(to.add(i * stride).cast(), column) };
        }
    }
}

// SAFETY (all functions): the traits' contract; the module is compiled with the feature.
impl NodeLanes for Simd128 {
    #[inline(always)]
    unsafe fn bits_as_numbers(self) -> Self {
        Self(f32x4_convert_i32x4(self.0))
    }

    #[inline(always)]
    unsafe fn numbers_as_bits(self) -> Self {
        Self(i32x4_trunc_sat_f32x4(self.0))
    }

    #[inline(always)]
    unsafe fn fourth(self) -> Self {
        Self(i32x4_shuffle::<3, 3, 3, 3>(self.0, self.0))
    }

    #[inline(always)]
    unsafe fn gather(nodes: *const [f32; 4], index: *const u16) -> [Self; 4] {
        let nodes = nodes.cast::<f64>();
        let row = |i: usize| unsafe { v128_load(nodes.add(*index.add(i) as usize).cast()) };
        transposed([row(0), row(1), row(2), row(3)]).map(Self)
    }

    #[inline(always)]
    unsafe fn scatter_add(nodes: *mut [f32; 4], index: *const u16, value: [Self; 3]) {
        let rows = transposed([value[0].0, value[1].0, value[2].0, value[2].0]);
        for (i, row) in rows.into_iter().enumerate() {
            unsafe {
                let node = nodes.cast::<f64>().add(*index.add(i) as usize);
                let target: *mut v128 = node.cast();
                v128_store(target, f32x4_add(v128_load(target), row));
            }
        }
    }
}
