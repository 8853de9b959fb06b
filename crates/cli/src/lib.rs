//! What the command `upt` does, and what the study of it (`crates/study`) needs too. One file or folder a subcommand: each has
//! its options (`clap::Args`) and `run(options) -> anyhow::Result<ExitCode>`.
//!
//! Exit codes: 0 done; 1 the command ran and its finding is bad (`doctor`, `check`); 2 wrong usage or
//! input, with a message on stderr that says what to do.

pub mod bundle;
pub mod bundle_folder;
#[cfg(feature = "linear")]
pub mod check;
#[cfg(feature = "linear")]
pub mod corrections;
pub mod counted;
pub mod dataset;
pub mod doctor;
pub mod effort;
pub mod errors;
#[cfg(feature = "files")]
pub mod export;
pub mod fit;
#[cfg(feature = "files")]
mod foreign;
pub mod host;
#[cfg(not(feature = "linear"))]
pub mod left_out;
pub mod loads;
pub mod machine;
#[cfg(feature = "linear")]
pub mod make;
pub mod manifest;
pub mod marks;
pub mod materials;
pub mod mesh;
#[cfg(feature = "linear")]
pub mod modes;
#[cfg(feature = "linear")]
mod parallel;
pub mod plot;
pub mod preview;
#[cfg(feature = "linear")]
pub mod prior;
pub mod progress;
mod python;
#[cfg(feature = "files")]
mod regions;
pub mod render;
pub mod replay;
pub mod rollout;
pub mod runtime;
pub mod setting;
pub mod simulate;
pub mod surrogate;
mod three;
pub mod tool_scale;
#[cfg(feature = "linear")]
pub mod validate;
pub mod view;
pub mod yardstick;

// For their features alone: see Cargo.toml.
use bitflags as _;
use either as _;
