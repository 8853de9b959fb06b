//! `upt_scene` without waiting: the scene's own worker steps, the host polls and samples.

use std::time::Duration;

use super::constants::*;
use super::failure::Answer;
use super::output::output;
use super::registry::call_scene;
use super::scene::contacts;
use super::structs::*;
use crate::Progress;
use crate::scene::Values;

/// Starts a step on the scene's worker thread and returns at once. An error of an earlier step that was not reported yet
/// is still reported.
///
/// - `contact_nodes`, `contact_vectors`, `contact_count`: as in `upt_scene_step_contacts`; checked and copied before the
///   call returns.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_BUSY` while a step is in flight (unless the scene was made with `latest_wins`), `UPT_ERR_NULL`,
/// `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` (also for an index or a count beyond K, or a node listed twice),
/// `UPT_ERR_NON_FINITE`, `UPT_ERR_STATE` if no thread can be started, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_submit(
    scene: *mut upt_scene,
    contact_nodes: *const u32,
    contact_vectors: *const f32,
    contact_count: u64,
) -> upt_status {
    call_scene("upt_scene_submit", scene, |scene| {
        let (nodes, vectors) =
            // SAFETY: the host passes that many nodes and vectors, as the header asks.
            unsafe { contacts(scene, contact_nodes, contact_vectors, contact_count) }?;
        scene.submit(nodes, vectors)?;
        Ok(UPT_OK)
    })
}

/// Asks whether the submitted step has finished. Never waits.
///
/// Returns `UPT_OK`, `UPT_PENDING`, or the step's error (once, also after a later submit). With `latest_wins`, `UPT_OK`
/// means that a step has finished since the last `UPT_OK`, even if another is in flight: a host that submits in every
/// frame sees every new state.
///
/// Threads: one at a time.
/// Errors: the step's; `UPT_ERR_STATE` when nothing was submitted, `UPT_ERR_NULL`, `UPT_ERR_HANDLE`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_poll(scene: *mut upt_scene) -> upt_status {
    call_scene("upt_scene_poll", scene, |scene| progress(scene.poll()?))
}

/// Waits for the submitted step, at most `timeout_ms` milliseconds.
///
/// Returns `UPT_OK` when no step is in flight, `UPT_PENDING` when the time is up, or the step's error (once).
///
/// Threads: one at a time.
/// Errors: as `upt_scene_poll`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_wait(scene: *mut upt_scene, timeout_ms: u32) -> upt_status {
    call_scene("upt_scene_wait", scene, |scene| {
        progress(scene.wait(Duration::from_millis(timeout_ms.into()))?)
    })
}

/// Interpolates between the last two states, for frames between steps. Works while a step is in flight.
///
/// - `alpha`: 0 is the state before, 1 the last state; values from 0 to 1.
/// - `out`: `[n,3]`, mm, in the region's order.
/// - `out_count`: number of floats in `out`, 3 n.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_sample(
    scene: *mut upt_scene,
    alpha: f64,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_sample", scene, |scene| {
        // SAFETY: the host passes room for that many elements, as the header asks.
        let out = unsafe { output(out, out_count, "out") }?;
        scene.sample_to(Values::Region, alpha, out)?;
        Ok(UPT_OK)
    })
}

fn progress(progress: Progress) -> Answer {
    Ok(match progress {
        Progress::Done => UPT_OK,
        Progress::Pending => UPT_PENDING,
    })
}
