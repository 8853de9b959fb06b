//! `upt modes`: the lowest natural modes of a held mesh, as a file.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Args;
use make::modes::{self, Written};
use serde_json::json;
use tissue::mesh::Boundary;

use crate::progress;

/// Options of `upt modes`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  upt modes --mesh onnx/meshes/brain.mesh.safetensors --out brain.modes.safetensors"
)]
pub struct Options {
    /// Mesh file (`*.mesh.safetensors`) with held nodes.
    #[arg(long)]
    mesh: PathBuf,
    /// Held node sets: `fixed` or `supported`.
    #[arg(long, default_value = "fixed")]
    boundary: Boundary,
    /// Number of modes.
    #[arg(long, default_value_t = 64)]
    count: usize,
    /// File to write.
    #[arg(long)]
    out: PathBuf,
    /// Young's modulus, Pa.
    #[arg(long, default_value_t = 3000.0)]
    young: f64,
    /// Poisson's ratio.
    #[arg(long, default_value_t = 0.49)]
    poisson: f64,
    /// Density, kg/m³.
    #[arg(long, default_value_t = 1000.0)]
    density: f64,
    /// Threads of the factorisation and the solves (0: all).
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Options) -> anyhow::Result<ExitCode> {
    let started = Instant::now();
    let order = modes::Options {
        mesh: args.mesh.clone(),
        boundary: args.boundary,
        count: args.count,
        out: args.out.clone(),
        young: args.young,
        poisson: args.poisson,
        density: args.density,
        threads: args.threads,
        watch: progress::watch(args.json),
    };
    let Written {
        hertz: [low, high],
        solves,
    } = modes::write(&order, &|| true)?;
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
    Ok(ExitCode::SUCCESS)
}
