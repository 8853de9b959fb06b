//! Bundles beside the reference solver, which runs here: what `report --load`, `--hang`, `--cut` and `--mobilise` have in common.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use contact::Vector;
use serde::Serialize;
use tissue::mesh::{Boundary, Mesh};
use tissue::solver::SolverOptions;
use upt::{Corrections, Error, Model, ModelOptions, Scene, SceneOptions, StepInput};

use crate::report::options::Options;
use crate::table::{Column, Table};
use host::Effort;
use yardstick::bundle_folder::BundleFolder;

/// A bundle, its mesh, and the corrections that are asked for.
pub struct Subject {
    pub name: String,
    pub path: PathBuf,
    pub mesh: Mesh,
    pub boundary: Boundary,
    pub model: Arc<Model>,
    /// Default: what the bundle recommends.
    pub efforts: Vec<Effort>,
    threads: usize,
}

impl Subject {
    /// The solver with the bundle's material.
    pub fn solver(&self) -> SolverOptions {
        SolverOptions {
            material: self.model.manifest.material,
            threads: self.threads,
            ..SolverOptions::default()
        }
    }

    /// A scene with that many corrections.
    ///
    /// # Errors
    /// None are asked for: what is measured here acts in corrections.
    pub fn scene(&self, effort: Effort) -> Result<Scene> {
        let options = SceneOptions {
            threads: self.threads,
            corrections: match (effort.most, effort.target_mm) {
                (0, _) => {
                    bail!("loads, ties and cuts act in corrections; give --corrections at least 1")
                }
                (most, 0.0) => Corrections::Fixed(most),
                (most, target_mm) => Corrections::Auto {
                    most,
                    target_mm,
                    budget_us: 0,
                },
            },
            substeps: effort.substeps,
            ..SceneOptions::default()
        };
        Ok(Scene::new(Arc::clone(&self.model), &options)?)
    }

    /// The same subject with a changed copy of the bundle.
    ///
    /// # Errors
    /// The copy cannot be opened.
    pub fn in_copy(self, folder: &Path) -> Result<Self> {
        let model = open(folder)?;
        Ok(Self { model, ..self })
    }
}

/// Measures each bundle of `asked`, prints one table of all rows (or JSON), and writes it into the pages between the markers `mark`.
pub fn report<R: Serialize>(
    asked: &Options,
    mark: &str,
    (words, columns): (&'static [usize], &[Column<R>]),
    measure: impl Fn(Subject) -> Result<Vec<R>>,
) -> Result<ExitCode> {
    if asked.bundles.is_empty() {
        bail!("name the bundles to measure with --bundle");
    }
    let mut rows = Vec::new();
    for path in &asked.bundles {
        let bundle = BundleFolder::read(path)?;
        let recommended = bundle.corrections.unwrap_or(Effort::NONE);
        let subject = Subject {
            mesh: Mesh::read(&bundle.mesh_file)?,
            boundary: bundle.boundary.parse().map_err(anyhow::Error::msg)?,
            model: open(path)?,
            path: path.clone(),
            efforts: match asked.corrections.as_slice() {
                [] => vec![recommended],
                efforts => efforts.to_vec(),
            },
            name: bundle.name,
            threads: asked.most_threads() as usize,
        };
        rows.extend(measure(subject)?);
    }
    let publisher = asked.publisher();
    publisher.part(mark, &Table::of(words, columns, &rows).markdown())?;
    publisher.end(&rows, &[])?;
    Ok(ExitCode::SUCCESS)
}

fn open(bundle: &Path) -> Result<Arc<Model>> {
    Model::open(bundle, &ModelOptions::default()).with_context(|| bundle.display().to_string())
}

/// What steps took and how they held.
#[derive(Clone)]
pub struct Steps {
    pub ms: Vec<f64>,
    pub smallest_det: f64,
    pub fell_back: usize,
    /// Steps that the guard refused: the last state stays.
    pub refused: usize,
}

impl Default for Steps {
    fn default() -> Self {
        Self {
            ms: Vec::new(),
            smallest_det: 1.0,
            fell_back: 0,
            refused: 0,
        }
    }
}

impl Steps {
    /// One step, its field in `u`.
    pub fn step(&mut self, scene: &Scene, input: StepInput, u: &mut [f32]) -> Result<()> {
        let start = Instant::now();
        match scene.step(input, Some(&mut *u)) {
            Err(Error::Guard(_)) => {
                self.refused += 1;
                scene.read(u)?;
            }
            other => other?,
        }
        self.ms.push(1e3 * start.elapsed().as_secs_f64());
        let stats = scene.stats();
        // 0 where nothing was corrected.
        if stats.min_det != 0.0 {
            self.smallest_det = self.smallest_det.min(stats.min_det.into());
        }
        self.fell_back += usize::from(stats.flags & upt::flag::FELL_BACK != 0);
        Ok(())
    }
}

/// Sums of what vectors are off by, and of what they are.
#[derive(Clone, Copy, Default)]
pub struct Relative {
    off: f64,
    whole: f64,
}

impl Relative {
    pub fn add(&mut self, own: [f32; 3], wanted: Vector) {
        self.off += f64::from((Vector::from(own) - wanted).length());
        self.whole += f64::from(wanted.length());
    }

    /// Their ratio; none of nothing.
    pub fn ratio(self) -> Option<f64> {
        (self.whole > 0.0).then(|| self.off / self.whole)
    }
}

/// Squared distance of two vectors, mm².
pub fn square(own: [f32; 3], wanted: [f32; 3]) -> f64 {
    (Vector::from(own) - Vector::from(wanted))
        .length_squared()
        .into()
}

/// The largest of figures that are not negative.
pub fn largest(figures: impl IntoIterator<Item = f64>) -> f64 {
    figures.into_iter().fold(0.0, f64::max)
}

/// A part of one as a share of a hundred, `-` of none.
pub fn percent(part: Option<f64>) -> String {
    crate::table::or_dash(part, |part| format!("{:.1} %", 100.0 * part))
}
