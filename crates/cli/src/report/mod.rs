//! `upt report`: error against run time, for the library and for the plain methods beside it.
//!
//! Every row replays the same held-out contacts autoregressively and is timed step by step around the
//! C call. Finished rows are kept by content, so that an interrupted report goes on where it was.

mod cache;
mod cases;
pub mod errors;
mod html;
mod measure;
pub mod method;
mod paper_split;
pub mod pictures;
mod plot;
mod row;
mod table;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::json;
use tissue::mesh::Mesh;

use crate::machine::Machine;
use cache::Cache;
use cases::Cases;
use measure::Plan;
use method::{BundleFolder, Method, Precision, Provider, Region};
use row::Measurement;

#[derive(Args)]
#[command(after_help = "Examples:
  upt report --data data/brain-fixed --cases 2 --out target/report
  upt report --trajectory push.trajectory.safetensors --bundle onnx/brain-reduced --plain zero,linear
  upt report --data data/brain-fixed --threads 1,2 --region all,surface --precision f32,bf16 --json

report.json and report.html are written to --out; the table goes to the terminal.")]
pub struct Options {
    /// Bundles; default: all below onnx/ that fit the cases' mesh and boundary condition.
    #[arg(long = "bundle", value_name = "FOLDER")]
    bundles: Vec<PathBuf>,
    /// A trajectory to replay (repeat for several).
    #[arg(long = "trajectory", value_name = "FILE")]
    trajectories: Vec<PathBuf>,
    /// A dataset folder whose test split is replayed (repeat for several).
    #[arg(long = "data", value_name = "FOLDER")]
    data: Vec<PathBuf>,
    /// Cases of each scheme at most.
    #[arg(long, default_value_t = 2)]
    cases: usize,
    /// Folder for report.json, report.html and the finished rows.
    #[arg(long, default_value = "target/report")]
    out: PathBuf,
    #[arg(long, value_delimiter = ',', default_values_t = default_threads())]
    threads: Vec<u32>,
    #[arg(long, value_delimiter = ',', default_value = "all,surface")]
    region: Vec<Region>,
    #[arg(long, value_delimiter = ',', default_value = "f32")]
    precision: Vec<Precision>,
    #[arg(long, value_delimiter = ',', default_value = "cpu")]
    provider: Vec<Provider>,
    /// Plain methods beside the library: zero, linear, coarse, tled, paper; or none.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "zero,linear,coarse,tled,paper"
    )]
    plain: Vec<String>,
    /// The mesh of `coarse`.
    #[arg(long, default_value = "onnx/meshes/brain-coarse.mesh.safetensors")]
    coarse_mesh: PathBuf,
    /// Frames of the first case that TLED itself is timed on.
    #[arg(long, default_value_t = 40)]
    tled_frames: usize,
    /// Leave out the Hausdorff distance (the slowest of the metrics).
    #[arg(long)]
    no_hausdorff: bool,
    /// Measure again what is stored.
    #[arg(long)]
    fresh: bool,
    /// The page's title.
    #[arg(long, default_value = "Error against run time")]
    title: String,
    /// Print report.json instead of the table.
    #[arg(long)]
    json: bool,
}

/// One thread, and all of them.
fn default_threads() -> Vec<u32> {
    let all = std::thread::available_parallelism().map_or(1, usize::from) as u32;
    if all > 1 { vec![1, all] } else { vec![1] }
}

pub fn run(options: &Options) -> Result<ExitCode> {
    let cases = Cases::read(&options.trajectories, &options.data, options.cases)?;
    let mut notes = Vec::new();
    let bundles = fitting_bundles(options, &cases, &mut notes)?;
    let mesh = mesh_of(&cases, &bundles)?;
    let methods = methods(options, &cases, &bundles, &mut notes)?;
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
    let report = write(
        options,
        &cases,
        &mesh,
        &measurements,
        &moments,
        &machine,
        &notes,
    )?;
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

/// The bundles whose mesh and boundary are the cases'; the others are named in `notes`.
fn fitting_bundles(
    options: &Options,
    cases: &Cases,
    notes: &mut Vec<String>,
) -> Result<Vec<BundleFolder>> {
    let paths = if options.bundles.is_empty() {
        crate::doctor::bundles_below("onnx".as_ref())
    } else {
        options.bundles.clone()
    };
    let mut fitting = Vec::new();
    for path in &paths {
        let bundle = BundleFolder::read(path)?;
        if bundle.mesh_sha256 != cases.mesh_sha256 {
            notes.push(format!(
                "{}: made for another mesh than the cases'",
                bundle.name
            ));
        } else if bundle.boundary != cases.boundary {
            notes.push(format!(
                "{}: made for the boundary `{}`, the cases have `{}`",
                bundle.name, bundle.boundary, cases.boundary
            ));
        } else {
            fitting.push(bundle);
        }
    }
    Ok(fitting)
}

/// The cases' mesh: out of a fitting bundle, or of onnx/meshes.
fn mesh_of(cases: &Cases, bundles: &[BundleFolder]) -> Result<Mesh> {
    let mut candidates: Vec<PathBuf> = bundles
        .iter()
        .map(|bundle| bundle.mesh_file.clone())
        .collect();
    if let Ok(entries) = std::fs::read_dir("onnx/meshes") {
        candidates.extend(entries.filter_map(|entry| entry.ok().map(|entry| entry.path())));
    }
    for path in candidates {
        if path
            .extension()
            .is_some_and(|extension| extension == "safetensors")
        {
            let mesh = Mesh::read(&path)?;
            if mesh.hash() == cases.mesh_sha256 {
                return Ok(mesh);
            }
        }
    }
    bail!(
        "no bundle and no file of onnx/meshes has the cases' mesh ({}); name a bundle with --bundle",
        cases.mesh_sha256
    )
}

/// Every configuration asked for.
fn methods(
    options: &Options,
    cases: &Cases,
    bundles: &[BundleFolder],
    notes: &mut Vec<String>,
) -> Result<Vec<Method>> {
    let most = options.threads.iter().copied().max().unwrap_or(1);
    let mut methods = Vec::new();
    for bundle in bundles {
        for provider in &options.provider {
            for precision in &options.precision {
                for region in &options.region {
                    for threads in &options.threads {
                        methods.push(Method::Surrogate {
                            bundle: bundle.clone(),
                            provider: *provider,
                            precision: *precision,
                            region: *region,
                            threads: *threads,
                        });
                    }
                }
            }
        }
    }
    for plain in &options.plain {
        match plain.as_str() {
            "zero" => methods.push(Method::Zero),
            "linear" => methods.push(Method::Linear {
                threads: most,
                decay: cases.release_decay(),
            }),
            "coarse" if options.coarse_mesh.is_file() => {
                if Mesh::read(&options.coarse_mesh)?.hash() == cases.mesh_sha256 {
                    notes.push("coarse TLED: the cases are on the coarse mesh themselves".into());
                    continue;
                }
                methods.extend(options.threads.iter().map(|threads| Method::CoarseTled {
                    mesh: options.coarse_mesh.clone(),
                    threads: *threads,
                }));
            }
            "coarse" => notes.push(format!(
                "coarse TLED: {} does not exist",
                options.coarse_mesh.display()
            )),
            "tled" => methods.extend(
                options
                    .threads
                    .iter()
                    .map(|threads| Method::Tled { threads: *threads }),
            ),
            "paper" => {
                let with_split = bundles
                    .iter()
                    .filter(|bundle| paper_split::available(bundle));
                for bundle in with_split {
                    methods.extend(options.threads.iter().map(|threads| Method::PaperSplit {
                        bundle: bundle.clone(),
                        threads: *threads,
                    }));
                }
            }
            "none" => {}
            other => bail!("--plain {other}: known are zero, linear, coarse, tled, paper, none"),
        }
    }
    Ok(methods)
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
        let name = format!("{}, {}", described.family(), described.variant());
        bar.set_prefix(name.clone());
        let steps = cases.steps().min(plan.step_limit);
        bar.set_length((steps * cases.list.len().min(plan.case_limit)) as u64);
        let is_base = described.method == "surrogate"
            && described.precision == "f32"
            && described.region == "all";
        let wanted = described.method == "surrogate" && !is_base;
        if wanted
            && reference
                .as_ref()
                .is_none_or(|(bundle, _)| *bundle != described.bundle_sha256)
        {
            reference = float32_frames(method, &plan)?
                .map(|frames| (described.bundle_sha256.clone(), frames));
        }
        let mut keep = (is_base
            && reference
                .as_ref()
                .is_none_or(|(bundle, _)| *bundle != described.bundle_sha256))
        .then(Vec::new);
        let against = reference
            .as_ref()
            .filter(|(bundle, _)| *bundle == described.bundle_sha256)
            .map(|(_, frames)| frames.as_slice());
        let outcome = measure::measure(method, &plan, against, &mut keep, &|case, frame| {
            bar.set_position((case * steps + frame) as u64)
        });
        match outcome {
            Ok(measurement) => {
                if let Some(frames) = keep {
                    reference = Some((described.bundle_sha256.clone(), frames));
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

/// The first case by the plain float32 path of the method's bundle: CPU, one thread, all nodes.
fn float32_frames(method: &Method, plan: &Plan<'_>) -> Result<Option<Vec<Vec<[f32; 3]>>>> {
    let Method::Surrogate { bundle, .. } = method else {
        return Ok(None);
    };
    let plain = Method::Surrogate {
        bundle: bundle.clone(),
        provider: Provider::Cpu,
        precision: Precision::F32,
        region: Region::All,
        threads: 1,
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

/// Writes report.json and report.html; returns the former.
fn write(
    options: &Options,
    cases: &Cases,
    mesh: &Mesh,
    measurements: &[Measurement],
    moments: &[(usize, usize)],
    machine: &Machine,
    notes: &[String],
) -> Result<serde_json::Value> {
    std::fs::create_dir_all(&options.out)
        .with_context(|| format!("cannot make {}", options.out.display()))?;
    let header = &cases.list[0].trajectory.header;
    let runtime = upt::onnx::Runtime::get(None).map_or_else(
        |error| error.to_string(),
        |runtime| runtime.version().to_owned(),
    );
    let date = date();
    let rows: Vec<&row::Row> = measurements.iter().map(|one| &one.row).collect();
    let report = json!({
        "machine": machine,
        "date": date,
        "versions": {"upt": env!("CARGO_PKG_VERSION"), "onnxruntime": runtime, "solver": header.solver},
        "mesh": {"name": header.mesh_name, "sha256": cases.mesh_sha256, "nodes": mesh.node_count(), "boundary": cases.boundary},
        "cases": cases.list.iter().map(|case| case.name.as_str()).collect::<Vec<_>>(),
        "left_out": notes,
        "rows": rows,
    });
    std::fs::write(
        options.out.join("report.json"),
        serde_json::to_string_pretty(&report)? + "\n",
    )?;

    let shown = one_a_family(measurements);
    let shown_measurements: Vec<&Measurement> =
        shown.iter().map(|index| &measurements[*index]).collect();
    let in_pictures: Vec<&Measurement> = shown_measurements
        .iter()
        .copied()
        .filter(|one| !matches!(one.row.method.as_str(), "TLED" | "predict zero"))
        .collect();
    let mut facts: html::Facts = vec![
        (
            "machine".into(),
            format!(
                "{}, {} cores, {} GB, {}",
                machine.cpu, machine.cores, machine.memory_gb, machine.os
            ),
        ),
        ("features".into(), machine.features.join(" ")),
        ("date".into(), date),
        (
            "versions".into(),
            format!(
                "upt {}, ONNX Runtime {runtime}, reference {}",
                env!("CARGO_PKG_VERSION"),
                header.solver
            ),
        ),
        (
            "mesh".into(),
            format!(
                "{}, {} nodes, boundary `{}`, {}",
                header.mesh_name,
                mesh.node_count(),
                cases.boundary,
                cases.mesh_sha256
            ),
        ),
        (
            "cases".into(),
            cases
                .list
                .iter()
                .map(|case| case.name.as_str())
                .collect::<Vec<_>>()
                .join("; "),
        ),
    ];
    let mut seen = Vec::new();
    for one in measurements.iter().filter(|one| !one.row.bundle.is_empty()) {
        if !seen.contains(&&one.row.bundle_sha256) {
            seen.push(&one.row.bundle_sha256);
            facts.push((
                format!("bundle {}", one.row.bundle),
                one.row.bundle_sha256.clone(),
            ));
        }
    }
    let page = html::Page {
        title: &options.title,
        lead: format!(
            "{} on {} ({} nodes), replayed autoregressively by every method on {}.",
            match cases.list.len() {
                1 => "One contact".to_owned(),
                count => format!("{count} contacts"),
            },
            header.mesh_name,
            mesh.node_count(),
            machine.cpu
        ),
        facts,
        measurements,
        galleries: pictures::galleries(mesh, &cases.list, moments, &in_pictures)?,
        shown,
        dt: header.dt_s,
        notes: notes
            .iter()
            .map(|note| format!("Left out: {note}"))
            .collect(),
    };
    std::fs::write(options.out.join("report.html"), html::page(&page))?;
    Ok(report)
}

/// One row a family for the curves: float32, all nodes, most threads.
fn one_a_family(measurements: &[Measurement]) -> Vec<usize> {
    let mut shown: Vec<usize> = Vec::new();
    let rank = |one: &Measurement| {
        (
            one.row.precision == "f32",
            one.row.region == "all",
            one.row.threads,
        )
    };
    for (index, one) in measurements.iter().enumerate() {
        match shown
            .iter_mut()
            .find(|at| measurements[**at].row.family() == one.row.family())
        {
            Some(at) if rank(one) > rank(&measurements[*at]) => *at = index,
            Some(_) => {}
            None => shown.push(index),
        }
    }
    shown
}

/// Today in UTC, `YYYY-MM-DD` (Howard Hinnant's civil-from-days).
fn date() -> String {
    let seconds = std::time::SystemTime::now()
        .duration_since(std::time::UNIX_EPOCH)
        .map_or(0, |since| since.as_secs());
    let days = (seconds / 86_400) as i64 + 719_468;
    let era = days / 146_097;
    let day_of_era = days - era * 146_097;
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 {
        shifted + 3
    } else {
        shifted - 9
    };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}
