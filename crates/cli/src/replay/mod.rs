//! `upt replay`: a recorded session again, step by step, and whether it comes out to the bit.
//!
//! REQ-095: A recorded session is replayed to the bit, and the first step that differs is named.

pub mod file;

mod play;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, ensure};
use clap::Args;
use upt::replay::lines::{Header, Line};
use upt::{Corrections, Model, ModelOptions, Precision, Scene};

use play::Player;

#[derive(Args)]
#[command(after_help = "Examples:
  upt replay exam.replay --bundle onnx/liver-coarse --verify
  upt replay inputs.replay --bundle onnx/liver-coarse --write exam.replay")]
pub struct Options {
    /// The replay (docs/reference/formats.md says what is in it; `upt_scene_record` and its like write one).
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
    let (header, lines) = file::parse(&text).with_context(|| name.clone())?;
    let fields = header.scene;
    if let Corrections::RecommendedWithin { budget_us } | Corrections::Auto { budget_us, .. } =
        fields.corrections
    {
        ensure!(
            budget_us == 0,
            "{name}: line 1: scene.corrections: a budget counts by the clock, so no replay has it"
        );
    }
    let model_options = ModelOptions {
        threads: options.threads,
        portable: header.portable,
        precision: (fields.precision != Precision::F32).then_some(fields.precision),
        ..ModelOptions::default()
    };
    let model = Model::open(&options.bundle, &model_options)?;
    let found: String = model
        .hash
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    if let Some(wanted) = &header.bundle_sha256 {
        ensure!(
            wanted.eq_ignore_ascii_case(&found),
            "{name}: recorded with another bundle ({}, bundle.json {wanted}); {} has {found}",
            header.bundle,
            options.bundle.display()
        );
    }
    let mut player = Player::new(Scene::new(model, &fields.options())?);
    if options.write.is_some() {
        player.scene.record(1)?;
    }
    let (mut step, mut compared) = (0, 0);
    for (number, line) in (2..).zip(&lines) {
        step += usize::from(matches!(line, Line::Step(_)));
        let at = || format!("{name}: line {number}, step {step}");
        let hash = player.play(line).with_context(at)?;
        let (Line::Step(given), Some(hash)) = (line, hash) else {
            continue;
        };
        if let (true, Some(wanted)) = (options.verify, &given.sha256) {
            if !wanted.eq_ignore_ascii_case(&hash) {
                eprintln!(
                    "{}: differs: {wanted} was recorded, here it is {hash}",
                    at()
                );
                explain(&header);
                return Ok(ExitCode::FAILURE);
            }
            compared += 1;
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
        player.scene.record(0)?;
        std::fs::write(path, player.scene.take_record()?)
            .with_context(|| path.display().to_string())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Why hashes may differ.
fn explain(header: &Header) {
    if !header.portable {
        eprintln!(
            "The recorded model was not portable: only a processor of the same kind gives its bits."
        );
    }
    let own = env!("CARGO_PKG_VERSION");
    if !header.libupt.is_empty() && header.libupt != own {
        eprintln!(
            "It was recorded with libupt {}, this is {own}: another version may have other bits.",
            header.libupt
        );
    }
}
