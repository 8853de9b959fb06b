//! `upt_scene`: points that move with the tissue, such as a render mesh's vertices.

use super::constants::*;
use super::output::output;
use super::pointers::optional;
use super::registry::call_scene;
use super::structs::*;
use crate::scene::View;

/// Attaches points to the tissue. They replace those attached before. A bundle of kind `upt` decodes each point in every
/// step (unless the scene has `interpolate_points`); one of kind `reduced` interpolates between nodes.
///
/// - `points`: `[n,3]`, rest positions, mm; NULL with count 0 detaches.
/// - `count`: number of points, n.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT`,
/// `UPT_ERR_UNSUPPORTED`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_attach_points(
    scene: *mut upt_scene,
    points: *const f32,
    count: u64,
) -> upt_status {
    call_scene("upt_scene_attach_points", scene, |scene| {
        crate::scene::check_point_count(count)?;
        // SAFETY: the host passes that many elements, as the header asks.
        let points = unsafe { optional(points, count.saturating_mul(3), "points") }?;
        scene.attach_points(points)?;
        Ok(UPT_OK)
    })
}

/// Copies the displacement of the attached points in the last state.
///
/// - `out`: `[n,3]`, mm.
/// - `out_count`: number of floats in `out`, 3 n.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: `UPT_ERR_STATE` when no points are attached, `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT`,
/// `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_read_points(
    scene: *mut upt_scene,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_read_points", scene, |scene| {
        // SAFETY: the host passes room for that many elements, as the header asks.
        scene.read_to(View::Points, unsafe { output(out, out_count, "out") }?)?;
        Ok(UPT_OK)
    })
}

/// As `upt_scene_sample`, at the attached points.
///
/// - `alpha`: 0 is the state before, 1 the last state.
/// - `out`: `[n,3]`, mm.
/// - `out_count`: number of floats in `out`, 3 n.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: as `upt_scene_read_points`, and `UPT_ERR_NON_FINITE`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_sample_points(
    scene: *mut upt_scene,
    alpha: f64,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_sample_points", scene, |scene| {
        // SAFETY: the host passes room for that many elements, as the header asks.
        let out = unsafe { output(out, out_count, "out") }?;
        scene.sample_to(View::Points, alpha, out)?;
        Ok(UPT_OK)
    })
}
