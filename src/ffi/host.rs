//! What a host of the WebAssembly module needs besides the C ABI: room in the module's memory, a bundle from memory, and the message of a
//! panic, which ends the module's instance. In no header: the package in `web/` is the only caller.

use std::alloc::{Layout, alloc, dealloc};
use std::collections::BTreeMap;
use std::ffi::c_char;
use std::sync::{Mutex, PoisonError};

use lanes::Isa;

use super::call::{call, remember};
use super::constants::*;
use super::failure::fail;
use super::registry::add_model;
use super::structs::*;
use super::{convert, output, pointers};
use crate::model::Model;

const ALIGN: usize = 16;

/// Files of the bundle that is opened next.
static FILES: Mutex<BTreeMap<String, Vec<u8>>> = Mutex::new(BTreeMap::new());

/// The first call. `isa` names the lanes to use, NULL the best that the module has; scalar ones are in modules for tests alone. A panic
/// leaves its message for `upt_last_error`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_host_begin(isa: *const c_char) -> upt_status {
    std::panic::set_hook(Box::new(|info| {
        remember("libupt", &info.to_string().replace('\n', " "))
    }));
    call(
        "upt_host_begin",
        || (),
        || {
            // SAFETY: NULL or a C string, as the package passes it.
            let Some(name) = (unsafe { pointers::optional_path(isa, "isa") })? else {
                return Ok(UPT_OK);
            };
            let name = name.to_string_lossy();
            let has = |isa: &Isa| *isa != Isa::Scalar || cfg!(feature = "fault");
            match Isa::parse(&name).filter(has).is_some_and(Isa::choose) {
                true => Ok(UPT_OK),
                false => fail(
                    UPT_ERR_ARGUMENT,
                    format!("isa is {name}, which this module lacks, or other lanes are in use"),
                ),
            }
        },
    )
}

/// Room for `bytes` bytes, aligned to 16; NULL where there is none.
#[unsafe(no_mangle)]
pub extern "C" fn upt_host_alloc(bytes: usize) -> *mut u8 {
    match Layout::from_size_align(bytes.max(1), ALIGN) {
        // SAFETY: the size is not zero.
        Ok(layout) => unsafe { alloc(layout) },
        Err(_) => std::ptr::null_mut(),
    }
}

/// Gives it back.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_host_free(at: *mut u8, bytes: usize) {
    if let (false, Ok(layout)) = (at.is_null(), Layout::from_size_align(bytes.max(1), ALIGN)) {
        // SAFETY: what `upt_host_alloc` gave for that size.
        unsafe { dealloc(at, layout) }
    }
}

/// Room for a file of the bundle that is opened next, to be written by the host before that; NULL and a message where there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_host_file(name: *const c_char, bytes: usize) -> *mut u8 {
    let mut room = std::ptr::null_mut();
    call(
        "upt_host_file",
        || (),
        || {
            // SAFETY: a C string, as the package passes it.
            let name = unsafe { pointers::path(name, "name") }?;
            let name = name.to_string_lossy().into_owned();
            let mut file = crate::memory::filled(bytes, 0u8, &name)?;
            room = file.as_mut_ptr();
            let mut files = FILES.lock().unwrap_or_else(PoisonError::into_inner);
            files.insert(name, file);
            Ok(UPT_OK)
        },
    );
    room
}

/// Opens the bundle of the files that were written since the last opening, as `upt_model_create` opens one in a folder.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_host_open(
    options: *const upt_model_options,
    out: *mut *mut upt_model,
) -> upt_status {
    call(
        "upt_model_create",
        || (),
        || {
            let files = std::mem::take(&mut *FILES.lock().unwrap_or_else(PoisonError::into_inner));
            // SAFETY: the package passes a place to write.
            let out = unsafe { output::place(out, "out") }?;
            // SAFETY: NULL, or a struct whose first field is its size.
            let raw = unsafe { pointers::options(options, "options") }?;
            // SAFETY: the pointers in the struct are NULL.
            let options = unsafe { convert::model_options(&raw) }?;
            out.set(add_model(Model::open_memory(files, &options)?));
            Ok(UPT_OK)
        },
    )
}
