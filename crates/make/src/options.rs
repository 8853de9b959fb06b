//! Options of a run, and what follows from them: material, keys of stages.

use std::path::PathBuf;

use anyhow::{Result, bail};
use elements::{Law, Material, Relaxation};
use host::Effort;
use serde_json::{Value, json};
use tissue::mesh::Boundary;
use tissue::mesh_import::Region;
use tissue::programmes::ToolProgramme;

use super::fibres::Fibre;
use super::fixed::Fixed;
use super::gravity::Gravity;
use super::material::{self, Choice};
use crate::{Watch, regions};

/// Until the estimated error is calibrated a bundle recommends so many, and coarse spaces are compared with so many.
const DRAFT: u32 = 5;

/// What to make, and how. [`Options::new`] has the defaults.
#[derive(Clone, Debug)]
pub struct Options {
    /// A closed surface (.stl, .obj, .ply, .vtp), tetrahedra (.msh, .vtk, .vtu, .inp, .feb, .mesh.safetensors) or a label volume (.nii, .nii.gz,
    /// .nrrd, .mha).
    pub input: PathBuf,
    /// Folder of the bundle.
    pub out: PathBuf,
    /// Unit of the input's coordinates: mm, cm, m, in, or a number of millimetres per unit.
    pub unit: String,
    /// Labels of a label volume that are the body; none: all but 0.
    pub label: Vec<i64>,
    /// Of tetrahedra take only the boundary and fill it anew.
    pub refill: bool,
    /// Which body, where the file holds several: its number or its name.
    pub part: Option<String>,
    /// Regions whose nodes are held, those with a name as support groups; none: what the mesh file holds.
    pub fixed: Vec<Fixed>,
    /// Parts of the surface that the bundle names, on which a host gives a pressure.
    pub pressure: Vec<Fixed>,
    /// Gravity under which the body was scanned.
    pub gravity: Option<Gravity>,
    /// Take the body's shape without that gravity.
    pub unload: bool,
    /// Node sets of a mesh file that are held.
    pub boundary: Boundary,
    /// Regions of the surface that instruments may touch; none: what the mesh file names, otherwise all but a rim around what is held.
    pub domain: Vec<Region>,
    /// Regions of another stiffness, each with a factor on Young's modulus; where they overlap the last one counts.
    pub stiffness: Vec<(Region, f32)>,
    /// Nodes to aim for when a surface is filled, at least 50.
    pub nodes: usize,
    /// Time for the whole run, minutes.
    pub minutes: f64,
    /// Held-out cases of the check at most; none: as many as there is time for, at most 8.
    pub cases: Option<usize>,
    /// Programmes of tools that are part of the certificate, two cases each.
    pub tools: Vec<ToolProgramme>,
    /// Factor on the sizes of their tools; none: from the body.
    pub tool_scale: Option<f64>,
    /// The body's numbers by name, and laws of regions.
    pub material: Vec<Choice>,
    /// Regions that `material` gives a law, by name.
    pub region: Vec<Fixed>,
    /// Directions of fibres, of such a region or of the whole body.
    pub fibre: Vec<Fibre>,
    /// Young's modulus, Pa; none: that of the law or the material.
    pub young: Option<f64>,
    pub law: Law,
    /// Where the law comes from, for the provenance.
    pub law_source: String,
    pub relaxation: Relaxation,
    /// Below 0.5.
    pub poisson: f64,
    /// kg/m³; none: the material's.
    pub density: Option<f64>,
    /// 1/s; none: the material's.
    pub damping: Option<f64>,
    /// Deepest push that the bundle is made for, mm; none: from the body.
    pub push: Option<f64>,
    /// More corrections are recommended while the largest error of the check is above this, mm².
    pub target_error: Option<f64>,
    /// Corrections a step that the bundle recommends; none: `10@0.02/2`, with the target in proportion to the deepest push.
    pub corrections: Option<Effort>,
    /// Natural modes.
    pub natural: usize,
    /// Patches that the coarse space is made from.
    pub patches: usize,
    /// Error that the block-wise tables may have, mm (root mean square over typical pushes).
    pub tolerance_mm: f64,
    /// Name of the bundle; none: the input's.
    pub name: Option<String>,
    /// Licence of the bundle: that of the anatomy.
    pub license: String,
    /// Folder for the stages; none: the bundle's with `.work` appended.
    pub work: Option<PathBuf>,
    /// Only import, and write the page that shows what is held and touched.
    pub preview: bool,
    /// Refuse faults instead of repairing those that can be repaired safely.
    pub no_repair: bool,
    /// Seed of the sites that are drawn.
    pub seed: u64,
    /// 0: all.
    pub threads: usize,
    /// Who hears how far the run is.
    pub watch: Watch,
}

impl Options {
    /// The defaults of `upt make`.
    pub fn new(input: impl Into<PathBuf>, out: impl Into<PathBuf>) -> Self {
        Self {
            input: input.into(),
            out: out.into(),
            unit: "mm".into(),
            label: Vec::new(),
            refill: false,
            part: None,
            fixed: Vec::new(),
            pressure: Vec::new(),
            gravity: None,
            unload: false,
            boundary: Boundary::Fixed,
            domain: Vec::new(),
            stiffness: Vec::new(),
            nodes: 5000,
            minutes: 10.0,
            cases: None,
            tools: Vec::new(),
            tool_scale: None,
            material: Vec::new(),
            region: Vec::new(),
            fibre: Vec::new(),
            young: None,
            law: Law::default(),
            law_source: String::new(),
            relaxation: Relaxation::default(),
            poisson: 0.49,
            density: None,
            damping: None,
            push: None,
            target_error: None,
            corrections: None,
            natural: 60,
            patches: 120,
            tolerance_mm: 5e-3,
            name: None,
            license: "as the input's".into(),
            work: None,
            preview: false,
            no_repair: false,
            seed: 1,
            threads: 0,
            watch: Watch::default(),
        }
    }
}

fn texts<T: ToString>(list: &[T]) -> Vec<String> {
    list.iter().map(T::to_string).collect()
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
        for own in &self.fibre {
            words += &format!(" fibre {own} {:?}", self.region);
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
                words += &crate::stages::key_of(&[&std::fs::read(path).unwrap_or_default()]);
            }
        }
        Ok(words)
    }

    fn tools_words(&self) -> Option<String> {
        let names: Vec<&str> = self.tools.iter().map(|tool| tool.name()).collect();
        (!names.is_empty()).then(|| names.join(","))
    }

    /// For the provenance.
    pub fn words(&self) -> Value {
        json!({
            "unit": self.unit, "stiffness": self.stiffness.iter().map(|(region, factor)| format!("{region}={factor}")).collect::<Vec<String>>(),
            "boundary": self.boundary.as_str(), "fixed": texts(&self.fixed),
            "pressure": texts(&self.pressure), "domain": texts(&self.domain), "nodes": self.nodes, "gravity": self.gravity.map(|own| own.0), "unload": self.unload,
            "part": self.part, "label": self.label, "refill": self.refill,
            "material": texts(&self.material), "region": texts(&self.region), "fibre": texts(&self.fibre), "law": material::words(&self.law, &self.law_source), "relaxation": self.relaxation.to_string(), "corrections": self.corrections.map(|effort| effort.to_string()), "natural": self.natural, "patches": self.patches,
            "tolerance_mm": self.tolerance_mm, "minutes": self.minutes, "tools": self.tools_words(), "tool_scale": self.tool_scale,
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
