//! The lowest natural modes of a held mesh.
//!
//! Writes `frequency [m]` (rad/s) and `modes [m,3K]` (mass-normalised, kg^-1/2) as one safetensors file, from which
//! `python -m upt_training.vibration --natural FILE` makes a bundle's free vibration.

use std::path::{Path, PathBuf};

use anyhow::Context;
use serde_json::json;
use tissue::linear::{Factor, Lame, NaturalModes, Stiffness, natural_modes};
use tissue::mesh::{Boundary, Mesh};
use tissue::tensors::f32_values;

use crate::Watch;
use crate::prior::{floats, header};

/// What to find, and where to write.
#[derive(Clone, Debug)]
pub struct Options {
    /// Mesh file (`*.mesh.safetensors`) with held nodes.
    pub mesh: PathBuf,
    /// Held node sets.
    pub boundary: Boundary,
    /// Number of modes.
    pub count: usize,
    /// File to write.
    pub out: PathBuf,
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// kg/m³.
    pub density: f64,
    /// 0: all.
    pub threads: usize,
    pub watch: Watch,
}

/// What was written.
pub struct Written {
    /// The lowest and the highest frequency, Hz.
    pub hertz: [f64; 2],
    /// Solves with the factor.
    pub solves: u64,
}

/// Reads a file of modes, as float32 kept them.
pub fn read(path: &Path) -> anyhow::Result<NaturalModes> {
    let bytes =
        std::fs::read(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    let file = safetensors::SafeTensors::deserialize(&bytes)
        .with_context(|| format!("{}: not a file of modes", path.display()))?;
    let values = |name: &str| -> anyhow::Result<Vec<f64>> {
        let tensor = file
            .tensor(name)
            .with_context(|| format!("{}: not a file of modes", path.display()))?;
        Ok(f32_values(tensor.data()).map(f64::from).collect())
    };
    Ok(NaturalModes {
        frequency: values("frequency")?,
        modes: values("modes")?,
    })
}

/// Writes the file. `go_on` is asked before each solve: where it says no, the error is
/// [`LinearError::Stopped`](tissue::linear::LinearError::Stopped).
pub fn write(args: &Options, go_on: &(dyn Fn() -> bool + Sync)) -> anyhow::Result<Written> {
    let mesh = Mesh::read(&args.mesh)?;
    let held = mesh.held_nodes(args.boundary);
    let lame = Lame::from_young(args.young, args.poisson)?;
    let stiffness = Stiffness::assemble(&mesh, &held, lame)?;
    let factor = Factor::new(&stiffness, &mesh.positions, args.threads)?;
    let bar = args.watch.spinner("solves with the factor");
    let found = natural_modes(
        &mesh,
        &stiffness,
        &factor,
        args.density,
        args.count,
        &|| {
            bar.inc(1);
            go_on()
        },
    )?;
    let solves = bar.position();
    drop(bar);

    let metadata = json!({
        "format": "upt-modes", "version": "1", "mesh_name": mesh.name, "mesh_sha256": mesh.hash(),
        "boundary": args.boundary.as_str(), "young_pa": args.young.to_string(), "poisson": args.poisson.to_string(),
        "density_kg_m3": args.density.to_string(),
    });
    let mut bytes = header(
        &[
            ("modes", "F32", [args.count, 3 * mesh.node_count()]),
            ("frequency", "F32", [args.count, 1]),
        ],
        metadata,
    );
    bytes.extend(floats(found.modes.iter().map(|&v| v as f32)));
    bytes.extend(floats(found.frequency.iter().map(|&v| v as f32)));
    let temporary = args.out.with_extension("partial");
    std::fs::write(&temporary, bytes)
        .with_context(|| format!("{}: writing failed", temporary.display()))?;
    std::fs::rename(&temporary, &args.out)
        .with_context(|| format!("{}: cannot be renamed", temporary.display()))?;

    let hertz = |at: usize| found.frequency[at] / std::f64::consts::TAU;
    Ok(Written {
        hertz: [hertz(0), hertz(args.count - 1)],
        solves,
    })
}
