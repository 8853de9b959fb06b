//! Where a stage's tensors lie: in the host's memory, which the CPU provider reads in place, or on a device, with pinned
//! staging on the host and explicit copies, so that a captured CUDA graph meets the same addresses in every run.

use ort::AsPointer;
use ort::memory::{AllocationDevice, Allocator, AllocatorType, MemoryInfo, MemoryType};
use ort::session::Session;
use ort::value::Tensor;

use super::runtime::Runtime;
use super::status;
use crate::options::Provider;

/// How a stage's tensors reach its session.
pub(super) enum Memory {
    /// The host's tensors are bound and read in place.
    Host,
    /// The host's tensors are bound anew before each run, and ONNX Runtime makes the device's copy.
    Rebound,
    /// Tensors on the device stay bound; the host's, pinned where the session offers it, are copied from and to them.
    Device {
        /// Allocator of the host's side.
        staging: Allocator,
        /// Allocator of the device's side.
        device: Allocator,
    },
}

impl Memory {
    /// The best that `session` on `provider` offers, and why it is not [`Memory::Device`] on a GPU.
    pub fn of(
        runtime: &'static Runtime,
        session: &Session,
        provider: Provider,
        device_id: i32,
    ) -> (Memory, Option<String>) {
        // The CPU provider works in the host's memory: a copy would be the same bytes twice.
        if provider == Provider::Cpu {
            return (Memory::Host, None);
        }
        match on_device(runtime, session, device_id) {
            Ok(memory) => (memory, None),
            Err(reason) => {
                tracing::warn!(
                    provider = provider.name(),
                    reason,
                    "tensors are bound anew in each run"
                );
                (Memory::Rebound, Some(reason))
            }
        }
    }

    /// Both sides in the host's memory: the device's code path without a device.
    #[cfg(test)]
    pub fn staged_on_the_host() -> Memory {
        Memory::Device {
            staging: Allocator::default(),
            device: Allocator::default(),
        }
    }

    /// Name for the description of a model.
    pub fn name(&self) -> &'static str {
        match self {
            Memory::Host => "host",
            Memory::Rebound => "bound anew in each run",
            Memory::Device { .. } => "device",
        }
    }

    /// A tensor of the host, zero, and its counterpart on the device where there is one.
    pub fn pair(&self, shape: &[usize]) -> Result<(Tensor<f32>, Option<Tensor<f32>>), String> {
        let text = |error: ort::Error| error.to_string();
        let (mut host, device) = match self {
            Memory::Host | Memory::Rebound => {
                let host = Tensor::<f32>::new(&Allocator::default(), shape.to_vec());
                (host.map_err(text)?, None)
            }
            Memory::Device { staging, device } => (
                Tensor::<f32>::new(staging, shape.to_vec()).map_err(text)?,
                Some(Tensor::<f32>::new(device, shape.to_vec()).map_err(text)?),
            ),
        };
        host.extract_tensor_mut().1.fill(0.0);
        Ok((host, device))
    }
}

/// CUDA's device memory and pinned memory through the session's allocators, tried with one small round trip.
///
/// That an allocator can be had does not mean that copies work; four floats that come back as they
/// were sent show that they do. Memory that is not pinned is slower and no reason to give up.
fn on_device(
    runtime: &'static Runtime,
    session: &Session,
    device_id: i32,
) -> Result<Memory, String> {
    let allocator = |device, kind| {
        MemoryInfo::new(device, device_id, AllocatorType::Device, kind)
            .and_then(|info| Allocator::new(session, info))
            .map_err(|error| error.to_string())
    };
    runtime.offer_cuda_copies()?;
    let device = allocator(AllocationDevice::CUDA, MemoryType::Default)?;
    let staging = allocator(AllocationDevice::CUDA_PINNED, MemoryType::CPUOutput)
        .inspect_err(|reason| tracing::debug!(reason, "staging memory is not pinned"))
        .unwrap_or_default();
    let memory = Memory::Device { staging, device };
    round_trip(runtime, &memory)?;
    Ok(memory)
}

/// Four floats to the device and back.
pub(super) fn round_trip(runtime: &'static Runtime, memory: &Memory) -> Result<(), String> {
    let (mut there, device) = memory.pair(&[4])?;
    let (mut back, _) = memory.pair(&[4])?;
    let Some(mut device) = device else {
        return Ok(());
    };
    let sent = [1.0, -2.0, 3.5, 1e-3];
    there.extract_tensor_mut().1.copy_from_slice(&sent);
    copy(runtime, &there, &mut device)?;
    copy(runtime, &device, &mut back)?;
    // A copy changes no bit, and none of the numbers is the zero that a fresh tensor holds.
    if back.extract_tensor_mut().1 == sent {
        return Ok(());
    }
    Err("a copy to the device and back gave other values".into())
}

/// Copies a tensor's values into another of the same shape, on whatever device each lies, and waits for it.
pub(super) fn copy(
    runtime: &'static Runtime,
    from: &Tensor<f32>,
    into: &mut Tensor<f32>,
) -> Result<(), String> {
    if from.memory_info().is_cpu_accessible() && into.memory_info().is_cpu_accessible() {
        // ONNX Runtime has no copy within the host's memory.
        let (shape, values) = from.extract_tensor();
        let (target_shape, target) = into.extract_tensor_mut();
        if shape != target_shape {
            return Err(format!(
                "a tensor of shape {shape} does not fit one of {target_shape}"
            ));
        }
        target.copy_from_slice(values);
        return Ok(());
    }
    let source = AsPointer::ptr(from);
    let mut target = AsPointer::ptr(&*into);
    // SAFETY: both tensors are alive and of one type; `into` is borrowed for writing; no stream means that the call
    // returns when the copy is done. The environment is only read.
    unsafe {
        status::check((ort::api().CopyTensors)(
            AsPointer::ptr(&runtime.environment).cast_mut(),
            &source,
            &mut target,
            std::ptr::null_mut(),
            1,
        ))
    }
}
