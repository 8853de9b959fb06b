//! Which vector instructions this machine runs: found once, by [`Isa::detect`]. The kernels take
//! an `Isa` argument, so that tests and benches can ask for any that the machine has.

use std::sync::OnceLock;

/// An instruction set that the kernels are compiled for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Isa {
    /// What [`Isa::Portable`] computes, in plain Rust: for x86-64 processors without AVX2, and for comparisons.
    PortableScalar,
    /// Eight lanes and no fused multiply-add, by the instructions that are there: the same bits on every machine.
    Portable,
    /// Plain Rust: the readable reference, right everywhere.
    Scalar,
    /// 128-bit SIMD of WebAssembly, for which a module is compiled or not.
    Simd128,
    /// 128-bit Advanced SIMD (AArch64).
    Neon,
    /// 256-bit AVX2 with FMA and F16C (x86-64).
    Avx2,
    /// 512-bit AVX-512 F, BW, DQ, VL (x86-64).
    Avx512,
}

/// What [`Isa::detect`] has found.
static BEST: OnceLock<Isa> = OnceLock::new();

impl Isa {
    /// Every set, slowest first.
    /// [`Isa::detect`] takes the last that the machine has, so the portable ones stand before
    /// [`Isa::Scalar`]: nobody gets them who did not ask.
    const ALL: [Isa; 7] = [
        Isa::PortableScalar,
        Isa::Portable,
        Isa::Scalar,
        Isa::Simd128,
        Isa::Neon,
        Isa::Avx2,
        Isa::Avx512,
    ];

    /// The best of this machine. The environment variable `UPT_ISA` (`scalar`, `neon`, `avx2`,
    /// `avx512`, `simd128`, `portable`, `portable-scalar`) lowers it, for comparisons; a set that the machine lacks is ignored.
    /// All scenes of a process see the same answer, whichever thread asks first.
    pub fn detect() -> Self {
        *BEST.get_or_init(|| {
            let asked = std::env::var("UPT_ISA").ok().and_then(|s| Self::parse(&s));
            match asked {
                Some(isa) if isa.is_available() => isa,
                _ => Self::available().last().copied().unwrap_or(Isa::Scalar),
            }
        })
    }

    /// The set for the same bits on every machine: [`Isa::Portable`], or [`Isa::PortableScalar`] where the machine lacks that or `UPT_ISA`
    /// is `scalar`.
    /// Steps of a model that was opened with the option `portable` run on it
    /// (docs/decisions/041-portable-bits.md).
    pub fn portable() -> Self {
        match Isa::detect() {
            Isa::Scalar | Isa::PortableScalar if Isa::PortableScalar.is_available() => {
                Isa::PortableScalar
            }
            _ if Isa::Portable.is_available() => Isa::Portable,
            _ => Isa::PortableScalar,
        }
    }

    /// Whether its bits are those of every machine.
    pub fn is_portable(self) -> bool {
        matches!(self, Isa::Portable | Isa::PortableScalar)
    }

    /// Makes this set the one that is found, for hosts without an environment; false where the machine lacks it, or another was found
    /// before.
    pub fn choose(self) -> bool {
        self.is_available() && *BEST.get_or_init(|| self) == self
    }

    /// All sets that this machine runs, slowest first; `Scalar` is always there.
    pub fn available() -> Vec<Self> {
        let all = Self::ALL.into_iter();
        all.filter(|isa| isa.is_available()).collect()
    }

    /// Whether this machine runs the set.
    pub fn is_available(self) -> bool {
        match self {
            Isa::Scalar => true,
            // Elsewhere there are always lanes.
            Isa::PortableScalar => !crate::HAS_LANES,
            Isa::Portable => {
                crate::HAS_LANES || cfg!(target_arch = "x86_64") && Isa::Avx2.is_available()
            }
            Isa::Simd128 => cfg!(all(target_arch = "wasm32", target_feature = "simd128")),
            #[cfg(target_arch = "aarch64")]
            Isa::Neon => std::arch::is_aarch64_feature_detected!("neon"),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2 => {
                is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("fma")
                    && is_x86_feature_detected!("f16c")
            }
            #[cfg(target_arch = "x86_64")]
            Isa::Avx512 => {
                Isa::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
            }
            #[allow(unreachable_patterns)]
            _ => false,
        }
    }

    /// Whether the machine multiplies bf16 pairs (`vdpbf16ps`) and `UPT_ISA` does not forbid it; the bf16 decoder needs it.
    pub fn has_bf16() -> bool {
        #[cfg(target_arch = "x86_64")]
        {
            Isa::detect() == Isa::Avx512 && is_x86_feature_detected!("avx512bf16")
        }
        #[cfg(not(target_arch = "x86_64"))]
        {
            false
        }
    }

    /// The name in statistics and in `UPT_ISA`.
    pub fn name(self) -> &'static str {
        match self {
            Isa::PortableScalar => "portable-scalar",
            Isa::Portable => "portable",
            Isa::Scalar => "scalar",
            Isa::Simd128 => "simd128",
            Isa::Neon => "neon",
            Isa::Avx2 => "avx2",
            Isa::Avx512 => "avx512",
        }
    }

    /// The set of that name, if there is one.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|isa| isa.name().eq_ignore_ascii_case(name.trim()))
    }
}

/// Defines `fn name(isa, args..)`: the scalar function for `Isa::Scalar`, else `body::<Lanes>`
/// compiled with the instruction set's features, and for the portable ones `body` in any case. An `Isa` that the machine lacks takes a scalar
/// path, so the function is safe to call with any value.
/// `body` has to be `#[inline(always)]`: compiled on its own it would have the target's baseline
/// alone, and each of its lanes would be a call of a function.
#[macro_export]
macro_rules! by_isa {
    ($(#[$meta:meta])* $vis:vis fn $name:ident($($arg:ident : $ty:ty),* $(,)?) = $body:ident, $scalar:ident;) => {
        $(#[$meta])*
        $vis fn $name(isa: $crate::Isa, $($arg: $ty),*) {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,f16c")]
            fn avx2($($arg: $ty),*) {
                // SAFETY: the features of these lanes are enabled here.
                unsafe { $body::<$crate::Avx2>($($arg),*) }
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma,f16c")]
            fn avx512($($arg: $ty),*) {
                // SAFETY: the features of these lanes are enabled here.
                unsafe { $body::<$crate::Avx512>($($arg),*) }
            }
            #[cfg(target_arch = "aarch64")]
            #[target_feature(enable = "neon")]
            fn neon($($arg: $ty),*) {
                // SAFETY: the features of these lanes are enabled here.
                unsafe { $body::<$crate::Neon>($($arg),*) }
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,f16c")]
            fn portable($($arg: $ty),*) {
                // SAFETY: the features of these lanes are enabled here.
                unsafe { $body::<$crate::Portable>($($arg),*) }
            }
            #[cfg(target_arch = "aarch64")]
            #[target_feature(enable = "neon")]
            fn portable($($arg: $ty),*) {
                // SAFETY: the features of these lanes are enabled here.
                unsafe { $body::<$crate::Portable>($($arg),*) }
            }
            match isa {
                #[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
                // SAFETY: the machine has the features.
                $crate::Isa::Portable if isa.is_available() => unsafe { portable($($arg),*) },
                #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
                // SAFETY: the module is compiled with the feature.
                $crate::Isa::Portable => unsafe { $body::<$crate::Portable>($($arg),*) },
                #[cfg(not(any(target_arch = "aarch64", all(target_arch = "wasm32", target_feature = "simd128"))))]
                // SAFETY: plain arrays.
                $crate::Isa::Portable | $crate::Isa::PortableScalar => unsafe { $body::<$crate::Scalar<8>>($($arg),*) },
                #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
                // SAFETY: the module is compiled with the feature.
                $crate::Isa::Simd128 => unsafe { $body::<$crate::Simd128>($($arg),*) },
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the machine has the features.
                $crate::Isa::Avx512 if isa.is_available() => unsafe { avx512($($arg),*) },
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the machine has the features.
                $crate::Isa::Avx2 if isa.is_available() => unsafe { avx2($($arg),*) },
                #[cfg(target_arch = "aarch64")]
                // SAFETY: the machine has the features.
                $crate::Isa::Neon if isa.is_available() => unsafe { neon($($arg),*) },
                _ => $scalar($($arg),*),
            }
        }
    };
}
#[cfg(test)]
mod tests {
    use super::Isa;

    #[test]
    fn the_detected_set_is_available_and_named() {
        let best = Isa::detect();
        assert!(best.is_available());
        assert!(Isa::available().contains(&best));
        for isa in Isa::available() {
            assert_eq!(Isa::parse(isa.name()), Some(isa));
        }
        assert_eq!(Isa::parse("sse9"), None);
        assert!(Isa::portable().is_available() && Isa::portable().is_portable());
    }
}
