//! `cargo xtask bench`: the speed tables of docs/results/speed.md.
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
use crate::{ort, venv};
use page::Measured;

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
    /// Page whose tables between the marks are replaced; `tests/docs/results.py run speed` makes it and keeps them.
    #[arg(long, value_name = "FILE")]
    page: Option<PathBuf>,
}

/// A bench target: package and name.
type Target = (&'static str, String);

/// The part of the tables that is no Rust: `tests/csharp/overhead.sh`.
const UNITY: &str = "unity-plugin";

pub fn run(workspace: &Workspace, options: &Options) -> Result<bool> {
    let random = workspace.path("target/bench/bundles");
    if let Err(error) = random_bundles(workspace, &random) {
        eprintln!("left out: the rows of `wide` and `paper`: {error:#}");
    }
    let mut chosen = targets(workspace)?;
    if let Some(part) = &options.only {
        chosen.retain(|(_, name)| name.contains(part.as_str()));
    }
    // What the targets run is built first, so that a measurement's time is its own.
    let mut commands = Vec::new();
    for target in &chosen {
        commands.push(command(workspace, target, &random, options)?);
    }
    let start = Instant::now();
    let (mut measured, mut all, mut failed) = (Measured::default(), Vec::new(), false);
    for ((package, name), mut command) in chosen.iter().zip(commands) {
        let name = format!("{package}/{name}");
        let finished = run_logged(workspace, &format!("bench {name}"), &mut command)?;
        let log = finished.log.display();
        if !finished.success {
            eprintln!("{name} failed; the end of {log}:\n{}", finished.tail(15));
            measured.notes.push(format!("{name} (failed)."));
            failed = true;
            continue;
        }
        for line in row::left_out(&finished.text) {
            eprintln!("{name}: {line}");
            measured.notes.push(line.to_owned());
        }
        let rows = row::rows(&finished.text)?;
        if rows.is_empty() {
            eprintln!("{name}: printed no rows (see {log})");
            continue;
        }
        let table = row::table(&rows);
        println!("\n{name}\n{table}");
        measured.tables.insert(name.replace('/', ": "), table);
        all.extend(rows);
    }
    let seconds = start.elapsed().as_secs_f64();
    eprintln!("measured in {seconds:.0} s (builds not counted)");
    if let Some(path) = &options.json {
        std::fs::write(path, serde_json::to_string_pretty(&all)? + "\n")
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    if let Some(page) = &options.page {
        page::write(page, options.quick, options.part.is_some(), &measured)?;
    }
    Ok(!failed)
}

/// What measures a target, built already.
fn command(
    workspace: &Workspace,
    (package, name): &Target,
    random: &Path,
    options: &Options,
) -> Result<Command> {
    let mut command = if *package == UNITY {
        let mut command = workspace.bash("tests/csharp/overhead.sh");
        workspace.with_parts(&mut command)?;
        command
    } else {
        let words = format!("bench -p {package} --bench {name}");
        let label = format!("build the bench {package}/{name}");
        run_checked(workspace, &label, workspace.cargo(&words).arg("--no-run"))?;
        let mut command = workspace.cargo(&words);
        ort::set_environment(workspace, &mut command)?;
        if let Some(part) = &options.part {
            command.args(["--", part]);
        }
        command
    };
    if options.quick {
        command.env("UPT_BENCH_QUICK", "1");
    }
    command.env("UPT_BENCH_BUNDLES", random);
    Ok(command)
}

/// What `benches/random_bundles.sh` makes in this folder, where it is older than what it is made of.
fn random_bundles(workspace: &Workspace, folder: &Path) -> Result<()> {
    venv::install(workspace, venv::TRAINING)?;
    let mut command = workspace.bash("benches/random_bundles.sh");
    ort::set_environment(workspace, &mut command)?;
    command.env("UPT_PYTHON", workspace.venv_program("python"));
    run_checked(workspace, "random bundles", command.arg(folder))
}

/// Bench targets of `benches/` and `crates/tissue/benches/` (files, and folders with a `main.rs`), and the C# side.
fn targets(workspace: &Workspace) -> Result<Vec<Target>> {
    let mut found = vec![(UNITY, "overhead".into())];
    for (package, folder) in [("libupt", "benches"), ("tissue", "crates/tissue/benches")] {
        for entry in std::fs::read_dir(workspace.path(folder))? {
            let path = entry?.path();
            let is_file = path.extension().is_some_and(|extension| extension == "rs");
            if is_file || path.join("main.rs").exists() {
                let name = path.file_stem().unwrap_or_default();
                found.push((package, name.to_string_lossy().into_owned()));
            }
        }
    }
    found.sort();
    Ok(found)
}
