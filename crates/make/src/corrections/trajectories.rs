//! What nonlinear elasticity adds to the linear response in simulated contacts: the difference, in block coordinates, between the
//! reference solver's state and the linear response to the same collision field. Trajectories of rigid tools have that field too.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use tissue::trajectory::Trajectory;

use super::beyond::Beyond;
use super::workbench::Workbench;
use crate::Watch;
use yardstick::finished;

/// So many states are kept at most, evenly over all trajectories: their Gram matrix is dense.
const MOST_STATES: usize = 900;

/// Differences of states in contact, from the training cases of `folders`.
pub fn differences(
    source: &Workbench,
    folders: &[PathBuf],
    watch: &Watch,
) -> Result<Vec<Vec<f32>>> {
    let mut files = Vec::new();
    for folder in folders {
        files.extend(finished(folder, "train", usize::MAX)?);
    }
    if files.is_empty() {
        bail!("--data: no finished case of the split `train`; `upt dataset` makes them");
    }
    let trajectories = files.iter().map(|path| {
        let found = Trajectory::read(path)?;
        if found.header.mesh_sha256 != source.mesh.hash()
            || found.header.boundary != source.boundary.as_str()
        {
            bail!(
                "{}: is of mesh `{}` with boundary `{}`, the bundle of mesh `{}` with `{}`",
                path.display(),
                found.header.mesh_name,
                found.header.boundary,
                source.mesh.name,
                source.boundary.as_str()
            );
        }
        Ok(found)
    });
    let trajectories = trajectories.collect::<Result<Vec<_>>>()?;
    let touched = |found: &Trajectory| {
        let frames = 0..found.frame_count();
        frames
            .filter(|&frame| !found.contact(frame).0.is_empty())
            .collect::<Vec<usize>>()
    };
    let all: usize = trajectories.iter().map(|found| touched(found).len()).sum();
    if all == 0 {
        bail!(
            "--data: nothing is touched in any of its {} training cases",
            files.len()
        );
    }
    let every = all.div_ceil(MOST_STATES);

    let mut beyond = Beyond::new(source)?;
    let bar = watch.bar(trajectories.len() as u64, "trajectories");
    let (mut rows, mut seen) = (Vec::with_capacity(all / every + 1), 0);
    for (found, path) in trajectories.iter().zip(&files) {
        for frame in touched(found) {
            seen += 1;
            if seen % every != 0 {
                continue;
            }
            let (nodes, vectors) = found.contact(frame);
            let mut q = vec![0.0; source.prior.width()];
            source
                .prior
                .project(found.frame(frame).as_flattened(), &mut q);
            let q = beyond
                .linear(nodes, vectors, q)
                .with_context(|| format!("{}: frame {frame}", path.display()))?;
            rows.push(q);
        }
        bar.inc(1);
    }
    drop(bar);
    Ok(rows)
}
