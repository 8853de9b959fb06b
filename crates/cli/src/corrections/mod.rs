//! `upt corrections`: gives a bundle with a linear response the coarse space that its corrections need (`docs/results/corrections.md`).
//!
//! Sources, none of which is a trajectory: natural modes, the bundle's own residual modes where it has them, and patches
//! (what a few quasi-Newton steps add to the linear response of pushes all over the domain).

mod manifest;
mod patches;
mod space;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::json;
use tissue::linear::{Factor, Lame, Stiffness, natural_modes};
use tissue::mesh::{Boundary, Mesh};
use upt::bundle::BundleFiles;
use upt::prior::PriorTable;

use crate::progress::spinner;
use space::Space;

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
    let files = BundleFiles::open(&args.bundle)?;
    let manifest = &files.manifest;
    let Some(entry) = &manifest.prior else {
        bail!(
            "{}: bundle.json has no `prior`; corrections need a linear response",
            args.bundle.display()
        );
    };
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
    let boundary: Boundary = match manifest.boundary {
        upt::bundle::Boundary::Fixed => Boundary::Fixed,
        upt::bundle::Boundary::Supported => Boundary::Supported,
    };
    let mesh = Mesh::read(&args.bundle.join(&manifest.mesh.file))?;
    let runtime_mesh =
        upt::bundle::Mesh::parse(&files.tensors(&manifest.mesh.file)?, manifest.boundary)?;
    let prior = PriorTable::open(&files, entry, &runtime_mesh)?;
    let held = mesh.held_nodes(boundary);
    let material = &manifest.material;
    let lame = Lame::from_young(material.young_pa, material.poisson)?;
    let quiet = args.json;

    let bar = spinner(quiet, "factorisation");
    let stiffness = Stiffness::assemble(&mesh, &held, lame)?;
    let factor = Factor::new(&stiffness, &mesh.positions, args.threads)?;
    bar.finish_and_clear();
    let bar = spinner(quiet, "natural modes: solves with the factor");
    let natural = natural_modes(
        &mesh,
        &stiffness,
        &factor,
        material.density_kg_m3,
        args.natural,
        &|| bar.inc(1),
    )?;
    bar.finish_and_clear();

    let mut space = Space::new(&prior, &stiffness, &mesh, material.density_kg_m3);
    let frequency = space.add_natural(&natural)?;
    if args.residual {
        let width = prior.width();
        if prior.residual.is_empty() {
            bail!("--residual: this bundle has no residual modes; leave the option out");
        }
        space.add(prior.residual.chunks_exact(width).map(<[f32]>::to_vec));
    } else if args.patch_modes > 0 {
        let source = patches::Source {
            mesh: &mesh,
            prior: &prior,
            stiffness: &stiffness,
            factor: &factor,
            material: elements::Material {
                young_pa: material.young_pa,
                poisson: material.poisson,
                density_kg_m3: material.density_kg_m3,
                damping_per_s: material.damping_per_s,
            },
            held: &held,
            push_mm: f64::from(manifest.envelope.max_push_mm),
            area_mm2: manifest.envelope.contact_area_mm2.map(f64::from),
        };
        let found = patches::modes(&source, args.patches, args.patch_modes, args.seed, quiet)?;
        space.add(found.into_iter());
    }
    let path = args.bundle.join(FILE);
    let count = space
        .write(&path, &frequency)
        .with_context(|| format!("{}: cannot be written", path.display()))?;
    manifest::add(
        &args.bundle,
        FILE,
        &json!({"file": FILE, "recommended": args.recommended, "calibration": args.calibration}),
    )?;
    Ok(count)
}
