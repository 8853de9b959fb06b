//! What the decoder computes in, and what this machine can.

use super::amx;
use lanes::Isa;

/// Arithmetic of the matrix products.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DecoderPrecision {
    /// f32 throughout.
    F32,
    /// bf16 operands, f32 sums, on vectors (`vdpbf16ps`); f32 where the machine lacks it
    /// ([`Isa::has_bf16`]). Error about 3e-3 of the output's size: opt-in.
    Bf16Vectors,
    /// The same on matrix tiles (Intel AMX); f32 where the machine or the system has none.
    Bf16Tiles,
}

impl DecoderPrecision {
    /// All that this machine runs, f32 first.
    pub fn available() -> Vec<DecoderPrecision> {
        [
            DecoderPrecision::F32,
            DecoderPrecision::Bf16Vectors,
            DecoderPrecision::Bf16Tiles,
        ]
        .into_iter()
        .filter(|precision| precision.is_available())
        .collect()
    }

    /// Whether this machine runs it.
    pub fn is_available(self) -> bool {
        match self {
            DecoderPrecision::F32 => true,
            DecoderPrecision::Bf16Vectors => Isa::has_bf16(),
            DecoderPrecision::Bf16Tiles => amx::is_available(),
        }
    }

    /// What a scene runs that asks for bf16: matrix tiles, else vectors on CPUs whose `vdpbf16ps` is faster than f32 (AMD since
    /// Zen 4), else f32. By the CPU's kind, not by a stopwatch: the same machine gives the same bits each time.
    pub fn fastest_bf16() -> DecoderPrecision {
        if amx::is_available() {
            DecoderPrecision::Bf16Tiles
        } else if Isa::has_bf16() && is_amd() {
            DecoderPrecision::Bf16Vectors
        } else {
            DecoderPrecision::F32
        }
    }
}

fn is_amd() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        let id = core::arch::x86_64::__cpuid(0);
        let name = [id.ebx, id.edx, id.ecx].map(u32::to_le_bytes).concat();
        name == b"AuthenticAMD"
    }
    #[cfg(not(target_arch = "x86_64"))]
    {
        false
    }
}
