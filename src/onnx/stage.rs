//! A stage: one graph with tensors of fixed shape, bound once and run many times.
//!
//! On the CPU the host writes the bound input tensors in place and a run copies nothing and allocates nothing of ours.

use ort::AsPointer;
use ort::memory::Allocator;
use ort::session::builder::SessionBuilder;
use ort::session::{IoBinding, Session};
use ort::value::{Tensor, ValueType};

use super::placement;
use super::providers::{ProviderChoice, ProviderPlan, Wish};
use super::runtime::Runtime;
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

/// One graph, its session and its bound tensors.
pub struct Stage {
    // Dropped before the session that it was made from.
    binding: IoBinding,
    session: Session,
    input_names: Vec<String>,
    inputs: Vec<Tensor<f32>>,
    indices: Vec<(String, Tensor<i64>)>,
    outputs: Vec<Tensor<f32>>,
    choice: ProviderChoice,
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
        Stage::with_indices(runtime, file, bytes, inputs, &[], outputs, options)
    }

    /// As [`Stage::new`], with further int64 inputs `[n]` that stay the same in every run.
    pub fn with_indices(
        runtime: &'static Runtime,
        file: &str,
        bytes: &[u8],
        inputs: &[(&str, &[usize])],
        indices: &[(&str, &[i64])],
        outputs: &[(&str, &[usize])],
        options: &StageOptions,
    ) -> Result<Stage> {
        let _span = tracing::debug_span!("session", file).entered();
        let mut invalid = None;
        let made = options.plan.choose(|_, wish| {
            let mut builder = configure(runtime, options, wish)?;
            builder.commit_from_memory(bytes).map_err(|error| {
                if error.code() == ort::ErrorCode::InvalidProtobuf
                    || error.code() == ort::ErrorCode::InvalidGraph
                {
                    invalid = Some(error.to_string());
                }
                error.to_string()
            })
        });
        if let Some(cause) = invalid {
            return Err(Error::bundle(file, format!("not a valid graph: {cause}")));
        }
        let (session, mut choice) = made?;
        choice.nodes = placement::nodes_by_provider(&session);
        check_names(file, "input", session.inputs(), inputs, indices.len())?;
        check_names(file, "output", session.outputs(), outputs, 0)?;
        let tensors = |list: &[(&str, &[usize])]| {
            list.iter()
                .map(|(_, shape)| Tensor::<f32>::new(&Allocator::default(), shape.to_vec()))
                .collect::<ort::Result<Vec<_>>>()
                .map_err(|error| Error::Runtime(error.to_string()))
        };
        let mut stage = Stage {
            binding: session
                .create_binding()
                .map_err(|error| Error::Runtime(error.to_string()))?,
            input_names: inputs.iter().map(|(name, _)| name.to_string()).collect(),
            inputs: tensors(inputs)?,
            indices: indices
                .iter()
                .map(|(name, values)| {
                    let tensor = Tensor::from_array(([values.len()], values.to_vec()));
                    Ok((
                        name.to_string(),
                        tensor.map_err(|error| Error::Runtime(error.to_string()))?,
                    ))
                })
                .collect::<Result<_>>()?,
            outputs: tensors(outputs)?,
            session,
            choice,
            file: file.to_owned(),
        };
        for tensor in &mut stage.inputs {
            tensor.extract_tensor_mut().1.fill(0.0);
        }
        stage.bind_inputs()?;
        stage.bind_indices()?;
        for ((name, _), tensor) in outputs.iter().zip(&mut stage.outputs) {
            stage
                .binding
                .bind_output(*name, tensor)
                .map_err(|error| Error::Runtime(format!("{file}: {error}")))?;
        }
        Ok(stage)
    }

    /// Binds the inputs that the host writes; on a device this makes the device's copy of each.
    fn bind_inputs(&mut self) -> Result<()> {
        for (name, tensor) in self.input_names.iter().zip(&self.inputs) {
            self.binding
                .bind_input(name.as_str(), tensor)
                .map_err(|error| Error::Runtime(format!("{}: {error}", self.file)))?;
        }
        Ok(())
    }

    /// Binds the inputs that never change, once: they stay on the device.
    fn bind_indices(&mut self) -> Result<()> {
        for (name, tensor) in &self.indices {
            self.binding
                .bind_input(name.as_str(), tensor)
                .map_err(|error| Error::Runtime(format!("{}: {error}", self.file)))?;
        }
        Ok(())
    }

    /// Input `index`, to be written before a run.
    pub fn input(&mut self, index: usize) -> &mut [f32] {
        self.inputs[index].extract_tensor_mut().1
    }

    /// Output `index` of the last run.
    pub fn output(&self, index: usize) -> &[f32] {
        self.outputs[index].extract_tensor().1
    }

    /// What runs this stage.
    pub fn choice(&self) -> &ProviderChoice {
        &self.choice
    }

    /// Runs the graph.
    pub fn run(&mut self) -> Result<()> {
        if self.choice.provider != Provider::Cpu {
            self.bind_inputs()?;
            return match self.session.run_binding(&self.binding) {
                Ok(_) => Ok(()),
                Err(error) => Err(Error::Runtime(format!("{}: {error}", self.file))),
            };
        }
        let api = ort::api();
        let session = self.session.inner();
        // SAFETY: session and binding are alive; `&mut self` makes this the only run of the session.
        let status = unsafe {
            (api.RunWithBinding)(
                AsPointer::ptr(&*session).cast_mut(),
                std::ptr::null(),
                AsPointer::ptr(&self.binding),
            )
        };
        drop(session);
        if status.0.is_null() {
            return Ok(());
        }
        // SAFETY: a status that is not null holds a message and is released once.
        let message = unsafe {
            let text = std::ffi::CStr::from_ptr((api.GetErrorMessage)(status.0));
            let text = text.to_string_lossy().into_owned();
            (api.ReleaseStatus)(status.0);
            text
        };
        Err(Error::Runtime(format!("{}: {message}", self.file)))
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
        Wish::Cpu => Ok(builder),
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

fn check_names(
    file: &str,
    what: &str,
    have: &[ort::value::Outlet],
    want: &[(&str, &[usize])],
    others: usize,
) -> Result<()> {
    let names: Vec<&str> = have.iter().map(|outlet| outlet.name()).collect();
    for (name, shape) in want {
        let Some(outlet) = have.iter().find(|outlet| outlet.name() == *name) else {
            return Err(Error::bundle(
                file,
                format!("{what} `{name}` is missing, the graph has {names:?}"),
            ));
        };
        let ValueType::Tensor {
            ty,
            shape: declared,
            ..
        } = outlet.dtype()
        else {
            return Err(Error::bundle(
                file,
                format!("{what} `{name}` is not a tensor"),
            ));
        };
        if *ty != ort::value::TensorElementType::Float32 {
            return Err(Error::bundle(
                file,
                format!("{what} `{name}` has type {ty:?}, must be float32"),
            ));
        }
        let fits = declared.len() == shape.len()
            && declared
                .iter()
                .zip(shape.iter())
                .all(|(&have, &want)| have < 0 || have == want as i64);
        if !fits {
            return Err(Error::bundle(
                file,
                format!("{what} `{name}` has shape {declared:?}, must hold {shape:?}"),
            ));
        }
    }
    if what == "input" && have.len() != want.len() + others {
        return Err(Error::bundle(
            file,
            format!("the graph has inputs {names:?}, must have {}", want.len()),
        ));
    }
    Ok(())
}
