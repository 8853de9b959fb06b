//! Threads for one step: `threads - 1` parked workers and the caller.
//!
//! A job is `chunk_count` independent chunks, taken in order from one counter. What a chunk
//! computes may depend on its index only, never on the thread that runs it, so results have the
//! same bits for any thread count. Between jobs workers sleep on a condition variable: the game owns
//! the cores. Only while a caller holds [`Pool::keep_awake`], for the few milliseconds of many short jobs
//! in a row, does a worker look for the next one for `worker::LOOKS` turns before it sleeps. `run` allocates
//! nothing. A worker that wakes late finds the job closed and goes back to sleep, so `run` never waits
//! for a thread that has not started. Where workers do not make what is done under [`Pool::keep_awake`] shorter, they are left out of it (`turns`).

mod turns;
mod worker;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use field::clock::Instant;
use field::error::Error;
use lanes::{FlushToZero, Isa};
use turns::Turns;
use worker::{Job, Shared, Task, panic_message, worker_loop};

/// Of the library's threads: as much as a program's first thread has. Two megabytes, the default of std, are not enough without optimisation.
pub const THREAD_STACK: usize = 8 << 20;

/// Bytes from which on streaming a table is split over threads. Waking a worker and waiting for its last chunk costs what
/// one core reads in the meantime, some megabytes from cache. Measured (`cargo bench --bench kernels -- pool`, two cores that share
/// their memory with others): reading alone gains nothing from a second thread up to 32 MB and loses below 4 MB; the products over the
/// tables of a large mesh, which also compute, take a quarter less time on two (`brain-fine-reduced` in docs/results/speed.md).
const SPLIT_BYTES: usize = 8 << 20;

/// The same while workers are kept awake: the next job costs a look at one number in place of waking a thread.
const SPLIT_AWAKE_BYTES: usize = 256 << 10;

/// Why a pool could not be made or a job not be finished.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PoolError {
    /// A chunk panicked; the remaining chunks were skipped and the pool stays usable.
    #[error("a computation panicked in chunk {chunk} of {chunk_count}: {message}")]
    Panicked {
        chunk: usize,
        chunk_count: usize,
        message: String,
    },
    /// The system refused a thread.
    #[error("could not start worker thread {index} of {count}: {message}; ask for fewer threads")]
    Spawn {
        index: usize,
        count: usize,
        message: String,
    },
}

impl From<PoolError> for Error {
    fn from(error: PoolError) -> Error {
        match error {
            PoolError::Panicked { .. } => Error::Panic(error.to_string()),
            PoolError::Spawn { .. } => Error::Argument(error.to_string()),
        }
    }
}

/// A small thread pool. Shared by reference; any thread may call [`Pool::run`].
pub struct Pool {
    /// What the workers look at; they hold it too, and outlive no pool: [`Drop`] joins them.
    shared: Arc<Shared>,
    /// All threads but the caller's.
    workers: Vec<JoinHandle<()>>,
    /// Held by the caller whose job the workers run.
    submit: Mutex<()>,
    /// Whether the workers have been of use, by time.
    turns: Mutex<Turns>,
    /// A caller under [`Pool::keep_awake`] leaves the workers out.
    is_alone: AtomicBool,
    /// Of the kernels that it runs: the floating-point mode is theirs.
    isa: Isa,
}

impl Pool {
    /// A pool of `threads` threads, the caller of [`Pool::run`] included (0 counts as 1).
    ///
    /// # Errors
    /// [`PoolError::Spawn`] where the system refuses a thread.
    pub fn new(threads: usize) -> Result<Self, PoolError> {
        Self::of(Isa::Scalar, threads)
    }

    /// The same for kernels of a set.
    ///
    /// # Errors
    /// As [`Pool::new`].
    pub fn of(isa: Isa, threads: usize) -> Result<Self, PoolError> {
        let shared = Arc::new(Shared::new());
        let mut pool = Self {
            shared,
            workers: Vec::new(),
            submit: Mutex::new(()),
            turns: Mutex::new(Turns::default()),
            is_alone: AtomicBool::new(false),
            isa,
        };
        let count = threads.saturating_sub(1);
        for index in 0..count {
            let shared = Arc::clone(&pool.shared);
            let handle = std::thread::Builder::new()
                .name(format!("upt-worker-{}", index + 1))
                .stack_size(THREAD_STACK)
                .spawn(move || worker_loop(&shared, isa, index + 1))
                .map_err(|e| PoolError::Spawn {
                    index,
                    count,
                    message: e.to_string(),
                })?;
            pool.workers.push(handle);
        }
        Ok(pool)
    }

    /// Threads that may work on a job, the caller included: at least 1.
    pub fn threads(&self) -> usize {
        self.workers.len() + 1
    }

    /// Runs `task(chunk, worker)` for every `chunk` in `0..chunk_count` and returns when all are
    /// done. Denormals are flushed inside, but for portable kernels; the caller's floating-point mode is restored.
    ///
    /// If another thread's job (or an outer job of this thread) has the workers, all chunks run on
    /// the calling thread with `worker` 0: the same bits, no waiting. Scratch space indexed by
    /// `worker` must therefore belong to the caller.
    ///
    /// # Errors
    /// [`PoolError::Panicked`] names the first chunk seen to panic; others may not have run.
    pub fn run(&self, chunk_count: usize, task: &Task<'_>) -> Result<(), PoolError> {
        let _flush = FlushToZero::of(self.isa);
        // Whoever comes second computes alone: waiting for another scene's job would take longer than its own chunks.
        let submit = match self.submit.try_lock() {
            Ok(guard) => Some(guard),
            Err(std::sync::TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(std::sync::TryLockError::WouldBlock) => None,
        };
        let is_alone = self.workers.is_empty() || self.is_alone.load(Ordering::Relaxed);
        if chunk_count <= 1 || is_alone || submit.is_none() {
            return run_alone(chunk_count, task);
        }
        let shared = &*self.shared;
        // SAFETY: only the lifetime is erased. The job is taken back and all workers have left it
        // before this function returns, so none of them sees the task after its end.
        let task_address: *const Task<'static> =
            unsafe { std::mem::transmute::<*const Task<'_>, *const Task<'static>>(task) };
        {
            let mut state = shared.lock();
            shared.next.store(0, Ordering::Relaxed);
            shared.failed.store(false, Ordering::Relaxed);
            state.panic = None;
            // A new number, by which a worker tells this job from the one that it has just left.
            state.epoch += 1;
            state.job = Some(Job {
                task: task_address,
                chunk_count,
            });
            shared.epoch.store(state.epoch, Ordering::Release);
        }
        // As many as there are chunks beside the caller's own: the others sleep on.
        for _ in 0..self.workers.len().min(chunk_count - 1) {
            shared.wake.notify_one();
        }
        shared.work(task, chunk_count, 0);
        let mut state = shared.lock();
        // From here on no worker can enter; those inside are waited for, since the task is borrowed from the caller.
        state.job = None;
        // The last chunks end within microseconds of each other: a look is shorter than going to sleep.
        if state.active > 0 && shared.is_awake() {
            drop(state);
            shared.look(|| shared.active.load(Ordering::Acquire) == 0);
            state = shared.lock();
        }
        while state.active > 0 {
            state = shared
                .done
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
        match state.panic.take() {
            None => Ok(()),
            Some((chunk, message)) => Err(PoolError::Panicked {
                chunk,
                chunk_count,
                message,
            }),
        }
    }
}

/// Workers stay awake between jobs while this lives, or are left out of them.
pub struct Awake<'a> {
    pool: &'a Pool,
    /// Of the first of several at once, whose time is taken.
    start: Option<Instant>,
}

impl Drop for Awake<'_> {
    fn drop(&mut self) {
        let pool = self.pool;
        if let Some(start) = self.start {
            let is_alone = pool.is_alone.swap(false, Ordering::Relaxed);
            pool.turns().take(is_alone, start.elapsed());
        }
        pool.shared.awake.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Pool {
    /// Keeps workers from going to sleep between the short jobs of the next milliseconds. Where they have been of no use in the last of these, beside
    /// busy threads of others, these jobs are the caller's alone: the same bits.
    pub fn keep_awake(&self) -> Awake<'_> {
        let is_first = self.shared.awake.fetch_add(1, Ordering::Relaxed) == 0;
        let start = (is_first && !self.workers.is_empty()).then(|| {
            let is_alone = self.turns().next_is_alone();
            self.is_alone.store(is_alone, Ordering::Relaxed);
            Instant::now()
        });
        Awake { pool: self, start }
    }

    fn turns(&self) -> std::sync::MutexGuard<'_, Turns> {
        self.turns.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// As [`Pool::run`], for a job that does little but read `bytes` of a table: a small one stays on the
    /// calling thread, since waking another costs more than it saves. The same bits either way.
    ///
    /// # Errors
    /// As [`Pool::run`].
    pub fn run_streaming(
        &self,
        bytes: usize,
        chunk_count: usize,
        task: &Task<'_>,
    ) -> Result<(), PoolError> {
        let least = match self.shared.is_awake() {
            true => SPLIT_AWAKE_BYTES,
            false => SPLIT_BYTES,
        };
        if bytes >= least {
            return self.run(chunk_count, task);
        }
        let _flush = FlushToZero::of(self.isa);
        run_alone(chunk_count, task)
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.shared.lock().closing = true;
        self.shared.wake.notify_all();
        for handle in self.workers.drain(..) {
            // A worker catches every panic of a task; there is nothing to report here.
            let _ = handle.join();
        }
    }
}

/// All chunks on this thread, in their order, with the same catch of a panic.
fn run_alone(chunk_count: usize, task: &Task<'_>) -> Result<(), PoolError> {
    for chunk in 0..chunk_count {
        catch_unwind(AssertUnwindSafe(|| task(chunk, 0))).map_err(|payload| {
            PoolError::Panicked {
                chunk,
                chunk_count,
                message: panic_message(payload.as_ref()),
            }
        })?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
