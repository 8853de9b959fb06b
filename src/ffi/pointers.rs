//! Raw pointers of the host -> slices, paths, structs to read. Checks what can be checked: NULL, alignment, size.
//! What the host wants to be written is in `output.rs`.

use std::ffi::{CStr, c_char};
use std::path::PathBuf;

use super::constants::*;
use super::failure::{Failure, fail};
use super::load_structs::{upt_point_force, upt_pressure};
use super::step_structs::*;
use super::structs::*;
use super::support_structs::upt_support;

/// A struct that starts with `struct_size`. Later versions only grow; each size ever published stays known.
///
/// # Safety
/// `repr(C)`, first field `struct_size: u32`, every bit pattern of zeros valid.
pub(super) unsafe trait Sized32: Copy {
    const NAME: &'static str;
    const KNOWN: &'static [usize] = &[size_of::<Self>()];
}

macro_rules! sized {
    ($($name:ident),*) => {$(
        // SAFETY: `repr(C)` in `structs.rs`, `struct_size` first, integers, floats and pointers alone.
        unsafe impl Sized32 for $name { const NAME: &'static str = stringify!($name); }
    )*};
}
sized!(
    upt_init_options,
    upt_model_options,
    upt_model_info,
    upt_scene_options,
    upt_instrument_reading,
    upt_cut,
    upt_blade,
    upt_surface,
    upt_haptics_options,
    upt_haptic_pose,
    upt_haptic_force,
    upt_scene_stats,
    upt_scene_timing,
    upt_input,
    upt_point_force,
    upt_pressure,
    upt_tie,
    upt_support,
    upt_tie_reading,
    upt_bed,
    upt_view
);

// SAFETY: as the trait asks.
unsafe impl Sized32 for upt_instrument {
    const NAME: &'static str = "upt_instrument";
    /// The first one ended with `reserved`.
    const KNOWN: &'static [usize] = &[std::mem::offset_of!(Self, friction), size_of::<Self>()];
}

pub(super) fn check<T>(pointer: *const T, name: &str) -> Result<(), Failure> {
    if pointer.is_null() {
        return fail(UPT_ERR_NULL, format!("{name} is NULL"));
    }
    if !pointer.is_aligned() {
        let align = align_of::<T>();
        return fail(
            UPT_ERR_ARGUMENT,
            format!("{name} is not aligned to {align} bytes"),
        );
    }
    Ok(())
}

pub(super) fn length<T>(count: u64, name: &str) -> Result<usize, Failure> {
    match usize::try_from(count) {
        Ok(count) if count <= isize::MAX as usize / size_of::<T>().max(1) => Ok(count),
        _ => fail(
            UPT_ERR_ARGUMENT,
            format!("{name}: a count of {count} is larger than any memory"),
        ),
    }
}

/// `count` elements; an empty array may be NULL.
pub(super) unsafe fn slice<'a, T>(
    pointer: *const T,
    count: u64,
    name: &str,
) -> Result<&'a [T], Failure> {
    let count = length::<T>(count, name)?;
    if count == 0 {
        return Ok(&[]);
    }
    check(pointer, name)?;
    // SAFETY: checked above: aligned, not NULL, of a size that fits; the caller promises the elements.
    Ok(unsafe { std::slice::from_raw_parts(pointer, count) })
}

/// As [`slice`], but NULL with count 0 means that there is none.
pub(super) unsafe fn optional<'a, T>(
    pointer: *const T,
    count: u64,
    name: &str,
) -> Result<Option<&'a [T]>, Failure> {
    if pointer.is_null() && count == 0 {
        return Ok(None);
    }
    // SAFETY: the host passes that many elements, as the header asks.
    unsafe { slice(pointer, count, name) }.map(Some)
}

/// A UTF-8 path.
pub(super) unsafe fn path(pointer: *const c_char, name: &str) -> Result<PathBuf, Failure> {
    check(pointer, name)?;
    // SAFETY: the caller promises a C string.
    match unsafe { CStr::from_ptr(pointer) }.to_str() {
        Ok("") => fail(UPT_ERR_ARGUMENT, format!("{name} is empty")),
        Ok(text) => Ok(PathBuf::from(text)),
        Err(error) => fail(UPT_ERR_ARGUMENT, format!("{name} is not UTF-8: {error}")),
    }
}

/// A UTF-8 path, or none when NULL.
pub(super) unsafe fn optional_path(
    pointer: *const c_char,
    name: &str,
) -> Result<Option<PathBuf>, Failure> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: NULL or a C string, as the header asks.
    unsafe { path(pointer, name) }.map(Some)
}

/// `count` structs to read, each of the size that the first one says: `take(index, value)`.
pub(super) unsafe fn each<T: Sized32>(
    pointer: *const T,
    count: u64,
    name: &str,
    mut take: impl FnMut(usize, T) -> Result<(), Failure>,
) -> Result<(), Failure> {
    let count = length::<T>(count, name)?;
    if count == 0 {
        return Ok(());
    }
    // SAFETY: the pointer leads to a struct, as this function's caller promises.
    let size = unsafe { struct_size(pointer, name) }?;
    for index in 0..count {
        let element = pointer.wrapping_byte_add(index * size);
        // SAFETY: the pointer leads to a struct, as this function's caller promises.
        let own = unsafe { struct_size(element, name) }?;
        if own != size {
            return fail(
                UPT_ERR_STRUCT_SIZE,
                format!(
                    "{name}: struct_size is {size} in the first element and {own} in element {index}"
                ),
            );
        }
        // SAFETY: the host passes a struct whose first field is its size, as the header asks.
        take(index, unsafe { required(element, name) }?)?;
    }
    Ok(())
}

pub(super) unsafe fn struct_size<T: Sized32>(
    pointer: *const T,
    name: &str,
) -> Result<usize, Failure> {
    check(pointer, name)?;
    // SAFETY: checked above: aligned and not NULL; every struct begins with a `u32`.
    let size = unsafe { pointer.cast::<u32>().read() } as usize;
    if T::KNOWN.contains(&size) {
        return Ok(size);
    }
    fail(
        UPT_ERR_STRUCT_SIZE,
        format!(
            "{name}: struct_size is {size}; set it to sizeof({}), which is {} here",
            T::NAME,
            size_of::<T>()
        ),
    )
}

/// A struct that may be NULL, which means the defaults (all zero).
pub(super) unsafe fn options<T: Sized32>(pointer: *const T, name: &str) -> Result<T, Failure> {
    if pointer.is_null() {
        // SAFETY: every bit pattern of zeros is a value of these structs.
        return Ok(unsafe { std::mem::zeroed() });
    }
    // SAFETY: the host passes a struct whose first field is its size, as the header asks.
    unsafe { required(pointer, name) }
}

/// A struct to read; fields that the caller's version does not have are zero.
pub(super) unsafe fn required<T: Sized32>(pointer: *const T, name: &str) -> Result<T, Failure> {
    // SAFETY: the pointer leads to a struct, as this function's caller promises.
    let size = unsafe { struct_size(pointer, name) }?;
    // SAFETY: every bit pattern of zeros is a value of these structs.
    let mut value: T = unsafe { std::mem::zeroed() };
    // SAFETY: both have `size` bytes, one that this library knows, and are apart.
    unsafe {
        std::ptr::copy_nonoverlapping(pointer.cast::<u8>(), (&raw mut value).cast(), size);
    }
    Ok(value)
}
