//! What a bundle's fields and a host's options may be: the same bounds for both.

use serde::{Deserialize, Serialize};

/// Arithmetic of the heavy stages (values of `UPT_PRECISION_*`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[repr(i32)]
pub enum Precision {
    /// Plain float32.
    F32 = 0,
    /// bfloat16 products, float32 sums, on CPUs that have them.
    Bf16 = 1,
    /// float16 tables or graphs.
    F16 = 2,
    /// int8 weights, where the bundle carries `*.int8.onnx`.
    Int8 = 3,
}

/// Most corrections of a step.
pub const MOST_CORRECTIONS: u32 = 64;
/// Most substeps of a step.
pub const MOST_SUBSTEPS: u32 = 8;
/// The shortest step that a host or a bundle may ask for, s.
pub const SHORTEST_STEP_S: f64 = 0.01;
/// The longest step, s.
pub const LONGEST_STEP_S: f64 = 0.05;
/// The largest gravity, in each direction, m/s².
pub const LARGEST_GRAVITY: f32 = 1e3;
/// The smallest mass-proportional damping, 1/s.
pub const SMALLEST_DAMPING_PER_S: f64 = 0.01;
/// The largest damping, 1/s.
pub const LARGEST_DAMPING_PER_S: f64 = 1000.0;
