//! `upt-study report`: error against run time, for the library and for the plain methods.
//!
//! Every row replays the same held-out contacts autoregressively and is timed step by step around the
//! C call. Finished rows are kept by content, so that an interrupted report goes on where it was.

mod cache;
pub mod cases;
mod choose;
mod film;
mod float32;
pub mod html;
mod measure;
pub mod method;
pub mod options;
mod paper_split;
pub mod pictures;
mod plot;
mod row;
mod same_body;
pub mod table;
mod write;

use std::process::ExitCode;

use anyhow::{Result, bail};
use tissue::mesh::Mesh;

use crate::cuts;
use crate::hang_report;
use crate::load_report;
use crate::mobilise_report;
use crate::shown;
use crate::tools;
use cache::Cache;
use yardstick::machine::Machine;

use cases::Cases;
use float32::float32_frames;
use measure::Plan;
use method::Method;
pub use options::Options;
use row::Measurement;
use yardstick::setting::Region;

pub fn run(options: &Options) -> Result<ExitCode> {
    if !options.load.is_empty() {
        return load_report::report(options);
    }
    if options.cut > 0 {
        return cuts::report(options);
    }
    if options.mobilise {
        return mobilise_report::report(options);
    }
    if options.hang > 0 {
        return hang_report::report(options);
    }
    if let Some(hz) = options.shown {
        return shown::report(options, hz);
    }
    if !options.step_ms.is_empty() {
        return shown::steps::report(options);
    }
    if !options.tools.is_empty() {
        return tools::report(options);
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
    let rows: Vec<&row::Row> = measurements.iter().map(|one| &one.row).collect();
    let publisher = options.publisher();
    publisher.say(&table::text(&rows));
    publisher.end(&report, &notes)?;
    publisher.say(&options.out.join("report.html").to_string_lossy());
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
