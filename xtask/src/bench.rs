//! `cargo xtask bench`: the speed tables, into docs/performance.md.
//!
//! Every bench target of `upt` and `tissue` prints its results as lines `ROW {json}`; this collects
//! them. A row is {"name","value","unit","against","ratio","error","bar","goal"}; null where it has none.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};
use clap::Args;
use serde::{Deserialize, Serialize};

use crate::process::{run_checked, run_logged};
use crate::workspace::Workspace;
use crate::{ort, stages, venv};

#[derive(Args)]
pub struct Options {
    /// Short runs: 3 minutes after the build, on an idle machine.
    #[arg(long)]
    quick: bool,
    /// Also write the rows to this file.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Only bench targets whose name contains this; the page then holds their tables only.
    #[arg(long)]
    only: Option<String>,
    /// Do not touch docs/performance.md.
    #[arg(long)]
    keep_docs: bool,
}

/// A measured figure. `ratio` is how many times faster than `against`, in the same run.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Row {
    name: String,
    value: Option<f64>,
    unit: Option<String>,
    against: Option<String>,
    ratio: Option<f64>,
    error: Option<f64>,
    bar: Option<f64>,
    goal: Option<f64>,
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
            stages::build(workspace)?;
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
        eprintln!("left out: the rows of `fast` and `paper`: {error:#}");
    }
    let mut tables: Vec<(String, Vec<Row>)> = Vec::new();
    let (mut failed, mut notes) = (Vec::new(), Vec::new());
    for target in targets(workspace)? {
        if options
            .only
            .as_ref()
            .is_some_and(|part| !target.name.contains(part.as_str()))
        {
            continue;
        }
        let mut command = target.command(workspace, &library)?;
        if options.quick {
            command.env("UPT_BENCH_QUICK", "1");
        }
        command.env("UPT_BENCH_BUNDLES", &random);
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
        for line in left_out(&finished.text) {
            eprintln!("{}/{}: {line}", target.package, target.name);
            notes.push(line.to_owned());
        }
        let rows = rows(&finished.text)?;
        if rows.is_empty() {
            eprintln!(
                "{}/{}: printed no rows (see {})",
                target.package,
                target.name,
                log.display()
            );
            continue;
        }
        println!("\n{}/{}\n{}", target.package, target.name, table(&rows));
        tables.push((format!("{}: {}", target.package, target.name), rows));
    }
    if let Some(path) = &options.json {
        let all: Vec<&Row> = tables.iter().flat_map(|table| &table.1).collect();
        std::fs::write(path, serde_json::to_string_pretty(&all)? + "\n")
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    if !options.keep_docs {
        write_document(workspace, options, &tables, &failed, &notes)?;
    }
    Ok(failed.is_empty())
}

/// Bundles with random weights of the `fast` and the `paper` configuration on the brain, the second with the graphs of
/// the paper's split beside it; made again when its configuration is newer.
fn random_bundles(workspace: &Workspace, library: &Path, folder: &Path) -> Result<()> {
    for name in ["fast", "paper"] {
        let out = folder.join(name);
        let config = workspace.path(&format!("training/configs/{name}.toml"));
        if is_newer(&out.join("bundle.json"), &config) {
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
            .arg(workspace.path("onnx/meshes/brain.mesh.safetensors"))
            .arg("--out")
            .arg(&out);
        if name == "paper" {
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

/// The rows among a bench's output.
fn rows(text: &str) -> Result<Vec<Row>> {
    text.lines()
        .filter_map(|line| line.trim().strip_prefix("ROW "))
        .map(|json| serde_json::from_str(json).with_context(|| format!("not a row: {json}")))
        .collect()
}

/// What a bench says that it did not measure, and why.
fn left_out(text: &str) -> Vec<&str> {
    text.lines()
        .filter_map(|line| line.trim().split_once("left out: "))
        .map(|(_, reason)| reason)
        .collect()
}

fn number(value: Option<f64>) -> String {
    let Some(value) = value else {
        return "-".into();
    };
    let magnitude = value.abs();
    if magnitude != 0.0 && !(1e-3..1e6).contains(&magnitude) {
        return format!("{value:.1e}");
    }
    let digits = if magnitude >= 100.0 {
        0
    } else if magnitude >= 10.0 {
        1
    } else if magnitude >= 1.0 {
        2
    } else {
        3
    };
    format!("{value:.digits$}")
}

/// Whether the bar is met, where the row has one. A bar on a ratio ("x") is a lower limit, all others are upper limits.
fn verdict(row: &Row) -> &'static str {
    let (Some(value), Some(bar)) = (row.value, row.bar) else {
        return "";
    };
    let lower_limit = row
        .unit
        .as_deref()
        .is_some_and(|unit| matches!(unit, "x" | "times"));
    let within = |limit: f64| {
        if lower_limit {
            value >= limit
        } else {
            value <= limit
        }
    };
    match (within(bar), row.goal.is_some_and(within)) {
        (_, true) => "goal",
        (true, false) => "bar",
        (false, false) => "missed",
    }
}

fn table(rows: &[Row]) -> String {
    let mut out = String::from(
        "| | value | against | times faster | error | bar | goal | reached |\n|---|---:|---|---:|---:|---:|---:|---|\n",
    );
    for row in rows {
        let value = format!(
            "{} {}",
            number(row.value),
            row.unit.as_deref().unwrap_or("")
        );
        let _ = writeln!(
            out,
            "| {} | {} | {} | {} | {} | {} | {} | {} |",
            row.name,
            value.trim(),
            row.against.as_deref().unwrap_or(""),
            number(row.ratio),
            number(row.error),
            number(row.bar),
            number(row.goal),
            verdict(row)
        );
    }
    out
}

/// Replaces what stands between the markers of docs/performance.md; the rest of the page is written by hand.
fn write_document(
    workspace: &Workspace,
    options: &Options,
    tables: &[(String, Vec<Row>)],
    failed: &[String],
    notes: &[String],
) -> Result<()> {
    const BEGIN: &str = "<!-- cargo xtask bench: begin -->";
    const END: &str = "<!-- cargo xtask bench: end -->";
    let mut body = format!(
        "\nMeasured on {}{}. Medians; `reached` compares with the bar and the goal of the row.\n",
        machine(),
        if options.quick {
            ", short runs (`--quick`)"
        } else {
            ""
        }
    );
    for (name, rows) in tables {
        let _ = write!(body, "\n### {name}\n\n{}", table(rows));
    }
    for name in failed {
        let _ = write!(body, "\nNot measured: {name} (failed).\n");
    }
    for note in notes {
        let _ = write!(body, "\nNot measured: {note}\n");
    }
    let path = workspace.path("docs/performance.md");
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("cannot read {}", path.display()))?;
    let (Some(start), Some(end)) = (text.find(BEGIN), text.find(END)) else {
        anyhow::bail!(
            "{}: the markers `{BEGIN}` and `{END}` are missing",
            path.display()
        );
    };
    let page = format!("{}{BEGIN}\n{body}\n{}", &text[..start], &text[end..]);
    std::fs::write(&path, page)?;
    println!("{} written", path.display());
    Ok(())
}

fn machine() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text
        .lines()
        .find_map(|line| line.strip_prefix("model name"))
        .map(|rest| rest.trim_start_matches([' ', '\t', ':']).to_owned());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!(
        "{}, {cores} cores",
        name.unwrap_or_else(|| std::env::consts::ARCH.into())
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_found_among_other_output_and_judged() {
        let text = "warming up\nROW {\"name\":\"step\",\"value\":7.9,\"unit\":\"ms\",\"against\":null,\"ratio\":null,\"error\":1e-7,\"bar\":10,\"goal\":5}\nROW {\"name\":\"gain\",\"value\":3.2,\"unit\":\"x\",\"bar\":1.6,\"goal\":3}\n";
        let rows = rows(text).unwrap();
        assert_eq!(rows.len(), 2);
        assert_eq!((verdict(&rows[0]), verdict(&rows[1])), ("bar", "goal"));
        assert!(table(&rows).contains("| step | 7.90 ms |"));
        assert!(super::rows("ROW {\"nam\":1}").is_err());
        assert_eq!(
            left_out("fast: left out: the floor\nleft over"),
            ["the floor"]
        );
    }
}
