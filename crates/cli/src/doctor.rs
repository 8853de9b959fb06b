//! `upt doctor`: what a scene would find on this machine.
//!
//! Reports ONNX Runtime (path, version), the providers that load and why others do not, the CPU's
//! vector features, and the bundles with their hashes. Exit code 0: every bundle that was looked at can run; 1: one cannot. Bundles without
//! a network (those of `upt make`) need no ONNX Runtime.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use clap::Args;
use serde::Serialize;
use sha2::{Digest, Sha256};

#[derive(Args)]
#[command(
    after_help = "Examples:\n  upt doctor\n  upt doctor --json\n  upt doctor onnx/brain-reduced"
)]
pub struct Options {
    /// Bundles to check. Default: those below onnx/ here or in the clone that this program was built in, or those of the archive that it
    /// came in.
    bundles: Vec<PathBuf>,
    /// Machine-readable output.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Findings {
    upt: String,
    abi: u32,
    onnxruntime: Runtime,
    providers: serde_json::Value,
    cpu: Cpu,
    bundles: Vec<Bundle>,
    healthy: bool,
}

#[derive(Serialize)]
struct Runtime {
    loaded: bool,
    path: Option<String>,
    version: Option<String>,
    /// Why it does not load, and what to do.
    problem: Option<String>,
}

#[derive(Serialize)]
struct Cpu {
    architecture: &'static str,
    name: String,
    cores: usize,
    features: Vec<&'static str>,
    kernels: String,
}

#[derive(Serialize)]
struct Bundle {
    path: String,
    name: Option<String>,
    kind: Option<String>,
    /// SHA-256 of bundle.json, which itself holds the hashes of all other files.
    sha256: Option<String>,
    load_seconds: Option<f64>,
    problem: Option<String>,
}

pub fn run(options: &Options) -> Result<ExitCode> {
    let findings = look(options);
    if options.json {
        println!("{}", serde_json::to_string_pretty(&findings)?);
    } else {
        print(&findings);
    }
    Ok(if findings.healthy {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(1)
    })
}

fn look(options: &Options) -> Findings {
    let (onnxruntime, providers) = runtime();
    let paths = match options.bundles.is_empty() {
        true => usual_bundles(),
        false => options.bundles.clone(),
    };
    let bundles: Vec<Bundle> = paths.iter().map(|path| open(path)).collect();
    let healthy = bundles.iter().all(|bundle| bundle.problem.is_none());
    Findings {
        upt: env!("CARGO_PKG_VERSION").into(),
        abi: upt::ffi::upt_abi_version(),
        onnxruntime,
        providers,
        cpu: cpu(),
        bundles,
        healthy,
    }
}

/// The bundles of where this is: of the folder at hand, of the clone that this program was built in, of the archive that it came in.
pub(crate) fn usual_bundles() -> Vec<PathBuf> {
    let exe = std::env::current_exe().ok();
    let below = |up: usize, place: &str| Some(exe.as_ref()?.ancestors().nth(up)?.join(place));
    // target/release/upt of a clone, bin/upt of an archive.
    let places = [
        Some(PathBuf::from("onnx")),
        below(3, "onnx"),
        below(2, "share/upt/bundles"),
    ];
    let found = places
        .into_iter()
        .flatten()
        .map(|place| bundles_below(&place));
    found
        .into_iter()
        .find(|found| !found.is_empty())
        .unwrap_or_default()
}

/// Folders directly below `folder` that hold a bundle, by name.
pub fn bundles_below(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else {
        return Vec::new();
    };
    let mut found: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| path.join("bundle.json").is_file())
        .collect();
    found.sort();
    found
}

/// Loads ONNX Runtime the way a host does and asks it for its providers.
fn runtime() -> (Runtime, serde_json::Value) {
    match upt::onnx::Runtime::get(None) {
        Ok(found) => {
            let providers = upt::providers_json()
                .ok()
                .and_then(|text| serde_json::from_str(&text).ok());
            let runtime = Runtime {
                loaded: true,
                path: Some(found.path().display().to_string()),
                version: Some(found.version().to_owned()),
                problem: None,
            };
            (runtime, providers.unwrap_or_default())
        }
        Err(error) => {
            let runtime = Runtime {
                loaded: false,
                path: None,
                version: None,
                // A host puts a library beside its own; who asks this command has another way.
                problem: Some(format!(
                    "{error}. `upt runtime` fetches it for this command; bundles without a network, as `upt make` makes them, need none"
                )),
            };
            (runtime, serde_json::Value::Null)
        }
    }
}

fn cpu() -> Cpu {
    Cpu {
        architecture: std::env::consts::ARCH,
        name: yardstick::machine::cpu_name(),
        cores: std::thread::available_parallelism().map_or(1, usize::from),
        features: yardstick::machine::cpu_features(),
        kernels: format!("{:?}", upt::kernels::Isa::detect()).to_lowercase(),
    }
}

/// Opens the bundle with all checks of the library.
fn open(path: &Path) -> Bundle {
    let manifest = std::fs::read(path.join("bundle.json")).ok();
    let fields: serde_json::Value = manifest
        .as_deref()
        .and_then(|bytes| serde_json::from_slice(bytes).ok())
        .unwrap_or_default();
    let text = |field: &str| fields[field].as_str().map(str::to_owned);
    let opened = host::Model::open(path, &host::ModelSettings::default());
    Bundle {
        path: path.display().to_string(),
        name: text("name"),
        kind: text("kind"),
        sha256: manifest.map(|bytes| format!("{:x}", Sha256::digest(bytes))),
        load_seconds: opened.as_ref().ok().map(|model| model.info().load_seconds),
        problem: opened.err().map(|error| format!("{error:#}")),
    }
}

fn print(findings: &Findings) {
    let mark = |good: bool| if good { "ok " } else { "BAD" };
    println!("upt {} (ABI {})", findings.upt, findings.abi);
    let runtime = &findings.onnxruntime;
    match (&runtime.path, &runtime.version, &runtime.problem) {
        (Some(path), Some(version), _) => println!("{} ONNX Runtime {version}: {path}", mark(true)),
        (_, _, problem) => println!(
            "{} ONNX Runtime: {}",
            // Missing is no fault where nothing asks for it.
            if findings.healthy { "-  " } else { mark(false) },
            problem.as_deref().unwrap_or("not found")
        ),
    }
    for provider in findings.providers.as_array().into_iter().flatten() {
        let name = provider["name"].as_str().unwrap_or("?");
        if provider["available"].as_bool().unwrap_or(false) {
            println!("ok  provider {name}");
        } else {
            println!(
                "-   provider {name}: {}",
                provider["reason"].as_str().unwrap_or("not available")
            );
        }
    }
    let cpu = &findings.cpu;
    println!(
        "ok  {} ({}, {} cores): kernels {}; {}",
        cpu.name,
        cpu.architecture,
        cpu.cores,
        cpu.kernels,
        cpu.features.join(" ")
    );
    if findings.bundles.is_empty() {
        println!("-   no bundles here; name one: upt doctor BUNDLE, or make one: upt make SURFACE");
    }
    for bundle in &findings.bundles {
        let short: String = bundle
            .sha256
            .as_deref()
            .unwrap_or("")
            .chars()
            .take(16)
            .collect();
        match &bundle.problem {
            None => println!(
                "ok  bundle {} ({}) {short} opened in {:.2} s",
                bundle.path,
                bundle.kind.as_deref().unwrap_or("?"),
                bundle.load_seconds.unwrap_or(0.0)
            ),
            Some(problem) => println!("BAD bundle {}: {problem}", bundle.path),
        }
    }
}
