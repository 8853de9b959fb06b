//! Plain arrays: the readable reference, and the fallback of any processor.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: the instruction set is enabled in the caller, and pointers hold what the shapes say"
)]

use super::{CUBE_ROOT_GUESS, Lanes, NodeLanes, WIDTH};

/// Sixteen f32 in an array.
#[derive(Clone, Copy)]
pub struct Scalar([f32; WIDTH]);

impl Scalar {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

// SAFETY (all functions): no instruction set beyond the target's baseline is used.
impl Lanes for Scalar {
    const COUNT: usize = WIDTH;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Self([value; WIDTH])
    }

    #[inline(always)]
    unsafe fn load(source: *const f32) -> Self {
        Self(unsafe { source.cast::<[f32; WIDTH]>().read_unaligned() })
    }

    #[inline(always)]
    unsafe fn store(self, target: *mut f32) {
        unsafe { target.cast::<[f32; WIDTH]>().write_unaligned(self.0) }
    }

    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }

    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }

    #[inline(always)]
    unsafe fn mul_add(self, b: Self, c: Self) -> Self {
        self.zip(b, |x, y| x * y).zip(c, |x, y| x + y)
    }

    #[inline(always)]
    unsafe fn neg_mul_add(self, b: Self, c: Self) -> Self {
        self.zip(b, |x, y| x * y).zip(c, |x, y| y - x)
    }

    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if b < a { b } else { a })
    }

    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if b > a { b } else { a })
    }
}

// SAFETY (all functions): no instruction set beyond the target's baseline is used.
impl NodeLanes for Scalar {
    #[inline(always)]
    unsafe fn inverse_cube_root_guess(self) -> Self {
        Self(self.0.map(|x| {
            let bits = CUBE_ROOT_GUESS - x.to_bits() as i32 as f32 * (1.0 / 3.0);
            f32::from_bits(bits as i32 as u32)
        }))
    }

    #[inline(always)]
    unsafe fn fourth(self) -> Self {
        Self(std::array::from_fn(|i| self.0[i | 3]))
    }

    #[inline(always)]
    unsafe fn gather(nodes: *const [f32; 4], index: *const u16) -> [Self; 4] {
        let values: [[f32; 4]; WIDTH] =
            std::array::from_fn(|i| unsafe { *nodes.add(*index.add(i) as usize / 2) });
        [0, 1, 2, 3].map(|axis| Self(std::array::from_fn(|i| values[i][axis])))
    }

    #[inline(always)]
    unsafe fn scatter_add(nodes: *mut [f32; 4], index: *const u16, value: [Self; 3]) {
        for i in 0..WIDTH {
            let node = unsafe { &mut *nodes.add(*index.add(i) as usize / 2) };
            for axis in 0..3 {
                node[axis] += value[axis].0[i];
            }
        }
    }
}
