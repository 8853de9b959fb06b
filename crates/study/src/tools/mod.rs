//! The yardstick from pose to picture (`upt-study report --tools`): the library is driven by the poses of rigid tools alone, step by
//! step from its own last state, and is measured by the reference solver's answer to the same poses.
//!
//! | module | what |
//! |---|---|
//! | [`row`] | the rows over cases |
//! | [`film`], [`section`], [`force`], [`table`], [`page`], `write` | what is shown |

mod film;
mod force;
mod measured;
mod page;
mod row;
pub mod section;
mod table;
mod write;

use std::process::ExitCode;

use anyhow::{Result, bail};
use serde_json::json;

use crate::posed::Posed;
use crate::report::options::Options;
use host::Effort;
use measured::Measured;
use row::Label;
use upt_cli::progress;
use write::{Made, write};
use yardstick::bundle_folder::BundleFolder;
use yardstick::drive::Drive;
use yardstick::measure::Truth;
use yardstick::prior_alone::PriorAlone;
use yardstick::yard::Yard;
use yardstick::{CaseFigures, Method};

/// Measures, and writes tools.json and tools.html.
pub fn report(options: &Options) -> Result<ExitCode> {
    let mut posed = Posed::asked(options)?;
    let Posed { cases, mesh, .. } = &posed;
    cases.check_steps()?;
    let mut yard = Yard::new(mesh, posed.boundary);
    let truths: Vec<Truth> = cases
        .list
        .iter()
        .map(|case| Truth::of(case, mesh, posed.boundary, &mut yard))
        .collect();
    let figures: Vec<CaseFigures> = cases
        .list
        .iter()
        .zip(&truths)
        .map(|(case, truth)| CaseFigures::of_truth(case, truth))
        .collect();
    let label = Label {
        bundle: String::new(),
        drive: "reference solver",
        corrections: Effort::NONE,
    };
    let mut rows = row::rows(&label, &figures);
    let mut details = vec![json!({"method": label.drive, "cases": figures})];
    let mut all = Vec::new();
    let methods = methods(options, &posed.bundles);
    let mut notes = Vec::new();
    for method in &methods {
        let name = method.name();
        match method.measure(
            options.most_threads(),
            cases,
            mesh,
            &truths,
            &mut yard,
            &progress::watch(false),
        ) {
            Ok((outcomes, figures)) => {
                details.push(json!({"method": name, "cases": figures}));
                rows.extend(row::rows(&label_of(method), &figures));
                all.push(Measured { name, outcomes });
            }
            Err(error) => notes.push(format!("{name}: {error:#}")),
        }
    }
    if all.is_empty() {
        bail!("nothing could be measured: {}", notes.join("; "));
    }
    let viewer = film::viewer(&methods, cases, mesh, options.most_threads())?;
    posed.notes.extend(notes);
    let made = Made {
        posed,
        viewer,
        truths,
        all,
        rows,
        details,
    };
    let report = write(options, &made)?;
    let publisher = options.publisher();
    publisher.say(&table::text(&made.rows));
    publisher.end(&report, &made.posed.notes)?;
    publisher.say(&options.out.join("tools.html").to_string_lossy());
    Ok(ExitCode::SUCCESS)
}

fn methods(options: &Options, bundles: &[BundleFolder]) -> Vec<Method> {
    let mut methods = Vec::new();
    for bundle in bundles {
        let mut counts = match bundle.corrections {
            None => vec![Effort::NONE],
            Some(recommended) if options.corrections.is_empty() => vec![Effort::NONE, recommended],
            Some(_) => options.corrections.to_vec(),
        };
        counts.dedup();
        let mut add = |drive, counts: &[Effort]| {
            methods.extend(counts.iter().map(|corrections| Method {
                bundle: bundle.clone(),
                drive,
                corrections: *corrections,
            }));
        };
        add(Drive::Solved, &counts);
        if PriorAlone::available(bundle) {
            add(Drive::Linear, &[Effort::NONE]);
        }
        add(Drive::Geometric, &counts);
    }
    methods
}

fn label_of(method: &Method) -> Label {
    Label {
        bundle: method.bundle.name.clone(),
        drive: method.drive.name(),
        corrections: method.corrections,
    }
}
