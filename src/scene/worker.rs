//! A scene's worker: steps in the background, so that the host's frame never waits unless it says so.
//!
//! One step runs at a time and one more input may wait. The thread is started by the first submit and sleeps between
//! steps.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::shared::Shared;
use super::{Contact, Progress, StepInput};
use crate::error::{Error, Result};

#[derive(Default)]
struct Slot {
    waiting: bool,
    running: bool,
    stop: bool,
    nodes: Vec<u32>,
    vectors: Vec<f32>,
    failed: Option<Error>,
    ever: bool,
}

#[derive(Default)]
struct Signal {
    slot: Mutex<Slot>,
    work: Condvar,
    done: Condvar,
}

/// The worker's handle.
#[derive(Default)]
pub struct Worker {
    signal: Arc<Signal>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

impl Signal {
    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Worker {
    /// Hands a contact to the worker. With `latest_wins` an input that has not started is replaced.
    pub fn submit(
        &self,
        shared: &Arc<Shared>,
        nodes: &[u32],
        vectors: &[f32],
        latest_wins: bool,
    ) -> Result<()> {
        self.start(shared)?;
        let mut slot = self.signal.lock();
        if (slot.waiting || slot.running) && !latest_wins {
            return Err(Error::Busy(
                "a submitted step has not finished; poll or wait first".into(),
            ));
        }
        slot.nodes.clear();
        slot.nodes.extend_from_slice(nodes);
        slot.vectors.clear();
        slot.vectors.extend_from_slice(vectors);
        slot.waiting = true;
        slot.ever = true;
        slot.failed = None;
        self.signal.work.notify_one();
        Ok(())
    }

    /// Whether a step is waiting or running.
    pub fn in_flight(&self) -> bool {
        let slot = self.signal.lock();
        slot.waiting || slot.running
    }

    /// Progress of the last submit; its error, once.
    pub fn poll(&self) -> Result<Progress> {
        Self::progress(&mut self.signal.lock())
    }

    /// Waits at most `timeout`.
    pub fn wait(&self, timeout: Duration) -> Result<Progress> {
        let until = Instant::now() + timeout;
        let mut slot = self.signal.lock();
        while slot.waiting || slot.running {
            let now = Instant::now();
            if now >= until {
                break;
            }
            slot = self
                .signal
                .done
                .wait_timeout(slot, until - now)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
        Self::progress(&mut slot)
    }

    fn progress(slot: &mut Slot) -> Result<Progress> {
        if !slot.ever {
            return Err(Error::State("nothing was submitted".into()));
        }
        if slot.waiting || slot.running {
            return Ok(Progress::Pending);
        }
        match slot.failed.take() {
            Some(error) => Err(error),
            None => Ok(Progress::Done),
        }
    }

    fn start(&self, shared: &Arc<Shared>) -> Result<()> {
        let mut thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner);
        if thread.is_some() {
            return Ok(());
        }
        let (shared, signal) = (Arc::clone(shared), Arc::clone(&self.signal));
        let handle = std::thread::Builder::new()
            .name("upt-scene".into())
            .spawn(move || run(&shared, &signal))
            .map_err(|error| {
                Error::State(format!("could not start the scene's worker: {error}"))
            })?;
        *thread = Some(handle);
        Ok(())
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.signal.lock().stop = true;
        self.signal.work.notify_all();
        let thread = self
            .thread
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        if let Some(thread) = thread {
            // The worker catches panics of a step; there is nothing to report.
            let _ = thread.join();
        }
    }
}

fn run(shared: &Shared, signal: &Signal) {
    let (mut nodes, mut vectors) = (Vec::new(), Vec::new());
    let mut slot = signal.lock();
    loop {
        while !slot.waiting && !slot.stop {
            slot = signal
                .work
                .wait(slot)
                .unwrap_or_else(PoisonError::into_inner);
        }
        if slot.stop {
            return;
        }
        slot.waiting = false;
        slot.running = true;
        std::mem::swap(&mut nodes, &mut slot.nodes);
        std::mem::swap(&mut vectors, &mut slot.vectors);
        drop(slot);
        let input = StepInput {
            displacement: None,
            contact: Contact::Sparse {
                nodes: &nodes,
                vectors: &vectors,
            },
        };
        let result = shared.step_blocking(input);
        slot = signal.lock();
        slot.running = false;
        if let Err(error) = result {
            slot.failed = Some(error);
        }
        signal.done.notify_all();
    }
}
