//! Four registers of Advanced SIMD as one.
//!
//! Elements of a mesh come in batches of [`WIDTH`], and this type takes a whole batch. The four
//! parts do not depend on each other, so a core with several vector units works on all of them
//! while one waits for its result. Loops over the parts are written out where the compiler would
//! otherwise keep the array in memory. The type serves the elements alone: it has no
//! [`super::DenseLanes`], and its minimum and maximum are the instructions of the set, which order
//! zeros and let a NaN of either side through; portable models do not compute with it.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: the instruction set is enabled in the caller, and pointers hold what the shapes say"
)]

use super::neon::{scale_by_power, split, transpose};
use super::{FunctionLanes, Lanes, NodeLanes, WIDTH};
use core::arch::aarch64::*;

/// Sixteen f32 in four registers.
#[derive(Clone, Copy)]
pub struct NeonFour([float32x4_t; 4]);

// SAFETY (all functions): the traits' contract; NEON is part of every AArch64 target.
impl Lanes for NeonFour {
    const COUNT: usize = WIDTH;
    const FUSED: bool = true;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        unsafe { Self([vdupq_n_f32(value); 4]) }
    }

    #[inline(always)]
    unsafe fn load(source: *const f32) -> Self {
        unsafe {
            Self([
                vld1q_f32(source),
                vld1q_f32(source.add(4)),
                vld1q_f32(source.add(8)),
                vld1q_f32(source.add(12)),
            ])
        }
    }

    #[inline(always)]
    unsafe fn store(self, target: *mut f32) {
        for i in 0..4 {
            unsafe { vst1q_f32(target.add(4 * i), self.0[i]) }
        }
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        unsafe {
            Self([
                vaddq_f32(self.0[0], other.0[0]),
                vaddq_f32(self.0[1], other.0[1]),
                vaddq_f32(self.0[2], other.0[2]),
                vaddq_f32(self.0[3], other.0[3]),
            ])
        }
    }

    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        unsafe {
            Self([
                vsubq_f32(self.0[0], other.0[0]),
                vsubq_f32(self.0[1], other.0[1]),
                vsubq_f32(self.0[2], other.0[2]),
                vsubq_f32(self.0[3], other.0[3]),
            ])
        }
    }

    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        unsafe {
            Self([
                vmulq_f32(self.0[0], other.0[0]),
                vmulq_f32(self.0[1], other.0[1]),
                vmulq_f32(self.0[2], other.0[2]),
                vmulq_f32(self.0[3], other.0[3]),
            ])
        }
    }

    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        unsafe {
            Self([
                vdivq_f32(self.0[0], other.0[0]),
                vdivq_f32(self.0[1], other.0[1]),
                vdivq_f32(self.0[2], other.0[2]),
                vdivq_f32(self.0[3], other.0[3]),
            ])
        }
    }

    #[inline(always)]
    unsafe fn mul_add(self, b: Self, c: Self) -> Self {
        unsafe {
            Self([
                vfmaq_f32(c.0[0], self.0[0], b.0[0]),
                vfmaq_f32(c.0[1], self.0[1], b.0[1]),
                vfmaq_f32(c.0[2], self.0[2], b.0[2]),
                vfmaq_f32(c.0[3], self.0[3], b.0[3]),
            ])
        }
    }

    #[inline(always)]
    unsafe fn neg_mul_add(self, b: Self, c: Self) -> Self {
        unsafe {
            Self([
                vfmsq_f32(c.0[0], self.0[0], b.0[0]),
                vfmsq_f32(c.0[1], self.0[1], b.0[1]),
                vfmsq_f32(c.0[2], self.0[2], b.0[2]),
                vfmsq_f32(c.0[3], self.0[3], b.0[3]),
            ])
        }
    }

    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        unsafe {
            Self([
                vminq_f32(self.0[0], other.0[0]),
                vminq_f32(self.0[1], other.0[1]),
                vminq_f32(self.0[2], other.0[2]),
                vminq_f32(self.0[3], other.0[3]),
            ])
        }
    }

    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        unsafe {
            Self([
                vmaxq_f32(self.0[0], other.0[0]),
                vmaxq_f32(self.0[1], other.0[1]),
                vmaxq_f32(self.0[2], other.0[2]),
                vmaxq_f32(self.0[3], other.0[3]),
            ])
        }
    }
}

// SAFETY (all functions): the traits' contract; NEON is part of every AArch64 target.
impl FunctionLanes for NeonFour {
    #[inline(always)]
    unsafe fn sqrt(self) -> Self {
        let mut parts = self.0;
        for part in &mut parts {
            unsafe { *part = vsqrtq_f32(*part) }
        }
        Self(parts)
    }

    #[inline(always)]
    unsafe fn round(self) -> Self {
        let mut parts = self.0;
        for part in &mut parts {
            unsafe { *part = vrndnq_f32(*part) }
        }
        Self(parts)
    }

    #[inline(always)]
    unsafe fn scale_by_power(self, exponent: Self) -> Self {
        let mut parts = self.0;
        for i in 0..4 {
            unsafe { parts[i] = scale_by_power(parts[i], exponent.0[i]) }
        }
        Self(parts)
    }

    #[inline(always)]
    unsafe fn split(self) -> [Self; 2] {
        let (mut rest, mut power) = (self.0, self.0);
        for i in 0..4 {
            unsafe { [rest[i], power[i]] = split(self.0[i]) }
        }
        [Self(rest), Self(power)]
    }

    #[inline(always)]
    unsafe fn below(self, limit: Self, then: Self, otherwise: Self) -> Self {
        let mut parts = self.0;
        for i in 0..4 {
            unsafe {
                let mask = vcltq_f32(self.0[i], limit.0[i]);
                parts[i] = vbslq_f32(mask, then.0[i], otherwise.0[i]);
            }
        }
        Self(parts)
    }

    #[inline(always)]
    unsafe fn all_below(self, limit: Self) -> bool {
        let mut all = true;
        for i in 0..4 {
            all &= unsafe { vminvq_u32(vcltq_f32(self.0[i], limit.0[i])) == u32::MAX };
        }
        all
    }
}

// SAFETY (all functions): the traits' contract; NEON is part of every AArch64 target.
impl NodeLanes for NeonFour {
    #[inline(always)]
    unsafe fn bits_as_numbers(self) -> Self {
        let mut parts = self.0;
        for part in &mut parts {
            unsafe { *part = vcvtq_f32_s32(vreinterpretq_s32_f32(*part)) }
        }
        Self(parts)
    }

    #[inline(always)]
    unsafe fn numbers_as_bits(self) -> Self {
        let mut parts = self.0;
        for part in &mut parts {
            unsafe { *part = vreinterpretq_f32_s32(vcvtq_s32_f32(*part)) }
        }
        Self(parts)
    }

    #[inline(always)]
    unsafe fn fourth(self) -> Self {
        unsafe {
            Self([
                vdupq_laneq_f32::<3>(self.0[0]),
                vdupq_laneq_f32::<3>(self.0[1]),
                vdupq_laneq_f32::<3>(self.0[2]),
                vdupq_laneq_f32::<3>(self.0[3]),
            ])
        }
    }

    #[inline(always)]
    unsafe fn gather(nodes: *const [f32; 4], index: *const u16) -> [Self; 4] {
        unsafe {
            let mut axes = [[vdupq_n_f32(0.0); 4]; 4];
            for part in 0..4 {
                let mut rows = [vdupq_n_f32(0.0); 4];
                for (i, row) in rows.iter_mut().enumerate() {
                    *row = vld1q_f32(
                        nodes
                            .cast::<f64>()
                            .add(*index.add(4 * part + i) as usize)
                            .cast(),
                    );
                }
                let columns = transpose(rows);
                for axis in 0..4 {
                    axes[axis][part] = columns[axis];
                }
            }
            [Self(axes[0]), Self(axes[1]), Self(axes[2]), Self(axes[3])]
        }
    }

    #[inline(always)]
    unsafe fn scatter_add(nodes: *mut [f32; 4], index: *const u16, value: [Self; 3]) {
        unsafe {
            for part in 0..4 {
                let rows = transpose([
                    value[0].0[part],
                    value[1].0[part],
                    value[2].0[part],
                    value[2].0[part],
                ]);
                for (i, row) in rows.into_iter().enumerate() {
                    let target: *mut f32 = nodes
                        .cast::<f64>()
                        .add(*index.add(4 * part + i) as usize)
                        .cast();
                    vst1q_f32(target, vaddq_f32(vld1q_f32(target), row));
                }
            }
        }
    }
}
