//! Execution providers: an ordered wish, what really runs, and why the others do not.

use std::collections::BTreeMap;
use std::path::PathBuf;

use ort::ep::{self, ExecutionProvider, ExecutionProviderDispatch};

use ort::session::Session;

use super::engine_cache::{engine_folder, engine_key};
use super::graph::Tensors;
use super::memory::Memory;
#[cfg(feature = "tensorrt-rtx")]
use super::plugin;
use super::runtime::Runtime;
use crate::error::{Error, Result};
use crate::library;
use crate::options::{ModelOptions, Precision, Provider, UserStream};

impl Provider {
    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Provider::Cpu => "cpu",
            Provider::Cuda => "cuda",
            Provider::TensorRt => "tensorrt",
            Provider::TensorRtRtx => "tensorrt-rtx",
        }
    }
}

/// Which providers to try for a session, with their options.
#[derive(Debug, Clone)]
pub struct ProviderPlan {
    order: Vec<Provider>,
    device_id: i32,
    memory_limit: u64,
    cache_dir: Option<PathBuf>,
    allow_tf32: bool,
    cuda_graph: bool,
    user_stream: Option<UserStream>,
    fp16: bool,
    fallback: bool,
}

/// How a session is told which provider to use.
pub(super) enum Wish {
    /// Nothing to tell: the CPU.
    Cpu,
    /// A provider of the library.
    Builtin(ExecutionProviderDispatch),
    /// The devices that a plugin provider offers, and its options.
    #[cfg(feature = "tensorrt-rtx")]
    Plugin(&'static str, Vec<(String, String)>),
}

/// What runs a session and why providers before it in the list do not.
#[derive(Debug, Clone)]
pub struct ProviderChoice {
    /// What runs.
    pub provider: Provider,
    /// Nodes of the session's graph by ONNX Runtime's name of the provider that runs them: a GPU provider may leave
    /// some to the CPU. Empty where the library does not tell.
    pub nodes: BTreeMap<String, usize>,
    /// Where the stage's tensors lie: `host`, `device`, or `bound anew in each run` where device memory is not to be had.
    pub memory: &'static str,
    /// Provider and reason, for each that was asked for and not taken.
    pub refused: Vec<(Provider, String)>,
}

impl ProviderChoice {
    /// The CPU, which nobody refused.
    #[cfg(test)]
    pub(super) fn cpu() -> ProviderChoice {
        ProviderChoice {
            provider: Provider::Cpu,
            nodes: BTreeMap::new(),
            memory: "host",
            refused: Vec::new(),
        }
    }
}

impl ProviderPlan {
    /// The plan of a model's options.
    pub fn new(options: &ModelOptions) -> ProviderPlan {
        let mut order = options.providers.clone();
        let fallback = !options.no_fallback;
        if order.is_empty() || (fallback && !order.contains(&Provider::Cpu)) {
            order.push(Provider::Cpu);
        }
        ProviderPlan {
            order,
            device_id: options.device_id,
            memory_limit: options.gpu_memory_limit,
            cache_dir: options.cache_dir.clone(),
            allow_tf32: options.allow_tf32,
            cuda_graph: options.cuda_graph,
            user_stream: options.user_stream,
            fp16: options.precision == Some(Precision::F16),
            fallback,
        }
    }

    /// The CPU alone.
    pub fn cpu() -> ProviderPlan {
        ProviderPlan::new(&ModelOptions::default())
    }

    /// Calls `make` with one provider after the other until one works.
    pub(super) fn choose<T>(
        &self,
        file: &str,
        graph: &[u8],
        tensors: &Tensors<'_>,
        mut make: impl FnMut(Provider, Wish) -> std::result::Result<T, String>,
    ) -> Result<(T, ProviderChoice)> {
        let mut refused = Vec::new();
        for &provider in &self.order {
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
        let note = if self.fallback {
            ""
        } else {
            " (no_fallback is set)"
        };
        Err(Error::Provider(format!("{}{note}", list.join("; "))))
    }

    /// Where the tensors of a session lie.
    ///
    /// # Errors
    /// A CUDA graph was asked for and the tensors have no fixed addresses on the device.
    pub(super) fn memory(
        &self,
        runtime: &'static Runtime,
        session: &Session,
        provider: Provider,
    ) -> std::result::Result<Memory, String> {
        let (memory, missing) = Memory::of(runtime, session, provider, self.device_id);
        match missing {
            Some(reason) if self.cuda_graph => Err(format!(
                "cuda_graph needs tensors of fixed address on the card, which are not to be had: {reason}"
            )),
            _ => Ok(memory),
        }
    }

    fn wish(
        &self,
        provider: Provider,
        file: &str,
        graph: &[u8],
        tensors: &Tensors<'_>,
    ) -> std::result::Result<Wish, String> {
        if provider == Provider::Cpu {
            return Ok(Wish::Cpu);
        }
        if let Some(reason) = missing(provider) {
            return Err(reason);
        }
        let runtime = Runtime::get(library::current().onnxruntime_path.as_deref())
            .map_err(|error| error.to_string())?;
        let folder = self.cache_dir.as_ref().map(|dir| {
            let key = engine_key(&[
                provider.name(),
                runtime.version(),
                &format!("device {} fp16 {}", self.device_id, self.fp16),
                &tensors.shapes(),
            ]);
            dir.join(engine_folder(file, graph, key))
        });
        if let Some(dir) = &folder {
            std::fs::create_dir_all(dir)
                .map_err(|error| format!("cache_dir {}: {error}", dir.display()))?;
        }
        let cache = folder.map(|dir| dir.display().to_string());
        let dispatch: ExecutionProviderDispatch = match provider {
            Provider::Cpu => return Ok(Wish::Cpu),
            #[cfg(feature = "cuda")]
            Provider::Cuda => {
                let mut cuda = ep::CUDA::default()
                    .with_device_id(self.device_id)
                    .with_tf32(self.allow_tf32)
                    .with_cuda_graph(self.cuda_graph);
                if self.memory_limit > 0 {
                    cuda = cuda.with_memory_limit(self.memory_limit as usize);
                }
                if let Some(stream) = self.user_stream {
                    // SAFETY: whoever made the `UserStream` promised that the stream outlives the model.
                    cuda = unsafe { cuda.with_compute_stream(stream.handle()) };
                }
                cuda.build()
            }
            #[cfg(feature = "tensorrt")]
            Provider::TensorRt => {
                let mut trt = ep::TensorRT::default()
                    .with_device_id(self.device_id)
                    .with_fp16(self.fp16)
                    .with_cuda_graph(self.cuda_graph);
                if let Some(cache) = cache {
                    trt = trt
                        .with_engine_cache(true)
                        .with_engine_cache_path(&cache)
                        .with_timing_cache(true)
                        .with_timing_cache_path(&cache);
                }
                if let Some(stream) = self.user_stream {
                    // SAFETY: as above.
                    trt = unsafe { trt.with_compute_stream(stream.handle()) };
                }
                trt.build()
            }
            #[cfg(feature = "tensorrt-rtx")]
            Provider::TensorRtRtx if !built_in_rtx() => {
                return Ok(Wish::Plugin(plugin::NAME, self.plugin_options(cache)));
            }
            #[cfg(feature = "tensorrt-rtx")]
            Provider::TensorRtRtx => {
                let mut rtx = ep::NVRTX::default()
                    .with_device_id(self.device_id.max(0) as u32)
                    .with_cuda_graph(self.cuda_graph);
                if let Some(cache) = cache {
                    rtx = rtx.with_runtime_cache_path(cache);
                }
                if let Some(stream) = self.user_stream {
                    // SAFETY: as above.
                    rtx = unsafe { rtx.with_compute_stream(stream.handle()) };
                }
                rtx.build()
            }
            #[cfg(not(all(feature = "cuda", feature = "tensorrt", feature = "tensorrt-rtx")))]
            _ => unreachable!("`missing` refuses providers of features that are off"),
        };
        Ok(Wish::Builtin(dispatch.error_on_failure()))
    }

    /// Options of the TensorRT-RTX plugin, each with the provider's name before it.
    #[cfg(feature = "tensorrt-rtx")]
    fn plugin_options(&self, cache: Option<String>) -> Vec<(String, String)> {
        let mut options = vec![(
            "enable_cuda_graph",
            if self.cuda_graph { "1" } else { "0" }.to_owned(),
        )];
        options.extend(cache.map(|folder| ("nv_runtime_cache_path", folder)));
        if let Some(stream) = self.user_stream {
            options.push(("has_user_compute_stream", "1".to_owned()));
            options.push(("user_compute_stream", stream.address().to_string()));
        }
        options
            .into_iter()
            .map(|(key, value)| (format!("{}.{key}", plugin::NAME), value))
            .collect()
    }
}

/// Why this build or the loaded library cannot offer a provider; `None` when they may.
fn missing(provider: Provider) -> Option<String> {
    let available: ort::Result<bool> = match provider {
        Provider::Cpu => return None,
        #[cfg(feature = "cuda")]
        Provider::Cuda => ep::CUDA::is_available(),
        #[cfg(feature = "tensorrt")]
        Provider::TensorRt => ep::TensorRT::is_available(),
        #[cfg(feature = "tensorrt-rtx")]
        Provider::TensorRtRtx if built_in_rtx() => return None,
        #[cfg(feature = "tensorrt-rtx")]
        Provider::TensorRtRtx => {
            let registered = Runtime::get(library::current().onnxruntime_path.as_deref())
                .map_err(|error| error.to_string())
                .and_then(plugin::available);
            return registered.err();
        }
        #[cfg(not(all(feature = "cuda", feature = "tensorrt", feature = "tensorrt-rtx")))]
        _ => {
            return Some(format!(
                "this build lacks the feature `{}`",
                provider.name()
            ));
        }
    };
    match available {
        Ok(true) => None,
        Ok(false) => Some(format!(
            "the loaded ONNX Runtime was built without the {} provider",
            provider.name()
        )),
        Err(error) => Some(error.to_string()),
    }
}

/// Whether the loaded library itself holds TensorRT-RTX; otherwise it is a plugin.
#[cfg(feature = "tensorrt-rtx")]
fn built_in_rtx() -> bool {
    ep::NVRTX::is_available().unwrap_or(false)
}

/// JSON list of providers: `[{"name","available","reason"}]`. Loads ONNX Runtime.
pub fn providers_json() -> Result<String> {
    let runtime = Runtime::get(library::current().onnxruntime_path.as_deref())?;
    let list: Vec<serde_json::Value> = [
        Provider::Cpu,
        Provider::Cuda,
        Provider::TensorRt,
        Provider::TensorRtRtx,
    ]
    .into_iter()
    .map(|provider| {
        let reason = missing(provider);
        serde_json::json!({
            "name": provider.name(),
            "available": reason.is_none(),
            "reason": reason.unwrap_or_else(|| format!("offered by {}", runtime.path().display())),
        })
    })
    .collect();
    Ok(serde_json::Value::Array(list).to_string())
}
