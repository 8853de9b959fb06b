//! Raw pointers of the host that a call writes to -> places, arrays, structs. The host need not have initialised them: nothing
//! here is a reference before it was written.

use std::borrow::Cow;
use std::ffi::c_char;
use std::marker::PhantomData;

use super::constants::*;
use super::failure::{Answer, Failure, fail};
use super::pointers::{Sized32, check, length, struct_size};
use crate::memory;
use crate::output::Output;

/// A place for one value.
pub(super) struct Place<'a, T>(*mut T, PhantomData<&'a mut T>);

impl<T: Copy> Place<'_, T> {
    /// Writes it.
    pub(super) fn set(self, value: T) {
        // SAFETY: aligned, not NULL, and the host's to write to, as `place` was promised.
        unsafe { self.0.write(value) };
    }
}

/// A place for one value.
///
/// # Safety
/// A pointer that is aligned and not NULL leads to memory that may be written.
pub(super) unsafe fn place<'a, T>(pointer: *mut T, name: &str) -> Result<Place<'a, T>, Failure> {
    check(pointer, name)?;
    Ok(Place(pointer, PhantomData))
}

/// Room for `count` elements; for none it may be NULL.
///
/// # Safety
/// An aligned pointer that is not NULL points to that many elements, which may be written.
pub(super) unsafe fn output<'a, T: Copy>(
    pointer: *mut T,
    count: u64,
    name: &str,
) -> Result<Output<'a, T>, Failure> {
    let count = length::<T>(count, name)?;
    if count == 0 {
        return Ok(Output::from(&mut [][..]));
    }
    check(pointer, name)?;
    // SAFETY: checked above: aligned, not NULL, of a size that fits; the caller promises the elements.
    Ok(unsafe { Output::new(pointer, count) })
}

/// As [`output`], but NULL with count 0 means that the host wants none.
///
/// # Safety
/// As [`output`].
pub(super) unsafe fn optional_output<'a, T: Copy>(
    pointer: *mut T,
    count: u64,
    name: &str,
) -> Result<Option<Output<'a, T>>, Failure> {
    if pointer.is_null() && count == 0 {
        return Ok(None);
    }
    // SAFETY: the caller's.
    unsafe { output(pointer, count, name) }.map(Some)
}

/// A struct to fill: `make` is called once `struct_size` is accepted; only the caller's fields are written.
pub(super) unsafe fn fill<T: Sized32>(
    out: *mut T,
    make: impl FnOnce(u32) -> Result<T, Failure>,
) -> Answer {
    // SAFETY: the pointer leads to a struct, as this function's caller promises.
    let size = unsafe { struct_size(out, "out") }?;
    let value = make(size as u32)?;
    // SAFETY: both have `size` bytes, one that this library knows, and are apart.
    unsafe { std::ptr::copy_nonoverlapping((&raw const value).cast::<u8>(), out.cast(), size) };
    Ok(UPT_OK)
}

/// Copies `values` to the host. `needed` (may be NULL) is always written; a NULL `out` with capacity 0 only asks.
pub(super) unsafe fn copy_out<T: Copy>(
    values: &[T],
    out: *mut T,
    capacity: u64,
    needed: *mut u64,
) -> Answer {
    if out.is_null() && capacity == 0 && needed.is_null() {
        return fail(UPT_ERR_NULL, "out and needed are both NULL");
    }
    if !needed.is_null() {
        // SAFETY: the header asks for a place to write, or NULL.
        unsafe { place(needed, "needed") }?.set(values.len() as u64);
    }
    if out.is_null() && capacity == 0 {
        return Ok(UPT_OK);
    }
    if out.is_null() {
        return fail(
            UPT_ERR_NULL,
            format!(
                "out is NULL and capacity is {capacity}; to ask for the size alone, give capacity 0"
            ),
        );
    }
    if capacity < values.len() as u64 {
        return fail(
            UPT_ERR_ARGUMENT,
            format!("capacity is {capacity}, {} are needed", values.len()),
        );
    }
    // SAFETY: the host passes room for that many elements, as the header asks.
    unsafe { output(out, values.len() as u64, "out") }?.copy_from(values);
    Ok(UPT_OK)
}

/// Copies text with its NUL to the host, as [`copy_out`].
pub(super) unsafe fn copy_text(
    text: &str,
    out: *mut c_char,
    capacity: u64,
    needed: *mut u64,
) -> Answer {
    let mut bytes: Vec<u8> = text.bytes().filter(|&byte| byte != 0).collect();
    bytes.push(0);
    // SAFETY: `out` has room for `capacity` elements and `needed` is NULL or writable, as the header asks.
    unsafe { copy_out(&bytes, out.cast(), capacity, needed) }
}

/// An input that shares no memory with an output: itself, or a copy.
pub(super) fn apart<'a, T: Copy>(
    input: &'a [T],
    out: &Output<'_, f32>,
) -> Result<Cow<'a, [T]>, Failure> {
    if !out.overlaps(input) {
        return Ok(Cow::Borrowed(input));
    }
    let copy = memory::copied(input, "a copy of an input that out overlaps")?;
    Ok(Cow::Owned(copy))
}
