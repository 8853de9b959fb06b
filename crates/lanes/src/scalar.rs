//! Plain arrays: the readable reference, and the fallback of any processor.
//!
//! What a function of the traits means is said best by its body here; the other files only say it
//! in the instructions of a set. `Scalar<16>` goes with a batch of elements, `Scalar<8>` with the
//! portable set on an x86-64 processor without AVX2, where it has the bits of [`crate::Portable`].
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: the instruction set is enabled in the caller, and pointers hold what the shapes say"
)]

use super::{DenseLanes, FunctionLanes, Lanes, NodeLanes, ROOT_OF_HALF, WIDTH};

/// `N` f32 in an array.
#[derive(Clone, Copy)]
pub struct Scalar<const N: usize = WIDTH>([f32; N]);

impl<const N: usize> Scalar<N> {
    /// `f` of the two numbers of each lane.
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }
}

// SAFETY (all functions): no instruction set beyond the target's baseline is used.
impl<const N: usize> Lanes for Scalar<N> {
    const COUNT: usize = N;
    const FUSED: bool = false;

    #[inline(always)]
    unsafe fn splat(value: f32) -> Self {
        Self([value; N])
    }

    #[inline(always)]
    unsafe fn load(source: *const f32) -> Self {
        Self(unsafe { source.cast::<[f32; N]>().read_unaligned() })
    }

    #[inline(always)]
    unsafe fn store(self, target: *mut f32) {
        unsafe { target.cast::<[f32; N]>().write_unaligned(self.0) }
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
        // Two roundings: `f32::mul_add` would be one, but a call of a function in software where
        // the target has no such instruction.
        self.zip(b, |x, y| x * y).zip(c, |x, y| x + y)
    }

    #[inline(always)]
    unsafe fn neg_mul_add(self, b: Self, c: Self) -> Self {
        self.zip(b, |x, y| x * y).zip(c, |x, y| y - x)
    }

    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        // Not `f32::min`, which drops a NaN in `self`: a NaN has to reach the guard that refuses
        // it.
        self.zip(other, |a, b| if b < a { b } else { a })
    }

    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if b > a { b } else { a })
    }
}

// SAFETY (all functions): no instruction set beyond the target's baseline is used.
impl<const N: usize> FunctionLanes for Scalar<N> {
    #[inline(always)]
    unsafe fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }

    #[inline(always)]
    unsafe fn round(self) -> Self {
        Self(self.0.map(f32::round_ties_even))
    }

    #[inline(always)]
    unsafe fn scale_by_power(self, exponent: Self) -> Self {
        self.zip(exponent, |x, e| {
            x * f32::from_bits(((e as i32 + 127) as u32) << 23)
        })
    }

    #[inline(always)]
    unsafe fn split(self) -> [Self; 2] {
        let power = |x: f32| (x.to_bits() as i32).wrapping_sub(ROOT_OF_HALF) >> 23;
        [
            Self(
                (self.0).map(|x| f32::from_bits(x.to_bits().wrapping_sub((power(x) << 23) as u32))),
            ),
            Self(self.0.map(|x| power(x) as f32)),
        ]
    }

    #[inline(always)]
    unsafe fn below(self, limit: Self, then: Self, otherwise: Self) -> Self {
        Self(std::array::from_fn(|i| {
            if self.0[i] < limit.0[i] {
                then.0[i]
            } else {
                otherwise.0[i]
            }
        }))
    }

    #[inline(always)]
    unsafe fn all_below(self, limit: Self) -> bool {
        (0..N).all(|i| self.0[i] < limit.0[i])
    }
}

// SAFETY (all functions): no instruction set beyond the target's baseline is used.
impl<const N: usize> DenseLanes for Scalar<N> {
    #[inline(always)]
    unsafe fn load_part(from: *const f32, count: usize) -> Self {
        let mut lanes = [0.0; N];
        unsafe { core::ptr::copy_nonoverlapping(from, lanes.as_mut_ptr(), count) };
        Self(lanes)
    }

    #[inline(always)]
    unsafe fn store_part(self, to: *mut f32, count: usize) {
        unsafe { core::ptr::copy_nonoverlapping(self.0.as_ptr(), to, count) }
    }

    #[inline(always)]
    unsafe fn load_f16(from: *const half::f16) -> Self {
        Self(std::array::from_fn(|i| unsafe { *from.add(i) }.to_f32()))
    }

    /// Neighbours first, then pairs of them, and so on: `((0 + 1) + (2 + 3)) + ((4 + 5) + (6 + 7))`.
    #[inline(always)]
    unsafe fn sums(four: [Self; 4]) -> [f32; 4] {
        four.map(|Self(mut lanes)| {
            let mut count = N;
            while count > 1 {
                count /= 2;
                for i in 0..count {
                    lanes[i] = lanes[2 * i] + lanes[2 * i + 1];
                }
            }
            lanes[0]
        })
    }

    #[inline(always)]
    unsafe fn transpose(from: *const f32, row_offset: &[usize], to: *mut f32, stride: usize) {
        for (i, offset) in row_offset[..N].iter().enumerate() {
            for j in 0..N {
                unsafe { *to.add(j * stride + i) = *from.add(offset + j) };
            }
        }
    }
}

// SAFETY (all functions): no instruction set beyond the target's baseline is used.
impl<const N: usize> NodeLanes for Scalar<N> {
    #[inline(always)]
    unsafe fn bits_as_numbers(self) -> Self {
        Self(self.0.map(|x| x.to_bits() as i32 as f32))
    }

    #[inline(always)]
    unsafe fn numbers_as_bits(self) -> Self {
        Self(self.0.map(|x| f32::from_bits(x as i32 as u32)))
    }

    #[inline(always)]
    unsafe fn fourth(self) -> Self {
        // Lane `4 g + 3` is the fourth component of the node that lanes `4 g ..= 4 g + 3` hold.
        Self(std::array::from_fn(|i| self.0[i | 3]))
    }

    #[inline(always)]
    unsafe fn gather(nodes: *const [f32; 4], index: *const u16) -> [Self; 4] {
        // An index counts half nodes and is always even.
        let values: [[f32; 4]; N] =
            std::array::from_fn(|i| unsafe { *nodes.add(*index.add(i) as usize / 2) });
        [0, 1, 2, 3].map(|axis| Self(std::array::from_fn(|i| values[i][axis])))
    }

    #[inline(always)]
    unsafe fn scatter_add(nodes: *mut [f32; 4], index: *const u16, value: [Self; 3]) {
        for i in 0..N {
            let node = unsafe { &mut *nodes.add(*index.add(i) as usize / 2) };
            for axis in 0..3 {
                node[axis] += value[axis].0[i];
            }
        }
    }
}
