//! `upt bundle`: the bundles that are here, and those that are fetched when they are wanted. A clone holds what most people use; networks of the
//! paper's size and bodies that few need are *assets*, which `onnx/index.json` names with the hash of their manifest.

mod get;
mod index;
mod source;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::{Args, Subcommand};
use serde_json::json;

use crate::doctor;
use foreign::python;
use index::Index;
use source::Source;

#[derive(Args)]
#[command(after_help = "Examples:\n  upt bundle list\n  upt bundle get brain-paper")]
pub struct Options {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// List the bundles that are here, and those that can be fetched.
    List(List),
    /// Fetch a bundle, once: each file is checked against its SHA-256.
    ///
    /// Without --from it comes out of the history of the clone that this program was built in, or that you stand in, where that goes back far
    /// enough. Nothing is there until everything is right.
    Get(Get),
}

#[derive(Args)]
#[command(after_help = "Examples:\n  upt bundle list\n  upt bundle list --json")]
struct List {
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
#[command(after_help = "Examples:
  upt bundle get brain-paper
  upt bundle get brain-supported --out onnx
  upt bundle get brain-paper --from https://mirror.example/bundles
  upt bundle get kidney --from /mnt/bundles --sha256 5f1c...")]
struct Get {
    /// Its name; `upt bundle list` has those that are known.
    name: String,
    /// A folder or an address (https://...) that holds NAME/bundle.json and its files. Default: the environment variable UPT_MIRROR, else the
    /// history of the clone.
    #[arg(long)]
    from: Option<String>,
    /// The folder that the bundle's folder appears in. Default: `upt/bundles` in the user's cache, where Python's `upt.bundle` looks too.
    #[arg(long)]
    out: Option<PathBuf>,
    /// SHA-256 of bundle.json, which holds those of all other files. Default: that of the index.
    #[arg(long)]
    sha256: Option<String>,
}

/// Runs the command.
pub fn run(options: &Options) -> Result<ExitCode> {
    match &options.command {
        Command::List(options) => list(options),
        Command::Get(options) => fetch(options),
    }
}

/// Where fetched bundles lie.
fn downloads() -> Result<PathBuf> {
    Ok(python::cache()?.join("bundles"))
}

fn name_of(folder: &Path) -> String {
    let name = folder.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

fn list(options: &List) -> Result<ExitCode> {
    let index = Index::shipped()?;
    let mut here = doctor::usual_bundles();
    if let Ok(folder) = downloads() {
        here.extend(doctor::bundles_below(&folder));
    }
    let absent = index.assets.iter().filter(|(name, _)| {
        let mut names = here.iter().map(|folder| name_of(folder));
        !names.any(|here| here == **name)
    });
    if options.json {
        let here: Vec<_> = here
            .iter()
            .map(|folder| json!({"name": name_of(folder), "folder": folder}))
            .collect();
        let absent: Vec<_> = absent
            .map(|(name, asset)| {
                json!({"name": name, "bytes": asset.bytes, "sha256": asset.sha256, "about": asset.about})
            })
            .collect();
        println!("{}", json!({"here": here, "to_fetch": absent}));
        return Ok(ExitCode::SUCCESS);
    }
    for folder in &here {
        println!("{:32} {}", name_of(folder), folder.display());
    }
    for (name, asset) in absent {
        let size = asset.bytes as f64 / 1e6;
        println!(
            "{name:32} not here; `upt bundle get {name}`, {size:.0} MB: {}",
            asset.about
        );
    }
    Ok(ExitCode::SUCCESS)
}

fn fetch(options: &Get) -> Result<ExitCode> {
    let index = Index::shipped()?;
    let asset = index.assets.get(&options.name);
    let sha256 = match (&options.sha256, asset) {
        (Some(stated), _) => stated.to_lowercase(),
        (None, Some(asset)) => asset.sha256.clone(),
        (None, None) => anyhow::bail!(
            "the index knows no bundle {:?}, only {}; give --sha256, that of its bundle.json",
            options.name,
            index.names()
        ),
    };
    let out = match &options.out {
        Some(out) => out.clone(),
        None => downloads()?,
    };
    let mirror = std::env::var("UPT_MIRROR").ok();
    let source = match (options.from.clone().or(mirror), asset) {
        (Some(place), _) if !place.is_empty() => Source::of(&place),
        (_, Some(asset)) => Source::history(&asset.commit)?,
        _ => anyhow::bail!(
            "give --from, a folder or an address that holds {}",
            options.name
        ),
    };
    let folder = get::bundle(&source, &options.name, &sha256, &out)
        .with_context(|| format!("{} is not fetched", options.name))?;
    println!("{}", folder.display());
    Ok(ExitCode::SUCCESS)
}
