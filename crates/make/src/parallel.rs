//! Work on several threads, with results in an order that does not depend on them.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::{Result, bail};

/// Threads as asked; 0: all.
pub fn workers(threads: usize) -> usize {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    if threads == 0 { cores } else { threads }
}

/// Runs `work` for 0, 1, 2 ... while `more` says so; results in that order.
pub fn in_parallel<T: Send>(
    workers: usize,
    more: &(dyn Fn(usize) -> bool + Sync),
    work: &(dyn Fn(usize) -> Result<T> + Sync),
) -> Result<Vec<T>> {
    let next = AtomicUsize::new(0);
    let finished: Mutex<Vec<(usize, T)>> = Mutex::new(Vec::new());
    let run = || -> Result<()> {
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            if !more(at) {
                return Ok(());
            }
            let found = work(at)?;
            finished
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push((at, found));
        }
    };
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..workers.max(1)).map(|_| scope.spawn(run)).collect();
        threads
            .into_iter()
            .try_for_each(|thread| thread.join().unwrap_or_else(|_| bail!("a thread panicked")))
    })?;
    let mut finished = finished
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner);
    finished.sort_by_key(|(at, _)| *at);
    Ok(finished.into_iter().map(|(_, found)| found).collect())
}
