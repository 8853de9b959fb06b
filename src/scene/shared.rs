//! The part of a scene that its handle and its worker share, and the rule that one thread at a time steps it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock, TryLockError};

use super::StepInput;
use super::core::Core;
use super::published::Published;
use super::record::{self, Record};
use crate::error::{Error, Result};

/// Core, published states, and whether a panic was caught.
pub struct Shared {
    /// What one thread at a time steps; [`Shared::core`] never waits for it.
    core: Mutex<Core>,
    /// The readable part.
    pub published: RwLock<Published>,
    /// A panic was caught inside of a call: the core may be half changed, and no call reads it again.
    poisoned: AtomicBool,
    /// Locked by who has the core, and by who takes the lines.
    pub record: Record,
}

impl Shared {
    /// Wraps a core.
    pub fn new(core: Core, published: Published) -> Shared {
        Shared {
            core: Mutex::new(core),
            published: RwLock::new(published),
            poisoned: AtomicBool::new(false),
            record: Record::default(),
        }
    }

    /// Whether a panic was caught.
    pub fn is_poisoned(&self) -> bool {
        self.poisoned.load(Ordering::Acquire)
    }

    /// Calls with the core; a panic poisons the scene, whose state nobody can vouch for any more, and becomes an error.
    pub fn guarded<T>(
        &self,
        mut core: MutexGuard<'_, Core>,
        call: impl FnOnce(&mut Core, &RwLock<Published>) -> Result<T>,
    ) -> Result<T> {
        if self.is_poisoned() {
            return Err(poison_error());
        }
        match catch_unwind(AssertUnwindSafe(|| call(&mut core, &self.published))) {
            Ok(result) => {
                // A worker of the pool has panicked: its error came back as a result, and what it wrote is as doubtful.
                if matches!(result, Err(Error::Panic(_))) {
                    self.poisoned.store(true, Ordering::Release);
                }
                result
            }
            Err(payload) => {
                self.poisoned.store(true, Ordering::Release);
                let message = payload
                    .downcast_ref::<String>()
                    .cloned()
                    .or_else(|| payload.downcast_ref::<&str>().map(|text| text.to_string()))
                    .unwrap_or_else(|| "no message".into());
                Err(Error::Panic(message))
            }
        }
    }

    /// The core, for [`Shared::guarded`].
    ///
    /// # Errors
    /// [`Error::Busy`] while another thread has it.
    pub fn core(&self) -> Result<MutexGuard<'_, Core>> {
        lock(&self.core)
    }

    /// A step of the scene's worker, which waits for a call in progress.
    pub fn step_blocking(&self, input: StepInput<'_>) -> Result<()> {
        let core = self.core.lock().unwrap_or_else(PoisonError::into_inner);
        self.guarded(core, |core, published| {
            let line = |recorder: &mut _| record::step(recorder, &input);
            let call = || core.step(published, input, None);
            self.record.told(published, line, call)
        })
    }
}

fn poison_error() -> Error {
    Error::Panic("a panic was caught in this scene; it can only be destroyed".into())
}

/// What one thread at a time uses.
///
/// # Errors
/// [`Error::Busy`] while another has it.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> Result<MutexGuard<'_, T>> {
    match mutex.try_lock() {
        Ok(guard) => Ok(guard),
        Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
        Err(TryLockError::WouldBlock) => {
            Err(Error::Busy("another thread is using the scene".into()))
        }
    }
}
