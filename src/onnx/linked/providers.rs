//! Execution providers: which are tried for a session, in order, and which this machine offers.
//!
//! A model's options name providers in the order of preference. A provider is asked three things
//! one after the other: whether this build and the loaded library have it, whether its options can
//! be met, and whether it makes a session of the graph. The first that says yes to all is taken;
//! the reasons of the others are kept, because a host that asked for a card and got the CPU wants
//! to know why.

use std::collections::BTreeMap;

use ort::session::Session;

use super::engine_cache::{engine_folder, engine_key};
use super::gpu;
use super::memory::Memory;
use super::runtime::Runtime;
use super::status::of_onnx;
use super::wish::Wish;
use crate::error::{Error, Result};
use crate::library;
use crate::onnx::{ProviderChoice, ProviderPlan, Tensors};
use crate::options::{Precision, Provider};

impl ProviderPlan {
    /// Calls `make` with one provider after the other until one works.
    pub(super) fn choose<T>(
        &self,
        file: &str,
        graph: &[u8],
        tensors: &Tensors<'_>,
        mut make: impl FnMut(Provider, Wish) -> std::result::Result<T, String>,
    ) -> Result<(T, ProviderChoice)> {
        let mut refused = Vec::new();
        // The list has the CPU in it where fallback is on: then only a graph that no provider can
        // run leaves this loop without a session.
        for &provider in &self.options.providers {
            let made = self
                .wish(provider, file, graph, tensors)
                .and_then(|wish| make(provider, wish));
            match made {
                Ok(value) => {
                    let choice = ProviderChoice {
                        provider,
                        nodes: BTreeMap::new(),
                        memory: "host",
                        refused,
                    };
                    return Ok((value, choice));
                }
                Err(reason) => {
                    tracing::warn!(provider = provider.name(), reason, "provider not taken");
                    refused.push((provider, reason));
                }
            }
        }
        let list: Vec<String> = refused
            .iter()
            .map(|(provider, reason)| format!("{}: {reason}", provider.name()))
            .collect();
        // All reasons in one message: the first alone often says only that a library is missing,
        // and the last only that the CPU was not asked.
        let note = match self.options.fallback {
            true => "",
            false => " (fallback is off)",
        };
        Err(of_onnx(
            format!("{}{note}", list.join("; ")),
            Error::Provider,
        ))
    }

    /// Where the tensors of a session lie.
    ///
    /// # Errors
    /// A CUDA graph was asked for and the tensors have no fixed addresses on the device.
    ///
    /// Memory bound anew in each run is good enough otherwise, but a captured graph replays the
    /// addresses that it was captured with: with other tensors it would read and write freed
    /// memory.
    pub(super) fn memory(
        &self,
        runtime: &'static Runtime,
        session: &Session,
        provider: Provider,
    ) -> std::result::Result<Memory, String> {
        let (memory, missing) = Memory::of(runtime, session, provider, self.options.device_id);
        match missing {
            Some(reason) if self.options.cuda_graph => Err(format!(
                "cuda_graph needs tensors of fixed address on the card, which are not available: {reason}"
            )),
            _ => Ok(memory),
        }
    }

    /// Folder of this session's compiled engines, which is made.
    ///
    /// An engine is of one graph, one set of shapes, one precision, one card and one version of
    /// ONNX Runtime; all of them go into the folder's name, so that a bundle that is replaced in
    /// place cannot meet the engine of the one before it. `Ok(None)` where the host named no
    /// folder: then each session is compiled again, and the host waits for it.
    fn engine_cache(
        &self,
        provider: Provider,
        file: &str,
        graph: &[u8],
        tensors: &Tensors<'_>,
    ) -> std::result::Result<Option<String>, String> {
        let Some(dir) = &self.options.cache_dir else {
            return Ok(None);
        };
        let runtime = Runtime::get(library::current().onnxruntime_path.as_deref())
            .map_err(|error| error.to_string())?;
        // The precision is named here and not left to the graph: TensorRT makes float16 engines of
        // a float32 graph, too.
        let fp16 = self.options.precision == Some(Precision::F16);
        let key = engine_key(&[
            provider.name(),
            runtime.version(),
            &format!("device {} fp16 {fp16}", self.options.device_id),
            &tensors.shapes(),
        ]);
        let folder = dir.join(engine_folder(file, graph, key));
        std::fs::create_dir_all(&folder)
            .map_err(|error| format!("cache_dir {}: {error}", folder.display()))?;
        Ok(Some(folder.display().to_string()))
    }

    /// What a session is asked for, or why this machine has no such provider. The cheap question
    /// comes first: a folder is made only for a provider that is there.
    fn wish(
        &self,
        provider: Provider,
        file: &str,
        graph: &[u8],
        tensors: &Tensors<'_>,
    ) -> std::result::Result<Wish, String> {
        if let Some(reason) = gpu::missing(provider) {
            return Err(reason);
        }
        let cache = match provider {
            Provider::Cpu | Provider::Cuda => None,
            Provider::TensorRt | Provider::TensorRtRtx => {
                self.engine_cache(provider, file, graph, tensors)?
            }
        };
        gpu::wish(&self.options, provider, cache)
    }
}

/// JSON list of providers: `[{"name","available","reason"}]`. Loads ONNX Runtime.
pub fn providers_json() -> Result<String> {
    let runtime = Runtime::get(library::current().onnxruntime_path.as_deref())?;
    let list: Vec<serde_json::Value> = Provider::ALL
    .into_iter()
    .map(|provider| {
        let reason = gpu::missing(provider);
        serde_json::json!({
            "name": provider.name(),
            "available": reason.is_none(),
            "reason": reason.unwrap_or_else(|| format!("offered by {}", runtime.path().display())),
        })
    })
    .collect();
    Ok(serde_json::Value::Array(list).to_string())
}
