//! `cargo xtask demo`: an organ pushed by libupt next to the reference solver, from a fresh clone.
//!
//! Set-up; a tool that presses, slides and lifts, simulated by the reference solver (kept by content); every committed bundle of that organ driven by
//! the tool's poses alone; a table and a page. With `--scheme` the paper's own measure instead: a collision field, replayed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde::Deserialize;
use sha2::{Digest, Sha256};
use walkdir::WalkDir;

use crate::process::run_visibly;
use crate::workspace::Workspace;
use crate::{ort, system, venv};

/// An organ with committed bundles.
struct Organ {
    name: &'static str,
    /// The mesh that is simulated, and a bundle on it: all others with the same mesh are shown too.
    mesh: &'static str,
    bundle: &'static str,
    /// What the paper's measure compares with: there is no coarser mesh of the liver.
    plain: &'static str,
}

const ORGANS: [Organ; 2] = [
    Organ {
        name: "brain",
        mesh: "onnx/meshes/brain.mesh.safetensors",
        bundle: "onnx/brain",
        plain: "zero,prior,coarse,tled",
    },
    Organ {
        name: "liver",
        mesh: "onnx/liver-coarse/mesh.safetensors",
        bundle: "onnx/liver-coarse",
        plain: "zero,prior,tled",
    },
];

#[derive(Args)]
pub struct Options {
    /// What is pushed; the liver's bundle was made by `upt make` without any training.
    #[arg(long, default_value = "brain", value_parser = ORGANS.map(|organ| organ.name))]
    organ: String,
    /// Install no system packages.
    #[arg(long)]
    no_install: bool,
    /// Programme of a rigid tool: `stroke` presses, slides and lifts; `press`, `poke`, `lift`, `two` and others (`upt simulate --help`).
    #[arg(long, default_value = "stroke", conflicts_with = "scheme")]
    tool: String,
    /// Replay a collision field instead, the paper's own measure: contact scheme 1 to 5, or a hard regime. The bundles were trained on
    /// 1 to 4.
    #[arg(long)]
    scheme: Option<String>,
    /// Seed of the contact site.
    #[arg(long, default_value_t = 2026)]
    seed: u64,
}

impl Options {
    fn organ(&self) -> &'static Organ {
        let mut organs = ORGANS.iter();
        let found = organs.find(|organ| organ.name == self.organ);
        found.expect("clap takes these names only")
    }

    /// What drives the contact, as `upt simulate` takes it, and in words.
    fn driver(&self) -> (String, String) {
        let (option, kind, name) = match &self.scheme {
            Some(scheme) => ("--scheme", "scheme", scheme),
            None => ("--tool", "tool programme", &self.tool),
        };
        let words = format!("{kind} `{name}`, seed {}", self.seed);
        (format!("{option} {name} --seed {}", self.seed), words)
    }
}

/// A bundle that the demo shows: its folder, and what its manifest says of the simulation.
#[derive(Deserialize)]
struct Bundle {
    #[serde(skip)]
    path: PathBuf,
    name: String,
    boundary: String,
    material: serde_json::Value,
    mesh: serde_json::Value,
}

pub fn run(workspace: &Workspace, options: &Options) -> Result<bool> {
    let missing = system::provide(workspace, &[system::BASE], !options.no_install)?;
    ensure!(missing.is_empty(), "install {} first", missing.join(", "));
    eprintln!("1/4 set-up");
    venv::create(workspace, "target/venv")?;
    workspace.build_for_demo()?;

    let mut by_boundary: BTreeMap<String, Vec<Bundle>> = BTreeMap::new();
    for bundle in bundles_of(workspace, options.organ())? {
        let boundary = bundle.boundary.clone();
        by_boundary.entry(boundary).or_default().push(bundle);
    }
    let folder = workspace.path(match options.organ.as_str() {
        "brain" => "target/demo",
        _ => "target/demo/liver",
    });
    std::fs::create_dir_all(&folder)?;
    for (place, (boundary, bundles)) in by_boundary.iter().enumerate() {
        let trajectory = simulate(workspace, options, &bundles[0], &folder)?;
        // The paper's boundary condition gets the plain names; another one its own folder.
        let out = match place {
            0 => folder.clone(),
            _ => folder.join(boundary),
        };
        report(workspace, options, bundles, &trajectory, &out)?;
    }
    Ok(true)
}

/// Takes more than the 50 ms of a step on two cores.
const NOT_IN_REAL_TIME: &str = "brain-paper";

/// The committed bundles of the mesh that the demo simulates, by name.
fn bundles_of(workspace: &Workspace, organ: &Organ) -> Result<Vec<Bundle>> {
    let own = read(&workspace.path(organ.bundle))?.mesh;
    let folders = workspace.bundles()?.into_iter();
    let all = folders
        .map(|folder| read(&folder))
        .collect::<Result<Vec<Bundle>>>()?;
    let (slow, all): (Vec<_>, Vec<_>) = all
        .into_iter()
        .partition(|one| one.name == NOT_IN_REAL_TIME);
    let (found, others): (Vec<_>, Vec<_>) = all.into_iter().partition(|one| one.mesh == own);
    for (reason, left_out) in [("on another mesh", others), ("not in real time", slow)] {
        let names: Vec<&str> = left_out.iter().map(|bundle| bundle.name.as_str()).collect();
        eprintln!("left out, {reason}: {}", names.join(", "));
    }
    Ok(found)
}

fn read(folder: &Path) -> Result<Bundle> {
    let file = folder.join("bundle.json");
    let parsed = || -> Result<Bundle> { Ok(serde_json::from_slice(&std::fs::read(&file)?)?) };
    let mut bundle = parsed().with_context(|| format!("cannot read {}", file.display()))?;
    bundle.path = folder.to_owned();
    Ok(bundle)
}

/// The reference simulation, made once for each mesh, load, seed, boundary and version of the solver's source.
fn simulate(
    workspace: &Workspace,
    options: &Options,
    bundle: &Bundle,
    folder: &Path,
) -> Result<PathBuf> {
    let (boundary, material) = (&bundle.boundary, &bundle.material);
    let mesh = options.organ().mesh;
    let (driver, words) = options.driver();
    let load = format!("{driver} --boundary {boundary}");
    let mut hash = Sha256::new();
    hash.update(format!("{load} {material}"));
    hash.update(std::fs::read(workspace.path(mesh))?);
    for part in ["contact", "elements", "tissue"] {
        let source = workspace.path(&format!("crates/{part}/src"));
        for entry in WalkDir::new(source).sort_by_file_name() {
            let entry = entry?;
            if entry.file_type().is_file() {
                hash.update(std::fs::read(entry.path())?);
            }
        }
    }
    let key = format!("{:x}", hash.finalize());
    let file = folder.join(format!("contact-{}.trajectory.safetensors", &key[..16]));
    if file.is_file() {
        let place = file.display();
        eprintln!("2/4 the reference simulation is there already: {place}");
        return Ok(file);
    }
    eprintln!("2/4 simulating {words}, boundary `{boundary}`, with the reference solver");
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let words = format!("simulate --mesh {mesh} {load} --threads {threads} --out");
    let mut command = workspace.command(workspace.upt(), &words);
    command.arg(&file);
    // `young_pa` of a manifest is the option `--young`.
    for (key, value) in material.as_object().context("material is no object")? {
        let option = key.split('_').next().unwrap_or_default();
        command.args([format!("--{option}"), value.to_string()]);
    }
    ensure!(run_visibly(&mut command)?, "`upt simulate` failed");
    Ok(file)
}

/// `cargo xtask study report` of the bundles: driven by the poses of the tool alone, or given the nodes and vectors of a contact scheme,
/// the paper's own measure.
fn report(
    workspace: &Workspace,
    options: &Options,
    bundles: &[Bundle],
    trajectory: &Path,
    out: &Path,
) -> Result<()> {
    let (Organ { name, plain, .. }, (_, words)) = (options.organ(), options.driver());
    let mut command = workspace.command(workspace.study(), "report --out");
    ort::set_environment(workspace, &mut command)?;
    let title = format!("A {name} pushed by libupt: {words}");
    command.arg(out).arg("--title").arg(title);
    for bundle in bundles {
        command.arg("--bundle").arg(&bundle.path);
    }
    let shows = match options.scheme {
        Some(_) => {
            eprintln!("3/4 replaying the contact through the bundles and the plain methods");
            let words = "--region all,surface --tled-frames 20 --plain";
            command.args(words.split(' ')).args([plain, "--trajectory"]);
            "pictures and curves: report.html"
        }
        None => {
            eprintln!("3/4 driving the bundles by the tool's poses alone");
            command.arg("--tools");
            "the dent in cross-section, forces over time: tools.html"
        }
    };
    let made = run_visibly(command.arg(trajectory))?;
    ensure!(made, "`upt-study report` failed");
    println!("4/4 in {}: {shows}", out.display());
    Ok(())
}
