//! Lists of numbers in a snapshot: their bytes as they lie in memory, behind their count.
//!
//! serde would write and read them one by one: `#[serde(with = "stored")]` on a list takes them at once, and asks for its room.

use std::cell::Cell;
use std::fmt;
use std::marker::PhantomData;

use bytemuck::Pod;
use serde::de::{Deserialize, Deserializer, Visitor};
use serde::ser::{Serialize, Serializer};

use crate::error::{Error, Result};
use crate::memory;

const WHAT: &str = "a snapshot";

// The byte order of a snapshot.
const _: () = assert!(cfg!(target_endian = "little"));

thread_local! {
    /// Bytes that there was no memory for: postcard keeps no text of an error.
    static MISSING: Cell<usize> = const { Cell::new(0) };
}

/// Writes a list.
pub fn serialize<T: Pod, S: Serializer>(
    values: &[T],
    serializer: S,
) -> std::result::Result<S::Ok, S::Error> {
    serializer.serialize_bytes(bytemuck::cast_slice(values))
}

/// Reads a list.
pub fn deserialize<'de, T: Pod, D: Deserializer<'de>>(
    deserializer: D,
) -> std::result::Result<Vec<T>, D::Error> {
    deserializer.deserialize_bytes(List(PhantomData))
}

struct List<T>(PhantomData<T>);

impl<T: Pod> Visitor<'_> for List<T> {
    type Value = Vec<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "numbers of {} bytes", size_of::<T>())
    }

    fn visit_bytes<E: serde::de::Error>(self, bytes: &[u8]) -> std::result::Result<Vec<T>, E> {
        if !bytes.len().is_multiple_of(size_of::<T>()) {
            return Err(E::invalid_length(bytes.len(), &self));
        }
        let mut list = memory::room(bytes.len() / size_of::<T>(), WHAT).map_err(|error| {
            MISSING.set(bytes.len());
            E::custom(error)
        })?;
        let numbers = bytes.chunks_exact(size_of::<T>());
        list.extend(numbers.map(bytemuck::pod_read_unaligned::<T>));
        Ok(list)
    }
}

/// A value as bytes, behind `head` and before `tail` bytes that the caller fills.
///
/// # Errors
/// [`Error::OutOfMemory`].
pub fn write(value: &impl Serialize, head: usize, tail: usize) -> Result<Vec<u8>> {
    let failed = |error: postcard::Error| Error::Snapshot(error.to_string());
    let size = postcard::experimental::serialized_size(value).map_err(failed)?;
    let mut bytes = memory::filled(head + size + tail, 0u8, WHAT)?;
    postcard::to_slice(value, &mut bytes[head..head + size]).map_err(failed)?;
    Ok(bytes)
}

/// The value at the start of the bytes, and the bytes behind it.
///
/// # Errors
/// [`Error::Snapshot`], [`Error::OutOfMemory`].
pub fn read<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<(T, &'a [u8])> {
    MISSING.set(0);
    postcard::take_from_bytes(bytes).map_err(|error| match (MISSING.take(), error) {
        (0, postcard::Error::DeserializeUnexpectedEnd) => Error::Snapshot("is cut short".into()),
        (0, error) => Error::Snapshot(format!("holds a value that no scene can have: {error}")),
        (missing, _) => memory::none(missing, WHAT),
    })
}

/// Whether a list that was read has this many numbers, all finite.
///
/// # Errors
/// [`Error::Snapshot`].
pub fn check(list: &[f32], count: usize) -> Result<()> {
    if list.len() != count {
        return Err(Error::Snapshot(format!(
            "holds a list of {} numbers, must have {count}",
            list.len()
        )));
    }
    if !list.iter().all(|value| value.is_finite()) {
        return Err(Error::Snapshot("holds a value that is not finite".into()));
    }
    Ok(())
}
