//! `upt_scene`: statistics, times and snapshots.

use std::sync::atomic::Ordering;

use super::call::call;
use super::constants::*;
use super::registry::{call_scene, find_scene};
use super::structs::*;
use super::{output, pointers};

/// Reports what the last step did. Set `out->struct_size` first. Works while a step is in flight and
/// on a poisoned scene.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_read_stats(
    scene: *const upt_scene,
    out: *mut upt_scene_stats,
) -> upt_status {
    call(
        "upt_scene_read_stats",
        || (),
        || {
            let entry = find_scene(scene)?;
            let fill = |struct_size| {
                let stats = entry.scene.stats();
                Ok(upt_scene_stats {
                    struct_size,
                    flags: stats.flags,
                    step_count: stats.step_count,
                    decoded_node_count: stats.decoded_node_count,
                    contact_count: stats.contact_count,
                    memory_bytes: stats.memory_bytes,
                    threads: stats.threads,
                    kernel: stats.kernel as i32,
                    provider: stats.provider as i32,
                    precision: stats.precision as i32,
                    max_displacement_mm: stats.max_displacement_mm,
                    indicator: stats.indicator,
                    sleeping: stats.sleeping.into(),
                    poisoned: (stats.poisoned || entry.poisoned.load(Ordering::Acquire)).into(),
                    prior_forces: stats.prior_forces.into(),
                    substeps: stats.substeps as u8,
                    reserved: [0; 4],
                    step_path: stats.step_path as i32,
                    corrections: stats.corrections,
                    evaluations: stats.evaluations,
                    residual: stats.residual,
                    error_mm: stats.error_mm,
                    min_det: stats.min_det,
                })
            };
            // SAFETY: `out` points to a struct whose first field is its size, as the header asks.
            unsafe { output::fill(out, fill) }
        },
    )
}

/// Reports how long the last step and its stages took. Set `out->struct_size` first. Works as `upt_scene_read_stats` does.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_read_timing(
    scene: *const upt_scene,
    out: *mut upt_scene_timing,
) -> upt_status {
    call(
        "upt_scene_read_timing",
        || (),
        || {
            let entry = find_scene(scene)?;
            let fill = |struct_size| {
                let timing = entry.scene.timing();
                Ok(upt_scene_timing {
                    struct_size,
                    reserved: [0; 4],
                    step_count: timing.step_count,
                    step_ms: timing.step_ms,
                    check_ms: timing.check_ms,
                    prior_ms: timing.prior_ms,
                    encode_ms: timing.encode_ms,
                    aggregate_ms: timing.aggregate_ms,
                    latent_ms: timing.latent_ms,
                    decode_ms: timing.decode_ms,
                    guard_ms: timing.guard_ms,
                    corrections_ms: timing.corrections_ms,
                    contact_ms: timing.contact_ms,
                    upload_ms: timing.upload_ms,
                    download_ms: timing.download_ms,
                })
            };
            // SAFETY: `out` points to a struct whose first field is its size, as the header asks.
            unsafe { output::fill(out, fill) }
        },
    )
}

/// Saves the state, so that it can be restored exactly.
///
/// - `out`: bytes; NULL with capacity 0 only queries the size.
/// - `capacity`: size of `out` in bytes.
/// - `needed`: size of the snapshot in bytes, always written; may be NULL.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` if capacity is too small,
/// `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_save(
    scene: *mut upt_scene,
    out: *mut u8,
    capacity: u64,
    needed: *mut u64,
) -> upt_status {
    call_scene("upt_scene_save", scene, |scene| {
        let snapshot = scene.save()?;
        // SAFETY: `out` has room for `capacity` elements and `needed` is NULL or writable, as the header asks.
        unsafe { output::copy_out(&snapshot, out, capacity, needed) }
    })
}

/// Restores a snapshot of the same model.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_SNAPSHOT`, `UPT_ERR_VERSION`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`,
/// `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`, `UPT_ERR_UNSUPPORTED` for one of a cut body in a scene with a region, attached points or
/// haptics; the state does not change.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_restore(
    scene: *mut upt_scene,
    bytes: *const u8,
    count: u64,
) -> upt_status {
    call_scene("upt_scene_restore", scene, |scene| {
        // SAFETY: the host passes that many elements, as the header asks.
        scene.restore(unsafe { pointers::slice(bytes, count, "bytes") }?)?;
        Ok(UPT_OK)
    })
}
