//! The report's files: report.json, report.html, and report.md for a document.

use anyhow::Result;
use serde_json::json;
use tissue::mesh::Mesh;
use tissue::trajectory::TrajectoryHeader;

use super::cases::Cases;
use super::row::{Measurement, Row};
use super::{Options, html, pictures, table};
use crate::date::date;
use crate::publish;
use yardstick::machine::Machine;

/// What was measured on which cases: all that a report says.
pub struct Findings<'a> {
    pub cases: &'a Cases,
    pub mesh: &'a Mesh,
    pub measurements: &'a [Measurement],
    /// Case and frame of each picture.
    pub moments: &'a [(usize, usize)],
    pub machine: &'a Machine,
    /// What was left out, and why.
    pub notes: &'a [String],
    /// A film in 3D for the page.
    pub viewer: Option<String>,
}

/// When a report was made, and with which ONNX Runtime.
struct Made {
    date: String,
    runtime: String,
}

impl Made {
    fn now() -> Self {
        let runtime = upt::onnx::Runtime::get(None);
        Self {
            date: date(),
            runtime: runtime.map_or_else(|error| error.to_string(), |r| r.version().to_owned()),
        }
    }
}

impl Findings<'_> {
    /// Writes report.json, report.md and report.html; returns the first.
    pub fn write(self, options: &Options) -> Result<serde_json::Value> {
        let made = Made::now();
        let report = self.json(&made);
        publish::file(&options.out.join("report.json"), &report)?;
        std::fs::write(options.out.join("report.md"), self.document(&made))?;
        let title = options.title.as_deref();
        let page = self.page(&made, title.unwrap_or("Error against run time"))?;
        std::fs::write(options.out.join("report.html"), page)?;
        Ok(report)
    }

    fn header(&self) -> &TrajectoryHeader {
        &self.cases.list[0].trajectory.header
    }

    fn names(&self) -> Vec<&str> {
        let cases = self.cases.list.iter();
        cases.map(|case| case.name.as_str()).collect()
    }

    fn json(&self, made: &Made) -> serde_json::Value {
        let header = self.header();
        let rows: Vec<&Row> = self.measurements.iter().map(|one| &one.row).collect();
        json!({
            "machine": self.machine,
            "date": made.date,
            "versions": {"upt": env!("CARGO_PKG_VERSION"), "onnxruntime": made.runtime, "solver": header.solver},
            "mesh": {
                "name": header.mesh_name,
                "sha256": self.cases.mesh_sha256,
                "nodes": self.mesh.node_count(),
                "boundary": self.cases.boundary,
            },
            "cases": self.names(),
            "left_out": self.notes,
            "rows": rows,
        })
    }

    /// A paragraph that says what was measured where, the table, and what was left out.
    fn document(&self, made: &Made) -> String {
        let rows: Vec<&Row> = self.measurements.iter().map(|one| &one.row).collect();
        let left_out = self
            .notes
            .iter()
            .map(|note| format!("\nLeft out: {note}\n"));
        format!(
            "{} held-out contacts of 8 s on {} nodes, boundary condition `{}`, replayed autoregressively; {}, {} cores, {}.\n\n{}{}\n",
            self.cases.list.len(),
            self.mesh.node_count(),
            self.cases.boundary,
            self.machine.cpu,
            self.machine.cores,
            made.date,
            table::markdown(&rows),
            left_out.collect::<String>()
        )
    }

    /// The lines above the page's tables: machine, versions, mesh, cases, and the digest of each bundle.
    fn facts(&self, made: &Made) -> html::Facts {
        let (machine, header) = (self.machine, self.header());
        let mut facts: html::Facts = [
            (
                "machine",
                format!(
                    "{}, {} cores, {} GB, {}",
                    machine.cpu, machine.cores, machine.memory_gb, machine.os
                ),
            ),
            ("features", machine.features.join(" ")),
            ("date", made.date.clone()),
            (
                "versions",
                format!(
                    "upt {}, ONNX Runtime {}, reference {}",
                    env!("CARGO_PKG_VERSION"),
                    made.runtime,
                    header.solver
                ),
            ),
            (
                "mesh",
                format!(
                    "{}, {} nodes, boundary `{}`, {}",
                    header.mesh_name,
                    self.mesh.node_count(),
                    self.cases.boundary,
                    self.cases.mesh_sha256
                ),
            ),
            ("cases", self.names().join("; ")),
        ]
        .map(|(name, text)| (name.into(), text))
        .into();
        let mut seen = Vec::new();
        let rows = self.measurements.iter().map(|one| &one.row);
        for row in rows.filter(|row| !row.bundle.is_empty()) {
            if !seen.contains(&&row.bundle_sha256) {
                seen.push(&row.bundle_sha256);
                facts.push((format!("bundle {}", row.bundle), row.bundle_sha256.clone()));
            }
        }
        facts
    }

    fn page(self, made: &Made, title: &str) -> Result<String> {
        let shown = one_a_family(self.measurements);
        let in_pictures: Vec<&Measurement> = (shown.iter())
            .map(|index| &self.measurements[*index])
            .filter(|one| !matches!(one.row.method.as_str(), "TLED" | "predict zero"))
            .collect();
        let cases = &self.cases.list;
        let lead = format!(
            "{} on {} ({} nodes), replayed autoregressively by every method on {}.",
            match cases.len() {
                1 => "One contact".to_owned(),
                count => format!("{count} contacts"),
            },
            self.header().mesh_name,
            self.mesh.node_count(),
            self.machine.cpu
        );
        let notes = self.notes.iter().map(|note| format!("Left out: {note}"));
        Ok(html::page(&html::Page {
            title,
            lead,
            facts: self.facts(made),
            measurements: self.measurements,
            galleries: pictures::galleries(self.mesh, cases, self.moments, &in_pictures)?,
            dt: self.header().dt_s,
            notes: notes.collect(),
            viewer: self.viewer,
            shown,
        }))
    }
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
