//! `upt check`: held-out contacts through a bundle and the reference solver, and the certificate that results.
//!
//! Nothing is stored on the way: the solver and the bundle's scenes step side by side. One scene makes the steps that the bundle
//! recommends, another leaves its corrections out; for a bundle without a learned map the latter is linear elasticity, static in
//! contact and swinging freely after a release.

mod bundle;
mod case;
mod certificate;
mod page;
mod recording;
mod score;
mod tools;
mod verdict;

pub use certificate::Certificate;
pub use recording::Recording;
pub use score::{nearest, regions};

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::Value;
use tissue::mesh::Mesh;
use tissue::programmes::ToolProgramme;
use tissue::schemes::{FRAMES, Scheme};
use upt::Corrections;

use crate::bundle_folder::BundleFolder;
use crate::parallel::{in_parallel, workers};
use crate::tool_scale::{self, Chosen};
use crate::{loads, progress};
use bundle::Bundle;
pub use bundle::{Plan, ToolSizes};
use case::{Case, Replay};

/// Programmes in the order in which they are run: `probe` has five sites, the others are the paper's.
const ORDER: [Scheme; 8] = [
    Scheme::Probe,
    Scheme::Four,
    Scheme::Probe,
    Scheme::Three,
    Scheme::Probe,
    Scheme::One,
    Scheme::Probe,
    Scheme::Five,
];
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
    sizes: tool_scale::Arguments,
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
        sizes: sizes.map_or(ToolSizes::Asked(options.sizes), ToolSizes::Stated),
        tools,
        bundle: options.bundle.clone(),
        cases: Some(cases.unwrap_or(4)),
        seconds: f64::INFINITY,
        seed,
        threads: options.threads,
        quiet: options.json,
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

/// Simulates and replays; the certificate lacks the bundle's identity until it is finished.
pub fn measure(plan: &Plan) -> Result<Certificate> {
    let started = Instant::now();
    // The tools have half of the time, and what the contacts leave of theirs.
    let seconds = match plan.tools.is_empty() {
        true => plan.seconds,
        false => 0.5 * plan.seconds,
    };
    let until = seconds
        .is_finite()
        .then(|| started + Duration::from_secs_f64(seconds.max(0.0)));
    let bundle = Bundle::open(&plan.bundle)?;
    let most = plan.cases.unwrap_or(ORDER.len());
    let workers = workers(plan.threads).min(most);
    let bar = progress::bar(plan.quiet, (most * FRAMES) as u64, "held-out contacts");
    let late = |at: usize| {
        let spent = started.elapsed().as_secs_f64();
        // Another case takes about as long as those before it.
        let rounds = (at / workers) as f64;
        at >= workers && spent * (rounds + 1.0) / rounds > seconds
    };
    let scores = in_parallel(workers, &|at| at < most && !late(at), &|at| {
        let case = held_out(plan.seed, at);
        let body = bundle.body();
        let mut replay = Replay::new(case, &bundle.model, Corrections::Recommended, body)?;
        if at == 0 {
            replay = replay.filmed();
        }
        // The first frame is the body at rest.
        let frames = plan
            .frames
            .get(at)
            .copied()
            .flatten()
            .map(|count| count + 1);
        let most = frames.unwrap_or(FRAMES);
        let ended = case.simulate(&bundle.model, &body, most, until, &mut |frame| {
            bar.inc(1);
            replay.step(frame)
        })?;
        Ok(replay.finish(ended.or(frames.map(case::no_time))))
    })?;
    bar.finish_and_clear();
    let mut certificate = bundle.certificate(plan.seed, scores)?;
    if !plan.tools.is_empty() {
        let sizes = plan.sizes.choose(&bundle);
        let left = plan.seconds - started.elapsed().as_secs_f64();
        let rows = tools::measure(plan, &bundle, sizes.scale, left)?;
        certificate.add_tools(rows, &sizes, &plan.tools);
    }
    certificate.judge();
    Ok(certificate)
}

/// The case at a place of a plan.
fn held_out(seed: u64, at: usize) -> Case {
    Case {
        scheme: ORDER[at % ORDER.len()],
        seed: seed.wrapping_mul(1000).wrapping_add(at as u64),
    }
}
