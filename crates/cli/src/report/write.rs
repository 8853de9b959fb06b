//! The report's files: report.json and report.html.

use anyhow::{Context, Result};
use serde_json::json;
use tissue::mesh::Mesh;

use super::cases::Cases;
use super::row::{Measurement, Row};
use super::{Options, html, pictures};
use crate::machine::Machine;

/// Writes report.json and report.html; returns the former.
#[expect(clippy::too_many_arguments, reason = "all that a report is made from")]
pub fn write(
    options: &Options,
    cases: &Cases,
    mesh: &Mesh,
    measurements: &[Measurement],
    moments: &[(usize, usize)],
    machine: &Machine,
    notes: &[String],
    viewer: Option<String>,
) -> Result<serde_json::Value> {
    std::fs::create_dir_all(&options.out)
        .with_context(|| format!("cannot make {}", options.out.display()))?;
    let header = &cases.list[0].trajectory.header;
    let runtime = upt::onnx::Runtime::get(None).map_or_else(
        |error| error.to_string(),
        |runtime| runtime.version().to_owned(),
    );
    let date = date();
    let rows: Vec<&Row> = measurements.iter().map(|one| &one.row).collect();
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
        title: options.title.as_deref().unwrap_or("Error against run time"),
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
        viewer,
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
pub fn date() -> String {
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
