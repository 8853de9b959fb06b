//! The same work on several threads at once, started and awaited by plain barriers: none of the library's thread pool.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Barrier};
use std::thread::JoinHandle;

type Work = Box<dyn FnMut() + Send>;

struct Shared {
    start: Barrier,
    end: Barrier,
    closing: AtomicBool,
}

/// Threads that wait between runs; the caller is one of them.
pub struct Crew {
    own: Work,
    shared: Arc<Shared>,
    others: Vec<JoinHandle<()>>,
}

impl Crew {
    /// A crew of `threads`, each with a work of its own.
    pub fn new<W: FnMut() + Send + 'static>(threads: usize, make: impl Fn() -> W) -> Self {
        let shared = Arc::new(Shared {
            start: Barrier::new(threads),
            end: Barrier::new(threads),
            closing: AtomicBool::new(false),
        });
        let other = |_| {
            let (mut work, shared) = (make(), Arc::clone(&shared));
            std::thread::spawn(move || {
                loop {
                    shared.start.wait();
                    if shared.closing.load(Ordering::Relaxed) {
                        return;
                    }
                    work();
                    shared.end.wait();
                }
            })
        };
        let others = (1..threads).map(other).collect();
        Self {
            own: Box::new(make()),
            shared,
            others,
        }
    }

    /// Runs every thread's work once.
    pub fn run(&mut self) {
        self.shared.start.wait();
        (self.own)();
        self.shared.end.wait();
    }
}

impl Drop for Crew {
    fn drop(&mut self) {
        self.shared.closing.store(true, Ordering::Relaxed);
        self.shared.start.wait();
        for other in self.others.drain(..) {
            let _ = other.join();
        }
    }
}
