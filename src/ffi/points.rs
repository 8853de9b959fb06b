//! `upt_scene`: points that move with the tissue, such as a render mesh's vertices.

use super::constants::*;
use super::pointers::optional;
use super::registry::call_scene;
use super::structs::*;

/// Attaches points to the tissue, which views of kind `UPT_VIEW_POINTS` show. They replace those attached before. A bundle of kind `upt` decodes each point in every
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
