//! What the threads of a pool share, and what a worker does: it sleeps, or looks for a while, until there is a job, and takes chunks of it.
//!
//! The lock of [`State`] orders everything: a job is published and withdrawn under it, and a worker
//! enters and leaves under it. The atomics beside it only spare those that look the lock. Between
//! two jobs `job` is none and `active` is 0, so no task is reachable.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use lanes::{FlushToZero, Isa};

/// Looks of a worker that is kept awake for the next job, and of a caller for the end of one,
/// before it sleeps: about 0.1 ms, so that a host that stops calling gets its cores back at once.
pub const LOOKS: u32 = 2000;

/// What runs a chunk: `(chunk, worker)`, `worker < threads()` names the scratch space that this
/// thread may use during the chunk.
pub type Task<'a> = dyn Fn(usize, usize) + Sync + 'a;

/// A job's address as the workers see it; valid while `run` has it published.
#[derive(Clone, Copy)]
pub struct Job {
    /// Borrowed from the caller of `run`, with its lifetime erased.
    pub task: *const Task<'static>,
    /// Chunks are `0..chunk_count`.
    pub chunk_count: usize,
}
// SAFETY: the task is `Sync` and outlives the job (see `super::Pool::run`).
unsafe impl Send for Job {}

pub struct State {
    /// Published by `run`, and taken back by it once the counter has run out.
    pub job: Option<Job>,
    /// Number of the job, counted up by each.
    pub epoch: u64,
    /// Workers inside a job. `run` returns only at 0.
    pub active: usize,
    /// The pool is dropped: workers end.
    pub closing: bool,
    /// The first chunk that panicked, with its message.
    pub panic: Option<(usize, String)>,
}

pub struct Shared {
    /// Everything that needs an order.
    pub state: Mutex<State>,
    /// A job was published, or the pool is closing.
    pub wake: Condvar,
    /// `active` has fallen to 0.
    pub done: Condvar,
    /// The chunk that is taken next; beyond the job's count where none is left.
    pub next: AtomicUsize,
    /// A chunk has panicked: the rest is skipped.
    pub failed: AtomicBool,
    /// Callers that hold [`super::Pool::keep_awake`].
    pub awake: AtomicUsize,
    /// `State::epoch` and `State::active` for those that look without the lock.
    pub epoch: AtomicU64,
    pub active: AtomicUsize,
}

impl Shared {
    /// No job, nobody awake.
    pub fn new() -> Shared {
        Shared {
            state: Mutex::new(State {
                job: None,
                epoch: 0,
                active: 0,
                closing: false,
                panic: None,
            }),
            wake: Condvar::new(),
            done: Condvar::new(),
            next: AtomicUsize::new(0),
            failed: AtomicBool::new(false),
            awake: AtomicUsize::new(0),
            epoch: AtomicU64::new(0),
            active: AtomicUsize::new(0),
        }
    }

    /// Relaxed: it decides only how somebody waits, never what is computed.
    pub fn is_awake(&self) -> bool {
        self.awake.load(Ordering::Relaxed) > 0
    }

    /// Looks, for a while, until `found`.
    /// It returns at the latest after [`LOOKS`] turns; the caller asks again under the lock.
    pub fn look(&self, found: impl Fn() -> bool) {
        for _ in 0..LOOKS {
            if found() || !self.is_awake() {
                return;
            }
            std::hint::spin_loop();
        }
    }

    /// A poisoned lock is taken as it is: no panic happens while the state is half changed.
    pub fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes chunks until none is left or one has panicked.
    pub fn work(&self, task: &Task<'_>, chunk_count: usize, worker: usize) {
        while !self.failed.load(Ordering::Relaxed) {
            // The counter alone decides who computes a chunk; what it writes is seen by all once `active` is 0.
            let chunk = self.next.fetch_add(1, Ordering::Relaxed);
            if chunk >= chunk_count {
                return;
            }
            if let Err(payload) = catch_unwind(AssertUnwindSafe(|| task(chunk, worker))) {
                self.failed.store(true, Ordering::Relaxed);
                let mut state = self.lock();
                state
                    .panic
                    .get_or_insert((chunk, panic_message(payload.as_ref())));
            }
        }
    }
}

/// The life of a worker: sleep until there is a job that it has not seen, work, leave, and look
/// once for the next before it sleeps again, where somebody keeps the pool awake.
pub fn worker_loop(shared: &Shared, isa: Isa, worker: usize) {
    let _mode = FlushToZero::of(isa);
    let (mut seen, mut looked) = (0, false);
    let mut state = shared.lock();
    loop {
        if state.closing {
            return;
        }
        match state.job {
            Some(job) if state.epoch != seen => {
                (seen, looked) = (state.epoch, false);
                state.active += 1;
                shared.active.store(state.active, Ordering::Relaxed);
                drop(state);
                // SAFETY: `run` keeps the task alive while a job is published or `active > 0`.
                shared.work(unsafe { &*job.task }, job.chunk_count, worker);
                state = shared.lock();
                state.active -= 1;
                shared.active.store(state.active, Ordering::Release);
                if state.active == 0 {
                    shared.done.notify_all();
                }
            }
            _ if shared.is_awake() && !looked => {
                looked = true;
                // Once between two sleeps: a worker that looks for longer takes a core that the host may want.
                let last = state.epoch;
                drop(state);
                shared.look(|| shared.epoch.load(Ordering::Acquire) != last);
                state = shared.lock();
            }
            _ => {
                looked = false;
                state = shared
                    .wake
                    .wait(state)
                    .unwrap_or_else(PoisonError::into_inner);
            }
        }
    }
}

/// The text of a panic, of which `panic!` makes one of two types.
pub fn panic_message(payload: &(dyn std::any::Any + Send)) -> String {
    payload
        .downcast_ref::<&str>()
        .map(|s| (*s).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned())
}
