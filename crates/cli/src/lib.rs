//! What the command `upt` does, and what the study of it (`crates/study`) needs too. One file or folder a subcommand: each has
//! its options (`clap::Args`) and `run(options) -> anyhow::Result<ExitCode>`.
//!
//! Exit codes: 0 done; 1 the command ran and its finding is bad (`doctor`, `check`); 2 wrong usage or
//! input, with a message on stderr that says what to do.

pub mod bundle;
#[cfg(feature = "linear")]
pub mod check;
#[cfg(feature = "linear")]
pub mod corrections;
pub mod counted;
pub mod dataset;
pub mod doctor;
#[cfg(feature = "linear")]
mod emit;
#[cfg(feature = "linear")]
pub mod export;
pub mod fit;
#[cfg(not(feature = "linear"))]
pub mod left_out;
pub mod loads;
#[cfg(feature = "linear")]
pub mod make;
pub mod marks;
pub mod materials;
pub mod mesh;
#[cfg(feature = "linear")]
pub mod modes;
pub mod one_of;
#[cfg(feature = "linear")]
pub mod prior;
pub mod progress;
pub mod replay;
pub mod rollout;
pub mod runtime;
pub mod simulate;
mod tool_size;
#[cfg(feature = "linear")]
pub mod validate;
pub mod view;

// For their features alone: see Cargo.toml.
use bitflags as _;
use either as _;
