//! `upt mesh import` (a mesh from another program) and `upt mesh stuff` (a mesh from a distance field).

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::bail;
use clap::Args;
use foreign::labels::{Said, convert};
use make::regions;
use serde_json::json;
use tissue::mesh_import::{ImportOptions, RawTets, Region, Resolution, from_tets, import};
use tissue::mesh_quality::measure;
use tissue::stuffing::{GridField, HalfSpace, stuff};

use super::{print_quality, sets};
use crate::progress;

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  upt mesh import liver.msh liver.mesh.safetensors --fixed ball:0,0,0,20 --domain ball:60,0,30,25\n  upt mesh import kidney.stl kidney.mesh.safetensors --nodes 5000 --unit m"
)]
pub struct Import {
    /// File to read: .vtk, .vtu, .vtp, .msh (1, 2 or 4.1), .inp, .feb, .mesh, .node, .ele, .stl, .obj, .ply, .off, or a
    /// label volume (.nii, .nii.gz, .nrrd, .mha; read by Python libraries), whose surfaces go to a folder beside the output.
    input: PathBuf,
    /// Mesh file to write (*.mesh.safetensors).
    output: PathBuf,
    /// Name in the mesh file. Default: the input's.
    #[arg(long)]
    name: Option<String>,
    /// Unit of the file's coordinates: mm, cm, m, in, or a number of millimetres per unit. Regions are in mm.
    #[arg(long, default_value = "mm")]
    unit: String,
    /// Surfaces: number of nodes to aim for.
    #[arg(long, conflicts_with = "spacing")]
    nodes: Option<usize>,
    /// Surfaces: lattice spacing, mm.
    #[arg(long)]
    spacing: Option<f64>,
    /// Remove faults that can be removed safely, and report them.
    #[arg(long)]
    repair: bool,
    /// Of tetrahedra take only the boundary and fill it anew with about --nodes nodes: cures slivers.
    #[arg(long)]
    refill: bool,
    /// Which body, where the file holds several: its number or its name in the list that the command then prints.
    #[arg(long, value_name = "NUMBER|NAME")]
    part: Option<String>,
    /// Labels of a label volume that are the body: one or several (`--label 1,3`). Default: all but 0.
    #[arg(long, value_name = "LABELS", value_delimiter = ',')]
    label: Vec<i64>,
    /// Region whose nodes are held, in the words of `upt make`: ball:x,y,z,r, plane:a,b,c,d, inside:FILE, group:NAME, or not: before one of these.
    /// May be repeated.
    #[arg(long, value_name = "REGION", allow_hyphen_values = true)]
    fixed: Vec<Region>,
    /// Region of the surface that instruments may touch; may be repeated.
    #[arg(long, value_name = "REGION", allow_hyphen_values = true)]
    domain: Vec<Region>,
    /// Under the `supported` boundary condition hold the surface outside this region; may be repeated.
    #[arg(long, value_name = "REGION", allow_hyphen_values = true)]
    window: Vec<Region>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  upt mesh stuff head.grid.safetensors head.mesh.safetensors --spacing 3.2 --half-space 1,0,0,0"
)]
pub struct Stuff {
    /// Distance field (docs/reference/formats.md), positive inside.
    field: PathBuf,
    /// Mesh file to write; its sets are empty.
    output: PathBuf,
    /// Lattice spacing, mm.
    #[arg(long)]
    spacing: f64,
    /// Keep the side of a plane where a x + b y + c z + d > 0.
    #[arg(long, value_name = "A,B,C,D", allow_hyphen_values = true, value_parser = plane)]
    half_space: Option<[f64; 4]>,
    /// The part of the field's volume that the tetrahedra must hold.
    #[arg(long, value_name = "PART", default_value_t = 0.97)]
    least_share: f64,
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

/// A mesh from another program.
pub fn run_import(args: &Import) -> anyhow::Result<ExitCode> {
    let resolution = match (args.nodes, args.spacing) {
        (Some(nodes), _) => Some(Resolution::Nodes(nodes)),
        (_, Some(spacing)) => Some(Resolution::Spacing(spacing)),
        _ => None,
    };
    let mut found = Vec::new();
    let name = args.input.file_name().unwrap_or_default();
    let stem = name.to_string_lossy().split('.').next().map(String::from);
    let folder = args.output.with_extension("").with_extension("labels");
    let (watch, mut bar) = (progress::watch(args.json), None);
    let input = convert(&args.input, &args.label, &folder, &mut |said| match said {
        Said::Line(line) => found.push(line.to_owned()),
        Said::Percent(done) => bar
            .get_or_insert_with(|| watch.bar(100, "reading the labels"))
            .set_position(done),
    })?;
    drop(bar);
    let is_volume = input != args.input;
    let scale = regions::millimetres(&args.unit)?;
    let mut imported = import(
        &input,
        &ImportOptions {
            name: args.name.clone().or(stem.filter(|_| is_volume)),
            scale,
            resolution,
            repair: args.repair || is_volume,
            part: args.part.clone(),
            refill: args.refill,
        },
    )
    .map_err(|error| match error.names_file() {
        true => anyhow::Error::new(error),
        false => anyhow::Error::new(error).context(args.input.display().to_string()),
    })?;
    let asked = [&args.fixed[..], &args.domain, &args.window];
    sets::select(&mut imported.mesh, asked, &input, scale)?;
    imported.mesh.write(&args.output)?;
    let quality = measure(&imported.mesh);
    if args.json {
        let mut value = serde_json::to_value(&quality)?;
        value["repairs"] = serde_json::to_value(&imported.repairs)?;
        found.extend(imported.notes);
        value["notes"] = serde_json::to_value(&found)?;
        value["sha256"] = json!(imported.mesh.hash());
        println!("{value:#}");
        return Ok(ExitCode::SUCCESS);
    }
    for repair in &imported.repairs {
        println!("{:24}{repair}", "repaired");
    }
    found.extend(imported.notes);
    for note in &found {
        println!("{:24}{note}", "note");
    }
    print_quality(&quality);
    if imported.mesh.fixed.is_empty() {
        println!("no node is held; name some with --fixed before simulating");
    }
    println!("{:24}{}", "written", args.output.display());
    Ok(ExitCode::SUCCESS)
}

/// A mesh from a distance field.
pub fn run_stuff(args: &Stuff) -> anyhow::Result<ExitCode> {
    let field = GridField::read(&args.field)?;
    let (made, bounded) = match args.half_space {
        Some([a, b, c, offset]) => {
            let half = HalfSpace {
                inner: field.clone(),
                normal: [a, b, c],
                offset,
            };
            (stuff(&half, args.spacing)?, field.volume_of(&half))
        }
        None => (stuff(&field, args.spacing)?, field.volume_of(&field)),
    };
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
    let share = measure(&mesh).volume_mm3 / bounded;
    if !share.is_finite() || share < args.least_share {
        bail!(
            "{}: the tetrahedra would hold {:.0} % of the {:.1} ml that the field bounds, and --least-share asks for {:.0} %: give a smaller \
             --spacing than {} mm, at most as wide as the thinnest wall",
            args.field.display(),
            100.0 * share,
            1e-3 * bounded,
            100.0 * args.least_share,
            args.spacing
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
