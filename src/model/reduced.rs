//! Kind `reduced`: linear response plus a learned correction of the residual state `b` in a static basis.

use crate::bundle::{BundleFiles, ReducedEntry};
use crate::error::{Error, Result};
use crate::onnx::{ProviderChoice, ProviderPlan, Runtime, Stage, StageOptions};
use crate::options::Precision;

/// The part of a model that only kind `reduced` has; the tables are in [`crate::prior::PriorTable`].
pub struct ReducedModel {
    /// The manifest's entry.
    pub entry: ReducedEntry,
    /// Precision of the graph: float32, float16 or int8.
    pub precision: Precision,
    file: String,
    latent: Vec<u8>,
}

impl ReducedModel {
    /// Reads the correction network and makes a session once, so that what is wrong with it shows at load.
    pub fn open(
        files: &BundleFiles,
        runtime: &'static Runtime,
        plan: &ProviderPlan,
        precision: Precision,
    ) -> Result<(ReducedModel, ProviderChoice)> {
        let entry = files
            .manifest
            .reduced
            .clone()
            .ok_or_else(|| Error::bundle("bundle.json", "field `reduced` is missing"))?;
        let file = files.graph_file("latent", precision)?;
        let model = ReducedModel {
            entry,
            precision,
            latent: files.read(&file)?,
            file,
        };
        let stage = model.stage(runtime, plan)?;
        Ok((model, stage.choice().clone()))
    }

    /// A session of `latent.onnx`: `state [1,n_in]` -> `b_next [1,r]`, mm. One thread: the network is tiny.
    pub fn stage(&self, runtime: &'static Runtime, plan: &ProviderPlan) -> Result<Stage> {
        Stage::new(
            runtime,
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

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.latent.len()
    }
}
