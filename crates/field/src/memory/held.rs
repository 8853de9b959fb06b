//! [`HeldBytes`]: how much of the heap a value holds, for the statistics of models and scenes.
//!
//! Derived (`crates/held`), so that a new field counts without a line of its own. Lists count with their capacity. What others share, in
//! an `Arc`, is no one's alone: the type does not implement the trait, so whoever holds one says whose it is, `#[held(skip)]` or
//! `#[held(own)]`.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::clock::Instant;

use ::contact::{Candidate, Contact, Grasp, Pose, Search, Sweeps, Tie, Vector};
use half::{bf16, f16};

pub use ::held::HeldBytes;

/// Bytes of the heap that a value holds, itself not included.
pub trait HeldBytes {
    /// No value of the type holds any, so that a list of many needs no look at each.
    const PLAIN: bool = false;

    /// Bytes held.
    /// Not that of the allocator, which rounds up.
    fn held_bytes(&self) -> usize;
}

/// Types that hold nothing of the heap.
macro_rules! plain {
    ($($plain:ty),* $(,)?) => {$(
        impl HeldBytes for $plain {
            const PLAIN: bool = true;

            fn held_bytes(&self) -> usize {
                0
            }
        }
    )*};
}

plain!(bool, u8, u16, u32, u64, usize, i32, f16, bf16, f32, f64);
plain!(Duration, Instant, lanes::Isa, std::ops::Range<usize>);
plain!(Candidate, Contact, Grasp, Pose, Tie, Vector);

/// A type of another crate that says itself what it holds.
macro_rules! told {
    ($($other:ty: $says:ident),* $(,)?) => {$(
        impl HeldBytes for $other {
            fn held_bytes(&self) -> usize {
                self.$says()
            }
        }
    )*};
}

told!(elements::StressHistory: bytes, elements::Region: bytes);
told!(Search: memory_bytes, Sweeps: memory_bytes);
told!(elements::ElementForces: bytes, elements::Scratch: bytes, elements::Subset: bytes);

impl<T: HeldBytes> HeldBytes for [T] {
    fn held_bytes(&self) -> usize {
        match T::PLAIN {
            true => 0,
            false => self.iter().map(T::held_bytes).sum(),
        }
    }
}

impl<T: HeldBytes, const N: usize> HeldBytes for [T; N] {
    const PLAIN: bool = T::PLAIN;

    fn held_bytes(&self) -> usize {
        self.as_slice().held_bytes()
    }
}

impl<T: HeldBytes> HeldBytes for Vec<T> {
    fn held_bytes(&self) -> usize {
        size_of::<T>() * self.capacity() + self.as_slice().held_bytes()
    }
}

impl HeldBytes for String {
    fn held_bytes(&self) -> usize {
        self.capacity()
    }
}

impl<T: HeldBytes> HeldBytes for Box<T> {
    fn held_bytes(&self) -> usize {
        size_of::<T>() + (**self).held_bytes()
    }
}

impl<T: HeldBytes> HeldBytes for Option<T> {
    const PLAIN: bool = T::PLAIN;

    fn held_bytes(&self) -> usize {
        self.as_ref().map_or(0, T::held_bytes)
    }
}

/// Bytes behind an `Arc`, for the one holder who says `#[held(own)]`.
pub fn behind<T: HeldBytes>(shared: &Arc<T>) -> usize {
    size_of::<T>() + shared.held_bytes()
}

/// What cannot be looked at counts as nothing.
impl<T: HeldBytes> HeldBytes for Mutex<T> {
    fn held_bytes(&self) -> usize {
        self.lock().map_or(0, |value| value.held_bytes())
    }
}

/// Tuples hold what their parts do.
macro_rules! tuples {
    ($(($($name:ident)*))*) => {$(
        impl<$($name: HeldBytes),*> HeldBytes for ($($name,)*) {
            const PLAIN: bool = true $(&& $name::PLAIN)*;

            #[allow(non_snake_case, reason = "the type's letter names its part")]
            fn held_bytes(&self) -> usize {
                let ($($name,)*) = self;
                0 $(+ $name.held_bytes())*
            }
        }
    )*};
}

tuples!((A B)(A B C));

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(HeldBytes)]
    struct Inner {
        floats: Vec<f32>,
        #[held(skip)]
        _shared: Arc<Vec<f32>>,
        #[held(own)]
        own: Arc<Vec<u8>>,
    }

    #[derive(HeldBytes)]
    enum Outer {
        One {
            inner: Box<Inner>,
            rest: [Vec<u8>; 2],
        },
        Two(Option<String>, usize),
        Three,
    }

    #[test]
    fn every_field_counts_with_its_room_and_a_shared_one_does_not() {
        let inner = Inner {
            floats: Vec::with_capacity(10),
            _shared: Arc::new(vec![0.0; 100]),
            own: Arc::new(vec![0; 5]),
        };
        let held = 40 + size_of::<Vec<u8>>() + 5;
        assert_eq!(inner.held_bytes(), held);
        let rest = [vec![1; 3], Vec::new()];
        let one = Outer::One {
            inner: Box::new(inner),
            rest,
        };
        assert_eq!(one.held_bytes(), size_of::<Inner>() + held + 3);
        assert_eq!(Outer::Two(Some("four".into()), 5).held_bytes(), 4);
        assert_eq!(Outer::Three.held_bytes(), 0);
        assert_eq!(vec![vec![0.0f64; 2]; 3].held_bytes(), 3 * (24 + 16));
        const { assert!(<[(u32, Option<f32>); 3]>::PLAIN && !<Option<Vec<f32>>>::PLAIN) };
    }
}
