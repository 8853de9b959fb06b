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

use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use serde_json::json;
use tissue::mesh::{Boundary, Mesh};

use crate::report::options::Options;
use crate::tools::bundles::fitting;
use ::host::Effort;
use ::host::{Model, ModelSettings};
use figures::CaseFigures;
use host::{Clock, Shown};
use truth::Truth;
use upt_cli::counted::counted;
use upt_cli::marks::replace_between;
use upt_cli::progress;
use yardstick::cases::ToolCases;
use yardstick::drive::{Drive, Driver};
use yardstick::machine::{Machine, load_words};
use yardstick::yard::Yard;

/// Measures, and writes shown.json and the pictures.
pub fn report(options: &Options, hz: f64) -> Result<ExitCode> {
    let corrections = options.corrections.first().copied();
    let clock = Clock::new(hz, options.arrival_ms)?;
    let cases = ToolCases::read(&options.tools, options.split, options.cases)?;
    let mut notes = Vec::new();
    let bundles = fitting(&options.bundles, &cases, &mut notes)?;
    let boundary: Boundary = cases.boundary.parse().map_err(anyhow::Error::msg)?;
    let mesh = Mesh::read(&bundles[0].mesh_file)?;
    cases.check(&mesh)?;
    let truths: Vec<Truth> = cases.list.iter().map(Truth::of).collect::<Result<_>>()?;
    let mut yard = Yard::new(&mesh, boundary);
    std::fs::create_dir_all(&options.out)
        .with_context(|| format!("cannot make {}", options.out.display()))?;
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
            threads: options.most_threads(),
            corrections,
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
            options
                .step_ms
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
        let k = corrections.or(bundle.corrections).unwrap_or(Effort::NONE);
        let lead = format!(
            "`{}`, k = {k}, {} on {} ({} nodes), frames at {} Hz, each state {} ms after its step's moment, {}. {} ({}{}), {date}.",
            bundle.name,
            counted(cases.list.len(), "case"),
            header.mesh_name,
            mesh.node_count(),
            hz,
            options.arrival_ms,
            counted(options.most_threads() as usize, "thread"),
            machine.cpu,
            counted(machine.cores, "core"),
            load_words(),
        );
        let text = page::markdown(&lead, &rows, &datasets, &times);
        for path in &options.markdown {
            replace_between(
                path,
                &format!("study report --shown {}", bundle.name),
                &text,
            )?;
        }
        if !options.json {
            println!("{text}");
        }
        let pictures = page::pictures(
            &options.out,
            &bundle.name,
            (&mesh, &cases, &truths),
            [&outcomes, &between],
        )?;
        for path in pictures.iter().filter(|_| !options.json) {
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
        "hz": hz,
        "arrival_ms": options.arrival_ms,
        "threads": options.most_threads(),
        "versions": {"upt": env!("CARGO_PKG_VERSION"), "solver": header.solver},
        "mesh": {"name": header.mesh_name, "sha256": cases.mesh_sha256, "nodes": mesh.node_count(), "boundary": cases.boundary},
        "bundles": reports,
        "left_out": notes,
    });
    let text = serde_json::to_string_pretty(&report)? + "\n";
    std::fs::write(options.out.join("shown.json"), &text)?;
    if options.json {
        print!("{text}");
    }
    for note in notes.iter().filter(|_| !options.json) {
        println!("left out: {note}");
    }
    Ok(ExitCode::SUCCESS)
}
