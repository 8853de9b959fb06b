//! Options of `upt make`, and what follows from them: material, keys of stages.

use std::path::PathBuf;

use super::fixed::Fixed;
use super::gravity::{Gravity, gravity};
use super::material::{self, Choice};
use anyhow::{Result, bail};
use clap::Args;
use elements::{Law, Material, Relaxation};
use serde_json::{Value, json};
use tissue::mesh::Boundary;
use tissue::mesh_import::Region;
use tissue::programmes::ToolProgramme;

use crate::effort::Effort;
use crate::loads;
use crate::tool_scale;
use crate::{materials, regions};

/// Until the estimated error is calibrated a bundle recommends so many, and coarse spaces are compared with so many.
const DRAFT: u32 = 5;

#[derive(Args, Clone, Debug)]
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
    pub input: PathBuf,
    /// Folder of the bundle.
    #[arg(long)]
    pub out: PathBuf,
    /// Unit of the input's coordinates: mm, cm, m, in, or a number of millimetres per unit. Regions are in mm.
    #[arg(long, default_value = "mm")]
    pub unit: String,
    /// Labels of a label volume that are the body: one or several (`--label 1,3`). Default: all but 0.
    #[arg(long, value_name = "LABELS", value_delimiter = ',')]
    pub label: Vec<i64>,
    /// Of tetrahedra take only the boundary and fill it anew with about --nodes nodes: cures slivers.
    #[arg(long)]
    pub refill: bool,
    /// Which body, where the file holds several: its number or its name in the list that the command then prints.
    #[arg(long, value_name = "NUMBER|NAME")]
    pub part: Option<String>,
    /// Region whose nodes are held: ball:x,y,z,r, plane:a,b,c,d (where a x + b y + c z + d > 0), inside:FILE (a closed surface in the input's
    /// unit), group:NAME (a group, material or #rrggbb colour of the input), shell:MM (less deep beneath the surface), or not: before one of these. May be repeated. Default: what the
    /// mesh file holds. With NAME= before it the nodes are a support group, which a host moves and lets go apart; of several, a node is the first one's.
    #[arg(
        long,
        visible_alias = "support",
        value_name = "[NAME=]REGION",
        allow_hyphen_values = true
    )]
    pub fixed: Vec<Fixed>,
    /// Part of the surface that the bundle names, on which a host gives a pressure: boundary triangles with all three corners in a region, as of --fixed. May
    /// be repeated; regions of one name are one, and they may overlap.
    #[arg(long, value_name = "NAME=REGION", allow_hyphen_values = true)]
    pub pressure: Vec<Fixed>,
    /// Gravity under which the body was scanned, m/s²: what acts on it is what a host's differs by. Of an organ in fluid, what the fluid does not carry of it.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = gravity)]
    pub gravity: Option<Gravity>,
    /// Make the bundle of the body's shape without the gravity of --gravity, of which the input is the equilibrium: a host's gravity then acts in full.
    #[arg(long, requires = "gravity")]
    pub unload: bool,
    /// Node sets of a mesh file that are held: `fixed`, or `supported` (both sets; not together with --fixed).
    #[arg(long, default_value = "fixed")]
    pub boundary: Boundary,
    /// Region of the surface that instruments may touch. May be repeated. Default: what the mesh file names, otherwise all of the surface except a rim around what is held.
    #[arg(long, value_name = "REGION", allow_hyphen_values = true)]
    pub domain: Vec<Region>,
    /// Region of another stiffness: a region, `=` and a factor on Young's modulus, such as group:tumour=4 or inside:tumour.stl=4. May be repeated; where regions overlap, the last one counts.
    #[arg(long, value_name = "REGION=FACTOR", allow_hyphen_values = true, value_parser = stiffer)]
    pub stiffness: Vec<(Region, f32)>,
    /// Number of nodes to aim for when a surface is filled.
    #[arg(long, default_value_t = 5000)]
    pub nodes: usize,
    /// Time for the whole run, minutes, by the clock. What is optional stops in time; where the rest does not fit, an error says how many are needed.
    #[arg(long, default_value_t = 10.0)]
    pub minutes: f64,
    /// Held-out cases of the check at most. Default: as many as there is time for, at most 8.
    #[arg(long)]
    pub cases: Option<usize>,
    #[arg(long, help = loads::programmes_help() + ". Two cases of each are part of the certificate and of --target-error")]
    pub tools: Option<String>,
    #[command(flatten)]
    pub sizes: tool_scale::Arguments,
    /// Material that sets Young's modulus, density and damping: brain (if none is given), liver, kidney, heart or fat. With REGION= before it, a law as of
    /// --law that a region has: one that --region or the mesh file names, or else a group of the input. May be repeated; where regions overlap, the
    /// last one counts. All have the same Poisson's ratio, density, damping and relaxation.
    #[arg(long, value_name = "NAME|REGION=LAW", allow_hyphen_values = true)]
    pub material: Vec<Choice>,
    /// Region that --material gives a law: a name, `=` and a region as of --fixed. May be repeated; regions of one name are one.
    #[arg(long, value_name = "NAME=REGION", allow_hyphen_values = true)]
    pub region: Vec<Fixed>,
    /// Young's modulus, Pa; overrides the material's. A law with a modulus of its own sets it.
    #[arg(long)]
    pub young: Option<f64>,
    /// Law of the tissue: neo-hookean, mooney-rivlin:SHARE with the share of C01 in C10 + C01 (default: 0.526, brain), ogden:MU,ALPHA[,MU,ALPHA...] with
    /// MU in Pa or with kPa behind it, or a tissue that `upt materials` lists.
    #[arg(long, default_value = "neo-hookean", value_parser = materials::law)]
    pub law: Law,
    /// Relaxation of the stress without change of volume: SHARE,TAU_S[,SHARE,TAU_S...], each share lost with its time constant, s. Default: none.
    #[arg(long, default_value = "", hide_default_value = true, value_parser = materials::relaxation)]
    pub relaxation: Relaxation,
    /// Poisson's ratio, below 0.5.
    #[arg(long, default_value_t = 0.49)]
    pub poisson: f64,
    /// Density, kg/m³; overrides the material's.
    #[arg(long)]
    pub density: Option<f64>,
    /// Damping, 1/s; overrides the material's.
    #[arg(long)]
    pub damping: Option<f64>,
    /// Deepest push that the bundle is made for, mm. Default: 15 for a body as wide as a brain and at least 40 mm thick beneath its domain, less
    /// for a smaller or thinner one.
    #[arg(long)]
    pub push: Option<f64>,
    /// Fail if the mean squared error in contact, or that of a programme of --tools, is above this, mm².
    #[arg(long, value_name = "MM2")]
    pub target_error: Option<f64>,
    /// Corrections per step that the bundle recommends: COUNT, or COUNT@MM for at most COUNT and fewer once the estimated error is below MM.
    /// Default: 10@0.02/2 for pushes of 15 mm, with the target in proportion to the deepest push.
    #[arg(long, value_name = "COUNT[@MM]")]
    pub corrections: Option<Effort>,
    /// Natural modes.
    #[arg(long, default_value_t = 60)]
    pub natural: usize,
    /// Number of patches that the coarse space is made from.
    #[arg(long, default_value_t = 120)]
    pub patches: usize,
    /// Error that the block-wise tables may have, mm (root mean square over typical pushes).
    #[arg(long, default_value_t = 5e-3)]
    pub tolerance_mm: f64,
    /// Name of the bundle. Default: the input's.
    #[arg(long)]
    pub name: Option<String>,
    /// Licence of the bundle: that of the anatomy.
    #[arg(long, default_value = "as the input's")]
    pub license: String,
    /// Folder for the stages. Default: the bundle's folder with `.work` appended.
    #[arg(long)]
    pub work: Option<PathBuf>,
    /// Only import, and write the page that shows what is held and touched.
    #[arg(long)]
    pub preview: bool,
    /// Write job scripts for a cluster into a folder instead of running: `--emit slurm DIR` or `--emit ray DIR`.
    #[arg(long, num_args = 2, value_names = ["slurm|ray", "DIR"])]
    pub emit: Vec<String>,
    /// Refuse faults instead of repairing those that can be repaired safely.
    #[arg(long)]
    pub no_repair: bool,
    /// Seed of the sites that are drawn.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Threads (0: all).
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

fn texts<T: ToString>(list: &[T]) -> Vec<String> {
    list.iter().map(T::to_string).collect()
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

/// Young's modulus (Pa), density (kg/m³) and damping (1/s) of a material by name.
fn named(name: &str) -> Option<[f64; 3]> {
    Some(match name {
        "brain" => [3000.0, 1000.0, 20.0],
        "liver" => [5000.0, 1060.0, 20.0],
        "kidney" => [10_000.0, 1060.0, 30.0],
        "heart" => [15_000.0, 1060.0, 40.0],
        "fat" => [2000.0, 920.0, 20.0],
        _ => return None,
    })
}

impl Options {
    /// Refuses what no stage can use.
    pub fn check(&self) -> Result<()> {
        if !(self.minutes.is_finite() && self.minutes > 0.0) {
            bail!("--minutes is {}; it must be above 0", self.minutes);
        }
        if self.cases == Some(0) {
            bail!("--cases is 0; a certificate needs a held-out case, give 1 or more");
        }
        if self.nodes < 50 {
            bail!("--nodes is {}; it must be at least 50", self.nodes);
        }
        if !(self.tolerance_mm.is_finite() && self.tolerance_mm > 0.0) {
            bail!(
                "--tolerance-mm is {}; it must be positive",
                self.tolerance_mm
            );
        }
        if self.natural == 0 {
            bail!("--natural is 0; the free motion needs natural modes");
        }
        for (name, value) in [("--push", self.push), ("--target-error", self.target_error)] {
            if value.is_some_and(|value| !(value.is_finite() && value > 0.0)) {
                bail!("{name} must be positive");
            }
        }
        self.programmes()?;
        self.scale()?;
        self.material()?.validate()?;
        Ok(())
    }

    /// Millimetres a unit of the input.
    pub fn scale(&self) -> Result<f64> {
        regions::millimetres(&self.unit)
    }

    /// The tissue.
    pub fn material(&self) -> Result<Material> {
        let names = self.material.iter().filter_map(|choice| match choice {
            Choice::Numbers(name) => Some(name.as_str()),
            Choice::Law(..) => None,
        });
        let names: Vec<&str> = names.collect();
        if names.len() > 1 {
            bail!(
                "--material gives the body {}; give one, and --material REGION=LAW for regions",
                names.join(" and ")
            );
        }
        let name = names.first().copied().unwrap_or("brain");
        let Some([young, density, damping]) = named(name) else {
            bail!(
                "--material is `{name}`; use brain, liver, kidney, heart or fat, or REGION=LAW; --young, --density and --damping describe any other material"
            );
        };
        let own = Material {
            young_pa: young,
            poisson: self.poisson,
            density_kg_m3: self.density.unwrap_or(density),
            damping_per_s: self.damping.unwrap_or(damping),
            law: Law::default(),
            relaxation: self.relaxation,
        }
        .with_law(self.law);
        let young_pa = self.young.unwrap_or(own.young_pa);
        Ok(Material { young_pa, ..own })
    }

    /// The programmes of `--tools`.
    pub fn programmes(&self) -> Result<Vec<ToolProgramme>> {
        match self.tools.as_deref().map(ToolProgramme::parse_list) {
            None => Ok(Vec::new()),
            Some(list) => list.map_err(|error| anyhow::anyhow!("--tools: {error}")),
        }
    }

    /// Where stages are kept.
    pub fn work_folder(&self) -> PathBuf {
        self.work.clone().unwrap_or_else(|| {
            let mut name = self.out.file_name().unwrap_or_default().to_os_string();
            name.push(".work");
            self.out.with_file_name(name)
        })
    }

    /// What the body depends on besides the input's bytes.
    pub fn body_words(&self) -> Result<String> {
        let mesh = (self.nodes, self.no_repair, &self.name, &self.part);
        let more = (&self.label, self.refill, self.boundary.as_str());
        let sets = (&self.stiffness, &self.fixed, &self.pressure);
        let mut words = format!("{} {mesh:?} {more:?} {sets:?}", self.scale()?);
        if self
            .material
            .iter()
            .any(|choice| matches!(choice, Choice::Law(..)))
        {
            words += &format!(
                " {:?} {:?} {:?}",
                self.material,
                self.region,
                self.material()?
            );
        }
        if let (Some(Gravity(own)), true) = (self.gravity, self.unload) {
            words += &format!(" free of {own:?} {:?}", self.material()?);
        }
        let named = self.fixed.iter().chain(&self.pressure).chain(&self.region);
        let held = named.map(|named| &named.region);
        let regions = held.chain([&Region::All]).chain(&self.domain);
        for region in regions.chain(self.stiffness.iter().map(|(region, _)| region)) {
            words += &format!(" {region}");
            let mut inner = region;
            while let Region::Not(next) = inner {
                inner = next;
            }
            if let Region::Inside(path) = inner {
                words += &super::key_of(&[&std::fs::read(path).unwrap_or_default()]);
            }
        }
        Ok(words)
    }

    /// For the provenance.
    pub fn words(&self) -> Value {
        json!({
            "unit": self.unit, "stiffness": self.stiffness.iter().map(|(region, factor)| format!("{region}={factor}")).collect::<Vec<String>>(),
            "boundary": self.boundary.as_str(), "fixed": texts(&self.fixed),
            "pressure": texts(&self.pressure), "domain": texts(&self.domain), "nodes": self.nodes, "gravity": self.gravity.map(|own| own.0), "unload": self.unload,
            "part": self.part, "label": self.label, "refill": self.refill,
            "material": texts(&self.material), "region": texts(&self.region), "law": material::words(&self.law), "relaxation": self.relaxation.to_string(), "corrections": self.corrections.map(|effort| effort.to_string()), "natural": self.natural, "patches": self.patches,
            "tolerance_mm": self.tolerance_mm, "minutes": self.minutes, "tools": self.tools, "tool_scale": self.sizes.tool_scale,
        })
    }
}

impl Options {
    /// A fixed number of corrections, for as long as the estimated error is not calibrated.
    pub fn draft(&self) -> Effort {
        Effort::fixed(
            self.corrections
                .map_or(DRAFT, |effort| effort.most.min(DRAFT)),
        )
    }
}
