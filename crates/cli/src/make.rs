//! `upt make`: a bundle from an organ's surface or mesh (`crates/make`).

mod choice;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{anyhow, bail};
use clap::Args;
use elements::{Law, Relaxation};
use host::Effort;
use make::{Choice, Fibre, Fixed, Gravity, Made, gravity};
use serde_json::json;
use tissue::mesh::Boundary;
use tissue::mesh_import::Region;
use tissue::programmes::ToolProgramme;

use crate::{emit, loads, materials, progress, tool_size};
use choice::choice;

#[derive(Args, Debug)]
#[command(after_help = "Examples:
  upt make liver.obj --out liver --unit cm --fixed plane:0,0,-1,-20
  upt make kidney.stl --out kidney --fixed ball:0,0,12,9 --domain ball:30,0,0,25 --minutes 3
  upt make heart.vtu --out heart --fixed inside:pericardium.stl --young 15000 --nodes 8000
  upt make liver.obj --out liver --support bed=plane:0,0,-1,-20 --support ligament=ball:40,0,20,8 --gravity 0,-9.81,0 --unload
  upt make head.vtu --out head --fixed group:skull --law corona-radiata --material grey=cortex --material nuclei=basal-ganglia
  upt make liver.obj --out liver --fixed plane:0,0,-1,-20 --preview
  upt make liver.obj --out liver --fixed plane:0,0,-1,-20 --emit slurm jobs")]
pub struct Options {
    /// A closed surface (.stl, .obj, .ply, .vtp), tetrahedra (.msh, .vtk, .vtu, .inp, .feb, .mesh.safetensors) or a label volume
    /// (.nii, .nii.gz, .nrrd, .mha; read by Python libraries, which the command installs for itself).
    input: PathBuf,
    /// Folder of the bundle.
    #[arg(long)]
    out: PathBuf,
    /// Unit of the input's coordinates: mm, cm, m, in, or a number of millimetres per unit. Regions are in mm.
    #[arg(long, default_value = "mm")]
    unit: String,
    /// Labels of a label volume that are the body: one or several (`--label 1,3`). Default: all but 0.
    #[arg(long, value_name = "LABELS", value_delimiter = ',')]
    label: Vec<i64>,
    /// Of tetrahedra take only the boundary and fill it anew with about --nodes nodes: cures slivers.
    #[arg(long)]
    refill: bool,
    /// Which body, where the file holds several: its number or its name in the list that the command then prints.
    #[arg(long, value_name = "NUMBER|NAME")]
    part: Option<String>,
    /// Region whose nodes are held: ball:x,y,z,r, plane:a,b,c,d (where a x + b y + c z + d > 0), inside:FILE (a closed surface in the input's
    /// unit), group:NAME (a group, material or #rrggbb colour of the input), shell:MM (less deep beneath the surface), or not: before one of these. May be repeated. Default: what the
    /// mesh file holds. With NAME= before it the nodes are a support group, which a host moves and lets go apart; of several, a node is the first one's.
    #[arg(
        long,
        visible_alias = "support",
        value_name = "[NAME=]REGION",
        allow_hyphen_values = true
    )]
    fixed: Vec<Fixed>,
    /// Part of the surface that the bundle names, on which a host gives a pressure: boundary triangles with all three corners in a region, as of --fixed. May
    /// be repeated; regions of one name are one, and they may overlap.
    #[arg(long, value_name = "NAME=REGION", allow_hyphen_values = true)]
    pressure: Vec<Fixed>,
    /// Gravity under which the body was scanned, m/s²: what acts on it is what a host's differs by. Of an organ in fluid, what the fluid does not carry of it.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = gravity)]
    gravity: Option<Gravity>,
    /// Make the bundle of the body's shape without the gravity of --gravity, of which the input is the equilibrium: a host's gravity then acts in full.
    #[arg(long, requires = "gravity")]
    unload: bool,
    /// Node sets of a mesh file that are held: `fixed`, or `supported` (both sets; not together with --fixed).
    #[arg(long, default_value = "fixed")]
    boundary: Boundary,
    /// Region of the surface that instruments may touch. May be repeated. Default: what the mesh file names, otherwise all of the surface except a rim around what is held.
    #[arg(long, value_name = "REGION", allow_hyphen_values = true)]
    domain: Vec<Region>,
    /// Region of another stiffness: a region, `=` and a factor on Young's modulus, such as group:tumour=4 or inside:tumour.stl=4. May be repeated; where regions overlap, the last one counts.
    #[arg(long, value_name = "REGION=FACTOR", allow_hyphen_values = true, value_parser = stiffer)]
    stiffness: Vec<(Region, f32)>,
    /// Number of nodes to aim for when a surface is filled.
    #[arg(long, default_value_t = 5000)]
    nodes: usize,
    /// Time for the whole run, minutes, by the clock. What is optional stops in time; where the rest does not fit, an error says how many are needed.
    #[arg(long, default_value_t = 10.0)]
    minutes: f64,
    /// Held-out cases of the check at most. Default: as many as there is time for, at most 8.
    #[arg(long)]
    cases: Option<usize>,
    #[arg(long, help = loads::programmes_help() + ". Two cases of each are part of the certificate and of --target-error")]
    tools: Option<String>,
    #[command(flatten)]
    sizes: tool_size::Arguments,
    /// Material that sets Young's modulus, density and damping: brain (if none is given), liver, kidney, heart or fat. With REGION= before it, a law as of
    /// --law that a region has, with @ behind that its density, kg/m³, and with ~ behind that its relaxation as of --relaxation, or none: one that --region or the mesh file
    /// names, or else a group of the input. May be repeated; where regions overlap, the last one counts. All have the same Poisson's ratio and damping.
    #[arg(long, value_name = "NAME|REGION=LAW[@DENSITY][~RELAXATION]", allow_hyphen_values = true, value_parser = choice)]
    material: Vec<Choice>,
    /// Region that --material gives a law: a name, `=` and a region as of --fixed. May be repeated; regions of one name are one.
    #[arg(long, value_name = "NAME=REGION", allow_hyphen_values = true)]
    region: Vec<Fixed>,
    /// Direction of the fibres of a region that --region, the mesh file or a group names, or of the whole body: any length but 0. For laws with +fibres. Other
    /// directions than one a region come in the field `fibre` of a mesh file. May be repeated; the last one counts.
    #[arg(long, value_name = "[NAME=]X,Y,Z", allow_hyphen_values = true)]
    fibre: Vec<Fibre>,
    /// Young's modulus, Pa; overrides the material's. A law with a modulus of its own sets it.
    #[arg(long)]
    young: Option<f64>,
    /// Law of the tissue: neo-hookean, mooney-rivlin:SHARE with the share of C01 in C10 + C01 (default: 0.526, brain), yeoh:C2/C1[,C3/C1] as
    /// numbers, veronda-westmann:BETA, ogden:MU,ALPHA[,MU,ALPHA...] with MU in Pa or with kPa behind it, or a tissue that `upt materials` lists. Behind any of
    /// them +fibres:K1/MU,K2 adds fibres, whose directions come by --fibre or in the mesh file; fibres:K1/MU,K2 alone has them in neo-hookean.
    #[arg(long, default_value = "neo-hookean", value_parser = materials::law)]
    law: Law,
    /// Relaxation of the stress without change of volume: SHARE,TAU_S[,SHARE,TAU_S...], each share lost with its time constant, s, or a tissue that
    /// `upt materials` lists with one. Default: none.
    #[arg(long, default_value = "", hide_default_value = true, value_parser = materials::relaxation)]
    relaxation: Relaxation,
    /// Poisson's ratio, below 0.5.
    #[arg(long, default_value_t = 0.49)]
    poisson: f64,
    /// Density, kg/m³; overrides the material's.
    #[arg(long)]
    density: Option<f64>,
    /// Damping, 1/s; overrides the material's.
    #[arg(long)]
    damping: Option<f64>,
    /// Deepest push that the bundle is made for, mm. Default: 15 for a body as wide as a brain and at least 40 mm thick beneath its domain, less
    /// for a smaller or thinner one.
    #[arg(long)]
    push: Option<f64>,
    /// Fail if the mean squared error in contact, or that of a programme of --tools, is above this, mm².
    #[arg(long, value_name = "MM2")]
    target_error: Option<f64>,
    /// Corrections per step that the bundle recommends: COUNT, or COUNT@MM for at most COUNT and fewer once the estimated error is below MM.
    /// Default: 10@0.02/2 for pushes of 15 mm, with the target in proportion to the deepest push.
    #[arg(long, value_name = "COUNT[@MM]")]
    corrections: Option<Effort>,
    /// Natural modes.
    #[arg(long, default_value_t = 60)]
    natural: usize,
    /// Number of patches that the coarse space is made from.
    #[arg(long, default_value_t = 120)]
    patches: usize,
    /// Error that the block-wise tables may have, mm (root mean square over typical pushes).
    #[arg(long, default_value_t = 5e-3)]
    tolerance_mm: f64,
    /// Name of the bundle. Default: the input's.
    #[arg(long)]
    name: Option<String>,
    /// Licence of the bundle: that of the anatomy.
    #[arg(long, default_value = "as the input's")]
    license: String,
    /// Folder for the stages. Default: the bundle's folder with `.work` appended.
    #[arg(long)]
    work: Option<PathBuf>,
    /// Only import, and write the page that shows what is held and touched.
    #[arg(long)]
    preview: bool,
    /// Write job scripts for a cluster into a folder instead of running: `--emit slurm DIR` or `--emit ray DIR`.
    #[arg(long, num_args = 2, value_names = ["slurm|ray", "DIR"])]
    emit: Vec<String>,
    /// Refuse faults instead of repairing those that can be repaired safely.
    #[arg(long)]
    no_repair: bool,
    /// Seed of the sites that are drawn.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Threads (0: all).
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// `REGION=FACTOR`; a region may hold an equals sign itself.
fn stiffer(text: &str) -> Result<(Region, f32), String> {
    let (region, factor) = text
        .rsplit_once('=')
        .ok_or_else(|| format!("`{text}` has no factor; write REGION=FACTOR"))?;
    match factor.trim().parse::<f32>() {
        Ok(factor) if factor.is_finite() && factor > 0.0 => Ok((region.parse()?, factor)),
        _ => Err(format!("`{factor}` is not a number above 0")),
    }
}

impl Options {
    fn order(&self) -> anyhow::Result<make::Options> {
        let tools = match self.tools.as_deref().map(ToolProgramme::parse_list) {
            None => Vec::new(),
            Some(list) => list.map_err(|error| anyhow!("--tools: {error}"))?,
        };
        Ok(make::Options {
            input: self.input.clone(),
            out: self.out.clone(),
            unit: self.unit.clone(),
            label: self.label.clone(),
            refill: self.refill,
            part: self.part.clone(),
            fixed: self.fixed.clone(),
            pressure: self.pressure.clone(),
            gravity: self.gravity,
            unload: self.unload,
            boundary: self.boundary,
            domain: self.domain.clone(),
            stiffness: self.stiffness.clone(),
            nodes: self.nodes,
            minutes: self.minutes,
            cases: self.cases,
            tools,
            tool_scale: self.sizes.tool_scale,
            material: self.material.clone(),
            region: self.region.clone(),
            fibre: self.fibre.clone(),
            young: self.young,
            law: self.law,
            law_source: materials::source_of(&self.law),
            relaxation: self.relaxation,
            poisson: self.poisson,
            density: self.density,
            damping: self.damping,
            push: self.push,
            target_error: self.target_error,
            corrections: self.corrections,
            natural: self.natural,
            patches: self.patches,
            tolerance_mm: self.tolerance_mm,
            name: self.name.clone(),
            license: self.license.clone(),
            work: self.work.clone(),
            preview: self.preview,
            no_repair: self.no_repair,
            seed: self.seed,
            threads: self.threads,
            watch: progress::watch(self.json),
        })
    }
}

/// Runs the command.
pub fn run(options: &Options) -> anyhow::Result<ExitCode> {
    let order = options.order()?;
    if let [cluster, folder] = options.emit.as_slice() {
        order.check()?;
        let start = emit::write(&order, cluster, Path::new(folder))?;
        println!("{}: start this", start.display());
        return Ok(ExitCode::SUCCESS);
    }
    let Made::Bundle(made) = make::run(&order)? else {
        return Ok(ExitCode::SUCCESS);
    };
    let certificate = &made.certificate;
    if options.json {
        println!(
            "{}",
            json!({"bundle": options.out, "seconds": made.seconds, "certificate": certificate.json()})
        );
    } else {
        println!("{}", certificate.text());
        println!(
            "{}: made in {:.0} s; certificate.html says how good it is",
            options.out.display(),
            made.seconds
        );
    }
    if let Some(target) = options.target_error
        && certificate.worst_mse() > target
    {
        bail!(
            "the largest error, in contact or of a programme of tools, is {:.3e} mm² with {} corrections a step, above --target-error {target:.3e}; give more --minutes, or a smaller --push",
            certificate.worst_mse(),
            made.corrections
        );
    }
    Ok(ExitCode::SUCCESS)
}
