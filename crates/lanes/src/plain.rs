//! Lanes whose multiply-add rounds twice, as on a machine that has no such instruction, and that scatter in the order of the elements.
//!
//! What [`crate::Isa::Portable`] computes with: eight lanes, whatever the machine has ([`crate::Pair`], [`crate::Scalar`]). All that these traits
//! do besides is exact or rounded as IEEE 754 says, so the bits are the same on every set.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: that of the lanes within"
)]

use super::{DenseLanes, FunctionLanes, Lanes, NodeLanes};

/// `L` without fused multiply-adds. The wrapper has the layout of a register and disappears when it
/// is compiled: what remains is a product and a sum where the inner lanes have one instruction.
#[derive(Clone, Copy)]
pub struct Plain<L>(L);

/// Functions that IEEE 754 defines to the bit, or that move lanes about: those of the lanes within.
macro_rules! as_within {
    ($(fn $name:ident(self $(, $with:ident)*);)*) => {
        $(
            #[inline(always)]
            unsafe fn $name(self $(, $with: Self)*) -> Self {
                unsafe { Self(self.0.$name($($with.0),*)) }
            }
        )*
    };
}

// SAFETY (all functions): that of the lanes within.
impl<L: Lanes> Lanes for Plain<L> {
    const COUNT: usize = L::COUNT;
    const FUSED: bool = false;

    #[inline(always)]
    unsafe fn splat(x: f32) -> Self {
        unsafe { Self(L::splat(x)) }
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        unsafe { Self(L::load(from)) }
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe { self.0.store(to) }
    }

    as_within! {
        fn add(self, other);
        fn sub(self, other);
        fn mul(self, other);
        fn div(self, other);
        fn min(self, other);
        fn max(self, other);
    }

    #[inline(always)]
    unsafe fn mul_add(self, a: Self, b: Self) -> Self {
        // Rust never contracts a product and a sum by itself, so the product is rounded here on
        // every machine. It is why these are two calls and must stay so.
        unsafe { Self(self.0.mul(a.0).add(b.0)) }
    }

    #[inline(always)]
    unsafe fn neg_mul_add(self, a: Self, b: Self) -> Self {
        unsafe { Self(b.0.sub(self.0.mul(a.0))) }
    }
}

// SAFETY (all functions): that of the lanes within.
impl<L: FunctionLanes> FunctionLanes for Plain<L> {
    as_within! {
        fn sqrt(self);
        fn round(self);
        fn scale_by_power(self, exponent);
        fn below(self, limit, then, otherwise);
    }

    #[inline(always)]
    unsafe fn split(self) -> [Self; 2] {
        unsafe {
            let [rest, power] = self.0.split();
            [Self(rest), Self(power)]
        }
    }

    #[inline(always)]
    unsafe fn all_below(self, limit: Self) -> bool {
        unsafe { self.0.all_below(limit.0) }
    }
}

// SAFETY (all functions): that of the lanes within.
impl<L: DenseLanes> DenseLanes for Plain<L> {
    #[inline(always)]
    unsafe fn load_part(from: *const f32, count: usize) -> Self {
        unsafe { Self(L::load_part(from, count)) }
    }

    #[inline(always)]
    unsafe fn store_part(self, to: *mut f32, count: usize) {
        unsafe { self.0.store_part(to, count) }
    }

    #[inline(always)]
    unsafe fn load_f16(from: *const half::f16) -> Self {
        unsafe { Self(L::load_f16(from)) }
    }

    #[inline(always)]
    unsafe fn sums(four: [Self; 4]) -> [f32; 4] {
        let [a, b, c, d] = four;
        unsafe { L::sums([a.0, b.0, c.0, d.0]) }
    }

    #[inline(always)]
    unsafe fn transpose(from: *const f32, row_offset: &[usize], to: *mut f32, stride: usize) {
        unsafe { L::transpose(from, row_offset, to, stride) }
    }
}

// SAFETY (all functions): that of the lanes within.
impl<L: NodeLanes> NodeLanes for Plain<L> {
    #[inline(always)]
    unsafe fn bits_as_numbers(self) -> Self {
        unsafe { Self(self.0.bits_as_numbers()) }
    }

    #[inline(always)]
    unsafe fn numbers_as_bits(self) -> Self {
        unsafe { Self(self.0.numbers_as_bits()) }
    }

    #[inline(always)]
    unsafe fn fourth(self) -> Self {
        unsafe { Self(self.0.fourth()) }
    }

    #[inline(always)]
    unsafe fn gather(nodes: *const [f32; 4], index: *const u16) -> [Self; 4] {
        unsafe {
            let [x, y, z, w] = L::gather(nodes, index);
            [Self(x), Self(y), Self(z), Self(w)]
        }
    }

    #[inline(always)]
    unsafe fn scatter_add(nodes: *mut [f32; 4], index: *const u16, value: [Self; 3]) {
        // In the order of the elements: nodes that several elements share add up the same way on
        // sets of four lanes and of eight.
        let [x, y, z] = value;
        unsafe { L::scatter_add_in_order(nodes, index, [x.0, y.0, z.0]) }
    }
}
