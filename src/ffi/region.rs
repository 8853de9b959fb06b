//! `upt_scene`: which nodes are decoded.

use super::constants::*;
use super::output::output;
use super::pointers::{optional, slice};
use super::registry::call_scene;
use super::structs::*;

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

/// Decodes any nodes of the last state, in the region or not.
///
/// - `nodes`: `[n]` indices, n at most K.
/// - `out`: `[n,3]`, mm.
/// - `out_count`: number of floats in `out`, 3 n.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_STATE` before the first step,
/// `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_decode(
    scene: *mut upt_scene,
    nodes: *const u32,
    count: u64,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_decode", scene, |scene| {
        scene.check_node_count("count", count)?;
        // SAFETY: the host passes that many elements, as the header asks.
        let nodes = unsafe { slice(nodes, count, "nodes") }?;
        // SAFETY: the host passes room for that many elements, as the header asks.
        scene.decode_to(nodes, unsafe { output(out, out_count, "out") }?)?;
        Ok(UPT_OK)
    })
}
