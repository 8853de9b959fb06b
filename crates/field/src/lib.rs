//! What every layer of libupt stands on: fields over the nodes, and how a call fails.
//!
//! | module | holds |
//! |---|---|
//! | [`clock`] | the clock of waits and budgets, also in a browser |
//! | [`error`] | [`Error`]: what went wrong, where, and what to do; [`status`] its numbers in C |
//! | [`grid`] | points in cells, for searches at load time |
//! | [`memory`] | room whose size a host or a bundle decides, and how much of it a value holds |
//! | [`nodes`] | a displacement's limits; [`ContactSet`], nodes with a vector each |
//! | [`output`] | a caller's memory that a call fills |
//! | [`stored`] | lists of numbers in a snapshot |
//!
//! A field is `[K,3]` float32, row-major: lengths in mm, forces in mN.

pub mod clock;
pub mod error;
pub mod grid;
pub mod memory;
pub mod nodes;
pub mod output;
pub mod status;
pub mod stored;

pub use error::{Error, Result};
pub use nodes::{ContactSet, INPUT_LIMIT, check, check_count, check_displacement};
