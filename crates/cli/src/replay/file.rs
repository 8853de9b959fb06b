//! A replay: what a scene was given, step by step, as lines of JSON (`docs/reference/formats.md`).
//!
//! The first line says of which bundle and with which options, each further line is a step or a cut, the last line counts them. A step may hold
//! the SHA-256 of the displacement after it. All numbers are those of the C ABI, by its names.

use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};

/// The version of the format.
pub const VERSION: u32 = 1;

/// The first line.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Header {
    pub upt_replay: u32,
    /// Name of the bundle, for messages.
    pub bundle: String,
    /// SHA-256 of its `bundle.json`; absent: any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bundle_sha256: Option<String>,
    /// Whether the hashes are those of a portable model: else they are of one kind of processor.
    #[serde(default)]
    pub portable: bool,
    #[serde(default)]
    pub scene: SceneFields,
}

/// Fields of `upt_scene_options` that change what a step computes.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SceneFields {
    pub step_s: f64,
    pub damping_per_s: f64,
    pub corrections: CorrectionFields,
    pub substeps: u32,
}

/// `upt_corrections` without its budget, which counts by the clock.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CorrectionFields {
    pub mode: CorrectionsMode,
    pub count: u32,
    pub target_mm: f32,
}

/// `UPT_CORRECTIONS_*`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CorrectionsMode {
    #[default]
    Recommended,
    None,
    Count,
    Auto,
}

/// A further line.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Line {
    Step(Step),
    Cut(Cut),
    /// Lines before it, the first not counted.
    End(usize),
}

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Step {
    pub instruments: Vec<Instrument>,
    /// m/s².
    pub gravity: [f32; 3],
    pub gravity_at_rest: [f32; 3],
    /// Of the displacement `[K,3]` after the step: f32, little-endian, all nodes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
}

/// A field of `upt_instrument` each.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Instrument {
    pub shape: Kind,
    pub position: [f32; 3],
    #[serde(default)]
    pub rotation: [f32; 4],
    #[serde(default)]
    pub half_extents: [f32; 3],
    #[serde(default)]
    pub radius: f32,
    #[serde(default)]
    pub mode: Mode,
    #[serde(default)]
    pub friction: f32,
    #[serde(default)]
    pub tear_off_mn: f32,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    Sphere,
    Capsule,
    Box,
    Spatula,
}

#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    #[default]
    Slide,
    Grasp,
}

/// The arguments of `upt_scene_cut`.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cut {
    pub stroke: u32,
    pub points: usize,
    pub poses: Vec<[f32; 3]>,
}

/// Header and lines of a whole file.
///
/// # Errors
/// What is wrong, with the number of the line; a file that ends too early.
pub fn parse(text: &str) -> Result<(Header, Vec<Line>)> {
    let mut all = (1..).zip(text.lines());
    let (_, first) = all.next().context("the file is empty")?;
    let header: Header =
        serde_json::from_str(first).context("line 1 is not the first line of a replay")?;
    ensure!(
        header.upt_replay == VERSION,
        "line 1: the replay has version {}, this upt reads {VERSION}",
        header.upt_replay
    );
    let mut lines = Vec::new();
    while let Some((number, text)) = all.next() {
        let line = serde_json::from_str(text).with_context(|| format!("line {number}"))?;
        if let Line::End(count) = line {
            ensure!(
                count == lines.len(),
                "line {number}: the end counts {count} lines, there are {}; some are missing",
                lines.len()
            );
            if let Some((number, _)) = all.next() {
                bail!("line {number} comes after the end");
            }
            return Ok((header, lines));
        }
        lines.push(line);
    }
    bail!(
        "the file is cut off after {} lines: its last line must be {{\"end\":COUNT}}",
        lines.len() + 1
    )
}
