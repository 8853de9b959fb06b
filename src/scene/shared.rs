//! The part of a scene that its handle and its worker share, and the rule that one thread at a time steps it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, RwLock, TryLockError};

use super::StepInput;
use super::core::Core;
use super::published::Published;
use super::record::{self, Record};
use crate::error::{Error, Result};
use crate::replay::Recorder;

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

    /// The core, for one call.
    ///
    /// # Errors
    /// [`Error::Busy`] while another thread has it.
    pub fn core(&self) -> Result<CoreGuard<'_>> {
        Ok(CoreGuard {
            core: lock(&self.core)?,
            shared: self,
        })
    }

    /// A step of the scene's worker, which waits for a call in progress.
    pub fn step_blocking(&self, input: StepInput<'_>) -> Result<()> {
        let core = self.core.lock().unwrap_or_else(PoisonError::into_inner);
        let guard = CoreGuard { core, shared: self };
        let line = |recorder: &mut Recorder| record::step(recorder, &input);
        guard.told(Some(line), |core, published| {
            core.step(published, input, None)
        })
    }
}

/// A scene's core, which this thread has to itself for one call.
pub struct CoreGuard<'a> {
    core: MutexGuard<'a, Core>,
    shared: &'a Shared,
}

impl CoreGuard<'_> {
    /// Makes a call that changes nothing of what later steps compute, so that a recording has no line of it.
    ///
    /// # Errors
    /// As [`CoreGuard::told`].
    pub fn call<T>(
        self,
        call: impl FnOnce(&mut Core, &RwLock<Published>) -> Result<T>,
    ) -> Result<T> {
        self.told(None::<fn(&mut Recorder) -> Result<()>>, call)
    }

    /// Makes a call of which a recording tells with what `line` begins there. Where there is no room for that, nothing is done.
    /// A panic poisons the scene, whose state nobody can vouch for any more, and becomes an error.
    ///
    /// # Errors
    /// Those of the line and of the call; [`Error::Panic`] where the call panics, and from then on.
    pub fn told<T>(
        mut self,
        line: Option<impl FnOnce(&mut Recorder) -> Result<()>>,
        call: impl FnOnce(&mut Core, &RwLock<Published>) -> Result<T>,
    ) -> Result<T> {
        let shared = self.shared;
        if shared.is_poisoned() {
            return Err(poison_error());
        }
        let recorded = AssertUnwindSafe(|| {
            let has_line = match line {
                Some(line) => shared.record.begin(line)?,
                None => false,
            };
            let done = call(&mut self.core, &shared.published);
            if has_line {
                shared.record.end(&shared.published, done.is_ok());
            }
            done
        });
        match catch_unwind(recorded) {
            Ok(result) => {
                // A worker of the pool has panicked: its error came back as a result, and what it wrote is as doubtful.
                if matches!(result, Err(Error::Panic(_))) {
                    shared.poisoned.store(true, Ordering::Release);
                }
                result
            }
            Err(payload) => {
                shared.poisoned.store(true, Ordering::Release);
                let message = payload
                    .downcast_ref::<String>()
                    .cloned()
                    .or_else(|| payload.downcast_ref::<&str>().map(|text| text.to_string()))
                    .unwrap_or_else(|| "no message".into());
                Err(Error::Panic(message))
            }
        }
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
