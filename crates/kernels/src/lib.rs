//! The numerical kernels of a step, in f32: everything that runs natively between the graphs.
//!
//! Each kernel is a file with a scalar reference and one vector body, generic over the lanes of
//! [`lanes`], compiled for AVX2, AVX-512 and NEON and chosen at run time by [`Isa`]. Threads come
//! from a [`Pool`]. All results have the same bits for any thread count, and any subset of rows
//! gives the bits that the whole set gives (on one `Isa`; different sets differ in rounding).
//!
//! REQ-030: On one machine a step has the same bits for any number of threads.

// Register tiles are small arrays walked by index, several of them at once.
#![allow(clippy::needless_range_loop)]
// `by_isa!` gives each body its lanes; those that the compiler makes vectors of itself do not name them.
#![allow(clippy::extra_unused_type_parameters)]

pub mod aggregate;
pub mod cholesky;
pub mod contact;
pub mod decoder;
pub mod encode;
pub mod largest;
mod math;
pub mod nearest;
pub mod parts;
pub mod pool;
pub mod project;
pub mod ragged;
#[doc(hidden)]
pub mod random;
pub mod respond;
pub mod rows;
pub mod vectors;

// `derive(HeldBytes)` looks for it here.
use field::memory;
pub use lanes::{FlushToZero, Isa, MaskExceptions, flush};
pub use math::gelu;
pub use pool::{Pool, PoolError, THREAD_STACK};

/// What a computation runs on.
#[derive(Clone, Copy)]
pub struct Compute<'a> {
    /// Instruction set of the kernels.
    pub isa: Isa,
    /// Threads.
    pub pool: &'a Pool,
}

/// What a scene's computations run on, owned.
pub struct Machine {
    /// Instruction set of the kernels.
    pub isa: Isa,
    /// Threads.
    pub pool: Pool,
}

impl Machine {
    /// Lent to a computation.
    pub fn compute(&self) -> Compute<'_> {
        Compute {
            isa: self.isa,
            pool: &self.pool,
        }
    }
}
