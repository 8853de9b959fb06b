//! 128-bit lanes: Advanced SIMD of AArch64.
//!
//! The set has no masked loads, so parts of a register go through an array on the stack. It has
//! fused multiply-adds and an instruction for everything else that the traits ask for, but its own
//! minimum and maximum are not used here: they order the two zeros and let any NaN through, and
//! portable models, which compute with [`crate::Pair`] of these lanes, must give the bits of
//! x86-64.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: the instruction set is enabled in the caller, and pointers hold what the shapes say"
)]

use super::{DenseLanes, FunctionLanes, Lanes, NodeLanes, ROOT_OF_HALF};
use core::arch::aarch64::*;

/// Four f32.
#[derive(Clone, Copy)]
pub struct Neon(float32x4_t);

/// See [`FunctionLanes::split`].
#[inline(always)]
pub(super) unsafe fn split(x: float32x4_t) -> [float32x4_t; 2] {
    unsafe {
        let bits = vreinterpretq_s32_f32(x);
        let power = vshrq_n_s32::<23>(vsubq_s32(bits, vdupq_n_s32(ROOT_OF_HALF)));
        let rest = vsubq_s32(bits, vshlq_n_s32::<23>(power));
        [vreinterpretq_f32_s32(rest), vcvtq_f32_s32(power)]
    }
}

/// See [`FunctionLanes::scale_by_power`].
#[inline(always)]
pub(super) unsafe fn scale_by_power(x: float32x4_t, exponent: float32x4_t) -> float32x4_t {
    unsafe {
        let biased = vaddq_s32(vcvtq_s32_f32(exponent), vdupq_n_s32(127));
        vmulq_f32(x, vreinterpretq_f32_s32(vshlq_n_s32::<23>(biased)))
    }
}

/// Transposes four rows `[x y z w]` to columns, and back.
#[inline(always)]
pub(super) unsafe fn transpose(rows: [float32x4_t; 4]) -> [float32x4_t; 4] {
    unsafe {
        let a = vreinterpretq_f64_f32(vtrn1q_f32(rows[0], rows[1]));
        let b = vreinterpretq_f64_f32(vtrn2q_f32(rows[0], rows[1]));
        let c = vreinterpretq_f64_f32(vtrn1q_f32(rows[2], rows[3]));
        let d = vreinterpretq_f64_f32(vtrn2q_f32(rows[2], rows[3]));
        [
            vreinterpretq_f32_f64(vtrn1q_f64(a, c)),
            vreinterpretq_f32_f64(vtrn1q_f64(b, d)),
            vreinterpretq_f32_f64(vtrn2q_f64(a, c)),
            vreinterpretq_f32_f64(vtrn2q_f64(b, d)),
        ]
    }
}

// SAFETY (all functions): the traits' contract; NEON is part of every AArch64 target.
impl Lanes for Neon {
    const COUNT: usize = 4;
    const FUSED: bool = true;

    #[inline(always)]
    unsafe fn splat(x: f32) -> Self {
        unsafe { Self(vdupq_n_f32(x)) }
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        unsafe { Self(vld1q_f32(from)) }
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { vst1q_f32(to, self.0) }
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        unsafe { Self(vaddq_f32(self.0, other.0)) }
    }

    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        unsafe { Self(vsubq_f32(self.0, other.0)) }
    }

    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        unsafe { Self(vmulq_f32(self.0, other.0)) }
    }

    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        unsafe { Self(vdivq_f32(self.0, other.0)) }
    }

    #[inline(always)]
    unsafe fn mul_add(self, a: Self, b: Self) -> Self {
        unsafe { Self(vfmaq_f32(b.0, self.0, a.0)) }
    }

    #[inline(always)]
    unsafe fn neg_mul_add(self, a: Self, b: Self) -> Self {
        unsafe { Self(vfmsq_f32(b.0, self.0, a.0)) }
    }

    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        // Compare and select, as `other < self ? other : self`: a comparison with a NaN is false,
        // which keeps `self`, and equal zeros keep `self` too.
        unsafe { Self(vbslq_f32(vcltq_f32(other.0, self.0), other.0, self.0)) }
    }

    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        unsafe { Self(vbslq_f32(vcgtq_f32(other.0, self.0), other.0, self.0)) }
    }
}

// SAFETY (all functions): the traits' contract; NEON is part of every AArch64 target.
impl FunctionLanes for Neon {
    #[inline(always)]
    unsafe fn sqrt(self) -> Self {
        unsafe { Self(vsqrtq_f32(self.0)) }
    }

    #[inline(always)]
    unsafe fn round(self) -> Self {
        unsafe { Self(vrndnq_f32(self.0)) }
    }

    #[inline(always)]
    unsafe fn scale_by_power(self, exponent: Self) -> Self {
        unsafe { Self(scale_by_power(self.0, exponent.0)) }
    }

    #[inline(always)]
    unsafe fn split(self) -> [Self; 2] {
        unsafe {
            let [rest, power] = split(self.0);
            [Self(rest), Self(power)]
        }
    }

    #[inline(always)]
    unsafe fn below(self, limit: Self, then: Self, otherwise: Self) -> Self {
        unsafe { Self(vbslq_f32(vcltq_f32(self.0, limit.0), then.0, otherwise.0)) }
    }

    #[inline(always)]
    unsafe fn all_below(self, limit: Self) -> bool {
        unsafe { vminvq_u32(vcltq_f32(self.0, limit.0)) == u32::MAX }
        // A lane of the mask is all ones or zero, so the least of them says whether all hold.
    }
}

// SAFETY (all functions): the traits' contract; NEON is part of every AArch64 target.
impl DenseLanes for Neon {
    #[inline(always)]
    unsafe fn load_part(from: *const f32, count: usize) -> Self {
        let mut lanes = [0.0f32; 4];
        unsafe {
            core::ptr::copy_nonoverlapping(from, lanes.as_mut_ptr(), count);
            Self(vld1q_f32(lanes.as_ptr()))
        }
    }

    #[inline(always)]
    unsafe fn store_part(self, to: *mut f32, count: usize) {
        let mut lanes = [0.0f32; 4];
        unsafe {
            vst1q_f32(lanes.as_mut_ptr(), self.0);
            core::ptr::copy_nonoverlapping(lanes.as_ptr(), to, count);
        }
    }

    #[inline(always)]
    unsafe fn load_f16(from: *const half::f16) -> Self {
        unsafe {
            // Inline assembly, since the intrinsic for this instruction takes Rust's own type
            // `f16`, which a stable compiler does not have. Every AArch64 has `fcvtl`, and it is
            // exact.
            let bits = vld1_u16(from.cast());
            let wide: float32x4_t;
            core::arch::asm!(
                "fcvtl {wide:v}.4s, {bits:v}.4h",
                wide = lateout(vreg) wide,
                bits = in(vreg) bits,
                options(pure, nomem, nostack, preserves_flags)
            );
            Self(wide)
        }
    }

    #[inline(always)]
    unsafe fn sums(four: [Self; 4]) -> [f32; 4] {
        unsafe {
            // Pairwise additions: `(0 + 1) + (2 + 3)` of each register, the lower half of AVX2's
            // tree.
            let [a, b, c, d] = four.map(|r| r.0);
            let sum = vpaddq_f32(vpaddq_f32(a, b), vpaddq_f32(c, d));
            let mut out = [0.0; 4];
            vst1q_f32(out.as_mut_ptr(), sum);
            out
        }
    }

    #[inline(always)]
    unsafe fn transpose(from: *const f32, row_offset: &[usize], to: *mut f32, stride: usize) {
        unsafe {
            let r0 = vld1q_f32(from.add(row_offset[0]));
            let r1 = vld1q_f32(from.add(row_offset[1]));
            let r2 = vld1q_f32(from.add(row_offset[2]));
            let r3 = vld1q_f32(from.add(row_offset[3]));
            let a = vreinterpretq_f64_f32(vtrn1q_f32(r0, r1));
            let b = vreinterpretq_f64_f32(vtrn2q_f32(r0, r1));
            let c = vreinterpretq_f64_f32(vtrn1q_f32(r2, r3));
            let d = vreinterpretq_f64_f32(vtrn2q_f32(r2, r3));
            vst1q_f32(to, vreinterpretq_f32_f64(vtrn1q_f64(a, c)));
            vst1q_f32(to.add(stride), vreinterpretq_f32_f64(vtrn1q_f64(b, d)));
            vst1q_f32(to.add(2 * stride), vreinterpretq_f32_f64(vtrn2q_f64(a, c)));
            vst1q_f32(to.add(3 * stride), vreinterpretq_f32_f64(vtrn2q_f64(b, d)));
        }
    }
}

// SAFETY (all functions): the traits' contract; NEON is part of every AArch64 target.
impl NodeLanes for Neon {
    #[inline(always)]
    unsafe fn bits_as_numbers(self) -> Self {
        unsafe { Self(vcvtq_f32_s32(vreinterpretq_s32_f32(self.0))) }
    }

    #[inline(always)]
    unsafe fn numbers_as_bits(self) -> Self {
        unsafe { Self(vreinterpretq_f32_s32(vcvtq_s32_f32(self.0))) }
    }

    #[inline(always)]
    unsafe fn fourth(self) -> Self {
        unsafe { Self(vdupq_laneq_f32::<3>(self.0)) }
    }

    #[inline(always)]
    unsafe fn gather(nodes: *const [f32; 4], index: *const u16) -> [Self; 4] {
        unsafe {
            let nodes = nodes.cast::<f64>();
            let mut rows = [vdupq_n_f32(0.0); 4];
            for (i, row) in rows.iter_mut().enumerate() {
                *row = vld1q_f32(nodes.add(*index.add(i) as usize).cast());
            }
            let [x, y, z, w] = transpose(rows);
            [Self(x), Self(y), Self(z), Self(w)]
        }
    }

    #[inline(always)]
    unsafe fn scatter_add(nodes: *mut [f32; 4], index: *const u16, value: [Self; 3]) {
        unsafe {
            // The fourth row of the transpose may be anything; `z` again saves a register of zeros.
            let nodes = nodes.cast::<f64>();
            let rows = transpose([value[0].0, value[1].0, value[2].0, value[2].0]);
            for (i, row) in rows.into_iter().enumerate() {
                let target: *mut f32 = nodes.add(*index.add(i) as usize).cast();
                vst1q_f32(target, vaddq_f32(vld1q_f32(target), row));
            }
        }
    }
}
