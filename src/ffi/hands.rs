//! Live haptics objects, found without a lock: a fixed table whose places are taken and given back by one atomic exchange, so that a thread that
//! renders never waits for one that makes or destroys another.
//!
//! A place's state is one word: free, or the handle of its object with two bits beside it. Whoever
//! exchanges the plain handle for the busy one has the object until it stores the state again;
//! everyone else is told that it is busy, and nobody waits. Acquire at the exchange and Release at
//! the store hand the object from thread to thread. Handles are never used twice, so an old one
//! finds no place, whatever lies there now.

use std::cell::UnsafeCell;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::constants::*;
use super::failure::{Failure, fail};
use super::registry::{next_hand, refuse_hand};
use crate::haptics::Haptics;
use crate::memory;

/// Haptics objects of a process.
const MOST: usize = 64;

/// A free place; handles are larger.
const FREE: usize = 0;
/// The lowest digits of a handle are its kind: these say what its place does.
const BUSY: usize = 1 << (usize::BITS - 1);
/// A bug was caught in a call on it.
const BROKEN: usize = 1 << (usize::BITS - 2);

struct Place {
    /// [`FREE`], or a handle with what it does.
    state: AtomicUsize,
    /// The object; none in a free place, and for a moment while one is added or ended.
    hand: UnsafeCell<Option<Box<Haptics>>>,
}

// SAFETY: the cell is touched only by the thread whose exchange made the state busy.
unsafe impl Sync for Place {}

static PLACES: [Place; MOST] = [const {
    Place {
        state: AtomicUsize::new(FREE),
        hand: UnsafeCell::new(None),
    }
}; MOST];

/// A place that this thread alone has until it is dropped.
struct Taken {
    place: &'static Place,
    /// What the state becomes.
    then: usize,
}

impl Taken {
    fn hand(&mut self) -> &mut Option<Box<Haptics>> {
        // SAFETY: this thread's exchange made the place busy, and `self` is borrowed.
        unsafe { &mut *self.place.hand.get() }
    }
}

impl Drop for Taken {
    fn drop(&mut self) {
        // A panic went through a call on the object, which may be half changed: it is only good for
        // being destroyed.
        let broken = if std::thread::panicking() { BROKEN } else { 0 };
        let state = match self.then {
            FREE => FREE,
            handle => handle | broken,
        };
        self.place.state.store(state, Ordering::Release);
    }
}

/// The place of an object, and whether it is broken.
///
/// # Errors
/// Busy where another thread is in a call, and what [`refuse_hand`] says of a handle that is none
/// of a living object.
fn take(handle: usize) -> Result<(Taken, bool), Failure> {
    if handle & (BUSY | BROKEN) != 0 || handle == FREE {
        return refuse_hand(handle);
    }
    for place in &PLACES {
        // Only looked at to find the place; the exchange below is what counts.
        let state = place.state.load(Ordering::Relaxed);
        if state & !(BUSY | BROKEN) != handle {
            continue;
        }
        let busy = || {
            fail(
                UPT_ERR_BUSY,
                "another thread is in a call on this haptics object",
            )
        };
        if state & BUSY != 0 {
            return busy();
        }
        let exchange = place.state.compare_exchange(
            state,
            handle | BUSY,
            Ordering::Acquire,
            Ordering::Relaxed,
        );
        return match exchange {
            Ok(_) => {
                let then = handle;
                Ok((Taken { place, then }, state & BROKEN != 0))
            }
            Err(now) if now & !(BUSY | BROKEN) == handle => busy(),
            Err(_) => refuse_hand(handle),
        };
    }
    refuse_hand(handle)
}

/// Gives an object a place and a number.
pub(super) fn add(hand: Haptics) -> Result<usize, Failure> {
    let handle = next_hand();
    let hand = memory::boxed(hand, "the haptics of a scene")?;
    for place in &PLACES {
        let exchange =
            place
                .state
                .compare_exchange(FREE, handle | BUSY, Ordering::Acquire, Ordering::Relaxed);
        if exchange.is_ok() {
            let mut taken = Taken {
                place,
                then: handle,
            };
            *taken.hand() = Some(hand);
            return Ok(handle);
        }
    }
    fail(
        UPT_ERR_ARGUMENT,
        format!("{MOST} haptics objects are alive; destroy one first"),
    )
}

/// Calls with an object.
pub(super) fn with<T>(
    handle: usize,
    call: impl FnOnce(&mut Haptics) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let (mut taken, broken) = take(handle)?;
    if broken {
        taken.then = handle | BROKEN;
        return fail(
            UPT_ERR_PANIC,
            "a bug was caught in an earlier call on this haptics object; destroy it",
        );
    }
    match taken.hand() {
        Some(hand) => call(hand),
        None => refuse_hand(handle),
    }
}

/// Ends an object.
pub(super) fn remove(handle: usize) -> Result<(), Failure> {
    let (mut taken, _) = take(handle)?;
    taken.then = FREE;
    drop(taken.hand().take());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Tool;
    use crate::haptics::HapticOptions;
    use crate::haptics::test_hand;

    fn hand() -> Haptics {
        let shape = ::contact::Shape::Sphere { radius: 3.0 };
        let tool = Tool::new(&shape, [0.0; 3], [0.0, 0.0, 0.0, 1.0]).unwrap();
        test_hand(&HapticOptions::new(0, tool))
    }

    /// Threads that find, make and end objects at once: each call has the object alone, or is told that it has not.
    #[test]
    fn one_thread_at_a_time_has_an_object() {
        let turns = if cfg!(miri) { 20 } else { 20_000 };
        let shared = add(hand()).map_err(|e| e.message).unwrap();
        let inside = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(|| {
                    for turn in 0..turns {
                        let done = with(shared, |_| {
                            assert_eq!(inside.fetch_add(1, Ordering::AcqRel), 0);
                            inside.fetch_sub(1, Ordering::AcqRel);
                            Ok(())
                        });
                        assert!(done.map_or_else(|e| e.status == UPT_ERR_BUSY, |()| true));
                        if turn % 50 == 0 {
                            let own = add(hand()).map_err(|e| e.message).unwrap();
                            assert!(with(own, |_| Ok(())).is_ok());
                            assert!(remove(own).is_ok());
                            assert!(
                                with(own, |_| Ok(())).is_err_and(|e| e.status == UPT_ERR_HANDLE)
                            );
                        }
                    }
                });
            }
        });
        assert!(remove(shared).is_ok());
        assert!(remove(shared).is_err());
    }
}
