//! `upt_scene`: which nodes are decoded.

use super::constants::*;
use super::output::output;
use super::pointers::optional;
use super::registry::call_scene;
use super::step_structs::upt_view;
use super::structs::*;
use super::views::{Shown, read_view};

/// Limits a step to these nodes: `upt_scene_step`, `_read` and `_sample` write them alone, in this order. Fewer nodes
/// make a cheaper step.
///
/// - `nodes`: `[n]` indices, n at most K, in any order; NULL with count 0: all nodes.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` for an index of K or more or too many of
/// them, `UPT_ERR_UNSUPPORTED` for a cut body, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_set_region(
    scene: *mut upt_scene,
    nodes: *const u32,
    count: u64,
) -> upt_status {
    call_scene("upt_scene_set_region", scene, |scene| {
        scene.check_node_count("count", count)?;
        // SAFETY: the host passes that many elements, as the header asks.
        scene.set_region(unsafe { optional(nodes, count, "nodes") }?)?;
        Ok(UPT_OK)
    })
}

/// Computes any nodes of the last state, in the region or not.
///
/// - `view`: of kind `UPT_VIEW_NODES` its nodes; others as in `upt_scene_read`.
/// - `out`: `[n,3]`, mm, in the view's order.
/// - `out_count`: number of floats in `out`, 3 n.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_BUSY`, `UPT_ERR_STATE` for nodes before the first step, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, and as
/// `upt_scene_read`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_decode(
    scene: *mut upt_scene,
    view: *const upt_view,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_decode", scene, |scene| {
        // SAFETY: NULL, or a struct whose first field is its size, with that many nodes, as the header asks.
        let view = unsafe { read_view(scene, view) }?;
        // SAFETY: the host passes room for that many elements, as the header asks.
        let out = unsafe { output(out, out_count, "out") }?;
        match view {
            Shown::Kept(view) => scene.read_to(view, out)?,
            Shown::Nodes(nodes) => scene.decode_to(nodes, out)?,
        }
        Ok(UPT_OK)
    })
}
