//! The process-wide part: options that hold for all models, and when they may change.
//!
//! REQ-016: After a fork the child's calls are refused, and the parent goes on.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::{Error, Result};
use crate::options::InitOptions;

static OPTIONS: Mutex<Option<InitOptions>> = Mutex::new(None);
static LIVE: AtomicUsize = AtomicUsize::new(0);

fn options() -> MutexGuard<'static, Option<InitOptions>> {
    OPTIONS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Sets the process-wide options; the first model does it with the defaults. A second call with other options is
/// [`Error::State`].
pub fn init(wanted: &InitOptions) -> Result<()> {
    let mut options = options();
    match &*options {
        Some(current) if current != wanted => Err(Error::State(
            "the library was already started with other options; call upt_shutdown first".into(),
        )),
        _ => {
            *options = Some(wanted.clone());
            Ok(())
        }
    }
}

/// Ends the process-wide part; [`Error::State`] while models or scenes live.
///
/// ONNX Runtime stays loaded until the process ends: its environment can be made only once.
pub fn shutdown() -> Result<()> {
    let mut options = options();
    match LIVE.load(Ordering::Acquire) {
        0 => {
            *options = None;
            Ok(())
        }
        count => Err(Error::State(format!(
            "{count} models are alive; close all models and scenes first"
        ))),
    }
}

/// The options in force; sets the defaults where none were set.
pub(crate) fn current() -> InitOptions {
    options().get_or_insert_with(InitOptions::default).clone()
}

/// Counts a living model.
#[derive(Debug)]
pub(crate) struct Alive(());

impl Alive {
    pub(crate) fn new() -> Alive {
        LIVE.fetch_add(1, Ordering::AcqRel);
        Alive(())
    }
}

impl Drop for Alive {
    fn drop(&mut self) {
        LIVE.fetch_sub(1, Ordering::AcqRel);
    }
}
