//! `upt_scene`: make, end, reset, step, read.

use super::call::call;
use super::constants::*;
use super::failure::Failure;
use super::output::{apart, optional_output, output, place};
use super::pointers::slice;
use super::registry::{add_scene, call_scene, find_model, remove_scene};
use super::structs::*;
use super::{convert, pointers};
use crate::scene::Values;
use crate::scene::{Contact, Scene, StepInput};

/// Creates a scene at rest.
///
/// - `options`: NULL means the defaults.
/// - `out`: the new scene. The scene keeps what it needs of the model.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`,
/// `UPT_ERR_UNSUPPORTED`, `UPT_ERR_IO`, `UPT_ERR_BUNDLE`, `UPT_ERR_OUT_OF_MEMORY`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_create(
    model: *const upt_model,
    options: *const upt_scene_options,
    out: *mut *mut upt_scene,
) -> upt_status {
    call(
        "upt_scene_create",
        || (),
        || {
            // SAFETY: the header asks for a place to write.
            let out = unsafe { place(out, "out") }?;
            let model = find_model(model)?;
            // SAFETY: NULL, or a struct whose first field is its size, as the header asks.
            let raw = unsafe { pointers::options(options) }?;
            // SAFETY: the pointers in the struct are NULL or what the header asks for.
            let scene = Scene::new(model, &unsafe { convert::scene_options(&raw) }?)?;
            out.set(add_scene(scene));
            Ok(UPT_OK)
        },
    )
}

/// Destroys a scene, after waiting for a step in flight. A poisoned scene accepts only this call and
/// `upt_scene_get_stats`.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also if it was destroyed before), `UPT_ERR_BUSY` while another thread is in
/// a call on it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_destroy(scene: *mut upt_scene) -> upt_status {
    call(
        "upt_scene_destroy",
        || (),
        || {
            drop(remove_scene(scene)?);
            Ok(UPT_OK)
        },
    )
}

/// Returns the scene to rest. The region and the attached points stay.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_reset(scene: *mut upt_scene) -> upt_status {
    call_scene("upt_scene_reset", scene, |scene| {
        scene.reset()?;
        Ok(UPT_OK)
    })
}

/// One step: u(t), c(t) -> u(t + dt).
///
/// - `displacement`: `[K,3]`, mm; NULL uses the scene's own state.
/// - `collision`: `[K,3]`, mm, zero except at nodes in contact, where it is the displacement that the instrument imposes
///   by the end of the step; NULL means no contact.
/// - `out`: `[n,3]`, mm (n: K, or the region's count), may be NULL; it may be the memory of an input, at the cost of a
///   copy.
/// - `out_count`: number of floats in `out`, 3 n; 0 when out is NULL.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`,
/// `UPT_ERR_UNSUPPORTED`, `UPT_ERR_GUARD`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`; the state does
/// not change.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_step(
    scene: *mut upt_scene,
    displacement: *const f32,
    collision: *const f32,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_step", scene, |scene| {
        let floats = 3 * scene.node_count() as u64;
        let field = |pointer: *const f32, name| match pointer.is_null() {
            true => Ok(None),
            // SAFETY: the host passes that many elements, as the header asks.
            false => unsafe { slice(pointer, floats, name) }.map(Some),
        };
        let displacement = field(displacement, "displacement")?;
        let contact = field(collision, "collision")?.map_or(Contact::None, Contact::Dense);
        let input = StepInput {
            displacement,
            contact,
        };
        // SAFETY: the host passes `out_count` floats of room, as the header asks.
        unsafe { step(scene, input, out, out_count) }
    })
}

/// One step from the scene's own state, with a list of the nodes in contact.
///
/// - `contact_nodes`: `[m]` node indices, each at most once, in any order.
/// - `contact_vectors`: `[m,3]`, mm: the displacement of these nodes at the end of the step.
/// - `contact_count`: m; 0 means no contact and both may be NULL.
/// - `out`, `out_count`, threads and errors: as in `upt_scene_step`; also `UPT_ERR_ARGUMENT` for an index or a count
///   beyond K.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_step_contacts(
    scene: *mut upt_scene,
    contact_nodes: *const u32,
    contact_vectors: *const f32,
    contact_count: u64,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_step_contacts", scene, |scene| {
        let (nodes, vectors) =
            // SAFETY: the host passes that many nodes and vectors, as the header asks.
            unsafe { contacts(scene, contact_nodes, contact_vectors, contact_count) }?;
        let contact = Contact::Sparse { nodes, vectors };
        let input = StepInput {
            displacement: None,
            contact,
        };
        // SAFETY: the host passes `out_count` floats of room, as the header asks.
        unsafe { step(scene, input, out, out_count) }
    })
}

/// Copies the last published state.
///
/// - `out`: `[n,3]`, mm, in the region's order (all nodes when there is none).
/// - `out_count`: number of floats in `out`, 3 n.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_read(
    scene: *mut upt_scene,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_read", scene, |scene| {
        // SAFETY: the host passes room for that many elements, as the header asks.
        scene.read_to(Values::Region, unsafe { output(out, out_count, "out") }?)?;
        Ok(UPT_OK)
    })
}

/// The sparse collision field `[m]`, `[m,3]`, with at most as many entries as the mesh has nodes.
pub(super) unsafe fn contacts<'a>(
    scene: &Scene,
    nodes: *const u32,
    vectors: *const f32,
    count: u64,
) -> Result<(&'a [u32], &'a [f32]), Failure> {
    scene.check_node_count("contact_count", count)?;
    // SAFETY: the host passes that many elements, as the header asks.
    let nodes = unsafe { slice(nodes, count, "contact_nodes") }?;
    // SAFETY: the host passes that many elements, as the header asks.
    let vectors = unsafe { slice(vectors, count.saturating_mul(3), "contact_vectors") }?;
    Ok((nodes, vectors))
}

/// `out` may be an input's memory; Rust's references may not, so such an input, whose size has been checked, is copied first.
unsafe fn step(
    scene: &Scene,
    input: StepInput,
    out: *mut f32,
    out_count: u64,
) -> super::failure::Answer {
    // SAFETY: the host passes room for that many elements, as the header asks.
    let Some(out) = unsafe { optional_output(out, out_count, "out") }? else {
        scene.step(input, None)?;
        return Ok(UPT_OK);
    };
    scene.check_len(Values::Region, out.len())?;
    let displacement = input.displacement.map(|u| apart(u, &out)).transpose()?;
    let (dense, nodes, vectors);
    let contact = match input.contact {
        Contact::None => Contact::None,
        Contact::Tools(tools) => Contact::Tools(tools),
        Contact::Dense(field) => {
            dense = apart(field, &out)?;
            Contact::Dense(&dense)
        }
        Contact::Sparse {
            nodes: n,
            vectors: v,
        } => {
            (nodes, vectors) = (apart(n, &out)?, apart(v, &out)?);
            Contact::Sparse {
                nodes: &nodes,
                vectors: &vectors,
            }
        }
    };
    let input = StepInput {
        displacement: displacement.as_deref(),
        contact,
    };
    scene.step_to(input, Some(out))?;
    Ok(UPT_OK)
}
