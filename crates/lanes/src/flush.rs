//! The floating-point mode of a computation, on the calling thread only and put back on drop, so that a host's environment
//! is the same before and after a call. Exceptions are masked: a host that traps them must not die of an inexact
//! product here. Denormals are flushed where they would cost hundreds of cycles each and carry no tissue motion.
//!
//! REQ-015: The host's floating-point environment is the same after a call, and a host that traps exceptions may call.

use crate::Isa;
use std::marker::PhantomData;

/// A saved mode. It must be dropped on the thread that made it, hence it is not `Send`.
struct Saved {
    /// The mode of before: MXCSR in the low 32 bits, or FPCR.
    word: u64,
    /// A pointer is not `Send`, and so the guard cannot be moved to a thread whose mode it would
    /// overwrite.
    not_send: PhantomData<*const ()>,
}

impl Saved {
    /// Saves the word and sets the changed one. Guards nest: each puts back what it found, so they
    /// have to be dropped in reverse order, as values of a scope are.
    fn change(change: impl FnOnce(u64) -> u64) -> Self {
        let word = read_mode();
        write_mode(change(word));
        Self {
            word,
            not_send: PhantomData,
        }
    }
}

impl Drop for Saved {
    fn drop(&mut self) {
        RAISED.with(|raised| raised.set(raised.get() | (read_mode() & STATUS_BITS)));
        // Status (exception) flags are part of the word on x86: the host's own are put back.
        write_mode(self.word);
    }
}

thread_local! {
    /// Exceptions that computations of this thread have met, as bits of the mode word.
    /// They are collected only to be looked at: tests assert that a step raises no invalid
    /// operation, since the host's own status flags are put back and tell nothing. On x86-64 alone.
    pub static RAISED: std::cell::Cell<u64> = const { std::cell::Cell::new(0) };
}

/// Sets flush-to-zero (and denormals-are-zero) and masks all exceptions on this thread until dropped.
#[must_use = "the mode is restored when the guard is dropped"]
pub struct FlushToZero {
    _saved: Saved,
}

impl FlushToZero {
    /// Saves the thread's floating-point mode and sets its own.
    pub fn enter() -> Self {
        Self {
            _saved: Saved::change(|word| masked(word) | FLUSH_BITS),
        }
    }

    /// [`FlushToZero::of`] a portable set, for what is computed before the first step; none for others.
    pub fn of_portable(isa: Isa) -> Option<Self> {
        isa.is_portable().then(|| Self::of(isa))
    }

    /// The mode of the kernels of `isa`. Portable ones keep denormals, since some machines cannot flush them and others do so before or after
    /// they round, and they round to nearest whatever the host does.
    pub fn of(isa: Isa) -> Self {
        if isa.is_portable() {
            return Self {
                _saved: Saved::change(|_| masked(0)),
            };
        }
        Self::enter()
    }
}

/// Masks all exceptions on this thread until dropped; rounding and denormals stay the host's.
#[must_use = "the mode is restored when the guard is dropped"]
pub struct MaskExceptions {
    _saved: Saved,
}

impl MaskExceptions {
    /// Saves the thread's floating-point mode and masks its exceptions.
    pub fn enter() -> Self {
        Self {
            _saved: Saved::change(masked),
        }
    }
}

/// MXCSR: bits 7 to 12 mask an exception; bits 0 to 5, those that were met before, begin at none.
#[cfg(target_arch = "x86_64")]
fn masked(word: u64) -> u64 {
    (word | 0x1f80) & !0x3f
}

/// FPCR: bits 8 to 12 and 15 let an exception trap.
#[cfg(target_arch = "aarch64")]
fn masked(word: u64) -> u64 {
    word & !0x9f00
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn masked(word: u64) -> u64 {
    word
}

/// MXCSR: bits 0 to 5 say which exceptions were met. FPCR has none.
#[cfg(target_arch = "x86_64")]
const STATUS_BITS: u64 = 0x3f;
#[cfg(not(target_arch = "x86_64"))]
const STATUS_BITS: u64 = 0;

/// MXCSR: bit 15 flush-to-zero, bit 6 denormals-are-zero.
#[cfg(target_arch = "x86_64")]
const FLUSH_BITS: u64 = (1 << 15) | (1 << 6);
/// FPCR: bit 24 flush-to-zero.
#[cfg(target_arch = "aarch64")]
const FLUSH_BITS: u64 = 1 << 24;
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
const FLUSH_BITS: u64 = 0;

/// The thread's floating-point mode word: MXCSR on x86-64, FPCR on AArch64, 0 elsewhere.
#[cfg(target_arch = "x86_64")]
pub fn read_mode() -> u64 {
    let mut word = 0u32;
    // SAFETY: stores the 32-bit MXCSR to a valid, aligned location.
    unsafe { core::arch::asm!("stmxcsr [{}]", in(reg) &mut word, options(nostack)) };
    u64::from(word)
}

#[cfg(target_arch = "x86_64")]
fn write_mode(word: u64) {
    let word = word as u32;
    // SAFETY: the word came from `read_mode`, with defined bits set only.
    unsafe { core::arch::asm!("ldmxcsr [{}]", in(reg) &word, options(nostack, readonly)) };
}

/// The thread's floating-point mode word: MXCSR on x86-64, FPCR on AArch64, 0 elsewhere.
#[cfg(target_arch = "aarch64")]
pub fn read_mode() -> u64 {
    let word: u64;
    // SAFETY: reads a user-accessible system register.
    unsafe { core::arch::asm!("mrs {}, fpcr", out(reg) word, options(nomem, nostack)) };
    word
}

#[cfg(target_arch = "aarch64")]
fn write_mode(word: u64) {
    // SAFETY: the word came from `read_mode`, with defined bits set only.
    unsafe { core::arch::asm!("msr fpcr, {}", in(reg) word, options(nostack)) };
}

/// The thread's floating-point mode word: MXCSR on x86-64, FPCR on AArch64, 0 elsewhere.
#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
pub fn read_mode() -> u64 {
    0
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn write_mode(_word: u64) {}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use std::hint::black_box;

    #[test]
    fn denormals_vanish_inside_and_return_after() {
        let before = read_mode();
        let tiny = black_box(f32::MIN_POSITIVE);
        {
            let _guard = FlushToZero::enter();
            assert_eq!(black_box(tiny) * black_box(0.5), 0.0);
        }
        assert!(black_box(tiny) * black_box(0.5) > 0.0);
        assert_eq!(read_mode() & !0x3f, before & !0x3f);
    }

    #[test]
    fn an_exception_that_the_host_traps_is_masked_inside_and_trapped_after() {
        const INVALID_MASK: u64 = 1 << 7;
        let before = read_mode();
        write_mode(before & !INVALID_MASK & !0x3f);
        {
            let _guard = MaskExceptions::enter();
            assert_eq!(read_mode() & 0x1f80, 0x1f80);
            assert!((black_box(0.0f32) / black_box(0.0)).is_nan());
        }
        {
            let _guard = FlushToZero::enter();
            assert!((black_box(0.0f32) / black_box(0.0)).is_nan());
        }
        let after = read_mode();
        write_mode(before);
        assert_eq!(after & INVALID_MASK, 0, "the host's trap is back");
        assert_eq!(after & 0x3f, 0, "and what was met inside is not told");
        assert_ne!(RAISED.with(std::cell::Cell::get) & 1, 0);
    }
}
