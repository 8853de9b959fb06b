//! `upt modes`: the lowest natural modes of a held mesh.
//!
//! Writes `frequency [m]` (rad/s) and `modes [m,3K]` (mass-normalised, kg^-1/2) as one safetensors file, from which
//! `python -m upt_training.vibration --natural FILE` makes a bundle's free vibration.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use indicatif::ProgressBar;
use serde_json::json;
use tissue::linear::{Factor, Lame, NaturalModes, Stiffness, natural_modes};
use tissue::mesh::{Boundary, Mesh};
use tissue::tensors::f32_values;

use crate::prior::{floats, header};

/// Options of `upt modes`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  upt modes --mesh onnx/meshes/brain.mesh.safetensors --out brain.modes.safetensors"
)]
pub struct Options {
    /// Mesh file (`*.mesh.safetensors`) with held nodes.
    #[arg(long)]
    pub mesh: PathBuf,
    /// Held node sets: `fixed` or `supported`.
    #[arg(long, default_value = "fixed")]
    pub boundary: Boundary,
    /// Number of modes.
    #[arg(long, default_value_t = 64)]
    pub count: usize,
    /// File to write.
    #[arg(long)]
    pub out: PathBuf,
    /// Young's modulus, Pa.
    #[arg(long, default_value_t = 3000.0)]
    pub young: f64,
    /// Poisson's ratio.
    #[arg(long, default_value_t = 0.49)]
    pub poisson: f64,
    /// Density, kg/m³.
    #[arg(long, default_value_t = 1000.0)]
    pub density: f64,
    /// Threads of the factorisation and the solves (0: all).
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Runs the command.
pub fn run(args: &Options) -> anyhow::Result<ExitCode> {
    write(args, &|| true)?;
    Ok(ExitCode::SUCCESS)
}

/// Reads a file of modes, as float32 kept them.
pub fn read(path: &Path) -> anyhow::Result<NaturalModes> {
    let bytes =
        std::fs::read(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    let file = safetensors::SafeTensors::deserialize(&bytes)
        .with_context(|| format!("{}: not a file of modes", path.display()))?;
    let values = |name: &str| -> anyhow::Result<Vec<f64>> {
        let tensor = file
            .tensor(name)
            .with_context(|| format!("{}: not a file of modes", path.display()))?;
        Ok(f32_values(tensor.data()).map(f64::from).collect())
    };
    Ok(NaturalModes {
        frequency: values("frequency")?,
        modes: values("modes")?,
    })
}

/// Writes the file; returns the lowest and the highest frequency, Hz. `go_on` is asked before each solve: where it says no, the error is
/// [`LinearError::Stopped`](tissue::linear::LinearError::Stopped).
pub fn write(args: &Options, go_on: &(dyn Fn() -> bool + Sync)) -> anyhow::Result<[f64; 2]> {
    let mesh = Mesh::read(&args.mesh)?;
    let held = mesh.held_nodes(args.boundary);
    let lame = Lame::from_young(args.young, args.poisson)?;
    let started = Instant::now();
    let stiffness = Stiffness::assemble(&mesh, &held, lame)?;
    let factor = Factor::new(&stiffness, &mesh.positions, args.threads)?;
    let bar = if args.json {
        ProgressBar::hidden()
    } else {
        ProgressBar::new_spinner().with_message("solves with the factor")
    };
    let found = natural_modes(
        &mesh,
        &stiffness,
        &factor,
        args.density,
        args.count,
        &|| {
            bar.inc(1);
            go_on()
        },
    )?;
    let solves = bar.position();
    bar.finish_and_clear();

    let metadata = json!({
        "format": "upt-modes", "version": "1", "mesh_name": mesh.name, "mesh_sha256": mesh.hash(),
        "boundary": args.boundary.as_str(), "young_pa": args.young.to_string(), "poisson": args.poisson.to_string(),
        "density_kg_m3": args.density.to_string(),
    });
    let mut bytes = header(
        &[
            ("modes", "F32", [args.count, 3 * mesh.node_count()]),
            ("frequency", "F32", [args.count, 1]),
        ],
        metadata,
    );
    bytes.extend(floats(found.modes.iter().map(|&v| v as f32)));
    bytes.extend(floats(found.frequency.iter().map(|&v| v as f32)));
    let temporary = args.out.with_extension("partial");
    std::fs::write(&temporary, bytes)
        .with_context(|| format!("{}: writing failed", temporary.display()))?;
    std::fs::rename(&temporary, &args.out)
        .with_context(|| format!("{}: cannot be renamed", temporary.display()))?;

    let hertz = |rad_s: f64| rad_s / std::f64::consts::TAU;
    let (low, high) = (
        hertz(found.frequency[0]),
        hertz(found.frequency[args.count - 1]),
    );
    let seconds = started.elapsed().as_secs_f64();
    if args.json {
        let value = json!({
            "modes": args.count, "hertz": [low, high], "solves": solves, "seconds": seconds, "file": args.out.display().to_string(),
        });
        println!("{value}");
    } else {
        println!(
            "{}: {} modes from {low:.2} to {high:.2} Hz, {solves} solves, {seconds:.1} s",
            args.out.display(),
            args.count
        );
    }
    Ok([low, high])
}
