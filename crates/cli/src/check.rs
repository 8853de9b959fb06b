//! `upt check`: the certificate of a bundle, repeated.

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Args;
use make::check::{Plan, ToolSizes, measure};
use serde_json::Value;
use tissue::mesh::Mesh;
use tissue::programmes::ToolProgramme;
use yardstick::bundle_folder::BundleFolder;
use yardstick::tool_scale::Chosen;

use crate::{loads, progress, tool_size};

/// A certificate's errors that differ by more than this part from a repetition's do not fit the bundle.
const SAME: f64 = 0.1;

#[derive(Args)]
#[command(after_help = "Examples:
  upt check liver
  upt check liver --cases 4 --json
  upt check liver --tools press,stroke")]
pub struct Options {
    /// Bundle folder with a certificate, as `upt make` leaves it.
    bundle: PathBuf,
    /// Number of held-out cases. Default: that of the certificate.
    #[arg(long)]
    cases: Option<usize>,
    /// A seed other than the certificate's, for other sites.
    #[arg(long)]
    seed: Option<u64>,
    #[arg(long, help = loads::programmes_help() + ". Default: those of the certificate")]
    tools: Option<String>,
    #[command(flatten)]
    sizes: tool_size::Arguments,
    /// Rewrite certificate.json and certificate.html.
    #[arg(long)]
    write: bool,
    /// Threads (0: all).
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Print the certificate as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command. Exit code 1 where the errors are not the certificate's.
pub fn run(options: &Options) -> Result<ExitCode> {
    let path = options.bundle.join("certificate.json");
    let before: Option<Value> = match std::fs::read(&path) {
        Ok(text) => {
            Some(serde_json::from_slice(&text).with_context(|| format!("{}", path.display()))?)
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => None,
        Err(error) => return Err(error).with_context(|| format!("{}", path.display())),
    };
    let stated = |name: &str| {
        before
            .as_ref()
            .and_then(|text| text["tested"][name].as_u64())
    };
    let seed = options.seed.or(stated("seed")).unwrap_or(1);
    let cases = options
        .cases
        .or(stated("cases").map(|count| count as usize));
    let tools = match (&options.tools, &before) {
        (Some(list), _) => ToolProgramme::parse_list(list).map_err(anyhow::Error::msg)?,
        (None, Some(text)) => (text["tools"].as_array().into_iter().flatten())
            .filter_map(|row| row["programme"].as_str()?.parse().ok())
            .collect(),
        (None, None) => Vec::new(),
    };
    // A programme that the certificate has not seen has no sizes there.
    let sizes = (before.as_ref())
        .filter(|_| options.sizes.tool_scale.is_none())
        .and_then(Chosen::stated);
    let same_plan = before.is_some()
        && Some(seed) == stated("seed")
        && cases == stated("cases").map(|n| n as usize);
    let programmes = (before.iter()).flat_map(|text| text["tested"]["programmes"].as_array());
    let frames = programmes.flatten().map(|case| {
        let count = case["frames_in_time"].as_u64().filter(|_| same_plan);
        count.map(|count| count as usize)
    });
    let plan = Plan {
        frames: frames.collect(),
        sizes: sizes.map_or(
            ToolSizes::Asked(options.sizes.tool_scale),
            ToolSizes::Stated,
        ),
        tools,
        bundle: options.bundle.clone(),
        cases: Some(cases.unwrap_or(4)),
        seconds: f64::INFINITY,
        seed,
        threads: options.threads,
        watch: progress::watch(options.json),
    };
    if plan.cases == Some(0) {
        bail!("--cases is 0; give 1 or more");
    }
    let mut found = measure(&plan)?;
    let origin = before
        .as_ref()
        .map_or(Value::Null, |text| text["provenance"].clone());
    found.finish(&options.bundle, &origin)?;
    if options.json {
        println!("{:#}", found.json());
    } else {
        println!("{}", found.text());
    }
    if options.write {
        let mesh = Mesh::read(&BundleFolder::read(&options.bundle)?.mesh_file)?;
        found.write(&options.bundle, &mesh, &[])?;
    }
    let stated = before.and_then(|text| text["contact"]["mse_mm2"].as_f64());
    if let (true, Some(stated)) = (same_plan, stated) {
        let now = found.mse_in_contact();
        if (now - stated).abs() > SAME * stated {
            eprintln!(
                "the certificate says {stated:.3e} mm² in contact, this run found {now:.3e}: the bundle or the library changed"
            );
            return Ok(ExitCode::from(1));
        }
        if !options.json {
            println!("as the certificate says ({stated:.3e} mm² in contact)");
        }
    }
    Ok(ExitCode::SUCCESS)
}
