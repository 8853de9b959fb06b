//! Commands that this build of `upt` does not have: they say how to get them.

use std::process::ExitCode;

use anyhow::anyhow;
use clap::Args;

/// Takes anything.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  cargo build --release -p upt-cli")]
pub struct Options {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    rest: Vec<String>,
}

/// Always an error.
pub fn run(feature: &str, options: &Options) -> anyhow::Result<ExitCode> {
    let _ = &options.rest;
    Err(missing(feature))
}

/// That a feature is needed.
pub fn missing(feature: &str) -> anyhow::Error {
    anyhow!(
        "this is the small `upt` of `cargo xtask demo`, built without the feature `{feature}`: in the clone, `cargo build --release -p upt-cli` builds the whole command, target/release/upt"
    )
}
