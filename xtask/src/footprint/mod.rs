//! `cargo xtask footprint`: what each cargo feature of libupt adds, into docs/results/footprint.md.
//!
//! The library is built once for each set of features and stripped; a process of its own then opens it with the
//! system's loader, opens bundles and steps them, and reads what it has mapped (`probe`).

mod needed;
mod probe;

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::Args;

use crate::ort;
use crate::process::run_checked;
use crate::workspace::Workspace;
use probe::Probe;

#[derive(Args)]
pub struct Options {
    /// Bundles that are opened and stepped.
    #[arg(long = "bundle", default_values = ["onnx/brain-coarse-reduced", "onnx/brain-coarse"])]
    bundles: Vec<PathBuf>,
    /// Used by the command itself: open this library and one bundle, print what happened as JSON.
    #[arg(long, hide = true, value_name = "LIBRARY")]
    probe: Option<PathBuf>,
}

/// Name of a build and its features.
const BUILDS: [(&str, &str); 7] = [
    ("none", ""),
    ("`contact`", "contact"),
    ("`forces`", "forces"),
    ("`cuda`", "cuda"),
    ("`tensorrt`", "tensorrt"),
    ("`tensorrt-rtx`", "tensorrt-rtx"),
    ("default", "default"),
];

/// A build and what it showed.
struct Build {
    name: &'static str,
    library: PathBuf,
    bytes: u64,
    needed: Vec<String>,
    probes: Vec<Probe>,
}

pub fn run(workspace: &Workspace, options: &Options) -> Result<bool> {
    if let Some(library) = &options.probe {
        let [bundle] = options.bundles.as_slice() else {
            anyhow::bail!("--probe takes one --bundle");
        };
        println!(
            "{}",
            serde_json::to_string(&probe::probe(library, bundle)?)?
        );
        return Ok(true);
    }
    ensure!(
        cfg!(target_os = "linux"),
        "the footprint is read from /proc and from ELF files: run it on Linux"
    );
    let runtime = match std::env::var_os("ORT_DYLIB_PATH") {
        Some(path) => PathBuf::from(path),
        None => ort::host_library(workspace)?,
    };
    let mut builds = Vec::new();
    for (index, (name, features)) in BUILDS.into_iter().enumerate() {
        let library = build(workspace, index, features)?;
        let probes = options
            .bundles
            .iter()
            .map(|bundle| run_probe(&library, &workspace.root.join(bundle), &runtime))
            .collect::<Result<Vec<_>>>()?;
        let bytes = std::fs::metadata(&library)?.len();
        println!("  {name}: {bytes} bytes");
        builds.push(Build {
            name,
            bytes,
            needed: needed::libraries(&library)?,
            library,
            probes,
        });
    }
    write_document(workspace, options, &builds)?;
    Ok(true)
}

/// The stripped library of a set of features, in `target/footprint/`.
fn build(workspace: &Workspace, index: usize, features: &str) -> Result<PathBuf> {
    let folder = workspace.path("target/footprint").join(index.to_string());
    std::fs::create_dir_all(&folder)?;
    let library = folder.join("libupt.so");
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.current_dir(&workspace.root).args([
        "rustc",
        "--release",
        "--package",
        "upt",
        "--lib",
        "--crate-type",
        "cdylib",
        "--no-default-features",
        "--features",
        features,
    ]);
    let log = workspace.logs().join(format!("footprint-{index}.log"));
    run_checked(
        &format!("libupt with features \"{features}\""),
        &mut cargo,
        &log,
    )?;
    let mut strip = Command::new("strip");
    strip
        .arg("-o")
        .arg(&library)
        .arg(workspace.release().join("libupt.so"));
    let stripped = strip
        .status()
        .context("cannot start `strip`; install binutils")?;
    ensure!(stripped.success(), "`strip` failed on libupt.so");
    Ok(library)
}

fn run_probe(library: &Path, bundle: &Path, runtime: &Path) -> Result<Probe> {
    let output = Command::new(std::env::current_exe()?)
        .arg("footprint")
        .arg("--probe")
        .arg(library)
        .arg("--bundle")
        .arg(bundle)
        .env("ORT_DYLIB_PATH", runtime)
        .output()?;
    ensure!(
        output.status.success(),
        "{} with {}: {}",
        library.display(),
        bundle.display(),
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).context("the probe's answer is not JSON")
}

fn names<'a>(libraries: impl IntoIterator<Item = &'a String>) -> String {
    let names: Vec<String> = libraries
        .into_iter()
        .map(|name| format!("`{name}`"))
        .collect();
    if names.is_empty() {
        "none".into()
    } else {
        names.join(", ")
    }
}

fn tables(options: &Options, builds: &[Build]) -> Result<String> {
    let least = builds.first().context("no build")?.bytes;
    let needed: BTreeSet<&String> = builds.iter().flat_map(|build| &build.needed).collect();
    let mut text = format!(
        "\nAll builds need {} and nothing else from the system, unless the table says so.\n\n| features | bytes, stripped | more than none | needs |\n|---|---|---|---|\n",
        names(needed.iter().copied())
    );
    for build in builds {
        let same = build.needed.len() == needed.len();
        let needs = if same {
            "the same".into()
        } else {
            names(&build.needed)
        };
        let more = build.bytes as i64 - least as i64;
        writeln!(
            text,
            "| {} | {} | {more:+} | {needs} |",
            build.name, build.bytes
        )?;
    }
    for (index, bundle) in options.bundles.iter().enumerate() {
        let name = bundle.file_name().unwrap_or_default().to_string_lossy();
        write!(
            text,
            "\n### A process that opens `{name}`\n\n| features | mapped with libupt | mapped when the model was open | mapped by stepping | open, ms | a step in contact, µs |\n|---|---|---|---|---|---|\n"
        )?;
        for build in builds {
            let probe = &build.probes[index];
            writeln!(
                text,
                "| {} | {} | {} | {} | {:.0} | {:.0} |",
                build.name,
                names(&probe.with_library),
                names(&probe.with_model),
                names(&probe.with_steps),
                probe.open_ms,
                probe.step_us
            )?;
        }
    }
    Ok(text)
}

fn write_document(workspace: &Workspace, options: &Options, builds: &[Build]) -> Result<()> {
    const BEGIN: &str = "<!-- cargo xtask footprint: begin -->";
    const END: &str = "<!-- cargo xtask footprint: end -->";
    let path = workspace.path("docs/results/footprint.md");
    let page = std::fs::read_to_string(&path)
        .with_context(|| format!("cannot read {}", path.display()))?;
    let (start, end) = page.find(BEGIN).zip(page.find(END)).with_context(|| {
        format!(
            "{}: the markers `{BEGIN}` and `{END}` are missing",
            path.display()
        )
    })?;
    let text = tables(options, builds)?;
    std::fs::write(
        &path,
        format!("{}{BEGIN}\n{text}\n{}", &page[..start], &page[end..]),
    )?;
    for build in builds {
        println!("{}: {}", build.name, build.library.display());
    }
    println!("{} written", path.display());
    Ok(())
}
