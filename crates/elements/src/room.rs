//! Lists that are asked for: a body that there is no memory for is an error and not the end of the process.

use std::collections::TryReserveError;

/// An empty list with room for `count` elements.
pub fn room<T>(count: usize) -> Result<Vec<T>, TryReserveError> {
    let mut list = Vec::new();
    list.try_reserve_exact(count)?;
    Ok(list)
}

/// `count` times `value`.
pub fn filled<T: Clone>(count: usize, value: T) -> Result<Vec<T>, TryReserveError> {
    let mut list = room(count)?;
    list.resize(count, value);
    Ok(list)
}

/// What an iterator gives, which knows how much that is.
pub fn collected<T>(values: impl ExactSizeIterator<Item = T>) -> Result<Vec<T>, TryReserveError> {
    let mut list = room(values.len())?;
    list.extend(values);
    Ok(list)
}

/// One more element.
pub fn push<T>(list: &mut Vec<T>, value: T) -> Result<(), TryReserveError> {
    list.try_reserve(1)?;
    list.push(value);
    Ok(())
}
