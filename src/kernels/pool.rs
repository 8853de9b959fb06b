//! Threads for one step: `threads - 1` parked workers and the caller.
//!
//! A job is `chunk_count` independent chunks, taken in order from one counter. What a chunk
//! computes may depend on its index only, never on the thread that runs it, so results have the
//! same bits for any thread count. Between jobs workers sleep on a condition variable: the game owns
//! the cores. Only while a caller holds [`Pool::keep_awake`], for the few milliseconds of many short jobs
//! in a row, does a worker look for the next one for [`LOOKS`] turns before it sleeps. `run` allocates
//! nothing. A worker that wakes late finds the job closed and goes back to sleep, so `run` never waits
//! for a thread that has not started.

use super::flush::FlushToZero;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// Bytes from which on streaming a table is split over threads. Waking a worker and waiting for its last chunk costs what
/// one core reads in the meantime, some megabytes from cache. Measured (`cargo bench --bench kernels -- pool`, two cores that share
/// their memory with others): reading alone gains nothing from a second thread up to 32 MB and loses below 4 MB; the products over the
/// tables of a large mesh, which also compute, take a quarter less time on two (`brain-fine-reduced` in docs/results/performance.md).
const SPLIT_BYTES: usize = 8 << 20;

/// The same while workers are kept awake: the next job costs a look at one number in place of waking a thread.
const SPLIT_AWAKE_BYTES: usize = 256 << 10;

/// Looks of a worker that is kept awake for the next job, and of a caller for the end of one, before it sleeps: about 0.1 ms.
const LOOKS: u32 = 2000;

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

/// What runs a chunk: `(chunk, worker)`, `worker < threads()` names the scratch space that this
/// thread may use during the chunk.
type Task<'a> = dyn Fn(usize, usize) + Sync + 'a;

/// A job's address as the workers see it; valid while `run` has it published.
#[derive(Clone, Copy)]
struct Job {
    task: *const Task<'static>,
    chunk_count: usize,
}
// SAFETY: the task is `Sync` and outlives the job (see `Pool::run`).
unsafe impl Send for Job {}

struct State {
    job: Option<Job>,
    epoch: u64,
    active: usize,
    closing: bool,
    panic: Option<(usize, String)>,
}

struct Shared {
    state: Mutex<State>,
    wake: Condvar,
    done: Condvar,
    next: AtomicUsize,
    failed: AtomicBool,
    /// Callers that hold [`Pool::keep_awake`].
    awake: AtomicUsize,
    /// `State::epoch` and `State::active` for those that look without the lock.
    epoch: AtomicU64,
    active: AtomicUsize,
}

impl Shared {
    fn is_awake(&self) -> bool {
        self.awake.load(Ordering::Relaxed) > 0
    }

    /// Looks, for a while, until `found`.
    fn look(&self, found: impl Fn() -> bool) {
        for _ in 0..LOOKS {
            if found() || !self.is_awake() {
                return;
            }
            std::hint::spin_loop();
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes chunks until none is left or one has panicked.
    fn work(&self, task: &Task<'_>, chunk_count: usize, worker: usize) {
        while !self.failed.load(Ordering::Relaxed) {
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

/// A small thread pool. Shared by reference; any thread may call [`Pool::run`].
pub struct Pool {
    shared: Arc<Shared>,
    workers: Vec<JoinHandle<()>>,
    /// Held by the caller whose job the workers run.
    submit: Mutex<()>,
}

impl Pool {
    /// A pool of `threads` threads, the caller of [`Pool::run`] included (0 counts as 1).
    ///
    /// # Errors
    /// [`PoolError::Spawn`] where the system refuses a thread.
    pub fn new(threads: usize) -> Result<Self, PoolError> {
        let shared = Arc::new(Shared {
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
        });
        let mut pool = Self {
            shared,
            workers: Vec::new(),
            submit: Mutex::new(()),
        };
        let count = threads.saturating_sub(1);
        for index in 0..count {
            let shared = Arc::clone(&pool.shared);
            let handle = std::thread::Builder::new()
                .name(format!("upt-worker-{}", index + 1))
                .spawn(move || worker_loop(&shared, index + 1))
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
    /// done. Denormals are flushed inside; the caller's floating-point mode is restored.
    ///
    /// If another thread's job (or an outer job of this thread) has the workers, all chunks run on
    /// the calling thread with `worker` 0: the same bits, no waiting. Scratch space indexed by
    /// `worker` must therefore belong to the caller.
    ///
    /// # Errors
    /// [`PoolError::Panicked`] names the first chunk seen to panic; others may not have run.
    pub fn run(&self, chunk_count: usize, task: &Task<'_>) -> Result<(), PoolError> {
        let _flush = FlushToZero::enter();
        let submit = match self.submit.try_lock() {
            Ok(guard) => Some(guard),
            Err(std::sync::TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(std::sync::TryLockError::WouldBlock) => None,
        };
        if chunk_count <= 1 || self.workers.is_empty() || submit.is_none() {
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
            state.epoch += 1;
            state.job = Some(Job {
                task: task_address,
                chunk_count,
            });
            shared.epoch.store(state.epoch, Ordering::Release);
        }
        for _ in 0..self.workers.len().min(chunk_count - 1) {
            shared.wake.notify_one();
        }
        shared.work(task, chunk_count, 0);
        let mut state = shared.lock();
        state.job = None;
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

/// Workers stay awake between jobs while this lives.
pub struct Awake<'a>(&'a Shared);

impl Drop for Awake<'_> {
    fn drop(&mut self) {
        self.0.awake.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Pool {
    /// Keeps workers from going to sleep between the short jobs of the next milliseconds.
    pub fn keep_awake(&self) -> Awake<'_> {
        self.shared.awake.fetch_add(1, Ordering::Relaxed);
        Awake(&self.shared)
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
        let _flush = FlushToZero::enter();
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

fn worker_loop(shared: &Shared, worker: usize) {
    let _flush = FlushToZero::enter();
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

fn panic_message(payload: &(dyn std::any::Any + Send)) -> String {
    payload
        .downcast_ref::<&str>()
        .map(|s| (*s).to_owned())
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicU32;

    #[test]
    fn every_chunk_runs_once_for_any_thread_count() {
        for threads in [0, 1, 2, 4, 7] {
            let pool = Pool::new(threads).unwrap();
            for chunk_count in [0, 1, 2, 3, 1000] {
                let hits: Vec<AtomicU32> = (0..chunk_count).map(|_| AtomicU32::new(0)).collect();
                pool.run(chunk_count, &|chunk, worker| {
                    assert!(worker < pool.threads());
                    hits[chunk].fetch_add(1, Ordering::Relaxed);
                })
                .unwrap();
                assert!(hits.iter().all(|h| h.load(Ordering::Relaxed) == 1));
            }
        }
    }

    #[test]
    fn a_small_table_stays_on_the_calling_thread() {
        let pool = Pool::new(4).unwrap();
        let caller = std::thread::current().id();
        let hits = AtomicUsize::new(0);
        pool.run_streaming(SPLIT_BYTES - 1, 1000, &|_, worker| {
            assert_eq!((worker, std::thread::current().id()), (0, caller));
            hits.fetch_add(1, Ordering::Relaxed);
        })
        .unwrap();
        pool.run_streaming(SPLIT_BYTES, 1000, &|_, _| {
            hits.fetch_add(1, Ordering::Relaxed);
        })
        .unwrap();
        assert_eq!(hits.load(Ordering::Relaxed), 2000);
    }

    #[test]
    fn many_short_jobs_do_not_lose_a_wake_up() {
        let pool = Pool::new(3).unwrap();
        let total = AtomicUsize::new(0);
        let mut awake = None;
        for job in 0..20_000 {
            // Workers that sleep, that look, and that stop looking.
            if job % 1000 == 500 {
                awake = match awake {
                    None => Some(pool.keep_awake()),
                    Some(_) => None,
                };
            }
            pool.run(4, &|_, _| {
                total.fetch_add(1, Ordering::Relaxed);
            })
            .unwrap();
        }
        drop(awake);
        assert_eq!(total.load(Ordering::Relaxed), 80_000);
    }

    #[test]
    fn a_pool_that_is_kept_awake_splits_small_tables_and_ends() {
        let pool = Pool::new(3).unwrap();
        let run = || {
            let hits: Vec<AtomicU32> = (0..100).map(|_| AtomicU32::new(0)).collect();
            pool.run_streaming(SPLIT_AWAKE_BYTES, 100, &|chunk, _| {
                hits[chunk].fetch_add(1, Ordering::Relaxed);
            })
            .unwrap();
            hits.iter().all(|hit| hit.load(Ordering::Relaxed) == 1)
        };
        let awake = pool.keep_awake();
        let inner = pool.keep_awake();
        assert!(run());
        drop(inner);
        assert!(pool.shared.is_awake() && run());
        drop(awake);
        assert!(!pool.shared.is_awake() && run());
        // Workers that look when the pool ends.
        let awake = pool.keep_awake();
        std::mem::forget(awake);
        assert!(run());
    }

    #[test]
    fn a_panic_is_an_error_and_the_pool_lives_on() {
        let pool = Pool::new(3).unwrap();
        let hook = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| {}));
        let result = pool.run(50, &|chunk, _| assert!(chunk != 17, "seventeen"));
        let alone = Pool::new(1).unwrap().run(2, &|_, _| panic!("always"));
        std::panic::set_hook(hook);
        assert_eq!(
            result,
            Err(PoolError::Panicked {
                chunk: 17,
                chunk_count: 50,
                message: "seventeen".to_owned()
            })
        );
        assert!(alone.is_err());
        assert_eq!(pool.run(8, &|_, _| {}), Ok(()));
    }

    #[test]
    fn nested_and_concurrent_jobs_finish() {
        let pool = Pool::new(2).unwrap();
        let total = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..200 {
                        pool.run(3, &|_, _| {
                            pool.run(2, &|_, _| {
                                total.fetch_add(1, Ordering::Relaxed);
                            })
                            .unwrap();
                        })
                        .unwrap();
                    }
                });
            }
        });
        assert_eq!(total.load(Ordering::Relaxed), 4 * 200 * 3 * 2);
    }

    #[test]
    fn the_callers_floating_point_mode_is_untouched() {
        let pool = Pool::new(2).unwrap();
        let before = super::super::flush::read_mode() & !0x3f;
        pool.run(4, &|_, _| {}).unwrap();
        assert_eq!(super::super::flush::read_mode() & !0x3f, before);
    }
}
