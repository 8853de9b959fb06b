//! `upt mesh`: what a mesh is (`info`), a mesh from another program (`import`), a mesh from a
//! distance field (`stuff`).

use anyhow::bail;
use clap::{Args, Subcommand};
use serde_json::json;
use std::path::PathBuf;
use std::process::ExitCode;
use tissue::material::Material;
use tissue::mesh::{Boundary, Mesh};
use tissue::mesh_import::{Ball, ImportOptions, RawTets, Resolution, from_tets, import};
use tissue::mesh_quality::{Quality, measure};
use tissue::solver::{Solver, SolverOptions};
use tissue::stuffing::{GridField, HalfSpace, stuff};

#[derive(Debug, Args)]
#[command(after_help = "Example:\n  upt mesh info onnx/meshes/brain.mesh.safetensors --json")]
pub struct Options {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Counts, quality, manifoldness and the critical time step of a mesh.
    Info(Info),
    /// A mesh from tetrahedra (VTK, VTU, MSH) or from a closed surface (STL, OBJ, PLY).
    Import(Import),
    /// Fill a signed distance grid with tetrahedra; `python -m upt_training.anatomy` calls this.
    Stuff(Stuff),
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
    /// Selective mass scaling, ms: the critical step that it gives, and the mass that it adds.
    #[arg(long, default_value_t = 0.0)]
    mass_scaling_ms: f64,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  upt mesh import liver.msh liver.mesh.safetensors --fixed-sphere 0,0,0,20 --domain-sphere 60,0,30,25\n  upt mesh import kidney.stl kidney.mesh.safetensors --nodes 5000 --scale 1000"
)]
struct Import {
    /// File to read: .vtk, .vtu, .msh (2.2 or 4.1), .stl, .obj or .ply.
    input: PathBuf,
    /// Mesh file to write (*.mesh.safetensors).
    output: PathBuf,
    /// Name in the mesh file; default: the input's.
    #[arg(long)]
    name: Option<String>,
    /// Millimetres a unit of the file: 1000 for metres.
    #[arg(long, default_value_t = 1.0)]
    scale: f64,
    /// Surfaces: wanted number of nodes.
    #[arg(long, conflicts_with = "spacing")]
    nodes: Option<usize>,
    /// Surfaces: lattice spacing, mm.
    #[arg(long)]
    spacing: Option<f64>,
    /// Remove faults that can be removed safely, and report them.
    #[arg(long)]
    repair: bool,
    /// Hold the nodes in this ball (x,y,z,r in mm); may be repeated.
    #[arg(long, value_name = "X,Y,Z,R", allow_hyphen_values = true)]
    fixed_sphere: Vec<Ball>,
    /// Instruments may touch the surface in this ball; may be repeated.
    #[arg(long, value_name = "X,Y,Z,R", allow_hyphen_values = true)]
    domain_sphere: Vec<Ball>,
    /// Under the `supported` boundary condition hold the surface outside this ball; may be repeated.
    #[arg(long, value_name = "X,Y,Z,R", allow_hyphen_values = true)]
    window_sphere: Vec<Ball>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  upt mesh stuff head.grid.safetensors head.mesh.safetensors --spacing 3.2 --half-space 1,0,0,0"
)]
struct Stuff {
    /// Distance field (docs/formats.md), positive inside.
    field: PathBuf,
    /// Mesh file to write; no set is filled.
    output: PathBuf,
    /// Lattice spacing, mm.
    #[arg(long)]
    spacing: f64,
    /// Keep the side of a plane where a x + b y + c z + d > 0.
    #[arg(long, value_name = "A,B,C,D", allow_hyphen_values = true, value_parser = plane)]
    half_space: Option<[f64; 4]>,
}

fn plane(text: &str) -> Result<[f64; 4], String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let plane: [f64; 4] = numbers
        .ok()
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or("write a,b,c,d")?;
    let length = plane[..3].iter().map(|x| x * x).sum::<f64>().sqrt();
    if length.is_finite() && length > 0.0 && plane[3].is_finite() {
        Ok(plane.map(|x| x / length))
    } else {
        Err("the normal a,b,c must not be zero".into())
    }
}

/// Runs the command.
pub fn run(options: &Options) -> anyhow::Result<ExitCode> {
    match &options.command {
        Command::Info(info) => run_info(info),
        Command::Import(import) => run_import(import),
        Command::Stuff(stuff) => run_stuff(stuff),
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

fn print_quality(q: &Quality) {
    let row = |label: &str, text: String| println!("{label:24}{text}");
    row("nodes", q.nodes.to_string());
    row("tetrahedra", q.tets.to_string());
    row(
        "surface",
        format!(
            "{} faces, {} nodes, {:.0} mm²",
            q.surface_faces, q.surface_nodes, q.surface_area_mm2
        ),
    );
    row(
        "domain",
        format!("{} faces, {:.0} mm²", q.domain_faces, q.domain_area_mm2),
    );
    row(
        "held nodes",
        format!("{} fixed, {} supported", q.fixed_nodes, q.supported_nodes),
    );
    row("components", q.components.to_string());
    row("volume", format!("{:.1} ml", q.volume_mm3 * 1e-3));
    row("box", format!("{:?} to {:?} mm", q.low_mm, q.high_mm));
    row(
        "edges",
        format!(
            "{:.3} to {:.3} mm, mean {:.3}; surface mean {:.3}",
            q.min_edge_mm, q.max_edge_mm, q.mean_edge_mm, q.mean_surface_edge_mm
        ),
    );
    row(
        "dihedral angles",
        format!(
            "{:.2} to {:.2} degrees",
            q.min_dihedral_deg, q.max_dihedral_deg
        ),
    );
    row(
        "inscribed radius",
        format!(
            "{:.4} mm at least (tet {})",
            q.min_inscribed_radius_mm, q.min_inscribed_radius_tet
        ),
    );
    row("smallest tet", format!("{:.4} mm³", q.min_tet_volume_mm3));
    let mut boundary = String::from("manifold");
    if !q.non_manifold_edges.is_empty() || !q.non_manifold_nodes.is_empty() {
        boundary = format!(
            "not manifold at edges {:?} and nodes {:?}",
            q.non_manifold_edges, q.non_manifold_nodes
        );
    }
    row(
        "boundary",
        format!(
            "{boundary}, Euler characteristic {}",
            q.euler_characteristic
        ),
    );
}

fn run_import(args: &Import) -> anyhow::Result<ExitCode> {
    let resolution = match (args.nodes, args.spacing) {
        (Some(nodes), _) => Some(Resolution::Nodes(nodes)),
        (_, Some(spacing)) => Some(Resolution::Spacing(spacing)),
        _ => None,
    };
    let imported = import(
        &args.input,
        &ImportOptions {
            name: args.name.clone(),
            scale: args.scale,
            resolution,
            repair: args.repair,
            fixed: args.fixed_sphere.clone(),
            domain: args.domain_sphere.clone(),
            window: args.window_sphere.clone(),
        },
    )
    .map_err(|error| match error.names_file() {
        true => anyhow::Error::new(error),
        false => anyhow::Error::new(error).context(args.input.display().to_string()),
    })?;
    imported.mesh.write(&args.output)?;
    let quality = measure(&imported.mesh);
    if args.json {
        let mut value = serde_json::to_value(&quality)?;
        value["repairs"] = serde_json::to_value(&imported.repairs)?;
        value["sha256"] = json!(imported.mesh.hash());
        println!("{value:#}");
        return Ok(ExitCode::SUCCESS);
    }
    for repair in &imported.repairs {
        println!("{:24}{repair}", "repaired");
    }
    print_quality(&quality);
    if imported.mesh.fixed.is_empty() {
        println!("no node is held; name some with --fixed-sphere before simulating");
    }
    println!("{:24}{}", "written", args.output.display());
    Ok(ExitCode::SUCCESS)
}

fn run_stuff(args: &Stuff) -> anyhow::Result<ExitCode> {
    let field = GridField::read(&args.field)?;
    let made = match args.half_space {
        Some([a, b, c, offset]) => stuff(
            &HalfSpace {
                inner: field,
                normal: [a, b, c],
                offset,
            },
            args.spacing,
        ),
        None => stuff(&field, args.spacing),
    }?;
    let raw = RawTets {
        positions: made.positions,
        tets: made.tets,
    };
    let mut repairs = Vec::new();
    let mut mesh = from_tets(raw, false, &mut repairs)?;
    if !repairs.is_empty() {
        bail!(
            "{}: {} repairs in a stuffed mesh",
            args.field.display(),
            repairs.len()
        );
    }
    mesh.name = "stuffed".into();
    mesh.source = format!("distance field stuffed at a spacing of {} mm", args.spacing);
    mesh.license = "as the distance field's".into();
    mesh.write(&args.output)?;
    println!(
        "{} nodes, {} tetrahedra, {} dropped for a manifold boundary",
        mesh.node_count(),
        mesh.tets.len(),
        made.dropped
    );
    Ok(ExitCode::SUCCESS)
}
