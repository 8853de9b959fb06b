//! `upt prior`: compliance columns of the nodes that instruments may touch, as a file.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use make::prior::{self, Written};
use serde_json::json;
use tissue::mesh::Boundary;

use crate::progress;

/// Options of `upt prior`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  upt prior --mesh onnx/meshes/brain.mesh.safetensors --out brain.columns.safetensors"
)]
pub struct Options {
    /// Mesh file (`*.mesh.safetensors`) with a domain and held nodes.
    #[arg(long)]
    mesh: PathBuf,
    /// Held node sets: `fixed` or `supported`.
    #[arg(long, default_value = "fixed")]
    boundary: Boundary,
    /// File to write.
    #[arg(long)]
    out: PathBuf,
    /// Young's modulus, Pa.
    #[arg(long, default_value_t = 3000.0)]
    young: f64,
    /// Poisson's ratio.
    #[arg(long, default_value_t = 0.49)]
    poisson: f64,
    /// Right-hand sides solved together.
    #[arg(long, default_value_t = 96)]
    batch: usize,
    /// Threads of the factorisation and the solves (0: all).
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Options) -> anyhow::Result<ExitCode> {
    let order = prior::Options {
        mesh: args.mesh.clone(),
        boundary: args.boundary,
        out: args.out.clone(),
        young: args.young,
        poisson: args.poisson,
        batch: args.batch,
        threads: args.threads,
        watch: progress::watch(args.json),
    };
    let Written {
        rows,
        width,
        factor_entries,
        factor_seconds,
        solve_seconds,
    } = prior::write_columns(&order, &mut |_| Ok(()))?;
    let out = &args.out;
    if args.json {
        let value = json!({
            "columns": rows, "dofs": width, "factor_entries": factor_entries,
            "factor_s": factor_seconds, "solve_s": solve_seconds, "file": out.display().to_string(),
        });
        println!("{value}");
    } else {
        println!(
            "{}: {rows} columns of {width} dofs, factor {factor_seconds:.1} s, solves {solve_seconds:.1} s",
            out.display()
        );
    }
    Ok(ExitCode::SUCCESS)
}
