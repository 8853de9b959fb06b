//! A scene's worker: steps in the background, so that the host's frame never waits unless it says so.
//!
//! One step runs at a time and one more input may wait. The thread is started by the first submit and sleeps between
//! steps.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::shared::Shared;
use super::{Contact, Progress, StepInput};
use crate::contact::Tool;
use crate::error::{Error, Result};
use crate::field::ContactSet;
use crate::memory;

/// What host and worker share. The host writes an input only while none waits, or replaces one that has not started.
#[derive(Default)]
struct Slot {
    /// An input is there that the worker has not taken.
    waiting: bool,
    /// The worker is in a step.
    running: bool,
    /// The scene goes: the worker ends after the step that it is in.
    stop: bool,
    /// The input that waits: nodes and vectors `[m,3]`, mm, or tools. The worker exchanges them for its own lists, so that neither side
    /// allocates once the lists have grown.
    nodes: Vec<u32>,
    vectors: Vec<f32>,
    /// Tools drive the step that waits.
    driven: bool,
    tools: Vec<Tool>,
    /// Errors that no poll has returned yet: the first one, and how many came after it.
    failed: Option<Error>,
    failed_later: u64,
    /// A step has finished since a poll last said so.
    finished: bool,
    /// An input was submitted at some time: without one there is nothing to wait for, which is an error.
    ever: bool,
}

#[derive(Default)]
struct Signal {
    slot: Mutex<Slot>,
    /// Wakes the worker for an input or the end, and hosts for a step that is done.
    work: Condvar,
    done: Condvar,
}

/// The worker's handle.
pub struct Worker {
    signal: Arc<Signal>,
    thread: Mutex<Option<JoinHandle<()>>>,
    latest_wins: bool,
    /// Where a contact is checked.
    checked: Mutex<ContactSet>,
}

impl Signal {
    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Worker {
    /// A worker without a thread. With `latest_wins` an input that has not started is replaced by the next.
    pub fn new(latest_wins: bool) -> Worker {
        Worker {
            signal: Arc::default(),
            thread: Mutex::default(),
            latest_wins,
            checked: Mutex::default(),
        }
    }

    /// Hands a contact on a mesh of `node_count` nodes to the worker, checked.
    pub fn submit(
        &self,
        shared: &Arc<Shared>,
        nodes: &[u32],
        vectors: &[f32],
        node_count: usize,
    ) -> Result<()> {
        let mut checked = self.checked.lock().unwrap_or_else(PoisonError::into_inner);
        checked.take_sparse(nodes, vectors, node_count)?;
        drop(checked);
        self.start(shared)?;
        let mut slot = self.free_slot()?;
        // Both have room before either changes: a contact that waits stays whole.
        let room = |list: usize, have: usize| list.saturating_sub(have);
        let (more_nodes, more_floats) = (
            room(nodes.len(), slot.nodes.len()),
            room(vectors.len(), slot.vectors.len()),
        );
        memory::reserve(&mut slot.nodes, more_nodes, "a submitted contact")?;
        memory::reserve(&mut slot.vectors, more_floats, "a submitted contact")?;
        slot.nodes.clear();
        slot.nodes.extend_from_slice(nodes);
        slot.vectors.clear();
        slot.vectors.extend_from_slice(vectors);
        slot.driven = false;
        self.set_off(slot);
        Ok(())
    }

    /// Hands tools to the worker, checked.
    pub fn submit_tools(&self, shared: &Arc<Shared>, tools: &[Tool]) -> Result<()> {
        for (index, tool) in tools.iter().enumerate() {
            tool.check(index)?;
        }
        self.start(shared)?;
        let mut slot = self.free_slot()?;
        let more = tools.len().saturating_sub(slot.tools.len());
        memory::reserve(&mut slot.tools, more, "submitted instruments")?;
        slot.tools.clear();
        slot.tools.extend_from_slice(tools);
        slot.driven = true;
        self.set_off(slot);
        Ok(())
    }

    /// Where the next input may be put.
    fn free_slot(&self) -> Result<MutexGuard<'_, Slot>> {
        let slot = self.signal.lock();
        if (slot.waiting || slot.running) && !self.latest_wins {
            return Err(Error::Busy(
                "a submitted step has not finished; poll or wait first".into(),
            ));
        }
        Ok(slot)
    }

    /// Wakes the thread for the input that was put there.
    fn set_off(&self, mut slot: MutexGuard<'_, Slot>) {
        slot.waiting = true;
        slot.ever = true;
        if !self.latest_wins {
            slot.finished = false;
        }
        self.signal.work.notify_one();
    }

    /// Whether a step is waiting or running.
    pub fn in_flight(&self) -> bool {
        let slot = self.signal.lock();
        slot.waiting || slot.running
    }

    /// An error that no call has returned yet; else whether a step has finished that no call has reported, or none is in flight.
    pub fn poll(&self) -> Result<Progress> {
        let mut slot = self.signal.lock();
        let progress = Self::progress(&mut slot)?;
        match std::mem::take(&mut slot.finished) {
            true => Ok(Progress::Done),
            false => Ok(progress),
        }
    }

    /// Waits at most `timeout` until no step is in flight.
    pub fn wait(&self, timeout: Duration) -> Result<Progress> {
        let until = Instant::now().checked_add(timeout);
        let mut slot = self.signal.lock();
        while slot.waiting || slot.running {
            let left = until.map(|until| until.saturating_duration_since(Instant::now()));
            let left = left.unwrap_or(Duration::from_secs(3600));
            if left.is_zero() {
                break;
            }
            slot = self
                .signal
                .done
                .wait_timeout(slot, left)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
        if !(slot.waiting || slot.running) {
            slot.finished = false;
        }
        Self::progress(&mut slot)
    }

    fn progress(slot: &mut Slot) -> Result<Progress> {
        if !slot.ever {
            return Err(Error::State("nothing was submitted".into()));
        }
        if let Some(error) = slot.failed.take() {
            let later = std::mem::take(&mut slot.failed_later);
            return Err(match later {
                0 => error,
                _ => error.and_more(later),
            });
        }
        if slot.waiting || slot.running {
            return Ok(Progress::Pending);
        }
        Ok(Progress::Done)
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
    let mut tools = Vec::new();
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
        std::mem::swap(&mut tools, &mut slot.tools);
        let driven = slot.driven;
        drop(slot);
        let contact = Contact::Sparse {
            nodes: &nodes,
            vectors: &vectors,
        };
        let contact = match driven {
            true => Contact::Tools(&tools),
            false => contact,
        };
        let input = StepInput {
            displacement: None,
            contact,
        };
        let result = shared.step_blocking(input);
        slot = signal.lock();
        slot.running = false;
        match result {
            Ok(()) => slot.finished = true,
            Err(_) if slot.failed.is_some() => slot.failed_later += 1,
            Err(error) => slot.failed = Some(error),
        }
        signal.done.notify_all();
    }
}
