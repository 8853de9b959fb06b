//! The yardstick from pose to picture (`upt report --tools`): the library is driven by the poses of rigid tools alone, step by
//! step from its own last state, and is measured by the reference solver's answer to the same poses.
//!
//! | module | what |
//! |---|---|
//! | [`cases`], [`bundles`] | trajectories with tools, and what fits them |
//! | [`drive`] | how the library is driven |
//! | [`yard`] | det F and penetration of one state |
//! | [`measure`], [`row`] | a case, and the rows over cases |
//! | [`film`], [`section`], [`force`], [`table`], [`page`], `write` | what is shown |

pub mod bundles;
pub mod cases;
pub mod drive;
mod film;
mod force;
pub mod measure;
mod page;
mod plan;
mod row;
pub mod section;
mod table;
mod write;
pub mod yard;

use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use serde_json::json;
use tissue::mesh::{Boundary, Mesh};

use crate::effort::Effort;
use crate::host;
use crate::report::method::BundleFolder;
use crate::report::prior_alone::PriorAlone;
use crate::stress::progress;
use cases::ToolCases;
use drive::{Drive, Driver};
use measure::Truth;
pub use plan::Plan;
use plan::{Measured, Method};
pub use row::CaseFigures;
use row::Label;
use write::{Made, write};
use yard::Yard;

/// Measures, and writes tools.json and tools.html.
pub fn report(plan: &Plan) -> Result<ExitCode> {
    let cases = ToolCases::read(plan.paths, plan.split, plan.per_programme)?;
    let mut notes = Vec::new();
    cases.check_steps()?;
    let bundles = bundles::fitting(plan.bundles, &cases, &mut notes)?;
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
    let methods = methods(plan, &bundles);
    for method in &methods {
        let name = method.name();
        match measure_all(method, plan.threads, &cases, &mesh, &truths, &mut yard) {
            Ok(measured) => {
                details.push(json!({"method": name, "cases": measured.figures}));
                rows.extend(measured.rows.iter().cloned());
                all.push(measured);
            }
            Err(error) => notes.push(format!("{name}: {error:#}")),
        }
    }
    if all.is_empty() {
        bail!("nothing could be measured: {}", notes.join("; "));
    }
    let viewer = film::viewer(&methods, &cases, &mesh, plan.threads)?;
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
    let report = write(plan, &made)?;
    if plan.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
    } else {
        print!("{}", table::text(&made.rows));
        for note in &made.notes {
            println!("left out: {note}");
        }
        println!("{}", plan.out.join("tools.html").display());
    }
    Ok(ExitCode::SUCCESS)
}

fn methods(plan: &Plan, bundles: &[BundleFolder]) -> Vec<Method> {
    let mut methods = Vec::new();
    for bundle in bundles {
        let mut counts = match bundle.corrections {
            None => vec![Effort::NONE],
            Some(recommended) if plan.corrections.is_empty() => vec![Effort::NONE, recommended],
            Some(_) => plan.corrections.to_vec(),
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

fn measure_all(
    method: &Method,
    threads: u32,
    cases: &ToolCases,
    mesh: &Mesh,
    truths: &[Truth],
    yard: &mut Yard,
) -> Result<Measured> {
    let settings = host::ModelSettings {
        threads,
        corrections: Some(method.corrections),
        ..host::ModelSettings::default()
    };
    let model = host::Model::open(&method.bundle.path, &settings)?;
    let mut driver = match method.drive {
        Drive::Linear => Driver::of_linear(
            &model,
            &method.bundle,
            mesh,
            cases.boundary.parse().map_err(anyhow::Error::msg)?,
            cases.release_decay(),
            threads,
        )?,
        drive => Driver::new(&model, drive)?,
    };
    let name = method.name();
    let bar = progress(cases.list.len(), &name);
    let (mut outcomes, mut figures) = (Vec::new(), Vec::new());
    for (case, truth) in cases.list.iter().zip(truths) {
        let outcome =
            measure::measure(case, truth, &mut driver, yard).with_context(|| case.name.clone())?;
        figures.push(CaseFigures::of(case, truth, &outcome));
        outcomes.push(outcome);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(Measured {
        rows: row::rows(&method.label(), &figures),
        name,
        outcomes,
        figures,
    })
}

/// The figures of a bundle that tools drive, with `corrections` a step, case by case.
///
/// # Errors
/// Names the case or the bundle.
pub fn solved(
    bundle: &BundleFolder,
    corrections: Effort,
    cases: &ToolCases,
    mesh: &Mesh,
    threads: u32,
) -> Result<Vec<CaseFigures>> {
    let boundary: Boundary = cases.boundary.parse().map_err(anyhow::Error::msg)?;
    let mut yard = Yard::new(mesh, boundary);
    let truth = |case| Truth::of(case, mesh, boundary, &mut yard);
    let truths: Vec<Truth> = cases.list.iter().map(truth).collect();
    let method = Method {
        bundle: bundle.clone(),
        drive: Drive::Solved,
        corrections,
    };
    Ok(measure_all(&method, threads, cases, mesh, &truths, &mut yard)?.figures)
}
