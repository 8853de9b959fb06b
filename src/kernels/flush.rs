//! Flush-to-zero for the span of a computation: denormals cost hundreds of cycles each and carry
//! no tissue motion. The mode is set on the calling thread only and restored on drop, so a host's
//! floating-point environment is the same before and after a call.

use std::marker::PhantomData;

/// Sets flush-to-zero (and denormals-are-zero) on this thread until dropped.
///
/// The guard must be dropped on the thread that made it, hence it is not `Send`.
#[must_use = "the mode is restored when the guard is dropped"]
pub struct FlushToZero {
    saved: u64,
    not_send: PhantomData<*const ()>,
}

impl FlushToZero {
    /// Saves the thread's floating-point mode and sets flush-to-zero.
    pub fn enter() -> Self {
        let saved = read_mode();
        write_mode(saved | FLUSH_BITS);
        Self {
            saved,
            not_send: PhantomData,
        }
    }
}

impl Drop for FlushToZero {
    fn drop(&mut self) {
        // Status (exception) flags are part of the word on x86: the host's own are put back.
        write_mode(self.saved);
    }
}

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
}
