//! `upt_scene`: frames between steps.

use super::constants::*;
use super::input::read_input;
use super::output::output;
use super::registry::call_scene;
use super::step_structs::*;
use super::structs::*;
use super::views::kept_view;
use crate::features;

/// The tissue at a moment between steps, with the instruments where they are at that moment: frames without lag.
///
/// The velocities of the last published state continue as far as the instruments do, and contact is solved at the poses given here with
/// the compliance of that time. Any frame rate works, even an uneven one, and a submitted step may be in flight. When a step arrives, the
/// frames start from where they would have been without it. They blend into the new step within two fifths of a step, or at 25 mm/s where
/// that takes longer, but always within two steps.
///
/// - `input`: what drives the tissue, where it is at `when`: instruments, or for scenes that nodes drive these nodes and where they are.
///   Nodes of the last step that are no longer listed are released: they lose the force that held them. `supports` says where support
///   groups are at `when`; without any, they go on as they went. A group is seen from the first step on that moves it. Other loads are
///   those of the step. Neither `displacement` nor `time_s` may be set. NULL: nothing touches the tissue.
/// - `when`: the moment on the clock of the steps' `time_s`, s, not before that of the last published step; for hosts whose steps have
///   no time, the time since the last published step. Velocities are followed for two steps at most.
/// - `view`: the region, the attached points, or the vertices of the surface, `rest + out` of `upt_scene_read_surface`; NULL: the region.
/// - `out`: `[n,3]`, mm, in the view's order.
/// - `out_count`: number of floats in `out`, 3 n.
///
/// Threads: one thread at a time presents; another may step or submit meanwhile.
/// Errors: `UPT_ERR_BUSY` while another thread presents, and if a step is in flight at the first call;
/// `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", for a bundle without a linear response or corrections, and
/// for a scene without corrections; `UPT_ERR_STATE` for the points when none are attached, and for the
/// surface where the body has changed since the last `upt_scene_update_surface`; `UPT_ERR_UNSUPPORTED` for the surface of a scene with a region; `UPT_ERR_NULL`, `UPT_ERR_HANDLE`,
/// `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`, `UPT_ERR_RUNTIME`, `UPT_ERR_IO`, `UPT_ERR_BUNDLE`,
/// `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_present(
    scene: *mut upt_scene,
    input: *const upt_input,
    when: f64,
    view: *const upt_view,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_present", scene, |scene| {
        features::instruments()?;
        let mut lists = scene.frame_lists()?;
        let mut arrays = Default::default();
        // SAFETY: the host passes what the header asks for.
        let input = unsafe { read_input(scene, input, &mut lists, &mut arrays) }?;
        // SAFETY: NULL, or a struct whose first field is its size, as the header asks.
        let view = unsafe { kept_view(scene, view) }?;
        // SAFETY: the host passes room for that many elements, as the header asks.
        let out = unsafe { output(out, out_count, "out") }?;
        scene.present_to(input, when, view, out)?;
        Ok(UPT_OK)
    })
}
