//! `upt_scene` without waiting: the scene's own worker steps, the host polls and samples.

use std::time::Duration;

use super::constants::*;
use super::failure::Answer;
use super::input::read_input;
use super::output::output;
use super::registry::call_scene;
use super::step_structs::{upt_input, upt_view};
use super::structs::*;
use super::views::kept_view;
use crate::Progress;

/// Starts a step on the scene's worker thread and returns at once. An error of an earlier step that was not reported yet
/// is still reported.
///
/// - `input`: as in `upt_scene_step`; checked and copied before the call returns.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_BUSY` while a step is in flight (unless the scene was made with `latest_wins`), `UPT_ERR_NULL`,
/// `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT` and `UPT_ERR_NON_FINITE` for the input, `UPT_ERR_UNSUPPORTED` for
/// instruments in a build without feature "instruments", `UPT_ERR_STATE` if no thread can be started, `UPT_ERR_OUT_OF_MEMORY`,
/// `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_submit(
    scene: *mut upt_scene,
    input: *const upt_input,
) -> upt_status {
    call_scene("upt_scene_submit", scene, |scene| {
        let mut lists = scene.lists()?;
        let mut arrays = Default::default();
        // SAFETY: the host passes what the header asks for.
        scene.submit(unsafe { read_input(scene, input, &mut lists, &mut arrays) }?)?;
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
/// - `view`: as in `upt_scene_read`.
/// - `out`: `[n,3]`, mm, in the view's order.
/// - `out_count`: number of floats in `out`, 3 n.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: as `upt_scene_read`, and `UPT_ERR_NON_FINITE`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_sample(
    scene: *mut upt_scene,
    alpha: f64,
    view: *const upt_view,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_sample", scene, |scene| {
        // SAFETY: NULL, or a struct whose first field is its size, as the header asks.
        let view = unsafe { kept_view(scene, view) }?;
        // SAFETY: the host passes room for that many elements, as the header asks.
        scene.sample_to(view, alpha, unsafe { output(out, out_count, "out") }?)?;
        Ok(UPT_OK)
    })
}

fn progress(progress: Progress) -> Answer {
    Ok(match progress {
        Progress::Done => UPT_OK,
        Progress::Pending => UPT_PENDING,
    })
}
