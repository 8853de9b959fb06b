//! `cargo xtask bench`: the speed tables, into docs/results/performance.md.
//!
//! Every bench target of `upt` and `tissue` prints its results as lines `ROW {json}`; this collects
//! them. A row is {"name","value","unit","against","ratio","error","bar","goal"}; null where it has none.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args;

mod page;
mod row;

use crate::process::{run_checked, run_logged};
use crate::workspace::Workspace;
use crate::{ort, stages, venv};
use row::Row;

#[derive(Args)]
pub struct Options {
    /// Short runs: meant to take 3 minutes after the build on an idle machine; the time is printed.
    #[arg(long)]
    quick: bool,
    /// Also write the rows to this file.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Only bench targets whose name contains this; the page keeps its other tables.
    #[arg(long)]
    only: Option<String>,
    /// Only what these targets call so (of `step`: bundles whose name contains it); the tables keep their other rows.
    #[arg(long, requires = "only")]
    part: Option<String>,
    /// Do not touch docs/results/performance.md.
    #[arg(long)]
    keep_docs: bool,
}

/// A bench target: package and name.
struct Target {
    package: &'static str,
    name: String,
}

/// The part of the tables that is no Rust: `tests/csharp/overhead.sh`.
const UNITY: &str = "unity-plugin";

impl Target {
    fn command(&self, workspace: &Workspace, library: &Path) -> Result<Command> {
        if self.package == UNITY {
            let mut command = Command::new("bash");
            command.arg(workspace.path("tests/csharp/overhead.sh"));
            stages::set_test_environment(workspace, &mut command, library);
            return Ok(command);
        }
        let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        command.current_dir(&workspace.root).args([
            "bench",
            "-p",
            self.package,
            "--bench",
            &self.name,
        ]);
        ort::set_environment(&mut command, library);
        Ok(command)
    }
}

pub fn run(workspace: &Workspace, options: &Options) -> Result<bool> {
    venv::create(workspace)?;
    let library = ort::host_library(workspace)?;
    let random = workspace.path("target/bench/bundles");
    if let Err(error) = random_bundles(workspace, &library, &random) {
        eprintln!("left out: the rows of `wide` and `paper`: {error:#}");
    }
    let mut chosen = targets(workspace)?;
    if let Some(part) = &options.only {
        chosen.retain(|target| target.name.contains(part.as_str()));
    }
    build(workspace, &chosen)?;
    let started = Instant::now();
    let mut tables: Vec<(String, Vec<Row>)> = Vec::new();
    let (mut failed, mut notes) = (Vec::new(), Vec::new());
    for target in chosen {
        let mut command = target.command(workspace, &library)?;
        if options.quick {
            command.env("UPT_BENCH_QUICK", "1");
        }
        command.env("UPT_BENCH_BUNDLES", &random);
        if let Some(part) = options.part.as_ref().filter(|_| target.package != UNITY) {
            command.args(["--", part]);
        }
        let log = workspace
            .logs()
            .join(format!("bench-{}-{}.log", target.package, target.name));
        let finished = run_logged(
            &format!("bench {}/{}", target.package, target.name),
            &mut command,
            &log,
        )?;
        if !finished.success {
            eprintln!(
                "{}/{} failed; the end of {}:\n{}",
                target.package,
                target.name,
                log.display(),
                finished.tail(15)
            );
            failed.push(format!("{}/{}", target.package, target.name));
            continue;
        }
        for line in row::left_out(&finished.text) {
            eprintln!("{}/{}: {line}", target.package, target.name);
            notes.push(line.to_owned());
        }
        let rows = row::rows(&finished.text)?;
        if rows.is_empty() {
            eprintln!(
                "{}/{}: printed no rows (see {})",
                target.package,
                target.name,
                log.display()
            );
            continue;
        }
        println!(
            "\n{}/{}\n{}",
            target.package,
            target.name,
            row::table(&rows)
        );
        tables.push((format!("{}: {}", target.package, target.name), rows));
    }
    eprintln!(
        "measured in {:.0} s (builds not counted)",
        started.elapsed().as_secs_f64()
    );
    if let Some(path) = &options.json {
        let all: Vec<&Row> = tables.iter().flat_map(|table| &table.1).collect();
        std::fs::write(path, serde_json::to_string_pretty(&all)? + "\n")
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    if !options.keep_docs {
        let partly = options.part.is_some();
        page::write(workspace, options.quick, partly, &tables, &failed, &notes)?;
    }
    Ok(failed.is_empty())
}

/// Builds what the targets run, so that a measurement's time is its own.
fn build(workspace: &Workspace, targets: &[Target]) -> Result<()> {
    if targets.iter().any(|target| target.package == UNITY) {
        stages::build(workspace)?;
    }
    for package in ["upt", "tissue"] {
        let own: Vec<&Target> = targets
            .iter()
            .filter(|target| target.package == package)
            .collect();
        if own.is_empty() {
            continue;
        }
        let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        command
            .current_dir(&workspace.root)
            .args(["bench", "--no-run", "-p", package]);
        for target in own {
            command.args(["--bench", &target.name]);
        }
        let log = workspace.logs().join(format!("bench-build-{package}.log"));
        run_checked(
            &format!("build the benches of {package}"),
            &mut command,
            &log,
        )?;
    }
    Ok(())
}

/// Bundles with random weights of the `wide` and the `paper` configuration on the brain, the second with the graphs of
/// the paper's split beside it, and `paper-fine` on the mesh that `UPT_FINE_MESH` names; made again when a bundle's
/// configuration or mesh is newer.
fn random_bundles(workspace: &Workspace, library: &Path, folder: &Path) -> Result<()> {
    let brain = workspace.path("onnx/meshes/brain.mesh.safetensors");
    let fine = std::env::var_os("UPT_FINE_MESH").map(PathBuf::from);
    let mut wanted = vec![("wide", "wide", &brain), ("paper", "paper", &brain)];
    wanted.extend(fine.as_ref().map(|mesh| ("paper-fine", "paper", mesh)));
    for (name, config, mesh) in wanted {
        let out = folder.join(name);
        let config = workspace.path(&format!("training/configs/{config}.toml"));
        let split = name != "wide";
        let made = out.join(if split {
            "reference.safetensors"
        } else {
            "bundle.json"
        });
        if is_newer(&made, &config) && is_newer(&made, mesh) {
            continue;
        }
        venv::install_training(workspace)?;
        std::fs::create_dir_all(folder)?;
        let mut command = Command::new(workspace.python());
        command
            .current_dir(&workspace.root)
            .args(["-m", "upt_training.random_bundle", "--config"])
            .arg(&config)
            .arg("--mesh")
            .arg(mesh)
            .arg("--out")
            .arg(&out)
            .args(["--name", name]);
        if split {
            command.arg("--paper-split");
        }
        ort::set_environment(&mut command, library);
        let log = workspace.logs().join(format!("bench-bundle-{name}.log"));
        run_checked(
            &format!("bundle {name}, random weights"),
            &mut command,
            &log,
        )?;
    }
    Ok(())
}

/// Whether `made` exists and was written after `source`.
fn is_newer(made: &Path, source: &Path) -> bool {
    let written = |path: &Path| {
        std::fs::metadata(path)
            .and_then(|file| file.modified())
            .ok()
    };
    written(made).is_some_and(|made| written(source).is_some_and(|source| made > source))
}

/// Bench targets of `benches/` and `crates/tissue/benches/` (files, and folders with a `main.rs`), and the C# side.
fn targets(workspace: &Workspace) -> Result<Vec<Target>> {
    let mut found = Vec::new();
    for (package, folder) in [("upt", "benches"), ("tissue", "crates/tissue/benches")] {
        let Ok(entries) = std::fs::read_dir(workspace.path(folder)) else {
            continue;
        };
        for entry in entries {
            let path = entry?.path();
            let is_file = path.extension().is_some_and(|extension| extension == "rs");
            if is_file || path.join("main.rs").exists() {
                let name = path
                    .file_stem()
                    .unwrap_or_default()
                    .to_string_lossy()
                    .into_owned();
                found.push(Target { package, name });
            }
        }
    }
    found.push(Target {
        package: UNITY,
        name: "overhead".into(),
    });
    found.sort_by(|a, b| (a.package, &a.name).cmp(&(b.package, &b.name)));
    Ok(found)
}
