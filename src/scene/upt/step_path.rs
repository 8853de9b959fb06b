//! Who makes a step of a `upt` bundle: the split (native encoder and message mean, `latent.onnx`, decoder) or
//! `step.onnx`. On the CPU the split is taken, whose kernels were measured faster there; on a device both are timed on
//! the scene's own mesh while it is made, and the faster one stays. The first runs are a device's warm-up as well:
//! kernels are loaded and engines built before the first step.

use crate::clock::Instant;
use std::sync::Arc;

use super::{Choice, UptEngine};
use crate::error::Result;
use crate::kernels::{Compute, Pool};
use crate::memory;
use crate::model::{Model, UptModel, UptTables};
use crate::options::{DecoderKernel, Precision, Provider, SceneOptions, StepPath};
use crate::scene::inputs::Which;

/// Runs before the timed ones: a CUDA graph is captured in the second.
const WARM_UP: usize = 3;
/// Timed runs of each path, in turns.
const TIMED: usize = 7;

/// What a scene's engine is made of.
pub struct Parts<'a> {
    pub model: &'a Model,
    pub kind: &'a Arc<UptModel>,
    pub tables: &'a Arc<UptTables>,
    pub pool: &'a Pool,
    /// Of the scene's mesh, which may be one of the host's own.
    pub node_count: usize,
}

impl Parts<'_> {
    /// The engine on the path that the options ask for.
    ///
    /// # Errors
    /// [`crate::Error::Unsupported`] for [`StepPath::Whole`] without `step.onnx`, and what making sessions gives.
    pub fn engine(&self, options: &SceneOptions) -> Result<UptEngine> {
        let on_cpu = self.model.info().provider == Provider::Cpu;
        let kernel = match options.kernel {
            // The native kernel has float32 and bfloat16 only.
            DecoderKernel::Auto if on_cpu && self.kind.precision == Precision::F32 => {
                DecoderKernel::Native
            }
            DecoderKernel::Auto if on_cpu => DecoderKernel::Onnx,
            DecoderKernel::Auto => DecoderKernel::Resident,
            kernel => kernel,
        };
        let precision = options.precision.unwrap_or(self.model.execution.precision);
        let make = |whole| {
            let choice = Choice {
                whole,
                kernel,
                precision,
            };
            UptEngine::new(
                self.model,
                self.kind,
                self.tables,
                self.pool,
                self.node_count,
                choice,
            )
        };
        let measured = match options.step_path {
            StepPath::Split => false,
            StepPath::Whole => return self.warm(make(true)?, on_cpu),
            StepPath::Auto => !on_cpu,
            StepPath::Measured => true,
        };
        let split = make(false)?;
        if !measured || !self.kind.has_step() {
            return self.warm(split, on_cpu);
        }
        match make(true) {
            Ok(whole) if provider(&whole) == provider(&split) => self.faster(split, whole),
            Ok(whole) => {
                tracing::info!(
                    step = provider(&whole).name(),
                    latent = provider(&split).name(),
                    "step.onnx is not used: another provider would run it"
                );
                self.warm(split, on_cpu)
            }
            Err(error) => {
                tracing::warn!(%error, "step.onnx is not used");
                self.warm(split, on_cpu)
            }
        }
    }

    /// A device's first runs load kernels and build engines.
    fn warm(&self, mut engine: UptEngine, on_cpu: bool) -> Result<UptEngine> {
        let mut field = memory::zeros(3 * self.node_count, "a timed step")?;
        for _ in 0..if on_cpu { 0 } else { WARM_UP } {
            self.time(&mut engine, &mut field)?;
        }
        Ok(engine)
    }

    /// The path whose median is shorter; both are timed in turns, so that what else the device does meets both. The other
    /// one's sessions are dropped.
    fn faster(&self, mut split: UptEngine, mut whole: UptEngine) -> Result<UptEngine> {
        let mut field = memory::zeros(3 * self.node_count, "a timed step")?;
        let (mut split_ms, mut whole_ms) = (Vec::new(), Vec::new());
        for turn in 0..WARM_UP + TIMED {
            let times = [
                self.time(&mut split, &mut field)?,
                self.time(&mut whole, &mut field)?,
            ];
            if turn >= WARM_UP {
                split_ms.push(times[0]);
                whole_ms.push(times[1]);
            }
        }
        let (split_ms, whole_ms) = (median(split_ms), median(whole_ms));
        let taken = if whole_ms < split_ms { &whole } else { &split };
        tracing::info!(split_ms, whole_ms, taken = ?taken.path(), "step path measured");
        Ok(if whole_ms < split_ms { whole } else { split })
    }

    /// Milliseconds of the network and of decoding every node, at rest.
    fn time(&self, engine: &mut UptEngine, field: &mut [f32]) -> Result<f64> {
        let compute = Compute {
            isa: self.model.execution.isa,
            pool: self.pool,
        };
        let nodes = memory::collected(self.node_count, 0..self.node_count as u32, "a timed step")?;
        let start = Instant::now();
        engine.network(compute)?;
        engine.decode_mesh(compute, Which::Next, &nodes, field)?;
        Ok(start.elapsed().as_secs_f64() * 1e3)
    }
}

/// What runs the engine's network: paths are compared only where it is the same.
fn provider(engine: &UptEngine) -> Provider {
    engine.stage().choice().provider
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_slow_run_does_not_decide() {
        assert_eq!(median(vec![2.0, 90.0, 1.0]), 2.0);
    }
}
