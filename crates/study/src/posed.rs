//! Cases of rigid tools and the bundles that fit them: what `report --tools`, `--shown`, `--step-ms` and `envelope` measure.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};
use tissue::mesh::{Boundary, Mesh};
use tissue::trajectory::TrajectoryHeader;
use upt_cli::counted::counted;
use upt_cli::progress;
use yardstick::bundle_folder::BundleFolder;
use yardstick::cases::{Split, ToolCase, ToolCases};
use yardstick::machine::{Machine, load_words};

use crate::date::date;
use crate::report::options::Options;

/// All on one mesh under one boundary condition.
pub struct Posed {
    pub cases: ToolCases,
    pub bundles: Vec<BundleFolder>,
    pub mesh: Mesh,
    pub boundary: Boundary,
    machine: Machine,
    date: String,
    /// What was left out, and why.
    pub notes: Vec<String>,
}

impl Posed {
    /// The cases of `paths`, at most `most` of each programme, and the bundles made for their mesh, boundary and tissue.
    ///
    /// # Errors
    /// No case; cases that are not alike; a bundle was named that does not fit.
    pub fn read(paths: &[PathBuf], split: Split, most: usize, named: &[PathBuf]) -> Result<Self> {
        let cases = ToolCases::read(paths, split, most)?;
        let mut notes = Vec::new();
        let bundles = fitting(named, &cases, &mut notes)?;
        let mesh = Mesh::read(&bundles[0].mesh_file)?;
        cases.check(&mesh)?;
        Ok(Self {
            boundary: cases.boundary.parse().map_err(anyhow::Error::msg)?,
            cases,
            bundles,
            mesh,
            machine: Machine::this(),
            date: date(),
            notes,
        })
    }

    /// What a report asks for.
    pub fn asked(options: &Options) -> Result<Self> {
        Self::read(
            &options.tools,
            options.split,
            options.cases,
            &options.bundles,
        )
    }

    pub fn header(&self) -> &TrajectoryHeader {
        &self.cases.list[0].trajectory.header
    }

    /// Does something with each case behind a bar; an error names its case.
    pub fn each(
        &self,
        title: &str,
        mut own: impl FnMut(usize, &ToolCase) -> Result<()>,
    ) -> Result<()> {
        let bar = progress::cases(self.cases.list.len(), title);
        for (at, case) in self.cases.list.iter().enumerate() {
            own(at, case).with_context(|| case.name.clone())?;
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(())
    }

    /// `2 cases of rigid tools on brain (21708 nodes)`.
    pub fn said(&self) -> String {
        let cases = counted(self.cases.list.len(), "case");
        let (mesh, nodes) = (&self.header().mesh_name, self.mesh.node_count());
        format!("{cases} of rigid tools on {mesh} ({nodes} nodes)")
    }

    /// The machine, what else it was doing, and the date.
    pub fn place(&self) -> String {
        let Machine { cpu, cores, .. } = &self.machine;
        format!(
            "{cpu} ({}{}), {}",
            counted(*cores, "core"),
            load_words(),
            self.date
        )
    }

    /// Where a report's figures come from, the first part of its JSON.
    pub fn origin(&self, threads: u32) -> Value {
        json!({
            "machine": self.machine,
            "date": self.date,
            "threads": threads,
            "versions": {"upt": env!("CARGO_PKG_VERSION"), "solver": self.header().solver},
            "mesh": {
                "name": self.header().mesh_name,
                "sha256": self.cases.mesh_sha256,
                "nodes": self.mesh.node_count(),
                "boundary": self.cases.boundary,
            },
            "left_out": self.notes,
        })
    }

    /// The same for a page.
    pub fn facts(&self, threads: u32) -> Vec<(String, String)> {
        let Machine { cpu, cores, os, .. } = &self.machine;
        let names: Vec<&str> = self
            .cases
            .list
            .iter()
            .map(|case| case.name.as_str())
            .collect();
        let solver = &self.header().solver;
        [
            ("machine", format!("{cpu}, {cores} cores, {os}")),
            ("date", self.date.clone()),
            ("threads", threads.to_string()),
            (
                "versions",
                format!("upt {}, reference {solver}", env!("CARGO_PKG_VERSION")),
            ),
            ("cases", names.join("; ")),
        ]
        .map(|(name, text)| (name.into(), text))
        .into()
    }
}

/// The bundles made for the cases' mesh, boundary and tissue; where bundles were named, another is an error.
fn fitting(
    named_paths: &[PathBuf],
    cases: &ToolCases,
    notes: &mut Vec<String>,
) -> Result<Vec<BundleFolder>> {
    let named = !named_paths.is_empty();
    let paths = match named {
        true => named_paths.to_vec(),
        false => upt_cli::doctor::bundles_below("onnx".as_ref()),
    };
    let mesh = &cases.list[0].trajectory.header.mesh_name;
    let mut fitting = Vec::new();
    for path in &paths {
        let bundle = BundleFolder::read(path)?;
        let Some(reason) = bundle.misfit(&cases.list[0].trajectory.header) else {
            fitting.push(bundle);
            continue;
        };
        if named {
            bail!("{reason}; name a bundle or a dataset that fits");
        }
        notes.push(reason);
    }
    if fitting.is_empty() {
        bail!("no bundle below onnx/ fits the mesh {mesh} of the cases; name one with --bundle");
    }
    Ok(fitting)
}
