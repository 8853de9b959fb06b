//! What a host shows between steps (`upt-study report --shown HZ`): a virtual host steps the library every 50 ms with the poses that rigid
//! tools have then, gets each state a while later, and draws frames at an even rate. What it shows is measured by the reference solver's
//! state at the moment of the frame.
//!
//! | module | what |
//! |---|---|
//! | [`truth`] | the reference solver at any moment, from frames shorter than a step |
//! | [`host`] | one case through the virtual host |
//! | [`figures`] | rows over cases |
//! | [`timing`] | the time of a present call |
//! | [`steps`] | the error of steps by their length, without frames between (`upt-study report --step-ms`) |
//! | [`page`] | tables and pictures |

mod figures;
mod host;
mod page;
pub mod steps;
mod timing;
mod truth;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use serde_json::json;
use tissue::mesh::{Boundary, Mesh};

use crate::tools::bundles::fitting;
use figures::CaseFigures;
use host::{Clock, Shown};
use truth::Truth;
use upt_cli::counted::counted;
use upt_cli::effort::Effort;
use upt_cli::host::{Model, ModelSettings};
use upt_cli::machine::{Machine, load_words};
use upt_cli::marks::replace_between;
use upt_cli::progress;
use upt_cli::yardstick::cases::{Split, ToolCases};
use upt_cli::yardstick::drive::{Drive, Driver};
use upt_cli::yardstick::yard::Yard;

/// What is measured.
pub struct Plan<'a> {
    /// Frames a second.
    pub hz: f64,
    /// Time from a step's moment to its state's arrival, ms.
    pub arrival_ms: f64,
    /// Dataset folders and trajectories with frames shorter than a step.
    pub paths: &'a [PathBuf],
    pub split: Split,
    pub per_programme: usize,
    pub bundles: &'a [PathBuf],
    /// Corrections a step; none: as many as a bundle recommends.
    pub corrections: Option<Effort>,
    /// Lengths of step whose frames are measured besides the bundle's and the one that it recommends for frames, ms.
    pub step_ms: &'a [f64],
    pub threads: u32,
    pub out: PathBuf,
    pub markdown: &'a [PathBuf],
    pub json: bool,
}

/// Measures, and writes shown.json and the pictures.
pub fn report(plan: &Plan) -> Result<ExitCode> {
    let clock = Clock::new(plan.hz, plan.arrival_ms)?;
    let cases = ToolCases::read(plan.paths, plan.split, plan.per_programme)?;
    let mut notes = Vec::new();
    let bundles = fitting(plan.bundles, &cases, &mut notes)?;
    let boundary: Boundary = cases.boundary.parse().map_err(anyhow::Error::msg)?;
    let mesh = Mesh::read(&bundles[0].mesh_file)?;
    cases.check(&mesh)?;
    let truths: Vec<Truth> = cases.list.iter().map(Truth::of).collect::<Result<_>>()?;
    let mut yard = Yard::new(&mesh, boundary);
    std::fs::create_dir_all(&plan.out)
        .with_context(|| format!("cannot make {}", plan.out.display()))?;
    let header = &cases.list[0].trajectory.header;
    let (machine, date) = (Machine::this(), crate::date::date());
    let mut reports = Vec::new();
    for bundle in &bundles {
        if bundle.corrections.is_none() {
            notes.push(format!(
                "{}: has no corrections, so it cannot present frames; add them with `upt corrections`",
                bundle.name
            ));
            continue;
        }
        let settings = ModelSettings {
            threads: plan.threads,
            corrections: plan.corrections,
            ..ModelSettings::default()
        };
        let model = Model::open(&bundle.path, &settings)?;
        let mut driver = Driver::new(&model, Drive::Solved)?;
        let bar = progress::cases(cases.list.len(), &bundle.name);
        let (mut outcomes, mut figures): (Vec<Shown>, Vec<CaseFigures>) = Default::default();
        for (case, truth) in cases.list.iter().zip(&truths) {
            let shown = host::show(case, truth, &clock, &mut driver, &mut yard)
                .with_context(|| case.name.clone())?;
            figures.push(CaseFigures::of(case, &shown));
            outcomes.push(shown);
            bar.inc(1);
        }
        bar.finish_and_clear();
        let mut lengths = vec![(
            model.info().frame_step_s,
            format!(
                "the bundle's frame step ({:.0} ms)",
                1e3 * model.info().frame_step_s
            ),
        )];
        lengths.extend(
            plan.step_ms
                .iter()
                .map(|ms| (1e-3 * ms, format!("steps of {ms} ms"))),
        );
        let mut between = Vec::new();
        for (step_s, length) in &lengths {
            let settings = ModelSettings {
                step_s: *step_s,
                ..settings.clone()
            };
            let model = Model::open(&bundle.path, &settings)?;
            let mut driver = Driver::new(&model, Drive::Solved)?;
            let clock = clock.stepping(*step_s);
            let bar = progress::cases(cases.list.len(), &format!("{}, {length}", bundle.name));
            for ((case, truth), figures) in cases.list.iter().zip(&truths).zip(&mut figures) {
                let shown = host::show(case, truth, &clock, &mut driver, &mut yard)
                    .with_context(|| case.name.clone())?;
                figures.add(case, &shown, length);
                if between.len() < cases.list.len() {
                    between.push(shown);
                }
                bar.inc(1);
            }
            bar.finish_and_clear();
        }
        let settings = ModelSettings {
            step_s: model.info().frame_step_s,
            ..settings.clone()
        };
        let times = timing::measure(
            &mut Driver::new(&Model::open(&bundle.path, &settings)?, Drive::Solved)?,
            &mesh,
            &cases,
            &truths,
            &clock.stepping(settings.step_s),
        )?;
        let rows = figures::rows(&figures);
        let datasets = figures::by_dataset(&figures, host::WAYS.len());
        let k = plan
            .corrections
            .or(bundle.corrections)
            .unwrap_or(Effort::NONE);
        let lead = format!(
            "`{}`, k = {k}, {} on {} ({} nodes), frames at {} Hz, each state {} ms after its step's moment, {}. {} ({}{}), {date}.",
            bundle.name,
            counted(cases.list.len(), "case"),
            header.mesh_name,
            mesh.node_count(),
            plan.hz,
            plan.arrival_ms,
            counted(plan.threads as usize, "thread"),
            machine.cpu,
            counted(machine.cores, "core"),
            load_words(),
        );
        let text = page::markdown(&lead, &rows, &datasets, &times);
        for path in plan.markdown {
            replace_between(
                path,
                &format!("study report --shown {}", bundle.name),
                &text,
            )?;
        }
        if !plan.json {
            println!("{text}");
        }
        let pictures = page::pictures(
            &plan.out,
            &bundle.name,
            (&mesh, &cases, &truths),
            [&outcomes, &between],
        )?;
        for path in pictures.iter().filter(|_| !plan.json) {
            println!("{}", path.display());
        }
        reports.push(json!({"bundle": bundle.name, "corrections": k.to_string(), "rows": rows, "datasets": datasets, "present": times, "cases": figures}));
    }
    if reports.is_empty() {
        bail!("nothing could be measured: {}", notes.join("; "));
    }
    let report = json!({
        "machine": machine,
        "date": date,
        "hz": plan.hz,
        "arrival_ms": plan.arrival_ms,
        "threads": plan.threads,
        "versions": {"upt": env!("CARGO_PKG_VERSION"), "solver": header.solver},
        "mesh": {"name": header.mesh_name, "sha256": cases.mesh_sha256, "nodes": mesh.node_count(), "boundary": cases.boundary},
        "bundles": reports,
        "left_out": notes,
    });
    let text = serde_json::to_string_pretty(&report)? + "\n";
    std::fs::write(plan.out.join("shown.json"), &text)?;
    if plan.json {
        print!("{text}");
    }
    for note in notes.iter().filter(|_| !plan.json) {
        println!("left out: {note}");
    }
    Ok(ExitCode::SUCCESS)
}
