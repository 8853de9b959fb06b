//! `upt-study envelope`: which rigid tools a bundle is good for. Each case of a dataset with tools is driven from the poses alone and compared
//! with the reference solver; the limits are the widest that hold hardly a case beyond the wanted error
//! (`docs/reference/formats.md`, `envelope.tools`).

mod limits;
mod table;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::{Value, json};

use crate::posed::Posed;
use crate::publish::Publisher;
use host::Effort;
use limits::{Limits, Tried};
use upt_cli::one_of::one_of;
use upt_cli::progress;
use yardstick::cases::Split;
use yardstick::manifest::Manifest;

/// Options of `upt-study envelope`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  upt-study envelope onnx/brain-reduced --tools data/tools
  upt-study envelope my-bundle --tools data/tools --corrections 5 --limit-mm2 0.02 --dry-run")]
pub struct Options {
    /// Bundle folder with corrections; `envelope.tools` of its manifest is written.
    bundle: PathBuf,
    /// Datasets of `upt dataset --tools`, or trajectories; may be repeated.
    #[arg(long, required = true)]
    tools: Vec<PathBuf>,
    /// Which cases of a dataset.
    #[arg(long, default_value = "all", value_parser = one_of(&Split::ALL, Split::name))]
    split: Split,
    /// The most cases of each programme.
    #[arg(long, default_value_t = 100)]
    cases: usize,
    /// Corrections per step. Default: as many as the bundle recommends.
    #[arg(long)]
    corrections: Option<Effort>,
    /// Largest mean squared error of a good case, mm².
    #[arg(long, default_value_t = 0.05)]
    limit_mm2: f64,
    /// Share of the cases inside the limits that may be worse.
    #[arg(long, default_value_t = 0.05)]
    share: f64,
    /// Threads of the library.
    #[arg(long, default_value_t = 1)]
    threads: u32,
    /// Print what would be written, and write nothing.
    #[arg(long)]
    dry_run: bool,
    /// Document whose tables between `begin: study envelope BUNDLE` and its end are written; may be repeated.
    #[arg(long)]
    markdown: Vec<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(options: &Options) -> Result<ExitCode> {
    check(options)?;
    let named = std::slice::from_ref(&options.bundle);
    let posed = Posed::read(&options.tools, options.split, options.cases, named)?;
    let (cases, mesh, bundle) = (&posed.cases, &posed.mesh, &posed.bundles[0]);
    cases.check_steps()?;
    let corrections = match (options.corrections, bundle.corrections) {
        (_, None) => bail!(
            "{}: has no corrections, which the limits of tools need; add them with `upt corrections`",
            bundle.name
        ),
        (Some(effort), _) | (None, Some(effort)) => effort,
    };
    let figures = yardstick::solved(
        bundle,
        corrections,
        cases,
        mesh,
        options.threads,
        &progress::watch(false),
    )?;
    let samples = mesh.samples(posed.boundary);
    let good = |mse: f64, inverted: usize| mse <= options.limit_mm2 && inverted == 0;
    let tried: Vec<Tried> = cases
        .list
        .iter()
        .zip(&figures)
        .filter_map(|(case, figures)| {
            Tried::of(
                case,
                &samples,
                figures,
                good(figures.mse_mm2, figures.inverted_steps),
            )
        })
        .collect();
    let limits = Limits::widest(&tried, options.share).with_context(|| {
        format!(
            "{}: no case of {} stays within {} mm² at k = {corrections}; raise --limit-mm2 or --corrections",
            bundle.name,
            cases.list.len(),
            options.limit_mm2
        )
    })?;
    let entry = limits.entry(corrections.most);
    if !options.dry_run {
        write(options, &entry)?;
    }
    let text = table::markdown(
        &bundle.name,
        corrections,
        options.limit_mm2,
        &tried,
        &limits,
    );
    let publisher = Publisher {
        json: options.json,
        pages: &options.markdown,
    };
    publisher.part(&format!("study envelope {}", bundle.name), &text)?;
    if options.dry_run {
        publisher.say("nothing was written (--dry-run)");
    }
    let report = json!({"bundle": bundle.name, "tools": entry, "limit_mm2": options.limit_mm2, "cases": tried});
    publisher.end(&report, &[])?;
    Ok(ExitCode::SUCCESS)
}

fn check(options: &Options) -> Result<()> {
    if !(options.limit_mm2.is_finite() && options.limit_mm2 > 0.0) {
        bail!("--limit-mm2 is {}; it must be above 0", options.limit_mm2);
    }
    if !(0.0..1.0).contains(&options.share) {
        bail!("--share is {}; it must be from 0 to below 1", options.share);
    }
    if options.corrections == Some(Effort::NONE) {
        bail!(
            "--corrections is 0; the limits of tools hold for corrected steps, so it must be 1 to 64"
        );
    }
    Ok(())
}

/// Puts the limits into the manifest.
fn write(options: &Options, entry: &Value) -> Result<()> {
    let mut manifest = Manifest::read(&options.bundle)?;
    let mut envelope: indexmap::IndexMap<String, Value> =
        manifest.get("envelope")?.unwrap_or_default();
    envelope.insert("tools".into(), entry.clone());
    manifest.set("envelope", &json!(envelope), "mesh")?;
    manifest.write()
}
