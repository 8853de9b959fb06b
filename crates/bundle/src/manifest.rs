//! `bundle.json`: the manifest, its types and the checks of its values.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::node_set::NodeSet;

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
    /// Rigid tools that the bundle is good for; where it has none, they are judged by what they do to the nodes.
    pub tools: Option<ToolEnvelope>,
}

/// The rigid tools that a bundle with corrections was measured with and found good for (`cargo xtask study envelope`).
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct ToolEnvelope {
    /// Corrections a step of the measurement; with fewer these limits say nothing.
    pub corrections: u32,
    /// Range of half the smallest extent of a tool, the radius of a rod, mm.
    pub size_mm: [f32; 2],
    /// Largest displacement of the tissue under a tool, mm.
    pub depth_mm: f32,
    /// Largest speed of any point of a tool that touches, mm/s.
    pub speed_mm_s: f32,
    /// Tools that push at once.
    pub max_tools: usize,
}

/// The prior's file.
#[derive(Debug, Clone, Deserialize)]
pub struct PriorEntry {
    /// File of the bundle.
    pub file: String,
    /// File with the residual modes, where the response's file has none because other predictors share it.
    pub residual: Option<String>,
    /// File with the free vibration that follows a release; not together with a learned map of kind `reduced`.
    pub vibration: Option<String>,
    /// File with the learned map of a release, in addition to the free vibration of kind `reduced`.
    pub release: Option<String>,
}

/// The corrections' file.
#[derive(Debug, Clone, Deserialize)]
pub struct CorrectionsEntry {
    /// File of the bundle.
    pub file: String,
    /// Iterations a step that the bundle recommends; 0 leaves them off unless a host asks.
    pub recommended: u32,
    /// Fewer where the estimated error is below this, mm; 0: never.
    #[serde(default)]
    pub target_mm: f32,
    /// Substeps at most of a step that tools drive, where it alone would err by more than the target; 1: none.
    #[serde(default = "no_substeps")]
    pub substeps: u32,
    /// Measured over estimated error on held-out cases: the corrections' own estimate is multiplied
    /// by it, and the product is `SceneStats::error_mm`.
    #[serde(default = "one")]
    pub calibration: f32,
    /// Length of step that suits scenes whose frames are presented, s; none: the bundle's.
    pub frame_step_s: Option<f64>,
    /// File with natural modes as whole fields, for steps under loads.
    pub whole: Option<String>,
}

fn one() -> f32 {
    1.0
}

fn no_substeps() -> u32 {
    1
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
    /// Linear response to `c[t+1]`, or its free vibration without contact (3).
    Prior,
    /// That response in the step before (3).
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
    /// The linear response to `c[t+1]`, or its free vibration without contact.
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
    /// File with the nodes that are decoded, from which the others are interpolated; every node without it.
    pub anchors: Option<String>,
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
    /// The folder beside the bundle's own where the listed files lie that it lacks: those that several predictors of one body share.
    pub body: Option<String>,
    /// Material of the training data.
    pub material: elements::Material,
    /// Mesh.
    pub mesh: MeshEntry,
    /// Envelope.
    pub envelope: Envelope,
    /// Precisions of the graphs.
    #[serde(default)]
    pub precisions: Vec<String>,
    /// How far from rest the network's own free motion ends: its largest `|u|` of a node, mm; 0 where it ends at rest.
    #[serde(default)]
    pub rest_displacement_mm: f32,
    /// Linear response.
    pub prior: Option<PriorEntry>,
    /// Support groups.
    #[serde(default)]
    pub supports: Vec<NodeSet>,
    /// Named parts of the surface, which may overlap.
    #[serde(default)]
    pub regions: Vec<NodeSet>,
    /// Regions with a law of their own, as the mesh has them; null where it has none.
    #[serde(default)]
    pub laws: serde_json::Value,
    /// Gravity under which the mesh was scanned, m/s², where a step's input gives none; absent: zero.
    #[serde(default)]
    pub gravity_at_rest_m_s2: [f32; 3],
    /// Corrections by the elements.
    pub corrections: Option<CorrectionsEntry>,
    /// Kind `upt`.
    pub upt: Option<UptEntry>,
    /// Kind `reduced`; absent where the bundle has no learned map.
    pub reduced: Option<ReducedEntry>,
    /// Errors measured at export; free form, for indicators and reports.
    #[serde(default)]
    pub errors: serde_json::Value,
    /// All files but `bundle.json`.
    pub files: BTreeMap<String, FileEntry>,
}

impl Manifest {
    /// The material as the bundle's steps see it: with the modulus `g(dt_s)` of tissue that relaxes.
    pub fn step_material(&self) -> elements::Material {
        self.material.in_steps_of(self.dt_s)
    }

    /// Whether any of its tissue relaxes.
    pub fn relaxes(&self) -> bool {
        let branches = |law: &serde_json::Value| law.get("relaxation")?.as_array().map(Vec::len);
        let mut regions = (self.laws.as_array().into_iter().flatten()).filter_map(branches);
        !self.material.relaxation.is_empty() || regions.any(|count| count > 0)
    }

    /// Length of step for a scene that presents and corrects as the bundle recommends, s: `dt_s` where it recommends none of its own.
    pub fn frame_step_s(&self) -> f64 {
        let own = self
            .corrections
            .as_ref()
            .and_then(|entry| entry.frame_step_s);
        match own {
            Some(step_s) => step_s,
            None => self.dt_s,
        }
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
}
