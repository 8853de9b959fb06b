//! `upt replay`: a recorded session again, step by step, and whether it comes out to the bit.
//!
//! REQ-095: A recorded session is replayed to the bit, and the first step that differs is named.

pub mod file;

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use clap::Args;
use contact::Shape;
use sha2::{Digest, Sha256};
use upt::contact::{Mode, Tool};
use upt::{Contact, Corrections, Loads, Model, ModelOptions, Scene, SceneOptions, StepInput};

use crate::manifest::hex;
use file::{CorrectionFields, CorrectionsMode, Header, Instrument, Kind, Line, SceneFields, Step};

#[derive(Args)]
#[command(after_help = "Examples:
  upt replay exam.replay --bundle onnx/liver-coarse --verify
  upt replay inputs.replay --bundle onnx/liver-coarse --write exam.replay")]
pub struct Options {
    /// The replay (docs/reference/formats.md says what is in it; Python's `upt.Recorder` writes one).
    file: PathBuf,
    /// Folder of the bundle that it was recorded with.
    #[arg(long)]
    bundle: PathBuf,
    /// Compare each hash in the file with what this machine computes; exit code 1 at the first step that differs.
    #[arg(long)]
    verify: bool,
    /// Write the replay with the hashes of this machine.
    #[arg(long, value_name = "FILE")]
    write: Option<PathBuf>,
    /// Threads of a step; the bits do not depend on them.
    #[arg(long, default_value_t = 1)]
    threads: usize,
}

pub fn run(options: &Options) -> Result<ExitCode> {
    let name = options.file.display().to_string();
    let text = std::fs::read_to_string(&options.file).with_context(|| name.clone())?;
    let (mut header, mut lines) = file::parse(&text).with_context(|| name.clone())?;
    let model_options = ModelOptions {
        threads: options.threads,
        portable: header.portable,
        ..ModelOptions::default()
    };
    let model = Model::open(&options.bundle, &model_options)?;
    let found = hex(&model.hash);
    if let Some(wanted) = &header.bundle_sha256 {
        ensure!(
            wanted.eq_ignore_ascii_case(&found),
            "{name}: recorded with another bundle ({}, bundle.json {wanted}); {} has {found}",
            header.bundle,
            options.bundle.display()
        );
    }
    let scene = Scene::new(Arc::clone(&model), &scene_options(&header.scene)?)?;
    let (mut step, mut compared) = (0, 0);
    for (number, line) in (2..).zip(&mut lines) {
        match line {
            Line::Step(given) => {
                step += 1;
                let at = || format!("{name}: line {number}, step {step}");
                let hash = advance(&scene, given).with_context(at)?;
                if let (true, Some(wanted)) = (options.verify, &given.sha256) {
                    if !wanted.eq_ignore_ascii_case(&hash) {
                        eprintln!(
                            "{}: differs: {wanted} was recorded, here it is {hash}",
                            at()
                        );
                        if !header.portable {
                            eprintln!(
                                "The recorded model was not portable: only a processor of the same kind gives its bits."
                            );
                        }
                        return Ok(ExitCode::FAILURE);
                    }
                    compared += 1;
                }
                given.sha256 = Some(hash);
            }
            Line::Cut(cut) => {
                let at = || format!("{name}: line {number}, a cut after step {step}");
                scene
                    .cut(cut.stroke, cut.points, &cut.poses)
                    .with_context(at)?;
            }
            Line::End(_) => unreachable!("the reader ends there"),
        }
    }
    if options.verify {
        ensure!(
            compared > 0,
            "{name}: holds no hash to compare; `--write` makes a file with hashes"
        );
        println!("{name}: {step} steps, {compared} hashes, all the same");
    } else {
        println!("{name}: {step} steps");
    }
    if let Some(path) = &options.write {
        header.bundle_sha256 = Some(found);
        std::fs::write(path, written(&header, &lines)?)
            .with_context(|| path.display().to_string())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The file of these lines.
fn written(header: &Header, lines: &[Line]) -> Result<String> {
    let mut text = serde_json::to_string(header)? + "\n";
    for line in lines {
        writeln!(text, "{}", serde_json::to_string(line)?)?;
    }
    writeln!(text, "{}", serde_json::to_string(&Line::End(lines.len()))?)?;
    Ok(text)
}

/// Steps, and the hash of the displacement after it.
fn advance(scene: &Scene, step: &Step) -> Result<String> {
    let tools: Vec<Tool> = (step.instruments.iter().enumerate())
        .map(|(at, given)| tool(given).with_context(|| format!("instrument {at}")))
        .collect::<Result<_>>()?;
    let mut field = vec![0.0; 3 * scene.node_count()];
    let input = StepInput {
        loads: Loads {
            gravity: step.gravity,
            gravity_at_rest: step.gravity_at_rest,
            ..Loads::default()
        },
        ..StepInput::from(Contact::Tools(&tools))
    };
    scene.step(input, Some(&mut field))?;
    let mut hash = Sha256::new();
    for value in field {
        hash.update(value.to_le_bytes());
    }
    Ok(hex(&hash.finalize()))
}

fn tool(given: &Instrument) -> Result<Tool> {
    let (radius, half_extents) = (given.radius, given.half_extents);
    let shape = match given.shape {
        Kind::Sphere => Shape::Sphere { radius },
        Kind::Capsule => Shape::Capsule {
            half_length: half_extents[1],
            radius,
        },
        Kind::Box => Shape::Box { half_extents },
        Kind::Spatula => Shape::Spatula {
            half_extents,
            radius,
        },
    };
    let rotation = match given.rotation {
        [0.0, 0.0, 0.0, 0.0] => [0.0, 0.0, 0.0, 1.0],
        turned => turned,
    };
    let mut tool = Tool::new(&shape, given.position, rotation)?;
    tool.mode = match given.mode {
        file::Mode::Slide => Mode::Slide,
        file::Mode::Grasp => Mode::Grasp,
    };
    tool.friction = given.friction;
    tool.tear_off_mn = given.tear_off_mn;
    Ok(tool)
}

fn scene_options(fields: &SceneFields) -> Result<SceneOptions> {
    let CorrectionFields {
        mode,
        count,
        target_mm,
    } = fields.corrections;
    ensure!(
        count == 0 || mode == CorrectionsMode::Count,
        "line 1: scene.corrections has the count {count} and not the mode `count`"
    );
    let auto = |most| Corrections::Auto {
        most,
        target_mm,
        budget_us: 0,
    };
    Ok(SceneOptions {
        corrections: match (mode, target_mm > 0.0) {
            (CorrectionsMode::Auto, _) => auto(64),
            (CorrectionsMode::Count, true) => auto(count),
            (CorrectionsMode::Count, false) => Corrections::Fixed(count),
            (CorrectionsMode::None, false) => Corrections::None,
            (CorrectionsMode::Recommended, false) => Corrections::Recommended,
            (CorrectionsMode::None | CorrectionsMode::Recommended, true) => anyhow::bail!(
                "line 1: scene.corrections has a target of {target_mm} mm, which is for the modes `count` and `auto`"
            ),
        },
        step_s: fields.step_s,
        damping_per_s: fields.damping_per_s,
        substeps: fields.substeps,
        ..SceneOptions::default()
    })
}
