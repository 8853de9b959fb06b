//! The clock of waits, budgets and statistics: the standard library's, and in WebAssembly, which has none, the host's: it imports
//! `upt.now_ms`, milliseconds from any moment on.

#[cfg(target_family = "wasm")]
pub use hosts::Instant;
#[cfg(not(target_family = "wasm"))]
pub use std::time::Instant;

#[cfg(target_family = "wasm")]
mod hosts {
    use std::ops::{Add, Sub};
    use std::time::Duration;

    #[link(wasm_import_module = "upt")]
    unsafe extern "C" {
        safe fn now_ms() -> f64;
    }

    /// What the library uses of the standard library's type of this name.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    pub struct Instant(Duration);

    impl Instant {
        /// This moment.
        pub fn now() -> Instant {
            Instant(Duration::try_from_secs_f64(now_ms() * 1e-3).unwrap_or_default())
        }

        /// Time since then.
        pub fn elapsed(&self) -> Duration {
            Instant::now() - *self
        }

        /// Time since an earlier moment; 0 since a later one.
        pub fn saturating_duration_since(&self, earlier: Instant) -> Duration {
            *self - earlier
        }

        /// A later moment.
        pub fn checked_add(&self, duration: Duration) -> Option<Instant> {
            self.0.checked_add(duration).map(Instant)
        }
    }

    impl Sub for Instant {
        type Output = Duration;

        fn sub(self, earlier: Instant) -> Duration {
            self.0.saturating_sub(earlier.0)
        }
    }

    impl Add<Duration> for Instant {
        type Output = Instant;

        fn add(self, duration: Duration) -> Instant {
            Instant(self.0 + duration)
        }
    }
}
