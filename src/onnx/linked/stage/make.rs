//! How a stage comes to be: a session of its graph on the first provider that can run it, or the session that another stage
//! on the CPU has of it, and tensors bound to it.
//!
//! Only sessions on the CPU are shared. There a session is weights and a plan, which many runs may
//! use at once; on a card it also owns a stream and perhaps a captured graph with the addresses of
//! one binding. Sessions are found again by the graph's file and by the number of threads, since a
//! session's threads are its own.

use std::sync::Arc;

use ort::memory::Allocator;
use ort::session::Session;
use ort::session::builder::SessionBuilder;
use ort::value::Tensor;

use super::{Buffer, Stage};
use crate::error::{Error, Result};
use crate::onnx::linked::memory::Memory;
use crate::onnx::linked::placement;
use crate::onnx::linked::runtime::Runtime;
use crate::onnx::linked::wish::Wish;
use crate::onnx::{ProviderChoice, StageOptions, StageTimes, Tensors};
use crate::options::Provider;

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
        // A graph that cannot be read is the bundle's fault and not a provider's. It is remembered
        // here, because inside of `choose` it looks like one more refusal.
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
        // How many nodes each provider took: one that gave half of the graph back to the CPU is a
        // choice that a host should see.
        choice.nodes = placement::nodes_by_provider(&session);
        choice.memory = memory.name();
        let session = Arc::new(session);
        if choice.provider == Provider::Cpu {
            options.plan.sessions.keep(key, &session, &choice);
        }
        Stage::bind(runtime, file, tensors, session, memory, choice)
    }

    /// Makes the tensors and binds them to a session that is there.
    ///
    /// Inputs and outputs keep their tensors in the stage, which writes and reads them; constants
    /// and indices are bound and then owned by the binding alone. Everything that a run needs is
    /// allocated here, and a run allocates nothing of ours.
    pub(super) fn bind(
        runtime: &'static Runtime,
        file: &str,
        tensors: &Tensors<'_>,
        session: Arc<Session>,
        memory: Memory,
        choice: ProviderChoice,
    ) -> Result<Stage> {
        tensors.check(file, &session)?;
        let failed = |error: &dyn std::fmt::Display| super::failed(file, error);
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
            // On a device the constants lie there from now on: later runs upload only what the
            // stage wrote.
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
}

/// A session's options: its threads do not spin between runs and flush denormals.
///
/// Threads that spin would take the cores from the scene's own pool between two steps. Denormals
/// are flushed because an ordinary product is many times faster than one with them, and near rest
/// activations may be that small. Operators run one after another, each on all of the session's
/// threads.
pub(super) fn configure(
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
        Wish::Builtin(dispatch) => builder.with_execution_providers([dispatch]).map_err(text),
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
