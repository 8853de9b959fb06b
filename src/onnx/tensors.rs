//! What a stage binds to its graph, how its session is made, and how long a run took.

use super::plan::ProviderPlan;

/// Names and shapes of a graph's tensors.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tensors<'a> {
    /// Float32 inputs that the host writes before a run.
    pub inputs: &'a [(&'a str, &'a [usize])],
    /// Float32 inputs that stay the same in every run, with their values: on a device they are copied there once.
    pub constants: &'a [(&'a str, &'a [usize], &'a [f32])],
    /// Int64 inputs that stay the same in every run, with their values.
    pub indices: &'a [(&'a str, &'a [usize], &'a [i64])],
    /// Float32 outputs.
    pub outputs: &'a [(&'a str, &'a [usize])],
}

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
