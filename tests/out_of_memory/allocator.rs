//! An allocator that refuses one request after another, wherever a call makes it.

use std::alloc::{GlobalAlloc, Layout, System};
use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, AtomicIsize, AtomicUsize, Ordering};

struct Refusing;

/// Least bytes of a request that may be refused.
static LEAST: AtomicUsize = AtomicUsize::new(0);
/// Requests of that size until one is refused; negative: none is.
static LEFT: AtomicIsize = AtomicIsize::new(-1);
static REFUSED: AtomicBool = AtomicBool::new(false);
/// A call is being made: what the host takes between its calls is its own.
static CALLED: AtomicBool = AtomicBool::new(false);

fn refuses(size: usize) -> bool {
    let counts = CALLED.load(Ordering::Relaxed) && size >= LEAST.load(Ordering::Relaxed);
    if !counts || LEFT.load(Ordering::Relaxed) < 0 {
        return false;
    }
    let refused = LEFT.fetch_sub(1, Ordering::Relaxed) == 0;
    if refused {
        REFUSED.store(true, Ordering::Relaxed);
        if std::env::var_os("UPT_TEST_BACKTRACE").is_some() {
            eprintln!(
                "{size} bytes refused:\n{}",
                std::backtrace::Backtrace::force_capture()
            );
        }
    }
    refused
}

// SAFETY: passes what it does not refuse on to the system's allocator.
unsafe impl GlobalAlloc for Refusing {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if refuses(layout.size()) {
            return null_mut();
        }
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if refuses(size) {
            return null_mut();
        }
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Refusing = Refusing;

/// Calls with [`counted`] request `at` of those of `least` bytes or more refused, once; tells whether there were so many.
pub fn without<T>(least: usize, at: usize, call: impl FnOnce() -> T) -> (T, bool) {
    REFUSED.store(false, Ordering::Relaxed);
    LEAST.store(least, Ordering::Relaxed);
    LEFT.store(at as isize, Ordering::Relaxed);
    let made = call();
    LEFT.store(-1, Ordering::Relaxed);
    (made, REFUSED.load(Ordering::Relaxed))
}

/// Makes a call whose requests count.
pub fn counted<T>(call: impl FnOnce() -> T) -> T {
    CALLED.store(true, Ordering::Relaxed);
    let made = call();
    CALLED.store(false, Ordering::Relaxed);
    made
}
