//! ONNX Runtime's GPU providers: whether the loaded library offers one, and what it is told.
//!
//! Each provider is built with `error_on_failure`: without it a session is made although its
//! provider fails, and a model would run on the CPU while it says that it runs on a card. An error
//! instead sends [`crate::onnx::ProviderPlan`] on to the next one of the host's list, and its
//! reason is kept. A stream of the host's is given on as an address; the promise that it lives as
//! long as the model was made where the `UserStream` was.

use ort::ep::{self, ExecutionProvider};

use super::plugin;
use super::runtime::Runtime;
use super::wish::Wish;
use crate::options::Precision;
use crate::options::{ModelOptions, Provider};

/// Why this build or the loaded library cannot offer a provider; `None` when they may.
pub(super) fn missing(provider: Provider) -> Option<String> {
    match provider {
        Provider::Cpu => None,
        Provider::Cuda => not_offered(provider, ep::CUDA::is_available()),
        Provider::TensorRt => not_offered(provider, ep::TensorRT::is_available()),
        Provider::TensorRtRtx if built_in_rtx() => None,
        Provider::TensorRtRtx => {
            let path = crate::library::current().onnxruntime_path;
            let registered = Runtime::get(path.as_deref())
                .map_err(|error| error.to_string())
                .and_then(plugin::available);
            registered.err()
        }
    }
}

/// The reason that goes with the library's answer. That a provider was built in does not yet mean
/// that the machine has a card for it: making the session tells.
fn not_offered(provider: Provider, available: ort::Result<bool>) -> Option<String> {
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
fn built_in_rtx() -> bool {
    ep::NVRTX::is_available().unwrap_or(false)
}

/// What a provider is told that is not missing; compiled engines are kept in the folder `cache`.
///
/// TensorRT-RTX has two ways in, as a built-in provider and as a plugin, whose options have other
/// names.
pub(super) fn wish(
    options: &ModelOptions,
    provider: Provider,
    cache: Option<String>,
) -> Result<Wish, String> {
    match (provider, options, cache) {
        (Provider::Cpu, ..) => Ok(Wish::Cpu),
        (Provider::Cuda, options, _) => Ok(cuda(options)),
        (Provider::TensorRt, options, cache) => Ok(tensorrt(options, cache)),
        (Provider::TensorRtRtx, options, cache) if built_in_rtx() => {
            Ok(tensorrt_rtx(options, cache))
        }
        (Provider::TensorRtRtx, options, cache) => {
            Ok(Wish::Plugin(plugin::NAME, plugin_options(options, cache)))
        }
    }
}

/// TF32 rounds the factors of products to 10 bits of mantissa, so it is the host that allows it. A
/// memory limit of 0 is none.
fn cuda(options: &ModelOptions) -> Wish {
    let mut cuda = ep::CUDA::default()
        .with_device_id(options.device_id)
        .with_tf32(options.allow_tf32)
        .with_cuda_graph(options.cuda_graph);
    if options.gpu_memory_limit > 0 {
        cuda = cuda.with_memory_limit(options.gpu_memory_limit as usize);
    }
    if let Some(stream) = options.user_stream {
        // SAFETY: whoever made the `UserStream` promised that the stream outlives the model.
        cuda = unsafe { cuda.with_compute_stream(stream.address() as *mut ()) };
    }
    Wish::Builtin(cuda.build().error_on_failure())
}

/// The timing cache lies in the folder of the engines: one that has to be built again is built from
/// times that are known.
fn tensorrt(options: &ModelOptions, cache: Option<String>) -> Wish {
    let mut trt = ep::TensorRT::default()
        .with_device_id(options.device_id)
        .with_fp16(options.precision == Some(Precision::F16))
        .with_cuda_graph(options.cuda_graph);
    if let Some(cache) = cache {
        trt = trt
            .with_engine_cache(true)
            .with_engine_cache_path(&cache)
            .with_timing_cache(true)
            .with_timing_cache_path(&cache);
    }
    if let Some(stream) = options.user_stream {
        // SAFETY: as for CUDA.
        trt = unsafe { trt.with_compute_stream(stream.address() as *mut ()) };
    }
    Wish::Builtin(trt.build().error_on_failure())
}

/// It is told nothing of precision, which is the graph's own. Its devices are counted without a
/// sign here, and a negative number becomes the first.
fn tensorrt_rtx(options: &ModelOptions, cache: Option<String>) -> Wish {
    let mut rtx = ep::NVRTX::default()
        .with_device_id(options.device_id.max(0) as u32)
        .with_cuda_graph(options.cuda_graph);
    if let Some(cache) = cache {
        rtx = rtx.with_runtime_cache_path(cache);
    }
    if let Some(stream) = options.user_stream {
        // SAFETY: as for CUDA.
        rtx = unsafe { rtx.with_compute_stream(stream.address() as *mut ()) };
    }
    Wish::Builtin(rtx.build().error_on_failure())
}

/// Options of the TensorRT-RTX plugin, each with the provider's name before it.
fn plugin_options(options: &ModelOptions, cache: Option<String>) -> Vec<(String, String)> {
    let mut list = vec![(
        "enable_cuda_graph",
        if options.cuda_graph { "1" } else { "0" }.to_owned(),
    )];
    list.extend(cache.map(|folder| ("nv_runtime_cache_path", folder)));
    if let Some(stream) = options.user_stream {
        list.push(("has_user_compute_stream", "1".to_owned()));
        list.push(("user_compute_stream", stream.address().to_string()));
    }
    list.into_iter()
        .map(|(key, value)| (format!("{}.{key}", plugin::NAME), value))
        .collect()
}
