//! A stage: one graph with tensors of fixed shape, bound once and run many times.
//!
//! The host writes the inputs in place. On the CPU a run copies nothing; on a device it copies the inputs there and the
//! outputs back ([`super::memory`]). Neither allocates anything of ours.

mod make;

use std::sync::Arc;
use std::time::Instant;

use ort::AsPointer;
use ort::session::{IoBinding, Session};
use ort::value::Tensor;

use super::memory::{Memory, copy};
use super::runtime::Runtime;
use super::status;
use crate::error::{Error, Result};
use crate::memory::HeldBytes;
use crate::onnx::{ProviderChoice, StageTimes};
use crate::options::Provider;

/// A tensor of the host's and its counterpart on a device.
struct Buffer {
    /// Of the graph's input or output: what it is bound by.
    name: String,
    /// What the rest of the library writes before a run or reads after it; pinned where the session
    /// offers such memory.
    host: Tensor<f32>,
    /// Bound in its place, at an address that stays for the stage's life; none in the host's
    /// memory.
    device: Option<Tensor<f32>>,
}

/// One graph, its session, which other stages on the CPU share, and its own bound tensors.
pub struct Stage {
    // Dropped before the session that it was made from.
    binding: IoBinding,
    /// In the order in which the stage was asked for them, which is what [`Stage::input`] counts
    /// by.
    inputs: Vec<Buffer>,
    /// Likewise for [`Stage::output`].
    outputs: Vec<Buffer>,
    /// On the CPU it is shared with the model's other stages of this graph, so that weights lie in
    /// memory once; what a run needs for itself is the binding.
    session: Arc<Session>,
    /// Of inputs that were bound once and whose tensors the binding owns: no field here holds them.
    constant_bytes: usize,
    /// How the tensors get to the session, chosen when it was made.
    memory: Memory,
    /// Its environment makes the copies between host and device.
    runtime: &'static Runtime,
    /// Which provider was taken, and why those before it were not.
    choice: ProviderChoice,
    /// Of the last run, ms; zero before the first.
    times: StageTimes,
    /// The graph's name, for messages.
    file: String,
}

/// What a graph's run or its copies failed with.
fn failed(file: &str, cause: &dyn std::fmt::Display) -> Error {
    status::of_onnx(format!("{file}: {cause}"), Error::Runtime)
}

impl Stage {
    /// Input `index`, to be written before a run.
    pub fn input(&mut self, index: usize) -> &mut [f32] {
        self.inputs[index].host.extract_tensor_mut().1
    }

    /// Output `index` of the last run.
    pub fn output(&self, index: usize) -> &[f32] {
        self.outputs[index].host.extract_tensor().1
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
    ///
    /// Called when a scene is made, so that none of its steps pays for it. The outputs mean nothing
    /// afterwards.
    pub fn warm_up(&mut self) -> Result<()> {
        if self.choice.provider != Provider::Cpu {
            (0..3).try_for_each(|_| self.run())?;
        }
        Ok(())
    }

    /// Runs the graph.
    ///
    /// The three parts are timed apart, because only the middle one is the provider's: on a small
    /// graph the copies to a card and back can cost more than what they save. On an error the
    /// outputs hold whatever was written, and the caller keeps the last state.
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
        failed(&self.file, &cause)
    }

    /// Makes the host's inputs visible to the session. Nothing on the CPU, where the session reads
    /// them in place.
    fn upload(&mut self) -> Result<()> {
        match self.memory {
            Memory::Host => Ok(()),
            Memory::Rebound => {
                for input in &self.inputs {
                    self.binding
                        .bind_input(input.name.as_str(), &input.host)
                        .map_err(|error| failed(&self.file, &error))?;
                }
                self.binding
                    .synchronize_inputs()
                    .map_err(|error| self.failed(error))
            }
            Memory::Device { .. } => {
                for input in &mut self.inputs {
                    if let Some(device) = &mut input.device {
                        copy(self.runtime, &input.host, device)
                            .map_err(|error| failed(&self.file, &error))?;
                    }
                }
                Ok(())
            }
        }
    }

    /// The run itself, by the C interface: the wrapper's call asks for a session that is borrowed
    /// for writing, which one that is shared between stages cannot give.
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

    /// Copies the outputs to the host's tensors, where they lie on a device.
    fn download(&mut self) -> Result<()> {
        for output in &mut self.outputs {
            if let Some(device) = &output.device {
                copy(self.runtime, device, &mut output.host)
                    .map_err(|error| failed(&self.file, &error))?;
            }
        }
        Ok(())
    }
}

/// Of the host's tensors; the session is the model's.
impl HeldBytes for Stage {
    fn held_bytes(&self) -> usize {
        let buffers = self.inputs.iter().chain(&self.outputs);
        let floats: usize = buffers.map(|b| b.host.extract_tensor().1.len()).sum();
        4 * floats + self.constant_bytes
    }
}

#[cfg(test)]
mod tests;
