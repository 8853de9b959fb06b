//! A barrier for threads that meet every hundred microseconds, and the
//! floating-point mode that they compute in.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Turns spent before a waiting thread offers its core to others.
const SPINS: u32 = 20_000;

/// Counts arrivals; the generation tells those who wait that all have come.
pub(crate) struct SpinBarrier {
    count: usize,
    arrived: AtomicUsize,
    generation: AtomicUsize,
}

impl SpinBarrier {
    pub fn new(count: usize) -> Self {
        Self {
            count,
            arrived: AtomicUsize::new(0),
            generation: AtomicUsize::new(0),
        }
    }

    /// Returns when `count` threads have called it; their earlier writes are then visible.
    pub fn wait(&self) {
        if self.count == 1 {
            return;
        }
        let generation = self.generation.load(Ordering::Acquire);
        if self.arrived.fetch_add(1, Ordering::AcqRel) + 1 == self.count {
            self.arrived.store(0, Ordering::Relaxed);
            self.generation.store(generation + 1, Ordering::Release);
            return;
        }
        let mut turns = 0;
        while self.generation.load(Ordering::Acquire) == generation {
            turns += 1;
            if turns < SPINS {
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
    }
}

/// Flushes denormals to zero on this thread until dropped; the caller's mode comes back then.
///
/// Waves that fade, or have not arrived yet, would otherwise be computed in the
/// processor's slow path.
pub(crate) struct FlushDenormals {
    saved: u64,
}

impl FlushDenormals {
    pub fn new() -> Self {
        let saved = control_word();
        #[cfg(target_arch = "x86_64")]
        set_control_word(saved | 0x8040);
        #[cfg(target_arch = "aarch64")]
        set_control_word(saved | 1 << 24);
        Self { saved }
    }
}

impl Drop for FlushDenormals {
    fn drop(&mut self) {
        set_control_word(self.saved);
    }
}

#[cfg(target_arch = "x86_64")]
fn control_word() -> u64 {
    let mut word = 0u32;
    // SAFETY: stores MXCSR (SSE, always there) to a local.
    unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &mut word, options(nostack)) };
    u64::from(word)
}

#[cfg(target_arch = "x86_64")]
fn set_control_word(word: u64) {
    let word = word as u32;
    // SAFETY: loads MXCSR; only the flush and denormal bits ever differ from the caller's word.
    unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &word, options(nostack)) };
}

#[cfg(target_arch = "aarch64")]
fn control_word() -> u64 {
    let word: u64;
    // SAFETY: reads FPCR.
    unsafe { std::arch::asm!("mrs {}, fpcr", out(reg) word, options(nomem, nostack)) };
    word
}

#[cfg(target_arch = "aarch64")]
fn set_control_word(word: u64) {
    // SAFETY: writes FPCR; only the flush bit ever differs from the caller's word.
    unsafe { std::arch::asm!("msr fpcr, {}", in(reg) word, options(nomem, nostack)) };
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn control_word() -> u64 {
    0
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn set_control_word(_word: u64) {}
