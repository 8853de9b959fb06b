//! `upt report`: error against run time, for the library and for the plain methods.
//!
//! Every row replays the same held-out contacts autoregressively and is timed step by step around the
//! C call. Finished rows are kept by content, so that an interrupted report goes on where it was.

mod bundle_folder;
mod cache;
pub mod cases;
mod choose;
pub mod errors;
mod film;
pub mod html;
mod measure;
pub mod memory;
pub mod method;
mod paper_split;
pub mod pictures;
pub mod plot;
pub mod prior_alone;
mod row;
mod same_body;
pub mod setting;
pub mod table;
mod write;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, bail};
use clap::Args;
use tissue::mesh::Mesh;

use crate::effort::Effort;
use crate::machine::Machine;
use crate::shown;
use crate::tools::{self, cases::Split};
use cache::Cache;
pub use row::quantile;
pub use write::date;

use cases::Cases;
use measure::Plan;
use method::Method;
use row::Measurement;
use setting::{Precision, Provider, Region};

#[derive(Args)]
#[command(after_help = "Examples:
  upt report --data data/brain-fixed --cases 2 --out target/report
  upt report --trajectory push.trajectory.safetensors --bundle onnx/brain-reduced --plain zero,linear
  upt report --data data/brain-fixed --threads 1,2 --region all,surface --precision f32,bf16 --json
  upt report --tools data/brain-tools --bundle onnx/brain-reduced --corrections 0,3,5 --out target/tools
  upt report --shown 90 --tools data/brain-frames --split all --bundle onnx/brain-reduced --out target/shown
  upt report --step-ms 10,20,25,50 --tools data/brain-frames --split all --bundle onnx/brain-reduced

The command writes report.json, report.html and report.md (the table for a document of yours) to --out (with --tools: tools.json and tools.html), and prints the table.")]
pub struct Options {
    /// Bundles. Default: all below onnx/ that fit the cases' mesh and boundary condition.
    #[arg(long = "bundle", value_name = "FOLDER")]
    bundles: Vec<PathBuf>,
    /// A trajectory to replay (repeat for several).
    #[arg(long = "trajectory", value_name = "FILE")]
    trajectories: Vec<PathBuf>,
    /// A dataset folder whose test split is replayed (repeat for several).
    #[arg(long = "data", value_name = "FOLDER")]
    data: Vec<PathBuf>,
    /// A dataset folder or a trajectory with rigid tools (`upt dataset --tools`, repeat for several): the tools' poses alone drive the library. Of the options below, only --split, --cases, --corrections, --threads (the largest), --out,
    /// --title, --markdown and --json apply.
    #[arg(long = "tools", value_name = "PATH", conflicts_with_all = ["trajectories", "data"])]
    tools: Vec<PathBuf>,
    /// Cases of the datasets of --tools: held-out ones, those that bundles may learn from, or both.
    #[arg(long, default_value = "test", requires = "tools")]
    split: Split,
    /// Measure what a host shows between steps, at this many frames a second; --tools names datasets with frames shorter than a step
    /// (`upt dataset --tools all --frame-ms 5`). Writes shown.json and pictures; --markdown replaces the part between the markers
    /// `upt report --shown BUNDLE`.
    #[arg(long, value_name = "HZ", requires = "tools")]
    shown: Option<f64>,
    /// With --shown: time from a step's moment to the arrival of its state, ms.
    #[arg(long, default_value_t = 10.0, requires = "shown")]
    arrival_ms: f64,
    /// Lengths of a step, ms, 10 to 50. With --shown: also measure frames between such steps. Without: measure the error of the steps by their
    /// length, against frames shorter than a step; --markdown replaces the part between the markers
    /// `upt report --step-ms BUNDLE`.
    #[arg(long, value_name = "MS", value_delimiter = ',', requires = "tools")]
    step_ms: Vec<f64>,
    /// Page whose part between the markers `upt report --tools MESH` (with `--boundary NAME` behind where it is not `fixed`) is replaced by the tables of --tools, or by a narrow table if the markers end in `summary` (repeat for several).
    #[arg(long, value_name = "FILE", requires = "tools")]
    markdown: Vec<PathBuf>,
    /// The most cases of each scheme or programme.
    #[arg(long, default_value_t = 2)]
    cases: usize,
    /// Folder for report.json, report.html, report.md and the finished rows.
    #[arg(long, default_value = "target/report")]
    out: PathBuf,
    /// Threads of the library. Default: 1, and all of this machine's.
    #[arg(long, value_delimiter = ',', default_values_t = default_threads(), hide_default_value = true)]
    threads: Vec<u32>,
    /// Nodes that a step computes: all, those of the surface, or those of the domain.
    #[arg(long, value_delimiter = ',', default_value = "all,surface")]
    region: Vec<Region>,
    /// Default: float32, and whatever else the bundle and this CPU support.
    #[arg(long, value_delimiter = ',')]
    precision: Vec<Precision>,
    #[arg(long, value_delimiter = ',', default_value = "cpu")]
    provider: Vec<Provider>,
    /// Corrections per step in contact: counts, or COUNT@MM for at most COUNT and fewer once the estimated error is below MM. Default: none and
    /// as many as the bundle recommends; with all nodes and the most threads also 0, 1, 3, 5 and 10.
    #[arg(long, value_delimiter = ',')]
    corrections: Vec<Effort>,
    /// Plain methods to compare with: zero, linear, prior (the bundles' linear response alone), coarse, tled, paper; or none.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = DEFAULT_PLAIN
    )]
    plain: Vec<String>,
    /// The mesh of `coarse`.
    #[arg(long, default_value = "onnx/meshes/brain-coarse.mesh.safetensors")]
    coarse_mesh: PathBuf,
    /// Frames of the first case on which TLED itself is timed.
    #[arg(long, default_value_t = 40)]
    tled_frames: usize,
    /// Leave out the Hausdorff distance (the slowest of the metrics).
    #[arg(long)]
    no_hausdorff: bool,
    /// Measure again what is already stored.
    #[arg(long)]
    fresh: bool,
    /// The page's title.
    #[arg(long)]
    title: Option<String>,
    /// Print report.json instead of the table.
    #[arg(long)]
    json: bool,
}

/// All that this build has.
const DEFAULT_PLAIN: &str = if cfg!(feature = "linear") {
    "zero,linear,prior,coarse,tled,paper"
} else {
    "zero,prior,coarse,tled,paper"
};

/// One thread, and all of them.
fn default_threads() -> Vec<u32> {
    let all = std::thread::available_parallelism().map_or(1, usize::from) as u32;
    if all > 1 { vec![1, all] } else { vec![1] }
}

pub fn run(options: &Options) -> Result<ExitCode> {
    let threads = options.threads.iter().copied().max().unwrap_or(1);
    if let Some(hz) = options.shown {
        return shown::report(&shown::Plan {
            hz,
            arrival_ms: options.arrival_ms,
            paths: &options.tools,
            split: options.split,
            per_programme: options.cases,
            bundles: &options.bundles,
            corrections: options.corrections.first().copied(),
            step_ms: &options.step_ms,
            threads,
            out: options.out.clone(),
            markdown: &options.markdown,
            json: options.json,
        });
    }
    if !options.step_ms.is_empty() {
        return shown::steps::report(&shown::steps::Plan {
            step_ms: &options.step_ms,
            paths: &options.tools,
            split: options.split,
            per_programme: options.cases,
            bundles: &options.bundles,
            corrections: &options.corrections,
            threads,
            markdown: &options.markdown,
            json: options.json,
        });
    }
    if !options.tools.is_empty() {
        return tools::report(&tools::Plan {
            paths: &options.tools,
            split: options.split,
            per_programme: options.cases,
            bundles: &options.bundles,
            corrections: &options.corrections,
            threads,
            out: options.out.clone(),
            title: options.title.as_deref().unwrap_or("From pose to picture"),
            markdown: &options.markdown,
            json: options.json,
        });
    }
    let cases = Cases::read(&options.trajectories, &options.data, options.cases)?;
    let mut notes = Vec::new();
    let bundles = choose::fitting_bundles(options, &cases, &mut notes)?;
    let mesh = choose::mesh_of(&cases, &bundles)?;
    let methods = choose::methods(options, &cases, &bundles, &mut notes)?;
    let moments: Vec<(usize, usize)> = pictures::moments(&cases.list[0])
        .into_iter()
        .map(|frame| (0, frame))
        .collect();

    let machine = Machine::this();
    let measurements = measure_all(
        options, &cases, &mesh, &methods, &moments, &machine, &mut notes,
    )?;
    if measurements.is_empty() {
        bail!("nothing could be measured: {}", notes.join("; "));
    }
    let findings = write::Findings {
        cases: &cases,
        mesh: &mesh,
        measurements: &measurements,
        moments: &moments,
        machine: &machine,
        notes: &notes,
        viewer: film::viewer(&cases, &mesh, &methods)?,
    };
    let report = findings.write(options)?;
    if options.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        let rows: Vec<&row::Row> = measurements.iter().map(|one| &one.row).collect();
        print!("{}", table::text(&rows));
        for note in &notes {
            println!("left out: {note}");
        }
        println!("{}", options.out.join("report.html").display());
    }
    Ok(ExitCode::SUCCESS)
}

/// Measures what is not stored yet, one row after the other (two at once would steal each other's cores).
fn measure_all(
    options: &Options,
    cases: &Cases,
    mesh: &Mesh,
    methods: &[Method],
    moments: &[(usize, usize)],
    machine: &Machine,
    notes: &mut Vec<String>,
) -> Result<Vec<Measurement>> {
    let cache = Cache::new(&options.out.join("rows"));
    let bar = indicatif::ProgressBar::new(0).with_style(indicatif::ProgressStyle::with_template(
        "{prefix} {bar:30} step {pos}/{len}, {eta} left",
    )?);
    let mut measurements: Vec<Measurement> = Vec::new();
    // The float32 path of the bundle at hand, first case, all nodes: what deviations are measured from.
    let mut reference: Option<(String, Vec<Vec<[f32; 3]>>)> = None;
    for method in methods {
        let is_tled = matches!(method, Method::Tled { .. });
        let plan = Plan {
            mesh,
            cases,
            pictured: moments,
            step_limit: if is_tled {
                options.tled_frames
            } else {
                usize::MAX
            },
            case_limit: if is_tled { 1 } else { usize::MAX },
            hausdorff: !options.no_hausdorff,
        };
        let described = measure::describe(method, mesh);
        let key = Cache::key(&[
            &serde_json::to_string(&described)?,
            &cases.content,
            &serde_json::to_string(machine)?,
            &format!("{} {} {:?}", plan.step_limit, plan.hausdorff, moments),
            env!("CARGO_PKG_VERSION"),
        ]);
        if !options.fresh
            && let Some(stored) = cache.load(&key)
        {
            measurements.push(stored);
            continue;
        }
        let identity = format!("{} {}", described.bundle_sha256, described.corrections);
        let name = format!("{}, {}", described.family(), described.variant());
        bar.set_prefix(name.clone());
        let steps = cases.steps().min(plan.step_limit);
        bar.set_length((steps * cases.list.len().min(plan.case_limit)) as u64);
        let is_base = described.method == "surrogate"
            && described.precision == "f32"
            && described.region == "all";
        let wanted = described.method == "surrogate" && !is_base;
        if wanted && reference.as_ref().is_none_or(|(of, _)| *of != identity) {
            reference = float32_frames(method, &plan)?.map(|frames| (identity.clone(), frames));
        }
        let mut keep =
            (is_base && reference.as_ref().is_none_or(|(of, _)| *of != identity)).then(Vec::new);
        let against = reference
            .as_ref()
            .filter(|(of, _)| *of == identity)
            .map(|(_, frames)| frames.as_slice());
        let outcome = measure::measure(method, &plan, against, &mut keep, &|case, frame| {
            bar.set_position((case * steps + frame) as u64)
        });
        match outcome {
            Ok(measurement) => {
                if let Some(frames) = keep {
                    reference = Some((identity.clone(), frames));
                }
                cache.store(&key, &measurement)?;
                measurements.push(measurement);
            }
            Err(error) => notes.push(format!("{name}: {error:#}")),
        }
    }
    bar.finish_and_clear();
    Ok(measurements)
}

/// The frames of the first case, from the second on, by the plain float32 path of the method's bundle: CPU, one thread, all nodes.
fn float32_frames(method: &Method, plan: &Plan<'_>) -> Result<Option<Vec<Vec<[f32; 3]>>>> {
    let Method::Surrogate {
        bundle,
        corrections,
        ..
    } = method
    else {
        return Ok(None);
    };
    let plain = Method::Surrogate {
        bundle: bundle.clone(),
        provider: Provider::Cpu,
        precision: Precision::F32,
        region: Region::All,
        threads: 1,
        corrections: *corrections,
    };
    let quick = Plan {
        case_limit: 1,
        pictured: &[],
        hausdorff: false,
        ..*plan
    };
    let mut keep = Some(Vec::new());
    measure::measure(&plain, &quick, None, &mut keep, &|_, _| ())?;
    Ok(keep)
}
