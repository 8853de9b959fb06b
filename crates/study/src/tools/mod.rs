//! The yardstick from pose to picture (`upt-study report --tools`): the library is driven by the poses of rigid tools alone, step by
//! step from its own last state, and is measured by the reference solver's answer to the same poses.
//!
//! | module | what |
//! |---|---|
//! | [`bundles`] | the bundles that fit the cases |
//! | [`row`] | the rows over cases |
//! | [`film`], [`section`], [`force`], [`table`], [`page`], `write` | what is shown |

pub mod bundles;
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
use tissue::mesh::{Boundary, Mesh};

use crate::report::options::Options;
use host::Effort;
use measured::Measured;
use row::Label;
use upt_cli::progress;
use write::{Made, write};
use yardstick::bundle_folder::BundleFolder;
use yardstick::cases::ToolCases;
use yardstick::drive::Drive;
use yardstick::measure::Truth;
use yardstick::prior_alone::PriorAlone;
use yardstick::yard::Yard;
use yardstick::{CaseFigures, Method};

/// Measures, and writes tools.json and tools.html.
pub fn report(options: &Options) -> Result<ExitCode> {
    let cases = ToolCases::read(&options.tools, options.split, options.cases)?;
    let mut notes = Vec::new();
    cases.check_steps()?;
    let bundles = bundles::fitting(&options.bundles, &cases, &mut notes)?;
    let boundary: Boundary = cases.boundary.parse().map_err(anyhow::Error::msg)?;
    let mesh = Mesh::read(&bundles[0].mesh_file)?;
    cases.check(&mesh)?;
    let mut yard = Yard::new(&mesh, boundary);
    let truths: Vec<Truth> = cases
        .list
        .iter()
        .map(|case| Truth::of(case, &mesh, boundary, &mut yard))
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
    let methods = methods(options, &bundles);
    for method in &methods {
        let name = method.name();
        match method.measure(
            options.most_threads(),
            &cases,
            &mesh,
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
    let viewer = film::viewer(&methods, &cases, &mesh, options.most_threads())?;
    let made = Made {
        cases,
        mesh,
        viewer,
        truths,
        all,
        rows,
        details,
        notes,
    };
    let report = write(options, &made)?;
    if options.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        print!("{}", table::text(&made.rows));
        for note in &made.notes {
            println!("left out: {note}");
        }
        println!("{}", options.out.join("tools.html").display());
    }
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
