//! `upt corrections`: gives a bundle with a linear response the coarse space that its corrections need (`docs/reference/corrections.md`).
//!
//! Sources, none of which is a trajectory: natural modes, the bundle's own residual modes where it has them, and patches
//! (what a few quasi-Newton steps add to the linear response of pushes all over the domain).

mod beyond;
mod constraint;
mod extend;
pub mod manifest;
mod patches;
mod principal;
mod pushes;
mod space;
mod trajectories;
mod whole;
mod workbench;

pub use beyond::Beyond;
pub use constraint::Constraint;
pub use patches::differences;
pub use pushes::{Push, Pushes};
pub use workbench::{Known, Workbench};

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Result, bail};
use clap::Args;
use serde_json::{Value, json};
use upt::{LONGEST_STEP_S, SHORTEST_STEP_S};

use crate::effort::Effort;
use crate::manifest::Manifest;
use extend::Existing;
use principal::FILE;
pub use principal::principal;

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
    pub bundle: PathBuf,
    /// Natural modes.
    #[arg(long, default_value_t = 60)]
    pub natural: usize,
    /// Number of modes of what patches add to the linear response; 0: none.
    #[arg(long, default_value_t = 60)]
    pub patch_modes: usize,
    /// Number of patches that these modes are made from.
    #[arg(long, default_value_t = 160)]
    pub patches: usize,
    /// Use the bundle's own residual modes (kind `reduced`) in place of patches.
    #[arg(long)]
    pub residual: bool,
    /// Modes from the training cases of a dataset (`upt dataset`, schemes or tools), added to the others. May be repeated.
    #[arg(long)]
    pub data: Vec<PathBuf>,
    /// Number of modes from --data.
    #[arg(long, default_value_t = 60)]
    pub data_modes: usize,
    /// Corrections per step that the bundle recommends. COUNT@MM: at most COUNT, fewer once the estimated error is below MM.
    /// COUNT@MM/SUBSTEPS: also that many substeps, where one step that instruments drive would miss MM. Default: 3, with --keep or --extend the bundle's
    /// own.
    #[arg(long)]
    pub recommended: Option<Effort>,
    /// Factor of the estimated error: `truth over estimate` of `training/scripts/corrections_table.py` on held-out cases.
    /// Default: 1, or with --keep or --extend the bundle's own.
    #[arg(long)]
    pub calibration: Option<f32>,
    /// Length of step that the bundle recommends to hosts that show frames (`upt_scene_present`), s, 0.01 to 0.05. Default: none of its own,
    /// with --keep or --extend the bundle's.
    #[arg(long, value_name = "S", value_parser = frame_step)]
    pub frame_step_s: Option<f64>,
    /// Keep the modes of the bundle's file, and add what --data has outside of them.
    #[arg(long, requires = "data", conflicts_with_all = ["keep", "natural", "patch_modes", "patches", "residual"])]
    pub extend: bool,
    /// Keep the bundle's file and change only the manifest's entry.
    #[arg(long)]
    pub keep: bool,
    /// For steps under loads: as whole fields what the coarse space lacks of so many natural modes (`whole.safetensors`). Wanted where contact can
    /// hardly move a part of the body, such as the other half of a brain.
    #[arg(long, value_name = "NATURAL", value_parser = clap::value_parser!(u32).range(1..=128))]
    pub whole: Option<u32>,
    /// Seed of the patches.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Threads of the factorisation and the solves (0: all).
    #[arg(long, default_value_t = 0)]
    pub threads: usize,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}

fn frame_step(text: &str) -> Result<f64, String> {
    let allowed = SHORTEST_STEP_S..=LONGEST_STEP_S;
    let step_s = text.parse().ok().filter(|step_s| allowed.contains(step_s));
    step_s.ok_or_else(|| format!("`{text}` is not a length of step: give 0.01 to 0.05 s"))
}

/// What changes in the manifest's entry; none: as it was.
#[derive(Default)]
pub struct Change {
    pub recommended: Option<Effort>,
    /// What the estimated error is multiplied by.
    pub calibration: Option<f32>,
    /// Length of step for scenes that present, s.
    pub frame_step_s: Option<f64>,
}

impl Options {
    fn change(&self) -> Change {
        Change {
            recommended: self.recommended,
            calibration: self.calibration,
            frame_step_s: self.frame_step_s,
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
    if args.keep {
        let whole = add_whole(args)?;
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
    let (count, natural) = write(args)?;
    let whole = add_whole(args)?;
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
fn add_whole(args: &Options) -> Result<Option<usize>> {
    let Some(natural) = args.whole else {
        return Ok(None);
    };
    let (known, natural) = (Known::default(), natural as usize);
    let bench = Workbench::open(&args.bundle, natural, &known, args.threads, args.json)?;
    bench.write_whole(&args.bundle).map(Some)
}

/// Changes what the manifest says of the corrections; gives the new entry.
pub fn recommend(bundle: &Path, change: &Change) -> Result<Value> {
    let before: Option<Value> = Manifest::read(bundle)?.get("corrections")?;
    let Some(mut entry) = before else {
        bail!(
            "{}: has no corrections to keep; leave --keep out to make them",
            bundle.display()
        );
    };
    apply(&mut entry, change)?;
    manifest::add(bundle, FILE, &entry)?;
    Ok(entry)
}

fn apply(entry: &mut Value, change: &Change) -> Result<()> {
    if let Some(effort) = change.recommended {
        set_effort(entry, effort);
    }
    if let Some(calibration) = change.calibration {
        entry["calibration"] = short(calibration);
    }
    if let Some(step_s) = change.frame_step_s {
        entry["frame_step_s"] = json!(step_s);
    }
    if entry["frame_step_s"].is_number() && entry["recommended"] == 0 {
        bail!(
            "--frame-step-s: steps of a length of their own are made by corrections; recommend some with --recommended"
        );
    }
    Ok(())
}

/// A new entry of the manifest.
pub fn entry(recommended: Effort, calibration: f32) -> Value {
    let mut entry = json!({"file": FILE});
    set_effort(&mut entry, recommended);
    entry["calibration"] = short(calibration);
    entry
}

/// The keys that an [`Effort`] stands for; those that it leaves at their defaults are absent.
fn set_effort(entry: &mut Value, effort: Effort) {
    let target = (effort.target_mm > 0.0).then(|| short(effort.target_mm));
    let substeps = (effort.substeps > 1).then(|| json!(effort.substeps));
    for (key, value) in [
        ("recommended", Some(json!(effort.most))),
        ("target_mm", target),
        ("substeps", substeps),
    ] {
        match (value, entry.as_object_mut()) {
            (Some(value), _) => entry[key] = value,
            (None, Some(keys)) => drop(keys.remove(key)),
            (None, None) => {}
        }
    }
}

/// A float32 with the digits that it was given.
fn short(value: f32) -> Value {
    value
        .to_string()
        .parse::<f64>()
        .map_or(Value::Null, Value::from)
}

/// Writes the file and the manifest's entry; returns the number of modes, and of natural ones.
fn write(args: &Options) -> Result<(usize, usize)> {
    if args.natural == 0 {
        bail!("--natural is 0; corrections need natural modes");
    }
    let mut existing = match args.extend {
        true => Some(Existing::read(&args.bundle)?),
        false => None,
    };
    let (natural, mut entry) = match &mut existing {
        Some(old) => (old.natural, old.entry.take()),
        None => (args.natural, entry(Effort::fixed(3), 1.0)),
    };
    apply(&mut entry, &args.change())?;
    let bench = Workbench::open(
        &args.bundle,
        natural,
        &Known::default(),
        args.threads,
        args.json,
    )?;
    let mut more = if existing.is_some() || args.patch_modes == 0 && !args.residual {
        Vec::new()
    } else if args.residual {
        let width = bench.prior.width();
        if bench.prior.residual.is_empty() {
            bail!("--residual: this bundle has no residual modes; leave the option out");
        }
        let modes = bench.prior.residual.chunks_exact(width);
        modes.map(<[f32]>::to_vec).collect()
    } else {
        let found = patches::differences(&bench, args.patches, None, args.seed, args.json)?;
        principal(&found, args.patch_modes)
    };
    if !args.data.is_empty() {
        let found = trajectories::differences(&bench, &args.data, args.json)?;
        more.extend(match existing {
            Some(old) => old.extended(&found, args.data_modes),
            None => principal(&found, args.data_modes),
        });
    }
    let count = bench.write_space(&args.bundle, more.into_iter(), &entry)?;
    Ok((count, natural))
}
