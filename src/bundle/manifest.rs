//! `bundle.json`: the manifest, its types and the checks of its values.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::error::{Error, Result};

const FILE: &str = "bundle.json";
const VERSION: u64 = 1;

/// The kinds a manifest may name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ManifestKind {
    /// Universal Physics Transformer.
    Upt,
    /// Linear response and a learned correction in reduced coordinates.
    Reduced,
}

/// Which node sets are held at zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Boundary {
    /// The mesh's `fixed`.
    Fixed,
    /// The mesh's `fixed` and `supported`.
    Supported,
}

/// Material of the training data.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Material {
    /// Young's modulus, Pa.
    pub young_pa: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Density, kg/m^3.
    pub density_kg_m3: f64,
    /// Mass-proportional damping, 1/s.
    pub damping_per_s: f64,
}

/// Which mesh the bundle is for.
#[derive(Debug, Clone, Deserialize)]
pub struct MeshEntry {
    /// File of the bundle.
    pub file: String,
    /// Number of nodes, `K`.
    pub nodes: usize,
    /// Hash of positions, tets, fixed, supported.
    pub mesh_sha256: String,
}

/// What the model was trained on; outside of it flags are set.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Envelope {
    /// Largest `|c|`, mm.
    pub max_push_mm: f32,
    /// Largest change of `c` at a node in one step while in contact, mm.
    pub max_push_rate_mm: f32,
    /// Range of one contact patch's area, mm^2.
    pub contact_area_mm2: [f32; 2],
    /// Connected contact patches at once.
    pub max_sites: usize,
    /// Guard: a larger `|u|` is not published, mm.
    pub displacement_bound_mm: f32,
}

/// The prior's file.
#[derive(Debug, Clone, Deserialize)]
pub struct PriorEntry {
    /// File of the bundle.
    pub file: String,
}

/// One group of node features, in the order of the encoder's input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Feature {
    /// `u[t]` (3).
    Displacement,
    /// `c[t+1]` (3).
    Collision,
    /// `u[t-1]` (3).
    PreviousDisplacement,
    /// Linear response to `c[t+1]` (3).
    Prior,
    /// Linear response to `c[t]` (3).
    PreviousPrior,
    /// 1 at nodes in contact (1).
    Contact,
}

impl Feature {
    /// Numbers a node.
    pub fn width(self) -> usize {
        if self == Feature::Contact { 1 } else { 3 }
    }
}

/// What the decoder's output is added to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Base {
    /// Nothing.
    None,
    /// `u[t]`.
    Displacement,
    /// The linear response to `c[t+1]`.
    Prior,
}

/// Features of three numbers are `(x - mean) / std`.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Normalisation {
    /// mm, per axis.
    pub mean: [f32; 3],
    /// mm, per axis.
    pub std: [f32; 3],
}

/// Model coordinate = (p - offset) * scale.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Coordinates {
    /// mm.
    pub offset: [f32; 3],
    /// 1/mm.
    pub scale: f32,
}

/// Supernodes and radius graph.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Graph {
    /// Neighbourhood radius, mm.
    pub radius_mm: f64,
    /// Most neighbours a supernode.
    pub max_degree: usize,
    /// Supernodes, `n_S`.
    pub supernodes: usize,
    /// Seed of the selection.
    pub seed: u64,
    /// Part of the supernodes that is taken from the domain first.
    #[serde(default)]
    pub domain_fraction: f64,
}

/// Widths of the network.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Dims {
    /// Encoder width, `d`.
    pub encoder: usize,
    /// Width of a row of the query table, `2 h`.
    pub query: usize,
    /// Latent tokens, `L`.
    pub latent_tokens: usize,
    /// Decoder width, `h`.
    pub decoder: usize,
    /// Attention heads of the decoder.
    pub decoder_heads: usize,
    /// Hidden width of the decoder's MLP.
    pub decoder_mlp: usize,
}

/// The part of kind `upt`.
#[derive(Debug, Clone, Deserialize)]
pub struct UptEntry {
    /// Node features, in order.
    pub features: Vec<Feature>,
    /// What the output is added to.
    pub base: Base,
    /// Normalisation of the features.
    pub normalisation: Normalisation,
    /// Coordinates of the embedding.
    pub coordinates: Coordinates,
    /// Supernodes and radius graph.
    pub graph: Graph,
    /// Widths.
    pub dims: Dims,
    /// File of the native kernels' weights.
    pub weights: String,
}

impl UptEntry {
    /// Numbers a node in the encoder's input, `f`.
    pub fn feature_width(&self) -> usize {
        self.features.iter().map(|f| f.width()).sum()
    }

    /// Whether features or base need the linear response.
    pub fn needs_prior(&self) -> bool {
        self.base == Base::Prior
            || self.features.contains(&Feature::Prior)
            || self.features.contains(&Feature::PreviousPrior)
    }
}

/// One group of the correction network's inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReducedInput {
    /// Residual state (r).
    B,
    /// Residual state before (r).
    BPrev,
    /// Linear response in its leading modes (r_z).
    Z,
    /// The same, before.
    ZPrev,
    /// Linear response in the residual modes (r).
    P,
    /// The same, before.
    PPrev,
    /// 1 in contact.
    Contact,
    /// The same, before.
    ContactPrev,
}

/// Bound of the correction.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Bound {
    /// Relative to the linear response's norm.
    pub relative: f32,
    /// Factor of the bound of the step before.
    pub decay: f32,
}

/// Fade to the prior.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct Fade {
    /// Full correction up to this largest `|c|`, mm.
    pub start_push_mm: f32,
    /// No correction from this largest `|c|` on, mm.
    pub end_push_mm: f32,
}

/// The part of kind `reduced`.
#[derive(Debug, Clone, Deserialize)]
pub struct ReducedEntry {
    /// Residual modes, `r`.
    pub modes: usize,
    /// Leading modes of the response, `r_z`.
    pub response_modes: usize,
    /// Inputs of `latent.onnx`, concatenated.
    pub inputs: Vec<ReducedInput>,
    /// Bound of the correction.
    pub bound: Bound,
    /// Fade to the prior.
    pub fade: Fade,
}

/// Size and hash of a file of the bundle.
#[derive(Debug, Clone, Deserialize)]
pub struct FileEntry {
    /// Size.
    pub bytes: u64,
    /// SHA-256, lower-case hex.
    pub sha256: String,
}

/// `bundle.json`, checked.
#[derive(Debug, Clone, Deserialize)]
pub struct Manifest {
    /// Kind of the bundle.
    pub kind: ManifestKind,
    /// Name.
    pub name: String,
    /// Step, s.
    pub dt_s: f64,
    /// Must be `mm`.
    pub length_unit: String,
    /// Must be `mN`.
    pub force_unit: String,
    /// Held node sets.
    pub boundary: Boundary,
    /// Material.
    pub material: Material,
    /// Mesh.
    pub mesh: MeshEntry,
    /// Envelope.
    pub envelope: Envelope,
    /// Precisions of the graphs.
    #[serde(default)]
    pub precisions: Vec<String>,
    /// Linear response.
    pub prior: Option<PriorEntry>,
    /// Kind `upt`.
    pub upt: Option<UptEntry>,
    /// Kind `reduced`.
    pub reduced: Option<ReducedEntry>,
    /// Errors measured at export; free form, for indicators and reports.
    #[serde(default)]
    pub errors: serde_json::Value,
    /// All files but `bundle.json`.
    pub files: BTreeMap<String, FileEntry>,
}

#[derive(Deserialize)]
struct Header {
    format: String,
    version: u64,
}

fn bad(field: &str, message: impl std::fmt::Display) -> Error {
    Error::bundle(FILE, format!("field `{field}`: {message}"))
}

fn check(ok: bool, field: &str, message: &str) -> Result<()> {
    if ok { Ok(()) } else { Err(bad(field, message)) }
}

fn parse<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T> {
    let mut deserializer = serde_json::Deserializer::from_slice(bytes);
    serde_path_to_error::deserialize(&mut deserializer).map_err(|error| {
        let path = error.path().to_string();
        bad(
            &path,
            format!(
                "{}; export with `python -m upt_training export`",
                error.inner()
            ),
        )
    })
}

impl Manifest {
    /// Parses and checks the bytes of `bundle.json`.
    pub fn parse(bytes: &[u8]) -> Result<Manifest> {
        let header: Header = parse(bytes)?;
        check(
            header.format == "upt-bundle",
            "format",
            "must be `upt-bundle`",
        )?;
        if header.version != VERSION {
            return Err(Error::Version(format!(
                "{FILE}: field `version` is {}, this library reads version {VERSION}",
                header.version
            )));
        }
        let manifest: Manifest = parse(bytes)?;
        manifest.check()?;
        Ok(manifest)
    }

    fn check(&self) -> Result<()> {
        check(
            self.dt_s.is_finite() && self.dt_s > 0.0,
            "dt_s",
            "must be positive",
        )?;
        check(self.length_unit == "mm", "length_unit", "must be `mm`")?;
        check(self.force_unit == "mN", "force_unit", "must be `mN`")?;
        check(
            self.material.young_pa > 0.0 && self.material.young_pa.is_finite(),
            "material.young_pa",
            "must be positive",
        )?;
        check(
            self.material.poisson > -1.0 && self.material.poisson < 0.5,
            "material.poisson",
            "must be in (-1, 0.5)",
        )?;
        check(
            self.mesh.nodes >= 4 && self.mesh.nodes < i32::MAX as usize,
            "mesh.nodes",
            "must be at least 4",
        )?;
        self.envelope.check()?;
        for (name, entry) in &self.files {
            check_name(name, &format!("files.{name}"))?;
            check(
                entry.sha256.len() == 64 && entry.sha256.bytes().all(|b| b.is_ascii_hexdigit()),
                &format!("files.{name}.sha256"),
                "must be 64 hex digits",
            )?;
        }
        self.listed(&self.mesh.file, "mesh.file")?;
        if let Some(prior) = &self.prior {
            self.listed(&prior.file, "prior.file")?;
        }
        match self.kind {
            ManifestKind::Upt => {
                let upt = self
                    .upt
                    .as_ref()
                    .ok_or_else(|| bad("upt", "is missing, kind `upt` needs it"))?;
                upt.check()?;
                for file in ["embed.onnx", "latent.onnx", "decoder.onnx"] {
                    self.listed(file, "files")?;
                }
                self.listed(&upt.weights, "upt.weights")?;
                check(
                    !upt.needs_prior() || self.prior.is_some(),
                    "prior",
                    "is missing, the features or the base need it",
                )
            }
            ManifestKind::Reduced => {
                let reduced = self
                    .reduced
                    .as_ref()
                    .ok_or_else(|| bad("reduced", "is missing, kind `reduced` needs it"))?;
                reduced.check()?;
                self.listed("latent.onnx", "files")?;
                check(
                    self.prior.is_some(),
                    "prior",
                    "is missing, kind `reduced` needs it",
                )
            }
        }
    }

    fn listed(&self, file: &str, field: &str) -> Result<()> {
        check_name(file, field)?;
        check(
            self.files.contains_key(file),
            field,
            &format!("names `{file}`, which is not in `files`"),
        )
    }
}

/// A file of a bundle lies in its folder: one plain name.
fn check_name(name: &str, field: &str) -> Result<()> {
    let plain =
        !name.is_empty() && !name.contains(['/', '\\', ':', '\0']) && name != "." && name != "..";
    check(plain, field, "must be a plain file name")
}

impl Envelope {
    fn check(&self) -> Result<()> {
        let positive = |x: f32| x.is_finite() && x > 0.0;
        check(
            positive(self.max_push_mm),
            "envelope.max_push_mm",
            "must be positive",
        )?;
        check(
            positive(self.max_push_rate_mm),
            "envelope.max_push_rate_mm",
            "must be positive",
        )?;
        let [low, high] = self.contact_area_mm2;
        check(
            low >= 0.0 && high.is_finite() && low <= high,
            "envelope.contact_area_mm2",
            "must be a range [low, high]",
        )?;
        check(
            self.max_sites >= 1,
            "envelope.max_sites",
            "must be at least 1",
        )?;
        check(
            positive(self.displacement_bound_mm),
            "envelope.displacement_bound_mm",
            "must be positive",
        )
    }
}

impl UptEntry {
    fn check(&self) -> Result<()> {
        check(
            !self.features.is_empty(),
            "upt.features",
            "must not be empty",
        )?;
        for (i, feature) in self.features.iter().enumerate() {
            check(
                !self.features[..i].contains(feature),
                "upt.features",
                "holds a feature twice",
            )?;
        }
        for axis in 0..3 {
            check(
                self.normalisation.mean[axis].is_finite(),
                "upt.normalisation.mean",
                "must be finite",
            )?;
            check(
                self.normalisation.std[axis].is_finite() && self.normalisation.std[axis] > 0.0,
                "upt.normalisation.std",
                "must be positive",
            )?;
        }
        let graph = &self.graph;
        check(
            graph.radius_mm.is_finite() && graph.radius_mm > 0.0,
            "upt.graph.radius_mm",
            "must be positive",
        )?;
        check(
            (1..=4096).contains(&graph.max_degree),
            "upt.graph.max_degree",
            "must be in 1..=4096",
        )?;
        check(
            (1..=1 << 20).contains(&graph.supernodes),
            "upt.graph.supernodes",
            "must be in 1..=1048576",
        )?;
        check(
            (0.0..=1.0).contains(&graph.domain_fraction),
            "upt.graph.domain_fraction",
            "must be in [0, 1]",
        )?;
        let dims = &self.dims;
        for (name, value) in [
            ("encoder", dims.encoder),
            ("latent_tokens", dims.latent_tokens),
            ("decoder", dims.decoder),
            ("decoder_heads", dims.decoder_heads),
            ("decoder_mlp", dims.decoder_mlp),
        ] {
            check(
                (1..=65536).contains(&value),
                &format!("upt.dims.{name}"),
                "must be in 1..=65536",
            )?;
        }
        check(
            dims.query == 2 * dims.decoder,
            "upt.dims.query",
            "must be twice `upt.dims.decoder`",
        )?;
        check(
            dims.decoder % dims.decoder_heads == 0,
            "upt.dims.decoder_heads",
            "must divide `upt.dims.decoder`",
        )
    }
}

impl ReducedEntry {
    /// Numbers in the correction network's input.
    pub fn input_width(&self) -> usize {
        self.inputs
            .iter()
            .map(|input| match input {
                ReducedInput::B | ReducedInput::BPrev | ReducedInput::P | ReducedInput::PPrev => {
                    self.modes
                }
                ReducedInput::Z | ReducedInput::ZPrev => self.response_modes,
                ReducedInput::Contact | ReducedInput::ContactPrev => 1,
            })
            .sum()
    }

    fn check(&self) -> Result<()> {
        check(
            (1..=65536).contains(&self.modes),
            "reduced.modes",
            "must be in 1..=65536",
        )?;
        check(
            self.response_modes <= 65536,
            "reduced.response_modes",
            "must be at most 65536",
        )?;
        check(
            !self.inputs.is_empty(),
            "reduced.inputs",
            "must not be empty",
        )?;
        check(
            self.bound.relative.is_finite() && self.bound.relative >= 0.0,
            "reduced.bound.relative",
            "must not be negative",
        )?;
        check(
            (0.0..1.0).contains(&self.bound.decay),
            "reduced.bound.decay",
            "must be in [0, 1)",
        )?;
        let fade = &self.fade;
        check(
            fade.start_push_mm.is_finite()
                && fade.start_push_mm >= 0.0
                && fade.end_push_mm > fade.start_push_mm,
            "reduced.fade",
            "must have 0 <= start_push_mm < end_push_mm",
        )
    }
}
