//! Kind `reduced`: linear response plus a learned correction of the residual state `b` in a static basis, or, in a bundle
//! without a learned map, the linear response and its free vibration alone.

use crate::bundle::{BundleFiles, ReducedEntry};
use crate::error::Result;
use crate::memory::HeldBytes;
use crate::onnx::{ProviderChoice, ProviderPlan, Runtime, Stage, StageOptions};
use crate::options::Precision;

/// The part of a model that only kind `reduced` has; the tables are in [`crate::prior::PriorTable`].
#[derive(HeldBytes)]
pub struct ReducedModel {
    /// The learned map; none in a bundle that was made without training.
    pub learned: Option<LearnedMap>,
}

/// The correction network.
#[derive(HeldBytes)]
pub struct LearnedMap {
    /// The manifest's entry.
    #[held(skip)]
    pub entry: ReducedEntry,
    /// Precision of the graph: float32, float16 or int8.
    #[held(skip)]
    pub precision: Precision,
    #[held(skip)]
    runtime: &'static Runtime,
    file: String,
    latent: Vec<u8>,
}

impl ReducedModel {
    /// Reads the correction network, where the bundle has one, and makes a session once, so that what is wrong with it shows
    /// at load. `runtime` is called for a network only.
    pub fn open(
        files: &BundleFiles,
        runtime: impl FnOnce() -> Result<&'static Runtime>,
        plan: &ProviderPlan,
        precision: Precision,
    ) -> Result<(ReducedModel, ProviderChoice)> {
        let Some(entry) = files.manifest.reduced.clone() else {
            let choice = plan.without_graph(&files.manifest.name)?;
            if !matches!(precision, Precision::F32) {
                files.graph_file("latent", precision)?;
            }
            return Ok((ReducedModel { learned: None }, choice));
        };
        let file = files.graph_file("latent", precision)?;
        let map = LearnedMap {
            entry,
            precision,
            runtime: runtime()?,
            latent: files.read(&file)?,
            file,
        };
        let choice = map.stage(plan)?.choice().clone();
        Ok((ReducedModel { learned: Some(map) }, choice))
    }

    /// Precision of the graph; float32 without one.
    pub fn precision(&self) -> Precision {
        self.learned
            .as_ref()
            .map_or(Precision::F32, |map| map.precision)
    }
}

impl LearnedMap {
    /// A session of `latent.onnx`: `state [1,n_in]` -> `b_next [1,r]`, mm. One thread: the network is tiny.
    pub fn stage(&self, plan: &ProviderPlan) -> Result<Stage> {
        Stage::new(
            self.runtime,
            &self.file,
            &self.latent,
            &[("state", &[1, self.entry.input_width()])],
            &[("b_next", &[1, self.entry.modes])],
            &StageOptions {
                threads: 1,
                plan: plan.clone(),
            },
        )
    }
}
