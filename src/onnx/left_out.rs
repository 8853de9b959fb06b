//! What stands for ONNX Runtime in a build without the feature `learned`: types without a value, and the reason.

use std::path::Path;

use super::{ProviderChoice, StageOptions, StageTimes, Tensors};
use crate::error::{Error, Result};
use crate::features::{Feature, Learned};
use crate::memory::HeldBytes;
use crate::options::Provider;

/// There is none.
#[derive(Debug)]
enum Never {}

/// The library, which is never loaded.
#[derive(Debug)]
pub struct Runtime(Never);

/// A stage, which is never made.
#[derive(Debug)]
pub struct Stage(Never);

/// The sessions of a model, of which there are none.
#[derive(Debug, Clone, Default)]
pub(super) struct Sessions(());

impl Runtime {
    /// No runtime.
    ///
    /// # Errors
    /// Always [`Error::Unsupported`].
    pub fn get(_explicit: Option<&Path>) -> Result<&'static Runtime> {
        Err(Error::Unsupported(Learned::MISSING.into()))
    }

    /// Whether the library has been loaded.
    pub fn is_loaded() -> bool {
        false
    }

    /// File that was loaded.
    pub fn path(&self) -> &Path {
        match self.0 {}
    }

    /// Version of the library.
    pub fn version(&self) -> &str {
        match self.0 {}
    }
}

impl Stage {
    /// As in a build with the feature.
    pub fn new(
        runtime: &'static Runtime,
        _file: &str,
        _bytes: &[u8],
        _inputs: &[(&str, &[usize])],
        _outputs: &[(&str, &[usize])],
        _options: &StageOptions,
    ) -> Result<Stage> {
        match runtime.0 {}
    }

    /// As in a build with the feature.
    pub fn with_constants(
        runtime: &'static Runtime,
        _file: &str,
        _bytes: &[u8],
        _tensors: &Tensors<'_>,
        _options: &StageOptions,
    ) -> Result<Stage> {
        match runtime.0 {}
    }

    /// Input `index`, to be written before a run.
    pub fn input(&mut self, _index: usize) -> &mut [f32] {
        match self.0 {}
    }

    /// Output `index` of the last run.
    pub fn output(&self, _index: usize) -> &[f32] {
        match self.0 {}
    }

    /// What runs this stage.
    pub fn choice(&self) -> &ProviderChoice {
        match self.0 {}
    }

    /// Wall times of the last run.
    pub fn times(&self) -> StageTimes {
        match self.0 {}
    }

    /// A device's first runs.
    pub fn warm_up(&mut self) -> Result<()> {
        match self.0 {}
    }

    /// Runs the graph.
    pub fn run(&mut self) -> Result<()> {
        match self.0 {}
    }
}

/// Of the host's tensors; the session is the model's.
impl HeldBytes for Stage {
    fn held_bytes(&self) -> usize {
        match self.0 {}
    }
}

/// JSON list of providers, none of which is available: `[{"name","available","reason"}]`.
///
/// # Errors
/// None.
pub fn providers_json() -> Result<String> {
    let list: Vec<serde_json::Value> = Provider::ALL
        .into_iter()
        .map(|provider| {
            serde_json::json!({
                "name": provider.name(), "available": false, "reason": Learned::MISSING,
            })
        })
        .collect();
    Ok(serde_json::Value::Array(list).to_string())
}
