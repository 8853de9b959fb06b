//! One vector register of f32, as the kernels see it: the same body compiles for AVX2 (8 lanes),
//! AVX-512 (16) and NEON (4).
//!
//! Every function is unsafe for one reason: the instruction set must be enabled in the function
//! that it is inlined into (the `by_isa!` macro sees to that), and pointers must be valid
//! for the lanes they name.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "aarch64")]
mod neon;

#[cfg(target_arch = "x86_64")]
pub(crate) use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
pub(crate) use avx512::Avx512;
#[cfg(target_arch = "aarch64")]
pub(crate) use neon::Neon;

/// Arithmetic on `N` f32 lanes.
///
/// # Safety
/// All functions need the instruction set of the implementing type; pointers need not be aligned.
#[allow(clippy::missing_safety_doc)]
pub(crate) trait Lanes: Copy {
    /// Lanes of a register.
    const N: usize;

    unsafe fn splat(x: f32) -> Self;
    unsafe fn load(from: *const f32) -> Self;
    unsafe fn store(self, to: *mut f32);
    /// The first `count < N` lanes from memory, zeros behind them.
    unsafe fn load_part(from: *const f32, count: usize) -> Self;
    /// The first `count < N` lanes to memory.
    unsafe fn store_part(self, to: *mut f32, count: usize);
    /// `N` IEEE half-precision numbers, widened exactly.
    unsafe fn load_f16(from: *const half::f16) -> Self;

    unsafe fn add(self, other: Self) -> Self;
    unsafe fn sub(self, other: Self) -> Self;
    unsafe fn mul(self, other: Self) -> Self;
    unsafe fn div(self, other: Self) -> Self;
    /// `self * a + b`, rounded once.
    unsafe fn mul_add(self, a: Self, b: Self) -> Self;
    unsafe fn sqrt(self) -> Self;
    /// The larger; a NaN in `self` is kept.
    unsafe fn max(self, other: Self) -> Self;
    /// The smaller; a NaN in `self` is kept.
    unsafe fn min(self, other: Self) -> Self;
    /// The nearest integer.
    unsafe fn round(self) -> Self;
    /// `self * 2^exponent` for integer `exponent` in `-126..=127`.
    unsafe fn scale_by_power(self, exponent: Self) -> Self;
    /// Sums of the lanes of `four` registers, in `four`'s order: one fixed tree over the lanes,
    /// the same for each register.
    unsafe fn sums(four: [Self; 4]) -> [f32; 4];
    /// Transposes the `N` rows at `from + row_offset[i]` into `N` columns:
    /// `to[j * stride + i] = from[row_offset[i] + j]`.
    unsafe fn transpose(from: *const f32, row_offset: &[usize], to: *mut f32, stride: usize);
}

/// `count <= N` lanes from memory; zeros behind them.
///
/// # Safety
/// As [`Lanes`].
#[inline(always)]
pub(crate) unsafe fn load_some<V: Lanes>(from: *const f32, count: usize) -> V {
    // SAFETY: the caller's.
    unsafe {
        if count == V::N {
            V::load(from)
        } else {
            V::load_part(from, count)
        }
    }
}

/// `count <= N` lanes to memory.
///
/// # Safety
/// As [`Lanes`].
#[inline(always)]
pub(crate) unsafe fn store_some<V: Lanes>(x: V, to: *mut f32, count: usize) {
    // SAFETY: the caller's.
    unsafe {
        if count == V::N {
            x.store(to)
        } else {
            x.store_part(to, count)
        }
    }
}
