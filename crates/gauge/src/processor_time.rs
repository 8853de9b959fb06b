//! Time that a thread has spent on a processor: beside other work the clock on the wall measures that too.

use std::time::Instant;

/// A moment of this thread.
pub struct ProcessorTime {
    begun: Option<f64>,
    wall: Instant,
}

impl ProcessorTime {
    pub fn of_this_thread() -> Self {
        Self {
            begun: spent_ms(),
            wall: Instant::now(),
        }
    }

    /// Since then, ms; of the clock on the wall where the system does not tell.
    pub fn ms(&self) -> f64 {
        match (self.begun, spent_ms()) {
            (Some(begun), Some(now)) => now - begun,
            _ => self.wall.elapsed().as_secs_f64() * 1e3,
        }
    }
}

#[cfg(unix)]
fn spent_ms() -> Option<f64> {
    let mut time = libc::timespec {
        tv_sec: 0,
        tv_nsec: 0,
    };
    // SAFETY: the structure lives across the call, which fills it.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_THREAD_CPUTIME_ID, &raw mut time) };
    (status == 0).then_some(1e3 * time.tv_sec as f64 + 1e-6 * time.tv_nsec as f64)
}

#[cfg(not(unix))]
fn spent_ms() -> Option<f64> {
    None
}
