//! A scene's worker: steps in the background, so that the host's frame never waits unless it says so.
//!
//! One step runs at a time and one more input may wait. The thread is started by the first submit and sleeps between
//! steps.
//!
//! REQ-036: A submitted step gives what the host's own would, its error is told once, and concurrent use returns at once.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::clock::Instant;

use super::copied_loads::CopiedLoads;
use super::loads::Loads;
use super::published::lock_read;
use super::shared::Shared;
use super::{Contact, Progress, StepInput};
use crate::bundle::Mesh;
use crate::contact::Tool;
use crate::error::{Error, Result};
use crate::field::{ContactSet, check_displacement};
use crate::kernels::THREAD_STACK;
use crate::memory;

const SUBMITTED: &str = "a submitted input";

/// What host and worker share. The host writes an input only while none waits, or replaces one that has not started.
#[derive(Default)]
struct Slot {
    /// An input is there that the worker has not taken.
    waiting: bool,
    /// The worker is in a step.
    running: bool,
    /// The scene goes: the worker ends after the step that it is in.
    stop: bool,
    /// The input that waits. The worker exchanges it for its own, so that neither side allocates once the lists have grown.
    input: Copied,
    /// Errors that no poll has returned yet: the first one, and how many came after it.
    failed: Option<Error>,
    failed_later: u64,
    /// A step has finished since a poll last said so.
    finished: bool,
    /// An input was submitted at some time: without one there is nothing to wait for, which is an error.
    ever: bool,
}

/// A copy of the host's input.
#[derive(Default)]
struct Copied {
    /// Which of the lists below count.
    drive: Drive,
    nodes: Vec<u32>,
    /// `[m,3]`, mm.
    vectors: Vec<f32>,
    tools: Vec<Tool>,
    /// Whether the step starts from `displacement [K,3]`, mm.
    starts: bool,
    displacement: Vec<f32>,
    /// Gravity, forces and pressures, likewise copied.
    loads: CopiedLoads,
    time_s: f64,
}

/// What of a copied input counts.
#[derive(Clone, Copy, Default)]
enum Drive {
    #[default]
    None,
    Nodes,
    Tools,
}

impl Copied {
    /// Takes an input whose dense field is in `checked`. All lists have room before one changes: an input that waits stays whole.
    fn take(&mut self, input: &StepInput<'_>, checked: &ContactSet) -> Result<()> {
        let (drive, nodes, vectors, tools): (_, &[u32], &[f32], &[Tool]) = match input.contact {
            Contact::None => (Drive::None, &[], &[], &[]),
            Contact::Dense(_) => (Drive::Nodes, &checked.nodes, &checked.vectors, &[]),
            Contact::Sparse { nodes, vectors } => (Drive::Nodes, nodes, vectors, &[]),
            Contact::Tools(tools) => (Drive::Tools, &[], &[], tools),
        };
        let displacement = input.displacement.unwrap_or_default();
        memory::fit(&mut self.nodes, nodes.len(), SUBMITTED)?;
        memory::fit(&mut self.vectors, vectors.len(), SUBMITTED)?;
        memory::fit(&mut self.tools, tools.len(), SUBMITTED)?;
        memory::fit(&mut self.displacement, displacement.len(), SUBMITTED)?;
        self.loads.take(&input.loads)?;
        self.drive = drive;
        self.starts = input.displacement.is_some();
        self.time_s = input.time_s;
        self.nodes.clear();
        self.nodes.extend_from_slice(nodes);
        self.vectors.clear();
        self.vectors.extend_from_slice(vectors);
        self.tools.clear();
        self.tools.extend_from_slice(tools);
        self.displacement.clear();
        self.displacement.extend_from_slice(displacement);
        Ok(())
    }

    /// Calls with the input.
    fn with_input<T>(&self, call: impl FnOnce(StepInput<'_>) -> T) -> T {
        self.loads.with(|loads| call(self.input(loads)))
    }

    /// The input as it was submitted, with loads that borrow from the same copy.
    fn input<'a>(&'a self, loads: Loads<'a>) -> StepInput<'a> {
        StepInput {
            displacement: self.starts.then_some(&*self.displacement),
            contact: match self.drive {
                Drive::None => Contact::None,
                Drive::Nodes => Contact::Sparse {
                    nodes: &self.nodes,
                    vectors: &self.vectors,
                },
                Drive::Tools => Contact::Tools(&self.tools),
            },
            loads,
            time_s: self.time_s,
        }
    }
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

    /// Hands an input to the worker, checked.
    pub fn submit(&self, shared: &Arc<Shared>, input: &StepInput<'_>, mesh: &Mesh) -> Result<()> {
        input.check()?;
        let node_count = mesh.node_count();
        input.loads.check(node_count)?;
        let now = lock_read(&shared.published).last.field.len() / 3;
        let mut checked = self.checked.lock().unwrap_or_else(PoisonError::into_inner);
        input.contact.gather(&mut checked, [node_count, now])?;
        if let Contact::Tools(tools) = input.contact {
            for (index, tool) in tools.iter().enumerate() {
                tool.check(index)?;
            }
        }
        if let Some(displacement) = input.displacement {
            check_displacement(displacement, node_count)?;
        }
        self.start(shared)?;
        let mut slot = self.free_slot()?;
        slot.input.take(input, &checked)?;
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

    /// What a poll or a wait returns now; an error is taken out, so that it is told once.
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

    /// Starts the thread at the first submit; it lives until the worker is dropped. It holds the scene's shared part, not
    /// the scene, so that the scene can go while it sleeps.
    fn start(&self, shared: &Arc<Shared>) -> Result<()> {
        let mut thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner);
        if thread.is_some() {
            return Ok(());
        }
        let (shared, signal) = (Arc::clone(shared), Arc::clone(&self.signal));
        let handle = std::thread::Builder::new()
            .name("upt-scene".into())
            .stack_size(THREAD_STACK)
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

/// The worker's thread: waits for an input, steps, tells, until the scene ends.
fn run(shared: &Shared, signal: &Signal) {
    let mut own = Copied::default();
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
        std::mem::swap(&mut own, &mut slot.input);
        drop(slot);
        let result = own.with_input(|input| shared.step_blocking(input));
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
