//! The cases of the yardstick: trajectories with tools, on one mesh under one boundary condition.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use contact::{Body, Pose, Samples, Vector};
use tissue::baselines::DecayFit;
use tissue::mesh::Mesh;
use tissue::schemes::FRAME_S;
use tissue::solver::{Tool, ToolPose};
use tissue::tool_tracks::ToolTracks;
use tissue::trajectory::Trajectory;

use super::drive::{Load, load};
use crate::bundle_folder::is_one_tissue;
use crate::finished;

/// Which part of a dataset is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Split {
    /// Held-out cases.
    #[default]
    Test,
    /// Cases that bundles may learn from.
    Train,
    /// Both.
    All,
}

impl Split {
    pub const ALL: [Split; 3] = [Split::Test, Split::Train, Split::All];

    pub fn name(self) -> &'static str {
        match self {
            Split::Test => "test",
            Split::Train => "train",
            Split::All => "all",
        }
    }
}

/// One simulated case.
pub struct ToolCase {
    pub name: String,
    /// Name of the folder that it lies in.
    pub dataset: String,
    /// `press`, `stroke` and so on.
    pub programme: String,
    pub tools: Vec<Tool>,
    pub bodies: Vec<Body>,
    pub trajectory: Trajectory,
    /// By frame, one a tool; the first is where they start.
    pub poses: Vec<Vec<ToolPose>>,
}

impl ToolCase {
    fn read(path: &Path) -> Result<Self> {
        let trajectory = Trajectory::read(path)?;
        let programme = trajectory.header.scheme.trim_start_matches("tool-");
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let stem = file.trim_end_matches(".trajectory.safetensors");
        let name = format!("{programme}, {stem}");
        Self::of(trajectory, &name, path)
    }

    /// A case by its name; messages speak of `path`.
    pub fn of(trajectory: Trajectory, name: &str, path: &Path) -> Result<Self> {
        let Some(tracks) = trajectory.tools.as_ref().filter(|t| !t.tools.is_empty()) else {
            bail!(
                "{}: has no tools (scheme {}); write one with `upt simulate --tool NAME` or `upt dataset --tools NAMES`",
                path.display(),
                trajectory.header.scheme
            );
        };
        let bodies = tracks.tools.iter().enumerate().map(|(index, tool)| {
            Body::new(&tool.shape)
                .with_context(|| format!("{}: field `tools`, tool {index}", path.display()))
        });
        let programme = trajectory.header.scheme.trim_start_matches("tool-");
        let dataset = path.parent().and_then(Path::file_name).unwrap_or_default();
        Ok(Self {
            name: name.to_owned(),
            dataset: dataset.to_string_lossy().into_owned(),
            programme: programme.to_owned(),
            tools: tracks.tools.clone(),
            bodies: bodies.collect::<Result<_>>()?,
            poses: (0..trajectory.frame_count())
                .map(|frame| tracks.frame(frame))
                .collect(),
            trajectory,
        })
    }

    /// What the reference solver says of its tools.
    pub fn tracks(&self) -> &ToolTracks {
        self.trajectory
            .tools
            .as_ref()
            .expect("checked where the case was read")
    }

    /// Poses at a frame.
    pub fn at(&self, frame: usize) -> Vec<Pose> {
        self.poses[frame].iter().map(|to| to.pose).collect()
    }

    /// The parts of a recorded force at a sample; `samples` are those of the mesh.
    pub fn load(&self, frame: usize, row: usize, samples: &Samples, rest: &[[f32; 3]]) -> Load {
        let tracks = self.tracks();
        let tool = tracks.sample_tools[row] as usize;
        let field = self.trajectory.frame(frame);
        let sample = samples.at(tracks.sample_rows[row]);
        let point = sample
            .gather(|node| Vector::from(rest[node as usize]) + Vector::from(field[node as usize]));
        let nearest = self.bodies[tool].nearest_at(&self.poses[frame][tool].pose, point);
        load(
            tool,
            Vector::from(tracks.sample_forces[row]),
            nearest.normal,
        )
    }

    /// Nodes of the samples that are pushed or held at a frame.
    pub fn pushed_nodes(&self, frame: usize, samples: &Samples) -> Vec<u32> {
        let tracks = self.tracks();
        let rows = tracks.sample_offsets[frame] as usize..tracks.sample_offsets[frame + 1] as usize;
        let mut nodes = Vec::new();
        for row in rows {
            let sample = samples.at(tracks.sample_rows[row]);
            nodes.extend(sample.entries().map(|(node, _)| node));
        }
        nodes
    }

    /// The longest way that a point of any tool goes within a frame, mm.
    pub fn motion(&self, frame: usize) -> f32 {
        let ends = self.poses[frame - 1].iter().zip(&self.poses[frame]);
        let ways = ends.zip(&self.bodies);
        ways.map(|((from, to), body)| body.motion(&from.pose, &to.pose))
            .fold(0.0, f32::max)
    }

    /// Whether any tool is in contact at the end of a frame.
    pub fn touches(&self, frame: usize) -> bool {
        let count = self.tools.len();
        let contacts = &self.tracks().contacts[frame * count..(frame + 1) * count];
        contacts.iter().any(|contacts| *contacts > 0)
    }

    /// Whether a tool that is closed loses all that it holds in a frame.
    pub fn tears(&self, frame: usize) -> bool {
        let (count, tracks) = (self.tools.len(), self.tracks());
        (0..count).any(|tool| {
            let [before, now] = [frame - 1, frame].map(|frame| frame * count + tool);
            tracks.grasp[now] != 0 && tracks.held[before] > 0 && tracks.held[now] == 0
        })
    }

    /// Sum of the sizes of the tools' forces at the end of a frame, mN.
    fn force(&self, frame: usize) -> f32 {
        let count = self.tools.len();
        let wrenches = &self.tracks().wrenches[frame * count..(frame + 1) * count];
        wrenches
            .iter()
            .map(|w| (w[0] * w[0] + w[1] * w[1] + w[2] * w[2]).sqrt())
            .sum()
    }

    /// The frame that pictures show: the truth's largest force.
    pub fn moment(&self) -> usize {
        (1..self.poses.len())
            .max_by(|a, b| self.force(*a).total_cmp(&self.force(*b)))
            .unwrap_or(0)
    }

    /// The last frame of the first rest of all tools in contact, from which a hold goes on; none where they never rest.
    pub fn hold(&self) -> Option<usize> {
        const STILL_MM: f32 = 1e-4;
        let still = |frame: usize| self.motion(frame) < STILL_MM && self.touches(frame);
        let frames = self.poses.len();
        (1..frames).rfind(|frame| still(*frame) && (*frame + 1 == frames || !still(frame + 1)))
    }
}

/// Cases on one mesh.
pub struct ToolCases {
    pub list: Vec<ToolCase>,
    pub mesh_sha256: String,
    pub boundary: String,
}

impl ToolCases {
    /// Reads trajectories and, of dataset folders, the finished cases of a split, at most `per_programme` of each.
    ///
    /// # Errors
    /// Names the path that has no tools, or another mesh than the first.
    pub fn read(paths: &[PathBuf], split: Split, per_programme: usize) -> Result<Self> {
        let mut files = Vec::new();
        for path in paths {
            if !path.is_dir() {
                files.push(path.clone());
                continue;
            }
            let splits: &[&str] = match split {
                Split::Test => &["test"],
                Split::Train => &["train"],
                Split::All => &["train", "test"],
            };
            let before = files.len();
            for split in splits {
                files.extend(finished(path, split, per_programme)?);
            }
            if files.len() == before {
                bail!(
                    "{}: no finished case of the split `{}`; choose another with --split, or finish the dataset with `upt dataset`",
                    path.display(),
                    splits.join("` or `")
                );
            }
        }
        let list = files.iter().map(|path| ToolCase::read(path));
        Self::of(list.collect::<Result<_>>()?)
    }

    /// Cases of one mesh under one boundary condition.
    ///
    /// # Errors
    /// Names the case of another mesh.
    pub fn of(list: Vec<ToolCase>) -> Result<Self> {
        let first = &list
            .first()
            .context("no cases: name a dataset with tools, or a trajectory")?
            .trajectory
            .header;
        let (mesh_sha256, boundary) = (first.mesh_sha256.clone(), first.boundary.clone());
        for case in &list {
            let header = &case.trajectory.header;
            if header.mesh_sha256 != mesh_sha256 || header.boundary != boundary {
                bail!(
                    "{}: mesh {} with boundary `{}` differs from the first case's; write one report for each",
                    case.name,
                    header.mesh_name,
                    header.boundary
                );
            }
            if !is_one_tissue(&header.material, &first.material) {
                bail!(
                    "{}: its tissue is not the first case's; write one report for each",
                    case.name
                );
            }
        }
        Ok(Self {
            list,
            mesh_sha256,
            boundary,
        })
    }

    /// The decay a step without contact that fits these very cases best: linear elasticity at its best.
    pub fn release_decay(&self) -> f32 {
        let mut fit = DecayFit::default();
        for case in &self.list {
            for frame in 1..case.poses.len() {
                if !case.touches(frame) && !case.touches(frame - 1) {
                    fit.add(
                        case.trajectory.frame(frame - 1),
                        case.trajectory.frame(frame),
                    );
                }
            }
        }
        fit.decay().unwrap_or(0.0)
    }

    /// Checks that each frame is a step.
    ///
    /// # Errors
    /// Names a case with shorter frames.
    pub fn check_steps(&self) -> Result<()> {
        for case in &self.list {
            let frame_s = case.trajectory.header.dt_s;
            if (frame_s - FRAME_S).abs() > 1e-9 {
                bail!(
                    "{}: field `dt_s` is {frame_s}, but a step takes {FRAME_S} s; add --shown 90 to measure what is shown between steps",
                    case.name
                );
            }
        }
        Ok(())
    }

    /// Checks that the trajectories have as many nodes as the mesh.
    pub fn check(&self, mesh: &Mesh) -> Result<()> {
        for case in &self.list {
            let nodes = case.trajectory.frame(0).len();
            if nodes != mesh.node_count() {
                bail!(
                    "{}: field `displacement` has {nodes} nodes, but the mesh has {}; simulate the case again",
                    case.name,
                    mesh.node_count()
                );
            }
        }
        Ok(())
    }
}
