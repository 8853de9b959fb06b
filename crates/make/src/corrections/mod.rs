//! Gives a bundle with a linear response the coarse space that its corrections need (`docs/reference/corrections.md`).
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

use anyhow::{Result, bail};
use host::Effort;
use serde_json::{Value, json};

use crate::Watch;
use extend::Existing;
pub use principal::FILE;
pub use principal::principal;
use yardstick::manifest::Manifest;

/// How a coarse space is made.
#[derive(Clone, Debug)]
pub struct Options {
    /// Bundle folder with a linear response; `corrections.safetensors` and the manifest's entry are written there.
    pub bundle: PathBuf,
    /// Natural modes.
    pub natural: usize,
    /// Number of modes of what patches add to the linear response; 0: none.
    pub patch_modes: usize,
    /// Number of patches that these modes are made from.
    pub patches: usize,
    /// Use the bundle's own residual modes (kind `reduced`) in place of patches.
    pub residual: bool,
    /// Modes from the training cases of datasets, added to the others.
    pub data: Vec<PathBuf>,
    /// Number of modes from `data`.
    pub data_modes: usize,
    /// What the manifest says of them.
    pub change: Change,
    /// Keep the modes of the bundle's file, and add what `data` has outside of them.
    pub extend: bool,
    /// Seed of the patches.
    pub seed: u64,
    /// 0: all.
    pub threads: usize,
    pub watch: Watch,
}

/// What changes in the manifest's entry; none: as it was.
#[derive(Clone, Debug, Default)]
pub struct Change {
    pub recommended: Option<Effort>,
    /// What the estimated error is multiplied by.
    pub calibration: Option<f32>,
    /// Length of step for scenes that present, s.
    pub frame_step_s: Option<f64>,
}

/// Writes what the coarse space lacks of `natural` modes as whole fields, for steps under loads; returns how many there are.
pub fn write_whole(bundle: &Path, natural: usize, threads: usize, watch: &Watch) -> Result<usize> {
    Workbench::open(bundle, natural, &Known::default(), threads, watch)?.write_whole(bundle)
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
pub fn write(args: &Options) -> Result<(usize, usize)> {
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
    apply(&mut entry, &args.change)?;
    let bench = Workbench::open(
        &args.bundle,
        natural,
        &Known::default(),
        args.threads,
        &args.watch,
    )?;
    let mut more = if existing.is_some() || args.patch_modes == 0 && !args.residual {
        Vec::new()
    } else if args.residual {
        let width = bench.prior.width();
        if bench.prior.learned.residual.is_empty() {
            bail!("--residual: this bundle has no residual modes; leave the option out");
        }
        let modes = bench.prior.learned.residual.chunks_exact(width);
        modes.map(<[f32]>::to_vec).collect()
    } else {
        let found = patches::differences(&bench, args.patches, None, args.seed, &args.watch)?;
        principal(&found, args.patch_modes)
    };
    if !args.data.is_empty() {
        let found = trajectories::differences(&bench, &args.data, &args.watch)?;
        more.extend(match existing {
            Some(old) => old.extended(&found, args.data_modes),
            None => principal(&found, args.data_modes),
        });
    }
    let count = bench.write_space(&args.bundle, more.into_iter(), &entry)?;
    Ok((count, natural))
}
