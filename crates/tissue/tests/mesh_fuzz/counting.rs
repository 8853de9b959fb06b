//! An allocator that counts, and ends the process with the name of the file when a reader takes more than a gigabyte: a real lack of
//! memory would end the whole machine's tests.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Bytes at once that end the process.
const FATAL: usize = 1 << 30;

static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
static BYTES: AtomicUsize = AtomicUsize::new(0);
static COUNT: AtomicUsize = AtomicUsize::new(0);
static NAME: Mutex<String> = Mutex::new(String::new());

struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn taken(bytes: usize) {
    let live = LIVE.fetch_add(bytes, Relaxed) + bytes;
    PEAK.fetch_max(live, Relaxed);
    BYTES.fetch_add(bytes, Relaxed);
    COUNT.fetch_add(1, Relaxed);
    if live > FATAL {
        LIVE.store(0, Relaxed); // The message may allocate.
        if let Ok(name) = NAME.try_lock() {
            eprintln!("{name}: more than {FATAL} bytes at once");
        }
        std::process::abort();
    }
}

// SAFETY: every call goes to the system's allocator as it is; what is added only counts.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        taken(layout.size());
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        taken(layout.size());
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        taken(size);
        LIVE.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.realloc(place, layout, size) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(place, layout) }
    }
}

/// What a call allocates.
#[derive(Clone, Copy, Debug, Default)]
pub struct Use {
    /// Bytes at once.
    pub peak: usize,
    /// Bytes in all.
    pub bytes: usize,
    pub allocations: usize,
}

impl Use {
    /// Whether a file of this length may take that: some thousand times its length where arrays are packed, not its square.
    pub fn within(&self, length: usize) -> bool {
        self.peak < (64 << 20) + 1000 * length
            && self.bytes < (128 << 20) + 4000 * length
            && self.allocations < 10_000 + 200 * length
    }

    pub fn or(self, other: Self) -> Self {
        Self {
            peak: self.peak.max(other.peak),
            bytes: self.bytes.max(other.bytes),
            allocations: self.allocations.max(other.allocations),
        }
    }
}

/// Runs `call` and counts; `name` is what is said if it takes more than a gigabyte.
pub fn during<T>(name: &str, call: impl FnOnce() -> T) -> (Use, T) {
    if let Ok(mut place) = NAME.lock() {
        name.clone_into(&mut place);
    }
    let live = LIVE.load(Relaxed);
    PEAK.store(live, Relaxed);
    let (bytes, count) = (BYTES.load(Relaxed), COUNT.load(Relaxed));
    let out = call();
    let used = Use {
        peak: PEAK.load(Relaxed).saturating_sub(live),
        bytes: BYTES.load(Relaxed) - bytes,
        allocations: COUNT.load(Relaxed) - count,
    };
    (used, out)
}
