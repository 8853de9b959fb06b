//! `upt corrections`: gives a bundle with a linear response the coarse space that its corrections need.

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Result, bail};
use clap::Args;
use host::Effort;
use make::Watch;
use make::corrections::{self, Change, FILE, recommend, write, write_whole};
use serde_json::json;
use upt::{LONGEST_STEP_S, SHORTEST_STEP_S};

use crate::progress;

/// Options of `upt corrections`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  upt corrections onnx/brain-reduced
  upt corrections my-bundle --natural 60 --patches 160 --recommended 3
  upt corrections my-bundle --extend --data data/tools
  upt corrections my-bundle --keep --recommended 10@0.02/4
  upt corrections my-bundle --keep --frame-step-s 0.02
  upt corrections my-bundle --keep --whole 60")]
pub struct Options {
    /// Bundle folder with a linear response; `corrections.safetensors` and the manifest's entry are written there.
    bundle: PathBuf,
    /// Natural modes.
    #[arg(long, default_value_t = 60)]
    natural: usize,
    /// Number of modes of what patches add to the linear response; 0: none.
    #[arg(long, default_value_t = 60)]
    patch_modes: usize,
    /// Number of patches that these modes are made from.
    #[arg(long, default_value_t = 160)]
    patches: usize,
    /// Use the bundle's own residual modes (kind `reduced`) in place of patches.
    #[arg(long)]
    residual: bool,
    /// Modes from the training cases of a dataset (`upt dataset`, schemes or tools), added to the others. May be repeated.
    #[arg(long)]
    data: Vec<PathBuf>,
    /// Number of modes from --data.
    #[arg(long, default_value_t = 60)]
    data_modes: usize,
    /// Corrections per step that the bundle recommends. COUNT@MM: at most COUNT, fewer once the estimated error is below MM.
    /// COUNT@MM/SUBSTEPS: also that many substeps, where one step that instruments drive would miss MM. Default: 3, with --keep or --extend the bundle's
    /// own.
    #[arg(long)]
    recommended: Option<Effort>,
    /// Factor of the estimated error: `truth over estimate` of `training/scripts/corrections_table.py` on held-out cases.
    /// Default: 1, or with --keep or --extend the bundle's own.
    #[arg(long)]
    calibration: Option<f32>,
    /// Length of step that the bundle recommends to hosts that show frames (`upt_scene_present`), s, 0.01 to 0.05. Default: none of its own,
    /// with --keep or --extend the bundle's.
    #[arg(long, value_name = "S", value_parser = frame_step)]
    frame_step_s: Option<f64>,
    /// Keep the modes of the bundle's file, and add what --data has outside of them.
    #[arg(long, requires = "data", conflicts_with_all = ["keep", "natural", "patch_modes", "patches", "residual"])]
    extend: bool,
    /// Keep the bundle's file and change only the manifest's entry.
    #[arg(long)]
    keep: bool,
    /// For steps under loads: as whole fields what the coarse space lacks of so many natural modes (`whole.safetensors`). Wanted where contact can
    /// hardly move a part of the body, such as the other half of a brain.
    #[arg(long, value_name = "NATURAL", value_parser = clap::value_parser!(u32).range(1..=128))]
    whole: Option<u32>,
    /// Seed of the patches.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Threads of the factorisation and the solves (0: all).
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

fn frame_step(text: &str) -> Result<f64, String> {
    let allowed = SHORTEST_STEP_S..=LONGEST_STEP_S;
    let step_s = text.parse().ok().filter(|step_s| allowed.contains(step_s));
    step_s.ok_or_else(|| format!("`{text}` is not a length of step: give 0.01 to 0.05 s"))
}

impl Options {
    fn change(&self) -> Change {
        Change {
            recommended: self.recommended,
            calibration: self.calibration,
            frame_step_s: self.frame_step_s,
        }
    }

    fn order(&self, watch: Watch) -> corrections::Options {
        corrections::Options {
            bundle: self.bundle.clone(),
            natural: self.natural,
            patch_modes: self.patch_modes,
            patches: self.patches,
            residual: self.residual,
            data: self.data.clone(),
            data_modes: self.data_modes,
            change: self.change(),
            extend: self.extend,
            seed: self.seed,
            threads: self.threads,
            watch,
        }
    }
}

/// Runs the command.
pub fn run(args: &Options) -> Result<ExitCode> {
    if let Some(calibration) = args.calibration
        && !(calibration.is_finite() && calibration > 0.0)
    {
        bail!("--calibration is {calibration}; it must be positive");
    }
    let watch = progress::watch(args.json);
    if args.keep {
        let whole = add_whole(args, &watch)?;
        let entry = recommend(&args.bundle, &args.change())?;
        let path = args.bundle.join("bundle.json");
        if args.json {
            println!(
                "{}",
                json!({"file": path, "corrections": entry, "whole_modes": whole})
            );
        } else {
            println!("{}: {entry}", path.display());
            if let Some(count) = whole {
                println!("{count} whole modes");
            }
        }
        return Ok(ExitCode::SUCCESS);
    }
    let started = Instant::now();
    let (count, natural) = write(&args.order(watch.clone()))?;
    let whole = add_whole(args, &watch)?;
    let seconds = started.elapsed().as_secs_f64();
    let path = args.bundle.join(FILE);
    if args.json {
        let value = json!({
            "file": path, "modes": count, "natural": natural, "whole_modes": whole, "seconds": seconds
        });
        println!("{value}");
    } else {
        println!(
            "{}: {count} modes, {natural} of them natural ({seconds:.0} s)",
            path.display()
        );
        if let Some(count) = whole {
            println!("{count} whole modes");
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Writes the whole modes that the options ask for; returns how many there are.
fn add_whole(args: &Options, watch: &Watch) -> Result<Option<usize>> {
    let write = |natural| write_whole(&args.bundle, natural as usize, args.threads, watch);
    args.whole.map(write).transpose()
}
