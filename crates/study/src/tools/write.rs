//! What `upt-study report --tools` writes: tools.json, tools.html and the tables of documents.

use std::path::Path;

use anyhow::{Context, Result};
use serde_json::json;
use tissue::mesh::Mesh;

use super::measured::Measured;
use super::row::{ALL, Row};
use super::{force, page, section, table};
use crate::posed::Posed;
use crate::publish;
use crate::report::options::Options;
use crate::table::Table;
use picture::plot::colour;
use upt_cli::counted::counted;
use upt_cli::marks::replace_between;
use yardstick::cases::ToolCases;
use yardstick::drive::Drive;
use yardstick::measure::{Outcome, Truth};

/// The first case of each programme, with every method in it.
fn pictures(
    cases: &ToolCases,
    mesh: &Mesh,
    truths: &[Truth],
    all: &[Measured],
) -> Vec<page::Pictured> {
    let mut seen: Vec<&str> = Vec::new();
    let mut pictured = Vec::new();
    for (index, case) in cases.list.iter().enumerate() {
        if seen.contains(&case.programme.as_str()) {
            continue;
        }
        seen.push(&case.programme);
        let frame = case.moment();
        let time = frame as f64 * case.trajectory.header.dt_s;
        let each = all.iter().enumerate().map(|(at, one)| {
            let outcome = &one.outcomes[index];
            let mse = outcome.moments[frame - 1].mse_mm2;
            let name = format!("{}: MSE {} mm²", one.name, picture::plot::label(mse));
            section::picture(mesh, case, frame, &outcome.pictured, &name, colour(at))
        });
        let lines: Vec<(&Outcome, &str)> = all
            .iter()
            .enumerate()
            .map(|(at, one)| (&one.outcomes[index], colour(at)))
            .collect();
        pictured.push(page::Pictured {
            title: format!("{}: {time:.2} s", case.name),
            sections: each.collect(),
            forces: force::plots(case, &truths[index], &lines),
        });
    }
    pictured
}

/// What a report is written from.
pub(super) struct Made {
    pub posed: Posed,
    pub viewer: Option<String>,
    pub truths: Vec<Truth>,
    pub all: Vec<Measured>,
    pub rows: Vec<Row>,
    pub details: Vec<serde_json::Value>,
}

/// Writes all of it; returns what tools.json holds.
pub(super) fn write(options: &Options, made: &Made) -> Result<serde_json::Value> {
    let Made {
        posed, all, rows, ..
    } = made;
    let threads = options.most_threads();
    let mut report = posed.origin(threads);
    report["rows"] = json!(rows);
    report["methods"] = json!(made.details);
    publish::file(&options.out.join("tools.json"), &report)?;
    let lead = format!(
        "{}, every method driven by the tools' poses alone.",
        posed.said()
    );
    let page = page::Page {
        title: options.title.as_deref().unwrap_or("From pose to picture"),
        lead: lead.clone(),
        rows,
        keys: all
            .iter()
            .enumerate()
            .map(|(at, one)| (one.name.clone(), colour(at)))
            .collect(),
        pictured: pictures(&posed.cases, &posed.mesh, &made.truths, all),
        viewer: made.viewer.clone(),
        notes: posed
            .notes
            .iter()
            .map(|n| format!("Left out: {n}"))
            .collect(),
        facts: posed.facts(threads),
    };
    std::fs::write(options.out.join("tools.html"), page::page(&page))?;
    let made = format!(
        "{lead} {}, {}.",
        counted(threads as usize, "thread"),
        posed.place()
    );
    let header = posed.header();
    for path in &options.markdown {
        let cases = match header.boundary.as_str() {
            "fixed" => header.mesh_name.clone(),
            other => format!("{} --boundary {other}", header.mesh_name),
        };
        document(path, &cases, &made, rows)?;
    }
    Ok(report)
}

/// Writes the tables of a document: all columns between the marks `study report --tools MESH [--boundary NAME]`, and few between those
/// with `summary` behind; one of them may be missing.
fn document(path: &Path, cases: &str, made: &str, rows: &[Row]) -> Result<()> {
    let name = format!("study report --tools {cases}");
    let summary = format!("{name} summary");
    let over_all: Vec<&Row> = rows.iter().filter(|row| row.programme == ALL).collect();
    let page = std::fs::read_to_string(path).with_context(|| format!("{}", path.display()))?;
    let has = |name: &str| page.contains(&format!("begin: {name} -->"));
    if has(&name) || !has(&summary) {
        let solved = |row: &&&Row| {
            let corrected = row.corrections.most > 0 && row.drive == Drive::Solved.name();
            row.bundle.is_empty() || corrected
        };
        let each = table::by_programme(rows);
        let text = format!(
            "\n{made}\n\n{}\nBy programme, where contact is solved inside the corrections:\n\n{}",
            Table::of(&[0, 2], table::COLUMNS, over_all.iter().copied()).markdown(),
            Table::of(&[0, 2], table::COLUMNS, each.iter().filter(solved).copied()).markdown()
        );
        replace_between(path, &name, &text)?;
    }
    if has(&summary) {
        // The geometric rule once, with the most corrections: their number hardly matters to it.
        let most = rows.iter().map(|row| row.corrections.most).max();
        let methods = over_all
            .into_iter()
            .filter(|row| !row.bundle.is_empty())
            .filter(|row| {
                row.drive != Drive::Geometric.name() || Some(row.corrections.most) == most
            });
        let table = Table::of(&[0], table::FEW, methods).markdown();
        replace_between(path, &summary, &format!("\n{made}\n\n{table}"))?;
    }
    Ok(())
}
