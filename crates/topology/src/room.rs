//! Lists whose size the mesh or a host decides: no memory for one is an error, and the body is what it was. Nodes of maps and lists of one element's
//! parts are small; who cuts asks for their room before (`Body::most_bytes`).

use crate::TopologyError;

/// An empty list with room for `count` elements.
pub(crate) fn room<T>(count: usize) -> Result<Vec<T>, TopologyError> {
    let mut list = Vec::new();
    let bytes = count.saturating_mul(size_of::<T>());
    (list.try_reserve_exact(count)).map_err(|_| TopologyError::Memory { bytes })?;
    Ok(list)
}

/// `count` times `value`.
pub(crate) fn filled<T: Clone>(value: T, count: usize) -> Result<Vec<T>, TopologyError> {
    let mut list = room(count)?;
    list.resize(count, value);
    Ok(list)
}

/// Room for `count` more.
pub(crate) fn reserve<T>(list: &mut Vec<T>, count: usize) -> Result<(), TopologyError> {
    let bytes = count.saturating_mul(size_of::<T>());
    (list.try_reserve(count)).map_err(|_| TopologyError::Memory { bytes })
}

/// A copy.
pub(crate) fn copied<T: Copy>(values: &[T]) -> Result<Vec<T>, TopologyError> {
    let mut list = room(values.len())?;
    list.extend_from_slice(values);
    Ok(list)
}

/// One more element.
pub(crate) fn push<T>(list: &mut Vec<T>, value: T) -> Result<(), TopologyError> {
    let bytes = (list.len() + 1).saturating_mul(size_of::<T>());
    (list.try_reserve(1)).map_err(|_| TopologyError::Memory { bytes })?;
    list.push(value);
    Ok(())
}

/// What an iterator of `count` elements at most gives.
pub(crate) fn collected<T>(
    count: usize,
    values: impl Iterator<Item = T>,
) -> Result<Vec<T>, TopologyError> {
    let mut list = room(count)?;
    list.extend(values.take(count));
    Ok(list)
}
