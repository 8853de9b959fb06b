//! What a configuration of a bundle is chosen from: nodes, precision, provider.

use upt::ffi;

/// Which nodes a step returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Region {
    All,
    Surface,
    Domain,
}

impl Region {
    pub const ALL: [Region; 3] = [Region::All, Region::Surface, Region::Domain];

    pub fn name(self) -> &'static str {
        match self {
            Region::All => "all",
            Region::Surface => "surface",
            Region::Domain => "domain",
        }
    }
}

/// Arithmetic of the graphs and kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    F32,
    Bf16,
    F16,
    Int8,
}

impl Precision {
    pub const ALL: [Precision; 4] = [
        Precision::F32,
        Precision::Bf16,
        Precision::F16,
        Precision::Int8,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Precision::F32 => "f32",
            Precision::Bf16 => "bf16",
            Precision::F16 => "f16",
            Precision::Int8 => "int8",
        }
    }

    /// The ABI's constant.
    pub fn code(self) -> i32 {
        match self {
            Precision::F32 => ffi::UPT_PRECISION_F32,
            Precision::Bf16 => ffi::UPT_PRECISION_BF16,
            Precision::F16 => ffi::UPT_PRECISION_F16,
            Precision::Int8 => ffi::UPT_PRECISION_INT8,
        }
    }
}

/// What runs the latent stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Provider {
    Cpu,
    Cuda,
    Tensorrt,
    TensorrtRtx,
}

impl Provider {
    pub const ALL: [Provider; 4] = [
        Provider::Cpu,
        Provider::Cuda,
        Provider::Tensorrt,
        Provider::TensorrtRtx,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Provider::Cpu => "cpu",
            Provider::Cuda => "cuda",
            Provider::Tensorrt => "tensorrt",
            Provider::TensorrtRtx => "tensorrt-rtx",
        }
    }

    /// The ABI's constant.
    pub fn code(self) -> i32 {
        match self {
            Provider::Cpu => ffi::UPT_PROVIDER_CPU,
            Provider::Cuda => ffi::UPT_PROVIDER_CUDA,
            Provider::Tensorrt => ffi::UPT_PROVIDER_TENSORRT,
            Provider::TensorrtRtx => ffi::UPT_PROVIDER_TENSORRT_RTX,
        }
    }
}
