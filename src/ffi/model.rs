//! `upt_model`: open, close, what it is.

use core::ffi::c_char;

use super::call::call;
use super::constants::*;
use super::registry::{add_model, find_model, remove_model};
use super::structs::*;
use super::{convert, output, pointers};
use crate::model::Model;

/// Opens a bundle, checks it (sizes, dtypes, the SHA-256 of the manifest and of every file that is read) and makes it
/// ready to step.
///
/// - `path`: the bundle's folder, UTF-8.
/// - `options`: NULL means the defaults.
/// - `out`: the new model.
///
/// Threads: any.
/// Errors: `UPT_ERR_IO`, `UPT_ERR_BUNDLE`, `UPT_ERR_VERSION`, `UPT_ERR_RUNTIME`, `UPT_ERR_PROVIDER`,
/// `UPT_ERR_UNSUPPORTED`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NULL`, `UPT_ERR_OUT_OF_MEMORY`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_model_create(
    path: *const c_char,
    options: *const upt_model_options,
    out: *mut *mut upt_model,
) -> upt_status {
    call(
        "upt_model_create",
        || (),
        || {
            // SAFETY: the header asks for a place to write.
            let out = unsafe { output::place(out, "out") }?;
            // SAFETY: NULL or a C string, as the header asks.
            let path = unsafe { pointers::path(path, "path") }?;
            // SAFETY: NULL, or a struct whose first field is its size, as the header asks.
            let raw = unsafe { pointers::options(options, "options") }?;
            // SAFETY: the pointers in the struct are NULL or what the header asks for.
            let model = Model::open(&path, &unsafe { convert::model_options(&raw) }?)?;
            out.set(add_model(model));
            Ok(UPT_OK)
        },
    )
}

/// Closes a model. Its scenes keep what they need and stay usable.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also if it was closed before).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_model_destroy(model: *mut upt_model) -> upt_status {
    call(
        "upt_model_destroy",
        || (),
        || {
            drop(remove_model(model)?);
            Ok(UPT_OK)
        },
    )
}

/// Describes a model in numbers. Set `out->struct_size` first.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_model_read_info(
    model: *const upt_model,
    out: *mut upt_model_info,
) -> upt_status {
    call(
        "upt_model_read_info",
        || (),
        || {
            let model = find_model(model)?;
            let fill = |struct_size| {
                let info = model.info();
                Ok(upt_model_info {
                    struct_size,
                    kind: info.kind as i32,
                    node_count: info.node_count,
                    tet_count: info.tet_count,
                    surface_face_count: info.surface_face_count,
                    domain_node_count: info.domain_node_count,
                    held_node_count: info.held_node_count,
                    supernode_count: info.supernode_count,
                    dt: info.dt,
                    max_push_mm: info.max_push_mm,
                    provider: info.provider as i32,
                    precision: info.precision as i32,
                    memory_bytes: info.memory_bytes,
                    load_seconds: info.load_seconds,
                    frame_step_s: info.frame_step_s,
                })
            };
            // SAFETY: `out` points to a struct whose first field is its size, as the header asks.
            unsafe { output::fill(out, fill) }
        },
    )
}

/// Describes a model as JSON: name, bundle hash, the provider of each stage and why the others were not chosen.
///
/// - `out`: receives text with its NUL; NULL with capacity 0 only queries the size.
/// - `needed`: its size in bytes with the NUL, always written; may be NULL.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` if capacity is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_model_describe(
    model: *const upt_model,
    out: *mut c_char,
    capacity: u64,
    needed: *mut u64,
) -> upt_status {
    call(
        "upt_model_describe",
        || (),
        || {
            let text = find_model(model)?.describe_json();
            // SAFETY: `out` has room for `capacity` elements and `needed` is NULL or writable, as the header asks.
            unsafe { output::copy_text(&text, out, capacity, needed) }
        },
    )
}

/// Copies the rest positions.
///
/// - `out`: `[K,3]` floats, mm.
/// - `count`: number of floats in `out`, 3 K.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` when count is not 3 K.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_model_read_positions(
    model: *const upt_model,
    out: *mut f32,
    count: u64,
) -> upt_status {
    call(
        "upt_model_read_positions",
        || (),
        || {
            let model = find_model(model)?;
            let positions = model.positions();
            if count != positions.len() as u64 {
                return super::failure::fail(
                    UPT_ERR_ARGUMENT,
                    format!(
                        "count is {count}; 3 K = {} floats are needed",
                        positions.len()
                    ),
                );
            }
            // SAFETY: the host passes room for that many elements, as the header asks.
            unsafe { output::output(out, count, "out") }?.copy_from(positions);
            Ok(UPT_OK)
        },
    )
}

/// Copies a static index set.
///
/// - `set`: `UPT_SET_*`.
/// - `out`: node indices; NULL with capacity 0 only queries the size.
/// - `capacity`: number of indices that fit in `out`.
/// - `needed`: number of indices in the set (3 per face, 4 per tetrahedron), always written; may be NULL.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` (unknown set, capacity too small).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_model_read_indices(
    model: *const upt_model,
    set: upt_index_set,
    out: *mut u32,
    capacity: u64,
    needed: *mut u64,
) -> upt_status {
    call(
        "upt_model_read_indices",
        || (),
        || {
            let model = find_model(model)?;
            let indices = model.indices(convert::index_set(set)?);
            // SAFETY: `out` has room for `capacity` elements and `needed` is NULL or writable, as the header asks.
            unsafe { output::copy_out(indices, out, capacity, needed) }
        },
    )
}

/// Names a support group of a bundle, and copies its nodes: what `upt_input.supports` moves.
///
/// - `group`: from 0; the groups end where this is `UPT_ERR_ARGUMENT` (`upt_model_describe` lists them).
/// - `name`: receives text with its NUL; NULL with capacity 0 leaves it out.
/// - `nodes`: node indices, ascending; NULL with capacity 0 only queries the size.
/// - `node_capacity`: number of indices that fit in `nodes`.
/// - `needed`: number of nodes of the group, always written; may be NULL.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` (no such group, a capacity too small).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_model_read_support(
    model: *const upt_model,
    group: u32,
    name: *mut c_char,
    name_capacity: u64,
    nodes: *mut u32,
    node_capacity: u64,
    needed: *mut u64,
) -> upt_status {
    call(
        "upt_model_read_support",
        || (),
        || {
            let model = find_model(model)?;
            let sets = ("group", model.supports());
            let (name, nodes) = ((name, name_capacity), (nodes, node_capacity));
            // SAFETY: the host passes room as the header asks.
            unsafe { copy_named(sets, group, name, nodes, needed) }
        },
    )
}

/// Names a region of the surface that the bundle names, and copies its nodes: what `upt_pressure.nodes` takes.
///
/// - `region`: from 0; the regions end where this is `UPT_ERR_ARGUMENT` (`upt_model_describe` lists them).
/// - `name`: receives text with its NUL; NULL with capacity 0 leaves it out.
/// - `nodes`: node indices, ascending; NULL with capacity 0 only queries the size.
/// - `node_capacity`: number of indices that fit in `nodes`.
/// - `needed`: number of nodes of the region, always written; may be NULL.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` (no such region, a capacity too small).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_model_read_region(
    model: *const upt_model,
    region: u32,
    name: *mut c_char,
    name_capacity: u64,
    nodes: *mut u32,
    node_capacity: u64,
    needed: *mut u64,
) -> upt_status {
    call(
        "upt_model_read_region",
        || (),
        || {
            let model = find_model(model)?;
            let sets = ("region", model.regions());
            let (name, nodes) = ((name, name_capacity), (nodes, node_capacity));
            // SAFETY: the host passes room as the header asks.
            unsafe { copy_named(sets, region, name, nodes, needed) }
        },
    )
}

/// Name and nodes of the set at a place among those that a bundle names.
///
/// # Safety
/// `name` and `nodes` have room for as many elements as stands beside them, and `needed` is NULL or writable.
unsafe fn copy_named<'a>(
    (what, mut sets): (&str, impl Iterator<Item = (&'a str, &'a [u32])>),
    at: u32,
    (name, name_capacity): (*mut c_char, u64),
    (nodes, node_capacity): (*mut u32, u64),
    needed: *mut u64,
) -> super::failure::Answer {
    let mut count = 0u32;
    let found = sets.by_ref().inspect(|_| count += 1).nth(at as usize);
    let Some((text, own)) = found else {
        return super::failure::fail(
            UPT_ERR_ARGUMENT,
            format!("{what} is {at}, the bundle has {count}"),
        );
    };
    if !name.is_null() || name_capacity != 0 {
        // SAFETY: the caller's.
        let status = unsafe { output::copy_text(text, name, name_capacity, std::ptr::null_mut()) }?;
        debug_assert_eq!(status, UPT_OK);
    }
    // SAFETY: the caller's.
    unsafe { output::copy_out(own, nodes, node_capacity, needed) }
}
