//! The few vector operations that the element kernel needs, and one type a
//! processor family that provides them.
//!
//! A batch of 16 elements goes through in `WIDTH / COUNT` parts. A type is as wide
//! as lets the operands of a tetrahedron stay in registers.
//!
//! Nodes are `[x, y, z, w]` in memory. A gather loads one corner of each of `COUNT`
//! elements and transposes to four vectors; a scatter adds back in element
//! order, so corners that share a node are summed one after the other. Indices
//! count half nodes (8 bytes): the largest step that x86 addressing scales by itself.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
#[cfg(target_arch = "aarch64")]
mod neon;
mod scalar;

#[cfg(target_arch = "x86_64")]
pub use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
pub use avx512::Avx512;
#[cfg(target_arch = "aarch64")]
pub use neon::Neon;
pub use scalar::Scalar;

/// Elements in a batch.
pub const WIDTH: usize = 16;

/// Constant of the inverse cube root's first guess, `bits(y) = GUESS - bits(x) / 3`.
pub const CUBE_ROOT_GUESS: f32 = 1_419_967_116.0;

/// `COUNT` f32 lanes.
///
/// # Safety
/// Every method needs the instruction set of its type; the pointers of `load`,
/// `store`, `gather` and `scatter_add` must be valid for `COUNT` values, or for the
/// nodes that the indices name. The callers are `target_feature` functions that
/// are reached only after run-time detection.
pub trait Lanes: Copy {
    /// Elements that go through together; divides [`WIDTH`].
    const COUNT: usize;
    unsafe fn splat(value: f32) -> Self;
    unsafe fn load(source: *const f32) -> Self;
    unsafe fn store(self, target: *mut f32);
    unsafe fn add(self, other: Self) -> Self;
    unsafe fn sub(self, other: Self) -> Self;
    unsafe fn mul(self, other: Self) -> Self;
    unsafe fn div(self, other: Self) -> Self;
    /// `self * b + c`
    unsafe fn mul_add(self, b: Self, c: Self) -> Self;
    /// `c - self * b`
    unsafe fn neg_mul_add(self, b: Self, c: Self) -> Self;
    unsafe fn min(self, other: Self) -> Self;
    unsafe fn max(self, other: Self) -> Self;
    /// First guess of `self^(-1/3)` for positive values, within 4 %.
    unsafe fn inverse_cube_root_guess(self) -> Self;
    /// Of nodes that follow each other in memory, their fourth components in place of all four.
    unsafe fn fourth(self) -> Self;
    unsafe fn gather(nodes: *const [f32; 4], index: *const u16) -> [Self; 4];
    /// Adds three components; the fourth is left with anything.
    unsafe fn scatter_add(nodes: *mut [f32; 4], index: *const u16, value: [Self; 3]);
}

/// Asks for a value's cache lines; the pointer may be beyond any allocation.
#[inline(always)]
pub fn prefetch<T>(value: *const T) {
    #[cfg(target_arch = "x86_64")]
    for line in (0..size_of::<T>()).step_by(64) {
        let line = value.cast::<i8>().wrapping_add(line);
        // SAFETY: a prefetch does not access memory; SSE is part of the architecture.
        unsafe { std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(line) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = value;
}
