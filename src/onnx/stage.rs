//! A stage: one graph with tensors of fixed shape, bound once and run many times.
//!
//! The host writes the inputs in place. On the CPU a run copies nothing; on a device it copies the inputs there and the
//! outputs back ([`super::memory`]). Neither allocates anything of ours.

use std::sync::Arc;
use std::time::Instant;

use ort::AsPointer;
use ort::memory::Allocator;
use ort::session::builder::SessionBuilder;
use ort::session::{IoBinding, Session};
use ort::value::Tensor;

use super::graph::Tensors;
use super::memory::{Memory, copy};
use super::providers::{ProviderChoice, ProviderPlan, Wish};
use super::runtime::Runtime;
use super::{placement, status};
use crate::error::{Error, Result};
use crate::options::Provider;

/// How a stage's session is made.
#[derive(Debug, Clone)]
pub struct StageOptions {
    /// Threads of the session's own pool, the caller included.
    pub threads: usize,
    /// Providers to try.
    pub plan: ProviderPlan,
}

/// Wall time of the last run, ms.
#[derive(Debug, Clone, Copy, Default)]
pub struct StageTimes {
    /// Inputs to the device; 0 on the CPU.
    pub upload: f64,
    /// The graph. Where tensors are bound anew in each run it holds the way of the outputs back.
    pub compute: f64,
    /// Outputs back; 0 on the CPU.
    pub download: f64,
}

/// A tensor of the host's and its counterpart on a device.
struct Buffer {
    name: String,
    host: Tensor<f32>,
    device: Option<Tensor<f32>>,
}

/// One graph, its session, which other stages on the CPU share, and its own bound tensors.
pub struct Stage {
    // Dropped before the session that it was made from.
    binding: IoBinding,
    inputs: Vec<Buffer>,
    outputs: Vec<Buffer>,
    session: Arc<Session>,
    constant_bytes: usize,
    memory: Memory,
    runtime: &'static Runtime,
    choice: ProviderChoice,
    times: StageTimes,
    file: String,
}

impl Stage {
    /// Makes a session of the graph `bytes` and binds float32 tensors of the given names and shapes.
    ///
    /// # Errors
    /// [`Error::Bundle`] when the graph does not have these inputs and outputs, [`Error::Provider`] when no provider
    /// of the plan can run it.
    pub fn new(
        runtime: &'static Runtime,
        file: &str,
        bytes: &[u8],
        inputs: &[(&str, &[usize])],
        outputs: &[(&str, &[usize])],
        options: &StageOptions,
    ) -> Result<Stage> {
        let tensors = Tensors {
            inputs,
            outputs,
            ..Tensors::default()
        };
        Stage::with_constants(runtime, file, bytes, &tensors, options)
    }

    /// As [`Stage::new`], with inputs that stay the same in every run.
    pub fn with_constants(
        runtime: &'static Runtime,
        file: &str,
        bytes: &[u8],
        tensors: &Tensors<'_>,
        options: &StageOptions,
    ) -> Result<Stage> {
        let _span = tracing::debug_span!("session", file).entered();
        let mut invalid = None;
        let key = (file.to_owned(), options.threads);
        if let Some((session, choice)) = options.plan.sessions.find(&key) {
            return Stage::bind(runtime, file, tensors, session, Memory::Host, choice);
        }
        let made = options.plan.choose(file, bytes, tensors, |provider, wish| {
            let mut builder = configure(runtime, options, wish)?;
            let session = builder.commit_from_memory(bytes).map_err(|error| {
                if error.code() == ort::ErrorCode::InvalidProtobuf
                    || error.code() == ort::ErrorCode::InvalidGraph
                {
                    invalid = Some(error.to_string());
                }
                error.to_string()
            })?;
            let memory = options.plan.memory(runtime, &session, provider)?;
            Ok((session, memory))
        });
        if let Some(cause) = invalid {
            return Err(Error::bundle(file, format!("not a valid graph: {cause}")));
        }
        let ((session, memory), mut choice) = made?;
        choice.nodes = placement::nodes_by_provider(&session);
        choice.memory = memory.name();
        let session = Arc::new(session);
        if choice.provider == Provider::Cpu {
            options.plan.sessions.keep(key, &session, &choice);
        }
        Stage::bind(runtime, file, tensors, session, memory, choice)
    }

    fn bind(
        runtime: &'static Runtime,
        file: &str,
        tensors: &Tensors<'_>,
        session: Arc<Session>,
        memory: Memory,
        choice: ProviderChoice,
    ) -> Result<Stage> {
        tensors.check(file, &session)?;
        let failed = |error: &dyn std::fmt::Display| Error::Runtime(format!("{file}: {error}"));
        let buffers = |list: &[(&str, &[usize])]| {
            list.iter()
                .map(|(name, shape)| {
                    let (host, device) = memory.pair(shape).map_err(|error| failed(&error))?;
                    Ok(Buffer {
                        name: name.to_string(),
                        host,
                        device,
                    })
                })
                .collect::<Result<Vec<_>>>()
        };
        let (inputs, mut outputs) = (buffers(tensors.inputs)?, buffers(tensors.outputs)?);
        let mut binding = session.create_binding().map_err(|error| failed(&error))?;
        for input in &inputs {
            binding
                .bind_input(
                    input.name.as_str(),
                    input.device.as_ref().unwrap_or(&input.host),
                )
                .map_err(|error| failed(&error))?;
        }
        for &(name, shape, values) in tensors.constants {
            let mut tensor = Tensor::<f32>::new(&Allocator::default(), shape.to_vec())
                .map_err(|error| failed(&error))?;
            tensor.extract_tensor_mut().1.copy_from_slice(values);
            binding
                .bind_input(name, &tensor)
                .map_err(|error| failed(&error))?;
        }
        for &(name, shape, values) in tensors.indices {
            let mut tensor = Tensor::<i64>::new(&Allocator::default(), shape.to_vec())
                .map_err(|error| failed(&error))?;
            tensor.extract_tensor_mut().1.copy_from_slice(values);
            binding
                .bind_input(name, &tensor)
                .map_err(|error| failed(&error))?;
        }
        for output in &mut outputs {
            let bound = match &mut output.device {
                Some(device) => binding.bind_output(output.name.as_str(), device),
                None => binding.bind_output(output.name.as_str(), &mut output.host),
            };
            bound.map_err(|error| failed(&error))?;
        }
        binding
            .synchronize_inputs()
            .map_err(|error| failed(&error))?;
        let constants = tensors.constants.iter().map(|part| 4 * part.2.len());
        let indices = tensors.indices.iter().map(|part| 8 * part.2.len());
        Ok(Stage {
            constant_bytes: constants.chain(indices).sum(),
            binding,
            inputs,
            outputs,
            session,
            memory,
            runtime,
            choice,
            times: StageTimes::default(),
            file: file.to_owned(),
        })
    }

    /// Input `index`, to be written before a run.
    pub fn input(&mut self, index: usize) -> &mut [f32] {
        self.inputs[index].host.extract_tensor_mut().1
    }

    /// Output `index` of the last run.
    pub fn output(&self, index: usize) -> &[f32] {
        self.outputs[index].host.extract_tensor().1
    }

    /// Bytes of the host's tensors. The session is the model's.
    pub fn memory_bytes(&self) -> usize {
        let buffers = self.inputs.iter().chain(&self.outputs);
        let floats: usize = buffers.map(|b| b.host.extract_tensor().1.len()).sum();
        4 * floats + self.constant_bytes
    }

    /// What runs this stage.
    pub fn choice(&self) -> &ProviderChoice {
        &self.choice
    }

    /// Wall times of the last run.
    pub fn times(&self) -> StageTimes {
        self.times
    }

    /// A device's first runs, on the inputs as they are: kernels are loaded, engines built, a CUDA graph captured.
    pub fn warm_up(&mut self) -> Result<()> {
        if self.choice.provider != Provider::Cpu {
            (0..3).try_for_each(|_| self.run())?;
        }
        Ok(())
    }

    /// Runs the graph.
    pub fn run(&mut self) -> Result<()> {
        let start = Instant::now();
        let since = |start: Instant| start.elapsed().as_secs_f64() * 1e3;
        self.upload()?;
        self.times.upload = since(start);
        let start = Instant::now();
        self.compute()?;
        self.times.compute = since(start);
        let start = Instant::now();
        self.download()?;
        self.times.download = since(start);
        Ok(())
    }

    fn failed(&self, cause: impl std::fmt::Display) -> Error {
        Error::Runtime(format!("{}: {cause}", self.file))
    }

    fn upload(&mut self) -> Result<()> {
        match self.memory {
            Memory::Host => Ok(()),
            Memory::Rebound => {
                for input in &self.inputs {
                    self.binding
                        .bind_input(input.name.as_str(), &input.host)
                        .map_err(|error| Error::Runtime(format!("{}: {error}", self.file)))?;
                }
                self.binding
                    .synchronize_inputs()
                    .map_err(|error| self.failed(error))
            }
            Memory::Device { .. } => {
                for input in &mut self.inputs {
                    if let Some(device) = &mut input.device {
                        copy(self.runtime, &input.host, device)
                            .map_err(|error| Error::Runtime(format!("{}: {error}", self.file)))?;
                    }
                }
                Ok(())
            }
        }
    }

    fn compute(&mut self) -> Result<()> {
        let session = self.session.inner();
        // SAFETY: session and binding are alive; `&mut self` makes this the only run of the binding. A session takes runs of
        // several threads at once.
        let outcome = unsafe {
            status::check((ort::api().RunWithBinding)(
                AsPointer::ptr(&*session).cast_mut(),
                std::ptr::null(),
                AsPointer::ptr(&self.binding),
            ))
        };
        drop(session);
        outcome.map_err(|error| self.failed(error))
    }

    fn download(&mut self) -> Result<()> {
        for output in &mut self.outputs {
            if let Some(device) = &output.device {
                copy(self.runtime, device, &mut output.host)
                    .map_err(|error| Error::Runtime(format!("{}: {error}", self.file)))?;
            }
        }
        Ok(())
    }
}

/// A session's options: its threads do not spin between runs and flush denormals.
fn configure(
    runtime: &'static Runtime,
    options: &StageOptions,
    wish: Wish,
) -> std::result::Result<SessionBuilder, String> {
    let text = |error: ort::Error<SessionBuilder>| error.to_string();
    let builder = Session::builder(&runtime.environment)
        .map_err(|error| error.to_string())?
        .with_intra_threads(options.threads.max(1))
        .map_err(text)?
        .with_inter_threads(1)
        .map_err(text)?
        .with_config_entry("session.force_spinning_stop", "1")
        .map_err(text)?
        .with_config_entry("session.set_denormal_as_zero", "1")
        .map_err(text)?
        .with_config_entry(placement::RECORD, "1")
        .map_err(text)?;
    match wish {
        // With the shapes of a stage fixed, the arena finds its own blocks again; a pattern would hold as much once more.
        Wish::Cpu => builder.with_memory_pattern(false).map_err(text),
        #[cfg(any(feature = "cuda", feature = "tensorrt", feature = "tensorrt-rtx"))]
        Wish::Builtin(dispatch) => builder.with_execution_providers([dispatch]).map_err(text),
        #[cfg(feature = "tensorrt-rtx")]
        Wish::Plugin(name, settings) => {
            let devices = runtime.environment.devices();
            builder
                .with_devices(
                    devices.filter(|d| d.ep().is_ok_and(|ep| ep == name)),
                    Some(&settings),
                )
                .map_err(text)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::memory::round_trip;
    use super::*;

    const FILE: &str = "latent.onnx";

    fn runtime() -> &'static Runtime {
        Runtime::get(None).expect("ONNX Runtime: set ORT_DYLIB_PATH or run `cargo xtask ort`")
    }

    fn stage(memory: Memory) -> Stage {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/tiny-reduced/");
        let manifest = std::fs::read(format!("{folder}bundle.json")).unwrap();
        let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
        let bytes = std::fs::read(format!("{folder}{FILE}")).unwrap();
        let options = StageOptions {
            threads: 1,
            plan: ProviderPlan::cpu(),
        };
        let session = configure(runtime(), &options, Wish::Cpu)
            .unwrap()
            .commit_from_memory(&bytes)
            .unwrap();
        let width = |outlet: &ort::value::Outlet| {
            let ort::value::ValueType::Tensor { shape, .. } = outlet.dtype() else {
                panic!("not a tensor")
            };
            shape[1] as usize
        };
        let (n, r) = (
            width(&session.inputs()[0]),
            manifest["reduced"]["modes"].as_u64().unwrap() as usize,
        );
        let tensors = Tensors {
            inputs: &[("state", &[1, n])],
            outputs: &[("b_next", &[1, r])],
            ..Tensors::default()
        };
        let choice = ProviderChoice::cpu();
        Stage::bind(runtime(), FILE, &tensors, Arc::new(session), memory, choice).unwrap()
    }

    fn outputs(stage: &mut Stage) -> Vec<u32> {
        let mut bits = Vec::new();
        for t in 0..4 {
            for (i, x) in stage.input(0).iter_mut().enumerate() {
                *x = ((i + 7 * t) as f32 * 0.37).sin();
            }
            stage.run().unwrap();
            bits.extend(stage.output(0).iter().map(|x| x.to_bits()));
        }
        bits
    }

    /// The copies of a device's path, with both sides in the host's memory.
    #[test]
    fn staged_and_rebound_tensors_give_the_bits_of_bound_ones() {
        round_trip(runtime(), &Memory::staged_on_the_host()).unwrap();
        let want = outputs(&mut stage(Memory::Host));
        assert!(want.iter().any(|&bits| f32::from_bits(bits).abs() > 1e-3));
        assert_eq!(outputs(&mut stage(Memory::staged_on_the_host())), want);
        assert_eq!(outputs(&mut stage(Memory::Rebound)), want);
    }

    #[test]
    fn a_copy_into_another_shape_is_an_error() {
        let host = Memory::Host;
        let (four, _) = host.pair(&[4]).unwrap();
        let (mut six, _) = host.pair(&[2, 3]).unwrap();
        let error = copy(runtime(), &four, &mut six).unwrap_err();
        assert!(error.contains("[4]"), "{error}");
    }
}
