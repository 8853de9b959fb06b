//! `cargo xtask footprint`: what each cargo feature of libupt adds: the library is built
//! once for each set of features, stripped, and read. What a process maps is `tests/mapped_libraries.rs`.

use std::fmt::Write;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use crate::process::{output, run_checked};
use crate::workspace::{Workspace, write_between_markers};

/// Features and what the table calls them.
const FEATURES: [(&str, &str); 4] = [
    ("", "none"),
    ("instruments", "`instruments`"),
    ("learned", "`learned`"),
    ("default", "default"),
];

/// A build's bytes, and the libraries that it names (`DT_NEEDED`), sorted.
struct Build {
    bytes: u64,
    needed: String,
}

pub fn run(workspace: &Workspace, page: Option<&Path>) -> Result<bool> {
    ensure!(
        cfg!(target_os = "linux"),
        "the footprint is read from ELF files: run it on Linux"
    );
    let builds = FEATURES.map(|(features, _)| build(workspace, features));
    let builds = builds.into_iter().collect::<Result<Vec<Build>>>()?;
    let table = table(&builds)?;
    print!("{table}");
    if let Some(page) = page {
        write_between_markers(page, "footprint", |_| Ok(table))?;
    }
    Ok(true)
}

fn build(workspace: &Workspace, features: &str) -> Result<Build> {
    let mut cargo = workspace.cargo(
        "rustc --release --package libupt --lib --crate-type cdylib --no-default-features --features",
    );
    let label = format!("libupt with features \"{features}\"");
    run_checked(workspace, &label, cargo.arg(features))?;
    let library = workspace.path("target/footprint.so");
    let mut strip = workspace.command("strip", "-o");
    output(strip.arg(&library).arg(workspace.release.join("libupt.so")))
        .context("`strip` and `readelf` are in binutils")?;
    let mut readelf = workspace.command("readelf", "--dynamic --wide");
    let dynamic = output(readelf.arg(&library))?;
    let lines = dynamic.lines().filter(|line| line.contains("(NEEDED)"));
    let names = lines.filter_map(|line| Some(line.split_once('[')?.1.trim_end_matches(']')));
    let mut needed: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    needed.sort();
    Ok(Build {
        bytes: std::fs::metadata(&library)?.len(),
        needed: needed.join(", "),
    })
}

fn table(builds: &[Build]) -> Result<String> {
    let usual = &builds[builds.len() - 1].needed;
    let mut text = format!(
        "\nAll builds need {usual} and nothing else from the system, unless the table says so.\n\n\
         | features | bytes, stripped | more than none | needs |\n|---|---|---|---|\n",
    );
    for ((_, name), build) in FEATURES.iter().zip(builds) {
        let needs = match &build.needed {
            same if same == usual => "the same",
            other => other,
        };
        let more = build.bytes as i64 - builds[0].bytes as i64;
        writeln!(text, "| {name} | {} | {more:+} | {needs} |", build.bytes)?;
    }
    Ok(text + "\n")
}
