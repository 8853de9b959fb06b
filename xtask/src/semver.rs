//! `cargo xtask semver`: what the Rust interface has lost since a release, by `cargo-semver-checks`, for each package that crates.io takes.

use anyhow::{Context, Result, ensure};

use crate::crates;
use crate::process::{output, run_visibly};
use crate::system::has_program;
use crate::workspace::Workspace;

const PROGRAM: &str = "cargo-semver-checks";

#[derive(clap::Args)]
pub struct Options {
    /// The commit, branch or tag to compare with. Default: the last tag.
    #[arg(long)]
    baseline: Option<String>,
    /// Only these packages, as `libupt-contact`. Default: all that are published.
    #[arg(long = "package", value_name = "NAME")]
    packages: Vec<String>,
}

/// False where something that was public is gone, or has another type, and the version does not say so.
pub fn run(workspace: &Workspace, options: &Options) -> Result<bool> {
    ensure!(
        has_program(PROGRAM),
        "{PROGRAM} is missing: cargo install {PROGRAM} --locked (0.49.0 builds with Rust 1.92)"
    );
    let published = crates::published(workspace)?;
    for name in &options.packages {
        ensure!(
            published.contains(name),
            "--package {name}: crates.io takes {}",
            published.join(", ")
        );
    }
    let baseline = match &options.baseline {
        Some(baseline) => baseline.clone(),
        None => output(&mut workspace.command("git", "describe --tags --abbrev=0"))
            .context("nothing is tagged yet: name what to compare with, `--baseline COMMIT`")?
            .trim()
            .to_owned(),
    };
    let chosen = match options.packages.is_empty() {
        true => &published,
        false => &options.packages,
    };
    let mut command = workspace.cargo("semver-checks check-release --baseline-rev");
    command.arg(baseline);
    for name in chosen {
        command.args(["--package", name]);
    }
    run_visibly(&mut command)
}
