//! Vector registers of f32, the instruction set that a machine has of them, and the floating-point mode of a computation.
//!
//! One body of a kernel compiles for AVX2 (8 lanes), AVX-512 (16), NEON and WebAssembly (4). [`Lanes`] is arithmetic, [`FunctionLanes`]
//! what elementary functions ([`functions`]) need besides, [`DenseLanes`] what products over tables need, [`NodeLanes`] what the
//! elements of a mesh need. [`Isa`] chooses at run time, and
//! [`by_isa!`] writes the function that does.
//!
//! Sets differ in rounding: in the lanes of a sum, and in multiply-adds that are rounded once. [`Isa::Portable`] has eight lanes and
//! rounds twice on every machine ([`Pair`], [`Plain`]), for the same bits everywhere.
//!
//! Every function of the traits is unsafe for one reason: the instruction set must be enabled in the function that it is
//! inlined into, and pointers must be valid for the lanes that they name.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod dense;
pub mod flush;
pub mod functions;
mod isa;
#[cfg(target_arch = "aarch64")]
mod neon;
#[cfg(target_arch = "aarch64")]
mod neon_four;
mod pair;
mod plain;
mod scalar;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod simd128;
mod traits;

#[cfg(target_arch = "x86_64")]
pub use avx2::Avx2;
#[cfg(target_arch = "x86_64")]
pub use avx512::Avx512;
pub use dense::{load_some, store_some};
pub use flush::{FlushToZero, MaskExceptions};
pub use isa::Isa;
#[cfg(target_arch = "aarch64")]
pub use neon::Neon;
#[cfg(target_arch = "aarch64")]
pub use neon_four::NeonFour;
pub use pair::Pair;
pub use plain::Plain;
pub use scalar::Scalar;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
pub use simd128::Simd128;
pub(crate) use traits::ROOT_OF_HALF;
pub use traits::{CUBE_ROOT_GUESS, DenseLanes, FunctionLanes, Lanes, NodeLanes, WIDTH};

/// Lanes of [`Isa::Portable`]: eight, and no fused multiply-add.
#[cfg(target_arch = "x86_64")]
pub type Portable = Plain<Avx2>;
/// Lanes of [`Isa::Portable`]: eight, and no fused multiply-add.
#[cfg(target_arch = "aarch64")]
pub type Portable = Plain<Pair<Neon>>;
/// Lanes of [`Isa::Portable`]: eight, and no fused multiply-add.
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
pub type Portable = Pair<Simd128>;

/// Whether every machine of this target has vector lanes, without a look at run time.
const HAS_LANES: bool = cfg!(any(
    target_arch = "aarch64",
    all(target_arch = "wasm32", target_feature = "simd128")
));

/// Asks for a value's cache lines; the pointer may be beyond any allocation.
/// It is a hint: nothing is read, and on other processors than x86-64 nothing is done.
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
