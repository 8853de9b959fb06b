//! Room whose size a host or a bundle decides: asked for, so that there being none is an error and not the end of the
//! process.
//!
//! REQ-014: Where memory is missing for what a host or a bundle decides the size of, the call returns a status and nothing has changed.

mod held;

pub use self::held::{HeldBytes, behind};

use crate::error::{Error, Result};

/// The error of what there is no memory for.
pub fn none(bytes: usize, what: &str) -> Error {
    Error::OutOfMemory(format!("no memory for {what}: {bytes} bytes"))
}

/// Room for `count` more elements.
pub fn reserve<T>(list: &mut Vec<T>, count: usize, what: &str) -> Result<()> {
    list.try_reserve_exact(count)
        .map_err(|_| none(count.saturating_mul(size_of::<T>()), what))
}

/// One more element; the room doubles where there is none.
pub fn push<T>(list: &mut Vec<T>, value: T, what: &str) -> Result<()> {
    if list.len() == list.capacity() {
        reserve(list, list.len().max(64), what)?;
    }
    list.push(value);
    Ok(())
}

/// Room for `count` elements in all.
pub fn fit<T>(list: &mut Vec<T>, count: usize, what: &str) -> Result<()> {
    reserve(list, count.saturating_sub(list.len()), what)
}

/// The result of what asks for memory itself.
pub fn tried<T>(
    result: std::result::Result<T, std::collections::TryReserveError>,
    what: &str,
) -> Result<T> {
    result.map_err(|_| Error::OutOfMemory(format!("no memory for {what}")))
}

/// An empty list with room for `count` elements.
pub fn room<T>(count: usize, what: &str) -> Result<Vec<T>> {
    let mut list = Vec::new();
    reserve(&mut list, count, what)?;
    Ok(list)
}

/// `count` times `value`.
pub fn filled<T: Clone>(count: usize, value: T, what: &str) -> Result<Vec<T>> {
    let mut list = room(count, what)?;
    list.resize(count, value);
    Ok(list)
}

/// `count` zeros.
pub fn zeros(count: usize, what: &str) -> Result<Vec<f32>> {
    filled(count, 0.0, what)
}

/// A copy.
pub fn copied<T: Copy>(values: &[T], what: &str) -> Result<Vec<T>> {
    let mut list = room(values.len(), what)?;
    list.extend_from_slice(values);
    Ok(list)
}

/// What an iterator of `count` elements at most gives.
pub fn collected<T>(
    count: usize,
    values: impl IntoIterator<Item = T>,
    what: &str,
) -> Result<Vec<T>> {
    let mut list = room(count, what)?;
    list.extend(values.into_iter().take(count));
    Ok(list)
}

/// A value on the heap.
pub fn boxed<T>(value: T, what: &str) -> Result<Box<T>> {
    let mut list = room(1, what)?;
    list.push(value);
    let one: Box<[T]> = list.into_boxed_slice();
    // SAFETY: a slice of one element lies where the element does, and has its layout; also one without a size.
    Ok(unsafe { Box::from_raw(Box::into_raw(one).cast::<T>()) })
}

/// Whether there is room for `bytes` now: asked before a part is made of many lists, so that it fails as a whole or not at all.
pub fn probe(bytes: usize, what: &str) -> Result<()> {
    room::<u8>(bytes, what).map(drop)
}

/// Replaces what is in `list`.
pub fn replace<T: Copy>(list: &mut Vec<T>, values: &[T], what: &str) -> Result<()> {
    list.clear();
    reserve(list, values.len(), what)?;
    list.extend_from_slice(values);
    Ok(())
}

/// Gives freed memory back to the system when it is dropped: glibc's allocator would keep what many scenes took until the
/// process ends.
pub struct GivenBack;

impl Drop for GivenBack {
    fn drop(&mut self) {
        #[cfg(all(target_os = "linux", target_env = "gnu"))]
        // SAFETY: takes no memory that is in use.
        unsafe {
            libc::malloc_trim(0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_absurd_size_is_an_error_that_names_it() {
        let error = zeros(usize::MAX / 8, "a test").unwrap_err();
        assert_eq!(error.status(), -9);
        assert!(error.to_string().contains("a test"), "{error}");
        assert_eq!(filled(3, 7u8, "three").unwrap(), [7, 7, 7]);
        assert_eq!(collected(2, 0..9, "two").unwrap(), [0, 1]);
        assert_eq!(*boxed([1, 2, 3], "one").unwrap(), [1, 2, 3]);
    }
}
