//! `upt mesh`: what a mesh is (`info`); `import` and `stuff` are in `mesh/files.rs`.

#[cfg(feature = "linear")]
mod files;
mod quality;
#[cfg(feature = "linear")]
mod sets;

use clap::{Args, Subcommand};
use serde_json::json;
use std::path::PathBuf;
use std::process::ExitCode;
use tissue::material::Material;
use tissue::mesh::{Boundary, Mesh};
use tissue::mesh_quality::measure;
use tissue::solver::{Solver, SolverOptions};

#[cfg(feature = "linear")]
use files::{Import, Stuff, run_import, run_stuff};
use quality::print_quality;

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  upt mesh info onnx/meshes/brain.mesh.safetensors --json")]
pub struct Options {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Print counts, quality, manifoldness and the critical time step of a mesh.
    Info(Info),
    #[cfg(feature = "linear")]
    /// Import tetrahedra (VTK, Gmsh, Abaqus, FEBio, Medit, TetGen) or fill a closed surface (STL, OBJ, PLY, OFF, VTK).
    Import(Import),
    #[cfg(feature = "linear")]
    /// Fill a signed distance grid with tetrahedra; `python -m upt_training.anatomy` calls this.
    Stuff(Stuff),
    /// Left out of this small `upt`; `cargo build --release -p upt-cli` builds the whole.
    #[cfg(not(feature = "linear"))]
    Import(crate::left_out::Options),
    /// Left out of this small `upt`; `cargo build --release -p upt-cli` builds the whole.
    #[cfg(not(feature = "linear"))]
    Stuff(crate::left_out::Options),
}

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  upt mesh info onnx/meshes/brain.mesh.safetensors")]
struct Info {
    /// Mesh file (*.mesh.safetensors).
    mesh: PathBuf,
    /// Held nodes: `fixed` or `supported`.
    #[arg(long, default_value = "fixed")]
    boundary: Boundary,
    /// Young's modulus, Pa.
    #[arg(long, default_value_t = Material::default().young_pa)]
    young: f64,
    /// Poisson's ratio.
    #[arg(long, default_value_t = Material::default().poisson)]
    poisson: f64,
    /// Density, kg/m³.
    #[arg(long, default_value_t = Material::default().density_kg_m3)]
    density: f64,
    /// Selective mass scaling, ms; prints the critical step that it gives and the mass that it adds.
    #[arg(long, default_value_t = 0.0)]
    mass_scaling_ms: f64,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(options: &Options) -> anyhow::Result<ExitCode> {
    match &options.command {
        Command::Info(info) => run_info(info),
        #[cfg(feature = "linear")]
        Command::Import(import) => run_import(import),
        #[cfg(feature = "linear")]
        Command::Stuff(stuff) => run_stuff(stuff),
        #[cfg(not(feature = "linear"))]
        Command::Import(options) | Command::Stuff(options) => {
            crate::left_out::run("linear", options)
        }
    }
}

fn run_info(args: &Info) -> anyhow::Result<ExitCode> {
    let mesh = Mesh::read(&args.mesh)?;
    let quality = measure(&mesh);
    let options = SolverOptions {
        material: Material {
            young_pa: args.young,
            poisson: args.poisson,
            density_kg_m3: args.density,
            ..Material::default()
        },
        mass_scaling_s: args.mass_scaling_ms * 1e-3,
        ..SolverOptions::default()
    };
    let wave_speed = options.material.wave_speed_mm_s();
    let safety = options.safety;
    let solver = Solver::new(&mesh, args.boundary, options)?;
    let critical = solver.critical_step_at_rest_s();
    let added_mass = solver.added_mass();
    if args.json {
        let mut value = serde_json::to_value(&quality)?;
        value["name"] = json!(mesh.name);
        value["source"] = json!(mesh.source);
        value["license"] = json!(mesh.license);
        value["sha256"] = json!(mesh.hash());
        value["boundary"] = json!(args.boundary.as_str());
        value["critical_step_s"] = json!(critical);
        value["added_mass"] = json!(added_mass);
        println!("{value:#}");
        return Ok(ExitCode::SUCCESS);
    }
    println!("{:24}{}", "name", mesh.name);
    println!("{:24}{}", "source", mesh.source);
    println!("{:24}{}", "license", mesh.license);
    println!("{:24}{}", "hash", mesh.hash());
    print_quality(&quality);
    println!(
        "{:24}{:.4} ms at rest (E {} Pa, nu {}, {} kg/m³, boundary {}); {:.4} ms with the solver's safety of {safety}",
        "critical step",
        critical * 1e3,
        args.young,
        args.poisson,
        args.density,
        args.boundary.as_str(),
        critical * safety * 1e3,
    );
    if args.mass_scaling_ms > 0.0 {
        println!(
            "{:24}{:.3} % of the mass added",
            "mass scaling",
            100.0 * added_mass
        );
    }
    println!("{:24}{:.2} m/s at rest", "pressure wave", wave_speed * 1e-3);
    Ok(ExitCode::SUCCESS)
}
