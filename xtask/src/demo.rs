//! `cargo xtask demo`: an organ pushed by libupt beside the reference solver, from a fresh clone.
//!
//! Set-up; a tool that presses, slides and lifts, simulated by the reference solver (kept by content); every committed bundle of that organ driven by
//! the tool's poses alone; a table and a page. With `--scheme` the paper's own measure instead: a collision field, replayed.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use sha2::{Digest, Sha256};

use crate::workspace::Workspace;
use crate::{ort, stages, system, venv};

mod tables;

use tables::{print_table, print_tool_table};

/// An organ with committed bundles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Organ {
    Brain,
    Liver,
}

impl Organ {
    /// The mesh whose bundles are shown.
    fn mesh(self) -> &'static str {
        match self {
            Self::Brain => "onnx/meshes/brain.mesh.safetensors",
            Self::Liver => "onnx/liver-coarse/mesh.safetensors",
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Brain => "brain",
            Self::Liver => "liver",
        }
    }

    /// What it is compared with: there is no coarser mesh of the liver.
    fn plain(self) -> &'static str {
        match self {
            Self::Brain => "zero,prior,coarse,tled",
            Self::Liver => "zero,prior,tled",
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
    if !missing.is_empty() {
        bail!("install {} first", missing.join(", "));
    }
    eprintln!("1/4 set-up");
    venv::create(workspace)?;
    let library = ort::host_library(workspace)?;
    stages::build_for_demo(workspace)?;

    let bundles = bundles_of(workspace, options.organ)?;
    let mut boundaries: Vec<&str> = bundles
        .iter()
        .map(|bundle| bundle.boundary.as_str())
        .collect();
    boundaries.sort_unstable();
    boundaries.dedup();
    let folder = match options.organ {
        Organ::Brain => workspace.path("target/demo"),
        organ => workspace.path("target/demo").join(organ.name()),
    };
    std::fs::create_dir_all(&folder)?;
    for boundary in &boundaries {
        let own: Vec<&Bundle> = bundles
            .iter()
            .filter(|bundle| bundle.boundary == *boundary)
            .collect();
        let trajectory = simulate(workspace, options, own[0], &folder)?;
        // The paper's boundary condition gets the plain names; another one its own folder.
        let out = if *boundary == boundaries[0] {
            folder.clone()
        } else {
            folder.join(boundary)
        };
        let command = report_command(workspace, options, &library, &own, &out);
        match options.scheme {
            Some(_) => replay(options, command, &trajectory, &out)?,
            None => drive(options, command, &trajectory, &out)?,
        }
    }
    Ok(true)
}

/// The committed bundles of the mesh that the demo simulates.
fn bundles_of(workspace: &Workspace, organ: Organ) -> Result<Vec<Bundle>> {
    let mut found = Vec::new();
    let mut left_out = Vec::new();
    let nodes = mesh_nodes(&workspace.path(organ.mesh()))?;
    for entry in std::fs::read_dir(workspace.path("onnx"))? {
        let path = entry?.path();
        let Ok(text) = std::fs::read_to_string(path.join("bundle.json")) else {
            continue;
        };
        let manifest: serde_json::Value = serde_json::from_str(&text)
            .with_context(|| format!("{}/bundle.json", path.display()))?;
        let name = manifest["name"].as_str().unwrap_or("?").to_owned();
        if manifest["mesh"]["nodes"].as_u64() != Some(nodes) {
            left_out.push(format!("{name} (another mesh)"));
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
    if found.is_empty() {
        bail!("no bundle below onnx/ fits {}", organ.mesh());
    }
    Ok(found)
}

/// Node count of the demo's mesh, from the header of its file.
fn mesh_nodes(path: &Path) -> Result<u64> {
    let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let length = u64::from_le_bytes(
        bytes
            .get(..8)
            .context("the mesh file is cut short")?
            .try_into()?,
    ) as usize;
    let header: serde_json::Value = serde_json::from_slice(
        bytes
            .get(8..8 + length)
            .context("the mesh file is cut short")?,
    )?;
    header["positions"]["shape"][0]
        .as_u64()
        .context("the mesh file has no `positions`")
}

/// The reference simulation, made once for each mesh, scheme, seed, boundary and version of the solver's source.
fn simulate(
    workspace: &Workspace,
    options: &Options,
    bundle: &Bundle,
    folder: &Path,
) -> Result<PathBuf> {
    let mesh = options.organ.mesh();
    let boundary = bundle.boundary.as_str();
    let mut hash = Sha256::new();
    hash.update(std::fs::read(workspace.path(mesh))?);
    let mut folders = ["contact", "elements", "tissue"]
        .map(|name| workspace.path(&format!("crates/{name}/src")))
        .to_vec();
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder)? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else {
                files.push(path);
            }
        }
    }
    files.sort();
    for file in files {
        hash.update(std::fs::read(file)?);
    }
    let (option, name) = options.driver();
    hash.update(format!(
        "{option} {name} {} {boundary} {}",
        options.seed, bundle.material
    ));
    let key = format!("{:x}", hash.finalize());
    let file = folder.join(format!("contact-{}.trajectory.safetensors", &key[..16]));
    if file.is_file() {
        eprintln!(
            "2/4 the reference simulation is there already: {}",
            file.display()
        );
        return Ok(file);
    }
    eprintln!(
        "2/4 simulating {}, boundary `{boundary}`, with the reference solver: frames of 50 ms",
        options.words()
    );
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut command = Command::new(workspace.upt());
    command
        .current_dir(&workspace.root)
        .args([
            "simulate",
            "--mesh",
            mesh,
            option,
            name,
            "--seed",
            &options.seed.to_string(),
            "--boundary",
            boundary,
        ])
        .args(["--threads", &threads.to_string(), "--out"])
        .arg(&file);
    for (option, key) in [
        ("--young", "young_pa"),
        ("--poisson", "poisson"),
        ("--density", "density_kg_m3"),
        ("--damping", "damping_per_s"),
    ] {
        if let Some(value) = bundle.material[key].as_f64() {
            command.args([option, &value.to_string()]);
        }
    }
    run_visibly(&mut command, "upt simulate")?;
    Ok(file)
}

/// `upt report` of the bundles: what each demo has in common.
fn report_command(
    workspace: &Workspace,
    options: &Options,
    library: &Path,
    bundles: &[&Bundle],
    out: &Path,
) -> Command {
    let (organ, words) = (options.organ.name(), options.words());
    let mut command = Command::new(workspace.upt());
    command.current_dir(&workspace.root).stdout(Stdio::null());
    command.arg("report").arg("--out").arg(out);
    command.args(["--title", &format!("A {organ} pushed by libupt: {words}")]);
    for bundle in bundles {
        command.arg("--bundle").arg(&bundle.path);
    }
    ort::set_environment(&mut command, library);
    command
}

/// The paper's own measure: the nodes and vectors of the contact, given to the library.
fn replay(options: &Options, mut command: Command, trajectory: &Path, out: &Path) -> Result<()> {
    eprintln!("3/4 replaying the contact through the bundles and the plain methods");
    let plain = options.organ.plain();
    command.arg("--trajectory").arg(trajectory);
    command.args(["--region", "all,surface", "--tled-frames", "20"]);
    run_visibly(command.args(["--plain", plain]), "upt report")?;
    print_table(&out.join("report.json"))?;
    let page = out.join("report.html");
    println!("4/4 pictures and curves: {}", page.display());
    Ok(())
}

/// The library driven by the poses of the tool alone.
fn drive(options: &Options, mut command: Command, trajectory: &Path, out: &Path) -> Result<()> {
    let does = match options.tool.as_str() {
        "stroke" => "it presses, slides and lifts",
        other => other,
    };
    eprintln!("3/4 driving the bundles by the tool's poses alone: {does}");
    command.arg("--tools").arg(trajectory);
    run_visibly(&mut command, "upt report --tools")?;
    print_tool_table(&out.join("tools.json"))?;
    let page = out.join("tools.html");
    println!(
        "4/4 the dent in cross-section, forces over time: {}",
        page.display()
    );
    Ok(())
}

fn run_visibly(command: &mut Command, name: &str) -> Result<()> {
    let status = command
        .status()
        .with_context(|| format!("cannot start {name}"))?;
    if !status.success() {
        bail!("{name} failed");
    }
    Ok(())
}
