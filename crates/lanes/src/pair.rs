//! Two registers as one, of twice the lanes: eight where the machine has four.
//!
//! [`crate::Isa::Portable`] is eight lanes on every machine, because the number of lanes decides
//! how a sum is split up and hence its last bits. On AArch64 and in WebAssembly a register has
//! four, and two of them make a pair. Lane `i` of the pair is lane `i` of the first register for
//! `i < 4` and lane `i - 4` of the second one otherwise, in memory and in every function.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "one contract for all: that of the lanes within"
)]

use super::{DenseLanes, FunctionLanes, Lanes, NodeLanes, load_some, store_some};

/// The first half of the lanes, and the second.
#[derive(Clone, Copy)]
pub struct Pair<L>(L, L);

/// Functions of each lane alone: the pair's result is that of the first halves and that of the
/// second halves, and no lane meets one of the other register.
macro_rules! by_half {
    ($(fn $name:ident(self $(, $with:ident)*);)*) => {
        $(
            #[inline(always)]
            unsafe fn $name(self $(, $with: Self)*) -> Self {
                unsafe { Self(self.0.$name($($with.0),*), self.1.$name($($with.1),*)) }
            }
        )*
    };
}

// SAFETY (all functions): that of the lanes within.
impl<L: Lanes> Lanes for Pair<L> {
    const COUNT: usize = 2 * L::COUNT;
    const FUSED: bool = L::FUSED;

    #[inline(always)]
    unsafe fn splat(x: f32) -> Self {
        unsafe { Self(L::splat(x), L::splat(x)) }
    }

    #[inline(always)]
    unsafe fn load(from: *const f32) -> Self {
        unsafe { Self(L::load(from), L::load(from.add(L::COUNT))) }
    }

    #[inline(always)]
    unsafe fn store(self, to: *mut f32) {
        unsafe {
            self.0.store(to);
            self.1.store(to.add(L::COUNT));
        }
    }

    by_half! {
        fn add(self, other);
        fn sub(self, other);
        fn mul(self, other);
        fn div(self, other);
        fn mul_add(self, a, b);
        fn neg_mul_add(self, a, b);
        fn min(self, other);
        fn max(self, other);
    }
}

// SAFETY (all functions): that of the lanes within.
impl<L: FunctionLanes> FunctionLanes for Pair<L> {
    by_half! {
        fn sqrt(self);
        fn round(self);
        fn scale_by_power(self, exponent);
        fn below(self, limit, then, otherwise);
    }

    #[inline(always)]
    unsafe fn split(self) -> [Self; 2] {
        unsafe {
            let ([rest0, power0], [rest1, power1]) = (self.0.split(), self.1.split());
            [Self(rest0, rest1), Self(power0, power1)]
        }
    }

    #[inline(always)]
    unsafe fn all_below(self, limit: Self) -> bool {
        unsafe { self.0.all_below(limit.0) && self.1.all_below(limit.1) }
    }
}

// SAFETY (all functions): that of the lanes within.
impl<L: DenseLanes> DenseLanes for Pair<L> {
    #[inline(always)]
    unsafe fn load_part(from: *const f32, count: usize) -> Self {
        unsafe {
            // A whole first half needs the full load, since `load_part` is for fewer lanes than a
            // register has; [`load_some`] chooses.
            let first = count.min(L::COUNT);
            let second = match count > first {
                true => load_some(from.add(first), count - first),
                false => L::splat(0.0),
            };
            Self(load_some(from, first), second)
        }
    }

    #[inline(always)]
    unsafe fn store_part(self, to: *mut f32, count: usize) {
        unsafe {
            let first = count.min(L::COUNT);
            store_some(self.0, to, first);
            if count > first {
                store_some(self.1, to.add(first), count - first);
            }
        }
    }

    #[inline(always)]
    unsafe fn load_f16(from: *const half::f16) -> Self {
        unsafe { Self(L::load_f16(from), L::load_f16(from.add(L::COUNT))) }
    }

    #[inline(always)]
    unsafe fn sums(four: [Self; 4]) -> [f32; 4] {
        unsafe {
            // Each half by its own tree, then the two: with four lanes a half this is AVX2's tree
            // over eight, to the bit.
            let [a, b, c, d] = four;
            let first = L::sums([a.0, b.0, c.0, d.0]);
            let second = L::sums([a.1, b.1, c.1, d.1]);
            let mut out = first;
            for i in 0..4 {
                out[i] += second[i];
            }
            out
        }
    }

    #[inline(always)]
    unsafe fn transpose(from: *const f32, row_offset: &[usize], to: *mut f32, stride: usize) {
        unsafe {
            // Four blocks of half the size: rows of the first and second half, by columns of the
            // first and second half.
            let half = L::COUNT;
            for (rows, to) in [
                (&row_offset[..half], to),
                (&row_offset[half..], to.add(half)),
            ] {
                L::transpose(from, rows, to, stride);
                L::transpose(from.add(half), rows, to.add(half * stride), stride);
            }
        }
    }
}

// SAFETY (all functions): that of the lanes within.
impl<L: NodeLanes> NodeLanes for Pair<L> {
    by_half! {
        fn bits_as_numbers(self);
        fn numbers_as_bits(self);
        fn fourth(self);
    }

    #[inline(always)]
    unsafe fn gather(nodes: *const [f32; 4], index: *const u16) -> [Self; 4] {
        unsafe {
            let [x0, y0, z0, w0] = L::gather(nodes, index);
            let [x1, y1, z1, w1] = L::gather(nodes, index.add(L::COUNT));
            [Self(x0, x1), Self(y0, y1), Self(z0, z1), Self(w0, w1)]
        }
    }

    #[inline(always)]
    unsafe fn scatter_add(nodes: *mut [f32; 4], index: *const u16, value: [Self; 3]) {
        unsafe {
            // The first half has been added before the second is loaded, so an element of the
            // second half that shares a node sees the sum.
            let [x, y, z] = value;
            L::scatter_add(nodes, index, [x.0, y.0, z.0]);
            L::scatter_add(nodes, index.add(L::COUNT), [x.1, y.1, z.1]);
        }
    }
}
