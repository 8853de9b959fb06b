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

use crate::posed::Posed;
use crate::publish;
use crate::report::options::Options;
use ::host::Effort;
use ::host::{Model, ModelSettings};
use figures::CaseFigures;
use host::{Clock, Shown};
use truth::Truth;
use upt_cli::counted::counted;
use yardstick::drive::{Drive, Driver};
use yardstick::yard::Yard;

/// Measures, and writes shown.json and the pictures.
pub fn report(options: &Options, hz: f64) -> Result<ExitCode> {
    let corrections = options.corrections.first().copied();
    let clock = Clock::new(hz, options.arrival_ms)?;
    let mut posed = Posed::asked(options)?;
    let Posed { cases, mesh, .. } = &posed;
    let truths = Truth::of_all(cases)?;
    let mut yard = Yard::new(mesh, posed.boundary);
    std::fs::create_dir_all(&options.out)
        .with_context(|| format!("cannot make {}", options.out.display()))?;
    let publisher = options.publisher();
    let (mut reports, mut notes) = (Vec::new(), Vec::new());
    for bundle in &posed.bundles {
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
        let (mut outcomes, mut figures): (Vec<Shown>, Vec<CaseFigures>) = Default::default();
        posed.each(&bundle.name, |at, case| {
            let shown = host::show(case, &truths[at], &clock, &mut driver, &mut yard)?;
            figures.push(CaseFigures::of(case, &shown));
            outcomes.push(shown);
            Ok(())
        })?;
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
            posed.each(&format!("{}, {length}", bundle.name), |at, case| {
                let shown = host::show(case, &truths[at], &clock, &mut driver, &mut yard)?;
                figures[at].add(case, &shown, length);
                if between.len() < cases.list.len() {
                    between.push(shown);
                }
                Ok(())
            })?;
        }
        let settings = ModelSettings {
            step_s: model.info().frame_step_s,
            ..settings.clone()
        };
        let times = timing::measure(
            &mut Driver::new(&Model::open(&bundle.path, &settings)?, Drive::Solved)?,
            mesh,
            cases,
            &truths,
            &clock.stepping(settings.step_s),
        )?;
        let rows = figures::rows(&figures);
        let datasets = figures::by_dataset(&figures, host::WAYS.len());
        let k = corrections.or(bundle.corrections).unwrap_or(Effort::NONE);
        let lead = format!(
            "`{}`, k = {k}, {}, frames at {} Hz, each state {} ms after its step's moment, {}. {}.",
            bundle.name,
            posed.said(),
            hz,
            options.arrival_ms,
            counted(options.most_threads() as usize, "thread"),
            posed.place(),
        );
        let text = page::markdown(&lead, &rows, &datasets, &times);
        publisher.part(&format!("study report --shown {}", bundle.name), &text)?;
        let pictures = page::pictures(
            &options.out,
            &bundle.name,
            (mesh, cases, &truths),
            [&outcomes, &between],
        )?;
        for path in pictures {
            publisher.say(&path.to_string_lossy());
        }
        reports.push(json!({"bundle": bundle.name, "corrections": k.to_string(), "rows": rows, "datasets": datasets, "present": times, "cases": figures}));
    }
    posed.notes.extend(notes);
    if reports.is_empty() {
        bail!("nothing could be measured: {}", posed.notes.join("; "));
    }
    let mut report = posed.origin(options.most_threads());
    report["hz"] = json!(hz);
    report["arrival_ms"] = json!(options.arrival_ms);
    report["bundles"] = json!(reports);
    publish::file(&options.out.join("shown.json"), &report)?;
    publisher.end(&report, &posed.notes)?;
    Ok(ExitCode::SUCCESS)
}
