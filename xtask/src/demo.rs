//! `cargo xtask demo`: an organ pushed by libupt next to the reference solver, from a fresh clone.
//!
//! Set-up; a tool that presses, slides and lifts, simulated by the reference solver (kept by content); every committed bundle of that organ driven by
//! the tool's poses alone; a table and a page. With `--scheme` the paper's own measure instead: a collision field, replayed.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use clap::{Args, ValueEnum};
use sha2::{Digest, Sha256};
use walkdir::WalkDir;

use crate::process::run_visibly;
use crate::workspace::Workspace;
use crate::{ort, system, venv};

/// An organ with committed bundles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Organ {
    Brain,
    Liver,
}

impl Organ {
    /// Its name, the mesh whose bundles are shown, and what they are compared with: there is no coarser mesh of the liver.
    fn traits(self) -> [&'static str; 3] {
        match self {
            Self::Brain => [
                "brain",
                "onnx/meshes/brain.mesh.safetensors",
                "zero,prior,coarse,tled",
            ],
            Self::Liver => [
                "liver",
                "onnx/liver-coarse/mesh.safetensors",
                "zero,prior,tled",
            ],
        }
    }
}

#[derive(Args)]
pub struct Options {
    /// What is pushed; the liver's bundle was made by `upt make` without any training.
    #[arg(long, default_value = "brain")]
    organ: Organ,
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
    /// What drives the contact, as `upt simulate` takes it.
    fn driver(&self) -> (&'static str, &str) {
        match &self.scheme {
            Some(scheme) => ("--scheme", scheme),
            None => ("--tool", &self.tool),
        }
    }

    /// The same in words.
    fn words(&self) -> String {
        match &self.scheme {
            Some(scheme) => format!("scheme {scheme}, seed {}", self.seed),
            None => format!("tool programme `{}`, seed {}", self.tool, self.seed),
        }
    }
}

/// A bundle that the demo shows.
struct Bundle {
    path: PathBuf,
    boundary: String,
    material: serde_json::Value,
}

pub fn run(workspace: &Workspace, options: &Options) -> Result<bool> {
    let missing = system::provide(workspace, &[system::BASE], !options.no_install)?;
    ensure!(missing.is_empty(), "install {} first", missing.join(", "));
    eprintln!("1/4 set-up");
    venv::create(workspace, "target/venv")?;
    workspace.build_for_demo()?;

    let [organ, mesh, _] = options.organ.traits();
    let bundles = bundles_of(workspace, mesh)?;
    let mut boundaries: Vec<&str> = bundles.iter().map(|one| one.boundary.as_str()).collect();
    boundaries.sort_unstable();
    boundaries.dedup();
    let folder = match options.organ {
        Organ::Brain => workspace.path("target/demo"),
        Organ::Liver => workspace.path("target/demo").join(organ),
    };
    std::fs::create_dir_all(&folder)?;
    for boundary in &boundaries {
        let own: Vec<&Bundle> = bundles
            .iter()
            .filter(|one| one.boundary == *boundary)
            .collect();
        let trajectory = simulate(workspace, options, own[0], &folder)?;
        // The paper's boundary condition gets the plain names; another one its own folder.
        let out = match *boundary == boundaries[0] {
            true => folder.clone(),
            false => folder.join(boundary),
        };
        report(workspace, options, &own, &trajectory, &out)?;
    }
    Ok(true)
}

/// The committed bundles of the mesh that the demo simulates.
fn bundles_of(workspace: &Workspace, mesh: &str) -> Result<Vec<Bundle>> {
    let (mut found, mut left_out) = (Vec::new(), Vec::new());
    let nodes = mesh_nodes(&workspace.path(mesh))?;
    for entry in std::fs::read_dir(workspace.path("onnx"))? {
        let path = entry?.path();
        let Ok(text) = std::fs::read_to_string(path.join("bundle.json")) else {
            continue;
        };
        let manifest: serde_json::Value = serde_json::from_str(&text)
            .with_context(|| format!("{}/bundle.json", path.display()))?;
        if manifest["mesh"]["nodes"].as_u64() != Some(nodes) {
            left_out.push(format!(
                "{} (another mesh)",
                manifest["name"].as_str().unwrap_or("?")
            ));
            continue;
        }
        found.push(Bundle {
            path,
            boundary: manifest["boundary"].as_str().unwrap_or("fixed").to_owned(),
            material: manifest["material"].clone(),
        });
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    if !left_out.is_empty() {
        eprintln!("left out: {}", left_out.join(", "));
    }
    ensure!(!found.is_empty(), "no bundle below onnx/ fits {mesh}");
    Ok(found)
}

/// Node count of a mesh, from the header of its file.
fn mesh_nodes(path: &Path) -> Result<u64> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let header = bytes.split_first_chunk().and_then(|(length, rest)| {
        let header = rest.get(..u64::from_le_bytes(*length) as usize)?;
        serde_json::from_slice::<serde_json::Value>(header).ok()
    });
    let nodes = header.and_then(|header| header["positions"]["shape"][0].as_u64());
    nodes.with_context(|| {
        format!(
            "{}: the file has no header with `positions`",
            path.display()
        )
    })
}

/// The reference simulation, made once for each mesh, load, seed, boundary and version of the solver's source.
fn simulate(
    workspace: &Workspace,
    options: &Options,
    bundle: &Bundle,
    folder: &Path,
) -> Result<PathBuf> {
    let Bundle {
        boundary, material, ..
    } = bundle;
    let [_, mesh, _] = options.organ.traits();
    let (option, name) = options.driver();
    let load = format!(
        "{option} {name} --seed {} --boundary {boundary}",
        options.seed
    );
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
        eprintln!(
            "2/4 the reference simulation is there already: {}",
            file.display()
        );
        return Ok(file);
    }
    let words = options.words();
    eprintln!(
        "2/4 simulating {words}, boundary `{boundary}`, with the reference solver: frames of 50 ms"
    );
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let words = format!("simulate --mesh {mesh} {load} --threads {threads} --out");
    let mut command = workspace.command(workspace.upt(), &words);
    command.arg(&file);
    for (option, key) in [
        ("--young", "young_pa"),
        ("--poisson", "poisson"),
        ("--density", "density_kg_m3"),
        ("--damping", "damping_per_s"),
    ] {
        if let Some(value) = material[key].as_f64() {
            command.args([option, &value.to_string()]);
        }
    }
    succeed(&mut command)?;
    Ok(file)
}

/// `upt report` of the bundles: driven by the poses of the tool alone, or given the nodes and vectors of a contact scheme,
/// the paper's own measure.
fn report(
    workspace: &Workspace,
    options: &Options,
    bundles: &[&Bundle],
    trajectory: &Path,
    out: &Path,
) -> Result<()> {
    let [organ, _, plain] = options.organ.traits();
    let mut command = workspace.command(workspace.upt(), "report --out");
    ort::set_environment(workspace, &mut command)?;
    command.arg(out);
    command.args([
        "--title",
        &format!("A {organ} pushed by libupt: {}", options.words()),
    ]);
    for bundle in bundles {
        command.arg("--bundle").arg(&bundle.path);
    }
    let shows = match options.scheme {
        Some(_) => {
            eprintln!("3/4 replaying the contact through the bundles and the plain methods");
            command.args([
                "--region",
                "all,surface",
                "--tled-frames",
                "20",
                "--plain",
                plain,
            ]);
            command.arg("--trajectory");
            "pictures and curves: report.html"
        }
        None => {
            eprintln!("3/4 driving the bundles by the tool's poses alone");
            command.arg("--tools");
            "the dent in cross-section, forces over time: tools.html"
        }
    };
    succeed(command.arg(trajectory))?;
    println!("4/4 in {}: {shows}", out.display());
    Ok(())
}

fn succeed(command: &mut Command) -> Result<()> {
    if !run_visibly(command)? {
        bail!("{:?} failed", command.get_program());
    }
    Ok(())
}
