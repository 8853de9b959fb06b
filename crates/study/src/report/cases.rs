//! The contacts that all methods are measured on: the test split of dataset folders, or single trajectories.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use sha2::{Digest, Sha256};
use tissue::baselines::DecayFit;
use tissue::trajectory::{Trajectory, TrajectoryHeader};

use yardstick::bundle_folder::is_one_tissue;
use yardstick::finished;

/// One simulated contact.
pub struct Case {
    pub name: String,
    pub trajectory: Trajectory,
}

/// Cases on one mesh under one boundary condition.
pub struct Cases {
    pub list: Vec<Case>,
    pub mesh_sha256: String,
    pub boundary: String,
    /// SHA-256 over contacts and displacements of all cases.
    pub content: String,
}

impl Cases {
    /// Reads `trajectories`, then the held-out cases of the datasets in `folders`, at most `per_scheme` of a scheme.
    pub fn read(trajectories: &[PathBuf], folders: &[PathBuf], per_scheme: usize) -> Result<Self> {
        let mut paths: Vec<PathBuf> = trajectories.to_vec();
        for folder in folders {
            paths.extend(finished(folder, "test", per_scheme)?);
        }
        if paths.is_empty() {
            bail!(
                "no cases: name a trajectory (`upt simulate` makes one) or a dataset folder with finished test cases"
            );
        }
        let mut list = Vec::new();
        let mut hash = Sha256::new();
        for path in &paths {
            let trajectory = Trajectory::read(path)?;
            add_content(&mut hash, &trajectory);
            let header = &trajectory.header;
            let name = title(path, header);
            list.push(Case { name, trajectory });
        }
        let first = &list[0].trajectory.header;
        let (mesh_sha256, boundary) = (first.mesh_sha256.clone(), first.boundary.clone());
        for (case, path) in list.iter().zip(&paths) {
            let header = &case.trajectory.header;
            if header.mesh_sha256 != mesh_sha256 || header.boundary != boundary {
                bail!(
                    "{}: mesh {} with boundary `{}` differs from the first case's; write one report for each",
                    path.display(),
                    header.mesh_name,
                    header.boundary
                );
            }
            if !is_one_tissue(&header.material, &first.material) {
                bail!(
                    "{}: its tissue is not the first case's; write one report for each",
                    path.display()
                );
            }
        }
        let content = format!("{:x}", hash.finalize());
        Ok(Self {
            list,
            mesh_sha256,
            boundary,
            content,
        })
    }

    /// The decay a step after a release that fits these very cases best: linear elasticity at its best.
    pub fn release_decay(&self) -> f32 {
        let mut fit = DecayFit::default();
        for trajectory in self.list.iter().map(|case| &case.trajectory) {
            for frame in 1..trajectory.frame_count() {
                if trajectory.contact(frame).0.is_empty() {
                    fit.add(trajectory.frame(frame - 1), trajectory.frame(frame));
                }
            }
        }
        fit.decay().unwrap_or(0.0)
    }

    /// Steps of the longest case.
    pub fn steps(&self) -> usize {
        self.list
            .iter()
            .map(|case| case.trajectory.frame_count() - 1)
            .max()
            .unwrap_or(0)
    }
}

/// `scheme 5, seed 7`; a dataset's derived seeds mean nothing to a reader, its file names do.
fn title(path: &Path, header: &TrajectoryHeader) -> String {
    let file = path
        .file_name()
        .map(|name| name.to_string_lossy().into_owned())
        .unwrap_or_default();
    let stem = file.trim_end_matches(".trajectory.safetensors").to_owned();
    if header.seed < 1_000_000 {
        format!("scheme {}, seed {}", header.scheme, header.seed)
    } else {
        format!("scheme {}, {stem}", header.scheme)
    }
}

fn add_content(hash: &mut Sha256, trajectory: &Trajectory) {
    for vector in trajectory
        .displacement
        .iter()
        .chain(&trajectory.contact_vectors)
    {
        for value in vector {
            hash.update(value.to_le_bytes());
        }
    }
    for node in trajectory
        .contact_nodes
        .iter()
        .chain(&trajectory.contact_offsets)
    {
        hash.update(node.to_le_bytes());
    }
}
