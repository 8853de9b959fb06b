//! Trajectories from disk through a bundle: cases that it was not trained on, without the solver's time.

use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};
use tissue::trajectory::Trajectory;

use super::observer::{Moment, Observer, Truth};
use crate::bench::Bench;
use upt_cli::progress;
use yardstick::finished;

/// The cases of a scheme or regime.
pub struct Group {
    pub scheme: String,
    pub cases: usize,
    pub moments: Vec<Moment>,
}

/// All cases of the paths: trajectory files, and the held-out cases of dataset folders.
pub fn groups(bench: &Bench, paths: &[PathBuf]) -> Result<Vec<Group>> {
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            files.extend(finished(path, "test", usize::MAX)?);
        } else {
            files.push(path.clone());
        }
    }
    let bar = progress::cases(files.len(), &bench.subject);
    let mut groups: Vec<Group> = Vec::new();
    for file in &files {
        let (scheme, moments) = replay(bench, file)?;
        match groups.iter_mut().find(|group| group.scheme == scheme) {
            Some(group) => {
                group.cases += 1;
                group.moments.extend(moments);
            }
            None => groups.push(Group {
                scheme,
                cases: 1,
                moments,
            }),
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    groups.sort_by(|a, b| a.scheme.cmp(&b.scheme));
    Ok(groups)
}

fn replay(bench: &Bench, file: &Path) -> Result<(String, Vec<Moment>)> {
    let trajectory = Trajectory::read(file)?;
    let wanted = &bench.model.manifest.mesh.mesh_sha256;
    ensure!(
        trajectory.header.mesh_sha256 == *wanted,
        "{}: simulated on a mesh ({}) other than the bundle's",
        file.display(),
        trajectory.header.mesh_name
    );
    let mut observer = Observer::new(bench)?;
    let mut moments = Vec::with_capacity(trajectory.frame_count());
    for frame in 1..trajectory.frame_count() {
        let (nodes, vectors) = trajectory.contact(frame);
        let rows = &trajectory.contact_offsets[frame..frame + 2];
        let truth = Truth {
            displacement: trajectory.frame(frame),
            reaction: &trajectory.reaction[rows[0] as usize..rows[1] as usize],
            energy: f64::from(trajectory.strain_energy[frame] + trajectory.kinetic_energy[frame]),
        };
        moments.push(observer.step(nodes, vectors, &truth)?);
    }
    Ok((trajectory.header.scheme, moments))
}
