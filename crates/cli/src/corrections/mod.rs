//! `upt corrections`: gives a bundle with a linear response the coarse space that its corrections need (`docs/results/corrections.md`).
//!
//! Sources, none of which is a trajectory: natural modes, the bundle's own residual modes where it has them, and patches
//! (what a few quasi-Newton steps add to the linear response of pushes all over the domain).

mod constraint;
mod manifest;
mod patches;
mod pushes;
mod space;
mod workbench;

pub use constraint::Constraint;
pub use patches::differences;
pub use pushes::{Push, Pushes};
pub use workbench::Workbench;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Result, bail};
use clap::Args;
use serde_json::json;

const FILE: &str = "corrections.safetensors";

/// Options of `upt corrections`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  upt corrections onnx/brain-reduced
  upt corrections my-bundle --natural 60 --patches 160 --recommended 3")]
pub struct Options {
    /// Bundle folder with a linear response; `corrections.safetensors` and the manifest's entry are written there.
    pub bundle: PathBuf,
    /// Natural modes.
    #[arg(long, default_value_t = 60)]
    pub natural: usize,
    /// Modes of what patches add to the linear response; 0: none.
    #[arg(long, default_value_t = 60)]
    pub patch_modes: usize,
    /// Number of patches that these modes are made from.
    #[arg(long, default_value_t = 160)]
    pub patches: usize,
    /// Use the bundle's own residual modes (kind `reduced`) in place of patches.
    #[arg(long)]
    pub residual: bool,
    /// Corrections a step that the bundle recommends.
    #[arg(long, default_value_t = 3)]
    pub recommended: u32,
    /// Factor of the estimated error: `truth over estimate` of `training/scripts/corrections_table.py` on held-out cases.
    #[arg(long, default_value_t = 1.0)]
    pub calibration: f32,
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

/// Runs the command.
pub fn run(args: &Options) -> Result<ExitCode> {
    let started = Instant::now();
    let count = write(args)?;
    let seconds = started.elapsed().as_secs_f64();
    let path = args.bundle.join(FILE);
    if args.json {
        let value =
            json!({"file": path, "modes": count, "natural": args.natural, "seconds": seconds});
        println!("{value}");
    } else {
        println!(
            "{}: {count} modes, {} of them natural ({seconds:.0} s)",
            path.display(),
            args.natural
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// Changes how many corrections the bundle recommends and what their estimated error is multiplied by.
pub fn set_calibration(bundle: &Path, recommended: u32, calibration: f32) -> Result<()> {
    manifest::add(
        bundle,
        FILE,
        &json!({"file": FILE, "recommended": recommended, "calibration": calibration}),
    )
}

/// Writes the file and the manifest's entry; returns the number of modes.
pub fn write(args: &Options) -> Result<usize> {
    if !(args.calibration.is_finite() && args.calibration > 0.0) {
        bail!("--calibration is {}, must be positive", args.calibration);
    }
    if args.recommended > upt::corrections::LIMIT {
        bail!(
            "--recommended is {}, must be at most {}",
            args.recommended,
            upt::corrections::LIMIT
        );
    }
    if args.natural == 0 {
        bail!("--natural is 0; corrections need natural modes");
    }
    let bench = Workbench::open(&args.bundle, args.natural, args.threads, args.json)?;
    let more = if args.residual {
        let width = bench.prior.width();
        if bench.prior.residual.is_empty() {
            bail!("--residual: this bundle has no residual modes; leave the option out");
        }
        let modes = bench.prior.residual.chunks_exact(width);
        modes.map(<[f32]>::to_vec).collect()
    } else if args.patch_modes > 0 {
        let found = patches::differences(&bench, args.patches, args.seed, args.json)?;
        principal(&found, args.patch_modes)
    } else {
        Vec::new()
    };
    bench.write_space(
        &args.bundle,
        more.into_iter(),
        args.recommended,
        args.calibration,
    )
}

/// The leading principal directions of some vectors, by their Gram matrix.
pub fn principal(vectors: &[Vec<f32>], count: usize) -> Vec<Vec<f32>> {
    let n = vectors.len();
    let dot = |a: &[f32], b: &[f32]| -> f64 {
        let pairs = a.iter().zip(b);
        pairs.map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()
    };
    let gram = nalgebra::DMatrix::from_fn(n, n, |i, j| dot(&vectors[i], &vectors[j]));
    let eigen = gram.symmetric_eigen();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    order
        .into_iter()
        .take(count)
        .filter(|&at| eigen.eigenvalues[at] > 1e-9 * eigen.eigenvalues.max())
        .map(|at| {
            let mut mode = vec![0.0f32; vectors[0].len()];
            for (vector, &weight) in vectors.iter().zip(eigen.eigenvectors.column(at).iter()) {
                for (mode, value) in mode.iter_mut().zip(vector) {
                    *mode += weight as f32 * value;
                }
            }
            mode
        })
        .collect()
}
