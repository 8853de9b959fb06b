//! What a random call turns its numbers into: pointers, counts, spoiled values.

use std::ptr::{null, null_mut};

use super::{Call, Odd, Size};

/// What an output holds before a call, so that a write can be seen.
pub const UNTOUCHED: f32 = -7.7e7;

/// xorshift.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % limit.max(1)
    }
}

pub fn pointer<T>(values: &[T], call: &Call, index: u8) -> *const T {
    if call.null >> index & 1 == 1 {
        null()
    } else {
        values.as_ptr()
    }
}

pub fn pointer_mut<T>(values: &mut [T], call: &Call, index: u8) -> *mut T {
    if call.null >> index & 1 == 1 {
        null_mut()
    } else {
        values.as_mut_ptr()
    }
}

/// The count that is passed, and a buffer that is at least as long where the count is possible.
pub fn count(right: usize, size: Size) -> (u64, usize) {
    let passed = match size {
        Size::Right => right as u64,
        Size::Zero => 0,
        Size::Short => right.saturating_sub(1) as u64,
        Size::Long => right as u64 + 1,
        Size::Absurd => u64::MAX - 3,
    };
    (passed, right + 8)
}

/// A count of a list of nodes: the right one, or one that no list of a mesh of `nodes` nodes can have.
pub fn absurd(right: usize, nodes: usize, call: &Call) -> u64 {
    let nodes = nodes as u64;
    match call.size {
        Size::Absurd => {
            let counts = [nodes + 1, 100 * nodes, 1 << 31, 1 << 59, u64::MAX - 3];
            counts[call.seed as usize / 7 % counts.len()]
        }
        _ => right as u64,
    }
}

pub fn spoil(values: &mut [f32], odd: Odd, at: usize) {
    let value = match odd {
        Odd::None | Odd::Wrong => return,
        Odd::NaN => f32::NAN,
        Odd::Infinity => f32::NEG_INFINITY,
        Odd::Huge => 1e30,
        Odd::Denormal => 1e-42,
    };
    let length = values.len().max(1);
    if let Some(place) = values.get_mut(at % length) {
        *place = value;
    }
}

pub fn sized<T>(call: &Call) -> u32 {
    size_of::<T>() as u32 + u32::from(call.odd == Odd::Wrong && call.seed.is_multiple_of(3))
}

pub fn message() -> String {
    let text = unsafe { std::ffi::CStr::from_ptr(upt::ffi::upt_last_error()) };
    text.to_string_lossy().into_owned()
}
