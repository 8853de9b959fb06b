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

/// A copy of a long list that a few values will be added to.
pub fn copied_with_room<T: Copy>(values: &[T]) -> Result<Vec<T>, TryReserveError> {
    let mut list = room(values.len() + values.len() / 16 + 8)?;
    list.extend_from_slice(values);
    Ok(list)
}

/// Room for `more` elements of a long list: where there is none it grows by a quarter, for twice as much would lie idle.
pub fn grow<T>(list: &mut Vec<T>, more: usize) -> Result<(), TryReserveError> {
    if list.capacity() - list.len() < more {
        list.try_reserve_exact(more.max(list.len() / 4))?;
    }
    Ok(())
}

/// One more element.
pub fn push<T>(list: &mut Vec<T>, value: T) -> Result<(), TryReserveError> {
    list.try_reserve(1)?;
    list.push(value);
    Ok(())
}
