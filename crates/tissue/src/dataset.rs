//! A folder of simulated cases (docs/reference/formats.md, "Dataset"; use in docs/guide/datasets.md).
//!
//! Case `i` follows from the plan and `i` alone, so any process may compute any
//! case: shards share a folder, an interrupted run goes on where it stopped, and
//! the trajectories have the same bytes either way. Each finished or failed case
//! leaves a small record next to its trajectory; the manifest is put together from
//! the records, so it is right whoever writes it last.

pub use crate::loads::Load;
use crate::material::Material;
use crate::mesh::{Boundary, Mesh};
use crate::programmes::ToolScale;
use crate::schemes::SplitMix;
use crate::simulate::{SOLVER_NAME, ToolOrder, simulate, simulate_tools};
use crate::solver::SolverOptions;
#[cfg(feature = "linear")]
use crate::statics::StaticSolver;
use crate::tensors::write_whole;
use crate::trajectory::TrajectoryError;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::{Path, PathBuf};

/// What a dataset holds.
#[derive(Clone, Debug)]
pub struct DatasetPlan {
    pub boundary: Boundary,
    pub loads: Vec<Load>,
    pub count: usize,
    pub seed: u64,
    /// Store displacements as f16.
    pub half: bool,
    /// Frames that each step of a tool's programme is recorded in; 1, or more for what hosts show between steps.
    pub frames_per_step: usize,
    /// What the sizes of tools are multiplied by.
    pub tool_scale: ToolScale,
    pub options: SolverOptions,
    /// Settings for the split `train` where they differ: longer inner steps with mass scaling.
    pub training: Option<SolverOptions>,
    /// File of `upt prior` for the mesh and boundary; static schemes need it.
    pub columns: Option<PathBuf>,
}

/// One case of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Case {
    pub index: usize,
    pub file: String,
    pub scheme: String,
    pub seed: u64,
    /// `train` or `test`.
    pub split: String,
}

/// Outcome of a case, next to its trajectory as `case-….record.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseRecord {
    #[serde(flatten)]
    pub case: Case,
    /// `done`, `failed`, or (in a manifest) `pending`.
    pub status: String,
    /// Why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
    /// Equilibria of a static case that were not found, and why.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub skipped: Vec<String>,
    /// Seconds on the machine that computed it.
    pub wall_time_s: f64,
    /// Mesh, boundary, material, seed and solver that it belongs to.
    pub plan_key: String,
}

/// `manifest.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    pub format: String,
    pub version: u32,
    pub mesh_name: String,
    pub mesh_sha256: String,
    pub boundary: Boundary,
    pub material: Material,
    pub seed: u64,
    pub cases: Vec<CaseRecord>,
}

/// A dataset folder that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    #[error("{path}: {source}")]
    Io {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{path}: {reason}; choose another folder or remove it")]
    Foreign { path: PathBuf, reason: String },
    #[error("the plan has no schemes or tools, or no cases")]
    EmptyPlan,
    #[error(
        "scheme `{0}` needs the compliance columns of its mesh; make them with `upt prior` and name the file with --columns"
    )]
    NoColumns(&'static str),
    #[error("static schemes cannot use the average nodal pressure; leave --average-pressure out")]
    AveragePressure,
    #[cfg(feature = "linear")]
    #[error(transparent)]
    Statics(#[from] crate::statics::StaticsError),
    #[cfg(not(feature = "linear"))]
    #[error("scheme `{0}` needs the feature `linear`, which this build leaves out")]
    NoLinear(&'static str),
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
}

impl DatasetPlan {
    /// Case `index`: load `index mod |loads|`, group `index div |loads|`; every fifth group is held out.
    pub fn case(&self, index: usize) -> Case {
        let group = index / self.loads.len();
        let load = self.load(index);
        let held_out = group % 5 == 4 && load.is_tested();
        let mut random = SplitMix(self.seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ index as u64);
        Case {
            index,
            file: format!("case-{index:05}.trajectory.safetensors"),
            scheme: load.name(),
            // 53 bits: exact in every JSON reader.
            seed: random.next() >> 11,
            split: if held_out { "test" } else { "train" }.into(),
        }
    }

    /// What moves case `index`.
    pub fn load(&self, index: usize) -> Load {
        self.loads[index % self.loads.len()]
    }

    /// Identifies everything that the trajectories' bytes depend on.
    fn key(&self, mesh: &Mesh) -> String {
        let schemes: Vec<String> = self.loads.iter().map(|load| load.name()).collect();
        let mut key = format!(
            "{SOLVER_NAME}; mesh {}; {}; schemes {}; seed {}; {}; inner step {}; {:?}; {}",
            &mesh.hash()[..16],
            self.boundary.as_str(),
            schemes.join(","),
            self.seed,
            serde_json::json!(self.options.material),
            self.options.inner_step_s,
            self.options.pressure,
            if self.half { "f16" } else { "f32" },
        );
        if self.options.mass_scaling_s > 0.0 {
            key += &format!("; mass scaling {}", self.options.mass_scaling_s);
        }
        if self.frames_per_step > 1 {
            key += &format!("; {} frames a step", self.frames_per_step);
        }
        if self.tool_scale != ToolScale::TABLE {
            key += &format!("; tools of {}", self.tool_scale);
        }
        if let Some(training) = &self.training {
            key += &format!(
                "; training with inner step {}, mass scaling {}",
                training.inner_step_s, training.mass_scaling_s
            );
        }
        key
    }
}

#[cfg(feature = "linear")]
fn static_solver(
    plan: &DatasetPlan,
    mesh: &Mesh,
    scheme: &'static str,
) -> Result<StaticSolver, DatasetError> {
    let columns = plan.columns.as_deref();
    let columns = columns.ok_or(DatasetError::NoColumns(scheme))?;
    if plan.options.pressure != crate::solver::Pressure::Element {
        return Err(DatasetError::AveragePressure);
    }
    let material = plan.options.material;
    Ok(StaticSolver::new(mesh, plan.boundary, material, columns)?)
}

/// Without the feature `linear` there is none.
#[cfg(not(feature = "linear"))]
enum StaticSolver {}

#[cfg(not(feature = "linear"))]
impl StaticSolver {
    fn trajectory(
        &self,
        _: crate::schemes::Scheme,
        _: u64,
        _: impl FnMut(usize),
    ) -> Result<(crate::trajectory::Trajectory, Vec<String>), std::convert::Infallible> {
        match *self {}
    }
}

#[cfg(not(feature = "linear"))]
fn static_solver(
    _: &DatasetPlan,
    _: &Mesh,
    scheme: &'static str,
) -> Result<StaticSolver, DatasetError> {
    Err(DatasetError::NoLinear(scheme))
}

/// A plan bound to a mesh and a folder.
pub struct Dataset<'a> {
    plan: &'a DatasetPlan,
    mesh: &'a Mesh,
    folder: PathBuf,
    key: String,
    statics: Option<StaticSolver>,
}

impl<'a> Dataset<'a> {
    /// Creates the folder, or takes up one that an equal plan began.
    pub fn open(
        plan: &'a DatasetPlan,
        mesh: &'a Mesh,
        folder: &Path,
    ) -> Result<Self, DatasetError> {
        if plan.loads.is_empty() || plan.count == 0 {
            return Err(DatasetError::EmptyPlan);
        }
        let statics = match plan.loads.iter().find_map(|load| load.statics()) {
            Some(scheme) => Some(static_solver(plan, mesh, scheme.name())?),
            None => None,
        };
        std::fs::create_dir_all(folder).map_err(|source| DatasetError::Io {
            path: folder.into(),
            source,
        })?;
        let dataset = Self {
            plan,
            mesh,
            folder: folder.into(),
            key: plan.key(mesh),
            statics,
        };
        for index in 0..plan.count {
            if let Some(record) = dataset.record(index)
                && record.plan_key != dataset.key
            {
                return Err(DatasetError::Foreign {
                    path: dataset.record_path(index),
                    reason: format!(
                        "belongs to another dataset ({}); this one is {}",
                        record.plan_key, dataset.key
                    ),
                });
            }
        }
        Ok(dataset)
    }

    /// Cases of shard `shard` of `shards` (counted from 0) that have no outcome yet.
    pub fn pending(&self, shard: usize, shards: usize) -> Vec<Case> {
        (0..self.plan.count)
            .filter(|index| index % shards == shard)
            .filter(|index| self.record(*index).is_none())
            .map(|index| self.plan.case(index))
            .collect()
    }

    /// Simulates a case (or finds its equilibria) and writes its trajectory and record. `progress` hears the frames that
    /// are finished.
    ///
    /// A simulation that fails is an outcome (`failed`, with the cause), not an
    /// error; errors are a disk that is full, or the like.
    pub fn compute(
        &self,
        case: &Case,
        mut progress: impl FnMut(usize),
    ) -> Result<CaseRecord, DatasetError> {
        self.remove_leftovers(case);
        let load = self.plan.load(case.index);
        let start = std::time::Instant::now();
        let options = match &self.plan.training {
            Some(training) if case.split == "train" => training,
            _ => &self.plan.options,
        };
        let (mesh, boundary) = (self.mesh, self.plan.boundary);
        let outcome = match (load, &self.statics) {
            (Load::Scheme(scheme), Some(statics)) if scheme.is_static() => statics
                .trajectory(scheme, case.seed, progress)
                .map_err(|error| error.to_string()),
            (Load::Scheme(scheme), _) => {
                simulate(mesh, boundary, scheme, case.seed, options, progress)
                    .map(|trajectory| (trajectory, Vec::new()))
                    .map_err(|error| error.to_string())
            }
            (Load::Tools(tools), _) => {
                let progress = |frame, _| progress(frame);
                let order = ToolOrder {
                    frames_per_step: self.plan.frames_per_step,
                    scale: self.plan.tool_scale,
                    ..ToolOrder::new(tools, case.seed)
                };
                simulate_tools(mesh, boundary, order, options, progress)
                    .map(|trajectory| (trajectory, Vec::new()))
                    .map_err(|error| error.to_string())
            }
        };
        let (cause, skipped) = match outcome {
            Ok((trajectory, skipped)) => {
                trajectory.write(&self.folder.join(&case.file), self.plan.half)?;
                (None, skipped)
            }
            Err(error) => (Some(error), Vec::new()),
        };
        let record = CaseRecord {
            case: case.clone(),
            status: if cause.is_none() { "done" } else { "failed" }.into(),
            cause,
            skipped,
            wall_time_s: (start.elapsed().as_secs_f64() * 1e3).round() / 1e3,
            plan_key: self.key.clone(),
        };
        self.write_json(&self.record_path(case.index), &record)?;
        Ok(record)
    }

    /// Writes `manifest.json` from the records that exist now.
    pub fn write_manifest(&self) -> Result<Manifest, DatasetError> {
        let cases = (0..self.plan.count)
            .map(|index| {
                self.record(index).unwrap_or_else(|| CaseRecord {
                    case: self.plan.case(index),
                    status: "pending".into(),
                    cause: None,
                    skipped: Vec::new(),
                    wall_time_s: 0.0,
                    plan_key: self.key.clone(),
                })
            })
            .collect();
        let manifest = Manifest {
            format: "upt-dataset".into(),
            version: 1,
            mesh_name: self.mesh.name.clone(),
            mesh_sha256: self.mesh.hash(),
            boundary: self.plan.boundary,
            material: self.plan.options.material,
            seed: self.plan.seed,
            cases,
        };
        self.write_json(&self.folder.join("manifest.json"), &manifest)?;
        Ok(manifest)
    }

    fn record_path(&self, index: usize) -> PathBuf {
        self.folder.join(format!("case-{index:05}.record.json"))
    }

    /// The record of a case whose outcome is complete on disk.
    fn record(&self, index: usize) -> Option<CaseRecord> {
        let bytes = std::fs::read(self.record_path(index)).ok()?;
        let record: CaseRecord = serde_json::from_slice(&bytes).ok()?;
        let whole = record.status != "done" || self.folder.join(&record.case.file).exists();
        whole.then_some(record)
    }

    /// Removes temporary files that a killed run left of this case.
    fn remove_leftovers(&self, case: &Case) {
        let Ok(entries) = std::fs::read_dir(&self.folder) else {
            return;
        };
        let stem = format!("case-{:05}.", case.index);
        for entry in entries.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if name.starts_with(&stem) && name.ends_with(".tmp") {
                // Another process cannot own it: a case belongs to one shard.
                let _ = std::fs::remove_file(entry.path());
            }
        }
    }

    fn write_json(&self, path: &Path, value: &impl Serialize) -> Result<(), DatasetError> {
        let text = serde_json::to_vec_pretty(value).unwrap_or_default();
        write_whole(path, |file| file.write_all(&text)).map_err(|source| DatasetError::Io {
            path: path.into(),
            source,
        })
    }
}
