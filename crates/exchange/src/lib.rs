//! The latest value from one thread to another, through three buffers.
//!
//! The writer fills a buffer of its own and publishes it; the reader takes the last one that was published. Neither locks, waits
//! or allocates; what is published twice between two looks is seen once. One atomic byte says which buffer lies between them and whether
//! the reader has seen it:
//!
//! | who | has | does |
//! |---|---|---|
//! | writer | one buffer | swaps it, full, for the one between |
//! | between | one buffer | |
//! | reader | one buffer | swaps it, read, for the one between, if that is new |
//!
//! Both swaps release what their thread did with the buffer that it gives and acquire what the other did with the one that it gets.

use std::marker::PhantomData;

#[cfg(loom)]
use loom::{
    cell::UnsafeCell,
    sync::Arc,
    sync::atomic::{AtomicU8, Ordering},
};
#[cfg(not(loom))]
use std::{
    sync::Arc,
    sync::atomic::{AtomicU8, Ordering},
};

/// As loom's: a cell whose accesses it looks at.
#[cfg(not(loom))]
struct UnsafeCell<T>(std::cell::UnsafeCell<T>);

#[cfg(not(loom))]
impl<T> UnsafeCell<T> {
    fn new(value: T) -> UnsafeCell<T> {
        UnsafeCell(std::cell::UnsafeCell::new(value))
    }

    fn with<R>(&self, see: impl FnOnce(*const T) -> R) -> R {
        see(self.0.get())
    }

    fn with_mut<R>(&self, see: impl FnOnce(*mut T) -> R) -> R {
        see(self.0.get())
    }
}

/// The buffer between the two has not been seen by the reader.
const NEW: u8 = 4;
const PLACE: u8 = 3;

/// Apart from the others by two cache lines, which processors fetch together.
#[repr(align(128))]
struct Apart<T>(T);

struct Shared<T> {
    slots: [Apart<UnsafeCell<T>>; 3],
    /// Place of the buffer that is nobody's, and [`NEW`].
    between: Apart<AtomicU8>,
}

// SAFETY: each buffer belongs to one end or lies between them, so no two threads ever see the same one; it goes from thread to thread
// by swaps of `between` that release and acquire, which needs `T: Send` and no more.
unsafe impl<T: Send> Sync for Shared<T> {}

/// The end that publishes.
pub struct Writer<T> {
    shared: Arc<Shared<T>>,
    own: u8,
}

/// The end that reads.
pub struct Reader<T> {
    shared: Arc<Shared<T>>,
    own: u8,
    /// It shows a `T` to whoever has it: shared between threads only where `T` may be.
    shows: PhantomData<T>,
}

/// Both ends of three buffers. Nothing is published yet.
pub fn exchange<T>(buffers: [T; 3]) -> (Writer<T>, Reader<T>) {
    let shared = Arc::new(Shared {
        slots: buffers.map(|buffer| Apart(UnsafeCell::new(buffer))),
        between: Apart(AtomicU8::new(1)),
    });
    let writer = Writer {
        shared: Arc::clone(&shared),
        own: 0,
    };
    let reader = Reader {
        shared,
        own: 2,
        shows: PhantomData,
    };
    (writer, reader)
}

impl<T> Writer<T> {
    /// The buffer that is published next. It holds a value from some earlier time.
    pub fn buffer(&mut self) -> &mut T {
        // SAFETY: the buffer at `own` is this end's alone until it is published, for which this borrow must be over.
        self.shared.slots[usize::from(self.own)]
            .0
            .with_mut(|slot| unsafe { &mut *slot })
    }

    /// Publishes the buffer.
    pub fn publish(&mut self) {
        let before = self.shared.between.0.swap(self.own | NEW, Ordering::AcqRel);
        self.own = before & PLACE;
    }

    /// Publishes a value.
    pub fn write(&mut self, value: T) {
        *self.buffer() = value;
        self.publish();
    }
}

impl<T> Reader<T> {
    /// Takes the last published buffer. False if there is none that has not been seen.
    pub fn update(&mut self) -> bool {
        let between = &self.shared.between.0;
        // Only this end takes the mark away, so it is still there at the swap.
        if between.load(Ordering::Relaxed) & NEW == 0 {
            return false;
        }
        self.own = between.swap(self.own, Ordering::AcqRel) & PLACE;
        true
    }

    /// What was taken last.
    pub fn buffer(&self) -> &T {
        // SAFETY: the buffer at `own` is this end's alone until `update`, for which this borrow must be over; where
        // threads share a `Reader`, `T` is `Sync`.
        self.shared.slots[usize::from(self.own)]
            .0
            .with(|slot| unsafe { &*slot })
    }

    /// The last published value.
    pub fn read(&mut self) -> &T {
        self.update();
        self.buffer()
    }
}
