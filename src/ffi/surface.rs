//! `upt_scene`: the closed surface of a body that is cut.

use super::constants::*;
use super::failure::{Failure, fail};
use super::output::{fill, output, place};
use super::registry::call_scene;
use super::step_structs::*;
use super::structs::*;
use crate::output::Output;

/// Writes how many nodes the scene has now: K, and the copies that cuts have made. Wherever this header says K of a scene, it is this number. It
/// changes with `upt_scene_cut` and the calls beside it, `upt_scene_restore` and `upt_scene_reset`.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` for a place that is not aligned, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_read_node_count(
    scene: *mut upt_scene,
    out: *mut u64,
) -> upt_status {
    call_scene("upt_scene_read_node_count", scene, |scene| {
        // SAFETY: the host passes a place to write to, as the header asks.
        unsafe { place(out, "out") }?.set(scene.node_count() as u64);
        Ok(UPT_OK)
    })
}

/// Brings the closed surface of the body up to date: the mesh's own where nothing has happened, the lips of cuts, and what removal has laid
/// bare. Tells what has changed since the last call. Where the body has not changed since, it does nothing, so it may be called in every frame.
///
/// Vertices and slots of triangles keep their numbers, so that a renderer uploads the vertices from `first_vertex` on and the slots that
/// `upt_scene_read_surface` lists, unless `is_new` is 1. The first vertices are the nodes of the mesh, also those inside, which no triangle has;
/// vertices that nothing uses any more stay. Works on an intact body, too.
///
/// - `out`: counts; set `struct_size`.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_RUNTIME`,
/// `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_update_surface(
    scene: *mut upt_scene,
    out: *mut upt_surface,
) -> upt_status {
    call_scene("upt_scene_update_surface", scene, |scene| {
        let make = |struct_size| {
            let update = scene.surface().update()?;
            Ok(upt_surface {
                struct_size,
                is_new: update.is_new.into(),
                vertex_count: update.vertices as u64,
                triangle_count: update.triangles as u64,
                first_vertex: update.first_vertex as u64,
                changed_count: update.changed as u64,
            })
        };
        // SAFETY: `out` points to a struct whose first field is its size, as the header asks.
        unsafe { fill(out, make) }
    })
}

/// Copies the surface as the last `upt_scene_update_surface` left it, with the counts that it gave. An array that is NULL is not wanted.
///
/// - `rest`: `[vertex_count, 3]`, mm: where each vertex lies in the tissue at rest, for textures, also on faces that a cut has opened.
/// - `triangles`: `[triangle_count, 3]` vertices, outward; 0, 0, 0 in slots that are empty.
/// - `inside`: `[triangle_count]`: 1 where the triangle was inside of the intact body, else 0.
/// - `changed`: `[changed_count]`: the slots that the last update has changed, ascending.
///
/// Threads: one at a time in the calls of a scene's surface; another may step meanwhile.
/// Errors: `UPT_ERR_STATE` before the first update, `UPT_ERR_ARGUMENT` for other counts and an array that is not aligned, `UPT_ERR_HANDLE`,
/// `UPT_ERR_NULL` for the scene, `UPT_ERR_BUSY`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_read_surface(
    scene: *mut upt_scene,
    rest: *mut f32,
    vertex_count: u64,
    triangles: *mut u32,
    inside: *mut u8,
    triangle_count: u64,
    changed: *mut u32,
    changed_count: u64,
) -> upt_status {
    call_scene("upt_scene_read_surface", scene, |scene| {
        scene.surface().read(|surface| {
            let faces = surface.triangles.len();
            check(
                !rest.is_null(),
                "vertex_count",
                vertex_count,
                surface.rest.len(),
            )?;
            let wanted = !triangles.is_null() || !inside.is_null();
            check(wanted, "triangle_count", triangle_count, faces)?;
            let changes = surface.changed.len();
            check(!changed.is_null(), "changed_count", changed_count, changes)?;
            // SAFETY: each array that is not NULL has room for the elements that its count says, as the header asks.
            let (rest, triangles, inside, changed) = unsafe {
                (
                    wanted_output(rest, 3, vertex_count, "rest")?,
                    wanted_output(triangles, 3, triangle_count, "triangles")?,
                    wanted_output(inside, 1, triangle_count, "inside")?,
                    wanted_output(changed, 1, changed_count, "changed")?,
                )
            };
            if let Some(rest) = rest {
                rest.copy_from(surface.rest.as_flattened());
            }
            if let Some(triangles) = triangles {
                triangles.copy_from(surface.triangles.as_flattened());
            }
            if let Some(inside) = inside {
                inside.write(surface.inside.iter().map(|inside| u8::from(*inside)));
            }
            if let Some(changed) = changed {
                changed.copy_from(surface.changed);
            }
            Ok(UPT_OK)
        })?
    })
}

/// Copies where the vertices of the surface are in the last published state.
///
/// - `out`: `[vertex_count, 3]`, mm.
/// - `out_count`: number of floats in `out`, 3 `vertex_count`.
///
/// Threads: one at a time in the calls of a scene's surface; another may step meanwhile.
/// Errors: `UPT_ERR_STATE` where the body has changed since the last `upt_scene_update_surface`, `UPT_ERR_ARGUMENT`, `UPT_ERR_UNSUPPORTED` for a scene
/// with a region, `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_read_surface_positions(
    scene: *mut upt_scene,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_read_surface_positions", scene, |scene| {
        // SAFETY: the host passes room for that many elements, as the header asks.
        let out = unsafe { output(out, out_count, "out") }?;
        scene.surface().positions_to(out)?;
        Ok(UPT_OK)
    })
}

/// Whether an array that is wanted has the surface's size.
fn check(is_wanted: bool, name: &str, given: u64, own: usize) -> Result<(), Failure> {
    if !is_wanted || given == own as u64 {
        return Ok(());
    }
    fail(
        UPT_ERR_ARGUMENT,
        format!(
            "{name} is {given}, the surface has {own}; pass what upt_scene_update_surface gave"
        ),
    )
}

/// Room for `count` rows of `width`; NULL is not wanted.
///
/// # Safety
/// An aligned pointer that is not NULL leads to that many elements, which may be written.
unsafe fn wanted_output<'a, T: Copy>(
    pointer: *mut T,
    width: u64,
    count: u64,
    name: &str,
) -> Result<Option<Output<'a, T>>, Failure> {
    if pointer.is_null() {
        return Ok(None);
    }
    // SAFETY: the caller's.
    unsafe { output(pointer, count.saturating_mul(width), name) }.map(Some)
}
