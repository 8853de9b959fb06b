//! The lines of a recording: first a [`Header`], then [`Line`]s, the last of which counts those before it.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::base64::Bytes;
use super::drive::{Instrument, Rows};
use super::loads::{Loading, is_zero};
use crate::options::{Corrections, DecoderKernel, GuardPolicy, Precision, SceneOptions, StepPath};
use ::contact::Shape;

/// The version of the format.
pub const VERSION: u32 = 2;

/// The first line.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// [`VERSION`].
    pub upt_replay: u32,
    /// Version of the library that made the hashes, for messages.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub libupt: String,
    /// Name of the bundle, for messages.
    pub bundle: String,
    /// SHA-256 of its `bundle.json`; absent: any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bundle_sha256: Option<String>,
    /// Whether the hashes are those of a portable model: else they are of one kind of processor.
    #[serde(default)]
    pub portable: bool,
    /// How the scene was made.
    #[serde(default)]
    pub scene: SceneFields,
}

/// Fields of `upt_scene_options` that change what a step computes; a budget has no place here, since it counts by the clock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneFields {
    pub step_s: f64,
    pub damping_per_s: f64,
    pub corrections: Corrections,
    pub substeps: u32,
    pub guard_policy: GuardPolicy,
    pub boundary: bool,
    pub sleep: bool,
    pub check_inversion: bool,
    pub kernel: DecoderKernel,
    pub step_path: StepPath,
    pub precision: Precision,
}

impl SceneFields {
    /// Those of a scene that computes with `precision`.
    pub fn new(options: &SceneOptions, precision: Precision) -> SceneFields {
        SceneFields {
            step_s: options.step_s,
            damping_per_s: options.damping_per_s,
            corrections: options.corrections,
            substeps: options.substeps,
            guard_policy: options.guard_policy,
            boundary: options.boundary,
            sleep: options.sleep,
            check_inversion: options.check_inversion,
            kernel: options.kernel,
            step_path: options.step_path,
            precision,
        }
    }

    /// Options of such a scene.
    pub fn options(&self) -> SceneOptions {
        SceneOptions {
            step_s: self.step_s,
            damping_per_s: self.damping_per_s,
            corrections: self.corrections,
            substeps: self.substeps,
            guard_policy: self.guard_policy,
            boundary: self.boundary,
            sleep: self.sleep,
            check_inversion: self.check_inversion,
            kernel: self.kernel,
            step_path: self.step_path,
            ..SceneOptions::default()
        }
    }
}

impl Default for SceneFields {
    fn default() -> SceneFields {
        SceneFields::new(&SceneOptions::default(), Precision::F32)
    }
}

/// A further line.
#[allow(
    clippy::large_enum_variant,
    reason = "most lines are steps, and one is made at a time; with pointers of 32 bits it is not as large"
)]
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Line<'a> {
    /// A step, or a submitted one that has been made.
    Step(Step<'a>),
    /// A hull or closed surface; instruments name it by its place among these lines, from 0.
    Hull(Cow<'a, Shape>),
    Cut(Cut<'a>),
    Remove(Remove<'a>),
    Tear(Tear),
    ScaleStiffness(Stiffness<'a>),
    DropFragments {},
    Reset {},
    /// A snapshot that was restored; before the first step, the state in which the recording began.
    Restore(Bytes<'a>),
    /// The nodes that outputs, and hashes, have from then on; none: all.
    Region(Option<Cow<'a, [u32]>>),
    /// Lines before it, the first not counted.
    End(u64),
}

/// `upt_input`, and what came of it.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Step<'a> {
    /// Instruments that drive the step; absent: they do not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub instruments: Option<Vec<Instrument<'a>>>,
    /// Nodes in contact, and their displacements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<Rows<'a>>,
    /// The rows of a dense collision field that are not zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub collision: Option<Rows<'a>>,
    /// The rows of the displacement from which the step starts that are not zero.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement: Option<Rows<'a>>,
    #[serde(skip_serializing_if = "Loading::is_empty")]
    pub loads: Loading<'a>,
    /// s.
    #[serde(skip_serializing_if = "is_zero")]
    pub time_s: f64,
    /// Of the displacement `[n,3]` after the step as `upt_scene_read` gives it: f32, little-endian. The last field: the recorder of a scene fills it in.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sha256: Option<Cow<'a, str>>,
}

/// The arguments of `upt_scene_cut_with`; without a blade those of `upt_scene_cut`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cut<'a> {
    pub stroke: u32,
    pub points: usize,
    pub poses: Cow<'a, [[f32; 3]]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blade: Option<Blade>,
}

/// `upt_blade`.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Blade {
    pub fracture_energy: f64,
    pub threshold: f64,
    pub pushed: f64,
    pub ahead: [f64; 3],
}

/// The arguments of `upt_scene_remove`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Remove<'a> {
    pub instrument: Instrument<'a>,
    pub most_mm3: f32,
}

/// The arguments of `upt_scene_tear`.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tear {
    pub stroke: u32,
    pub stretch: f32,
    pub most: u32,
}

/// The arguments of `upt_scene_scale_stiffness`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stiffness<'a> {
    pub elements: Cow<'a, [u32]>,
    pub factor: f32,
}
