//! The gravity of the scan: what the bundle says of it, or a shape that is free of it.

use anyhow::{Context, Result};
use tissue::mesh::Mesh;
use tissue::statics;

use super::gravity::Gravity;
use super::options::Options;
use super::stages::Stage;

/// What `bundle.json` says of the gravity of its mesh, m/s².
pub fn at_rest(options: &Options) -> Option<[f64; 3]> {
    options.gravity.filter(|_| !options.unload).map(|own| own.0)
}

/// Moves the nodes to where they would be without the gravity of the scan.
pub fn unload(mesh: &mut Mesh, options: &Options, stage: &mut Stage) -> Result<()> {
    let (Some(Gravity(gravity)), true) = (options.gravity, options.unload) else {
        return Ok(());
    };
    let held = mesh.held_nodes(options.boundary);
    let rest = statics::unload(mesh, &held, &options.material()?, gravity).context("--unload")?;
    let way = |from: &[f32; 3], to: &[f64; 3]| {
        let square = |k: usize| (to[k] - f64::from(from[k])).powi(2);
        (square(0) + square(1) + square(2)).sqrt()
    };
    let ways = mesh.positions.iter().zip(&rest);
    let farthest = ways.map(|(from, to)| way(from, to)).fold(0.0, f64::max);
    for (position, rest) in mesh.positions.iter_mut().zip(&rest) {
        *position = rest.map(|x| x as f32);
    }
    stage.decided(&format!(
        "shape without the gravity of the scan: nodes go {farthest:.2} mm at most"
    ));
    Ok(())
}
