//! `upt_scene`: make, end, reset, step, read.

use super::call::call;
use super::constants::*;
use super::input::{field, read_input};
use super::output::{apart, optional_output, output, place};
use super::registry::{add_scene, call_scene, find_model, remove_scene};
use super::step_structs::{upt_input, upt_view};
use super::structs::*;
use super::views::kept_view;
use super::{convert, pointers};
use crate::scene::{
    Contact, GroupMotion, Loads, MAX_PRESSURES, MAX_SUPPORTS, Pressure, Scene, StepInput, View,
};
use std::borrow::Cow;

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
            let raw = unsafe { pointers::options(options, "options") }?;
            // SAFETY: the pointers in the struct are NULL or what the header asks for.
            let scene = Scene::new(model, &unsafe { convert::scene_options(&raw) }?)?;
            out.set(add_scene(scene));
            Ok(UPT_OK)
        },
    )
}

/// Destroys a scene, after waiting for a step in flight. A poisoned scene accepts only this call and
/// `upt_scene_read_stats`.
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

/// Returns the scene to rest, a cut body to the intact one. The region and the attached points stay.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_PANIC`; of a cut body also `UPT_ERR_RUNTIME` and `UPT_ERR_OUT_OF_MEMORY`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_reset(scene: *mut upt_scene) -> upt_status {
    call_scene("upt_scene_reset", scene, |scene| {
        scene.reset()?;
        Ok(UPT_OK)
    })
}

/// One step of the scene's `dt`, as `input` drives it.
///
/// Instruments are where they will be at the end of the step: each moves there on a straight line from its last pose, and their contact is
/// solved. An instrument that would move more than 40 mm in a step is placed there without a motion. Contact is unilateral, with
/// Coulomb friction, at points of the domain's surface at most 1.7 mm apart. A scene with corrections solves it inside each
/// correction, as a load; with `UPT_CORRECTIONS_NONE` it is solved once, on the linear response. The scene remembers
/// each place of the array: pass every instrument every time, in the same order.
///
/// - `input`: what drives the step; NULL: nothing does, the tissue moves on by itself.
/// - `out`: `[n,3]`, mm (n: K, or the region's count; K of a cut body counts the copies of its nodes, `upt_scene_read_node_count`), may be NULL;
///   it may be the memory of an input, at the cost of a copy.
/// - `out_count`: number of floats in `out`, 3 n; 0 when out is NULL.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_STRUCT_SIZE` for an input of another size; `UPT_ERR_ARGUMENT` also for two drives at once, for a displacement with
/// instruments and for a node beyond K or listed twice; `UPT_ERR_NON_FINITE`; for instruments `UPT_ERR_UNSUPPORTED` in a build without
/// feature "instruments" and for a bundle without a linear response, and `UPT_ERR_HANDLE` for a hull that was destroyed; `UPT_ERR_NULL`,
/// `UPT_ERR_BUSY`, `UPT_ERR_GUARD`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`; the state does not change.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_step(
    scene: *mut upt_scene,
    input: *const upt_input,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_step", scene, |scene| {
        let mut lists = scene.lists()?;
        let mut arrays = Default::default();
        // SAFETY: the host passes what the header asks for.
        let input = unsafe { read_input(scene, input, &mut lists, &mut arrays) }?;
        // SAFETY: the host passes `out_count` floats of room, as the header asks.
        unsafe { step(scene, input, out, out_count) }
    })
}

/// One step of dense fields, `u(t), c(t) -> u(t + dt)`, as the paper writes it: `upt_scene_step` with `displacement` and `collision`.
///
/// - `displacement`: `[K,3]`, mm; NULL uses the scene's own state.
/// - `collision`: `[K,3]`, mm, zero except at nodes in contact, where it is the displacement that is imposed by the end of the step; NULL
///   means no contact.
/// - `out`, `out_count`, threads: as in `upt_scene_step`.
///
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`,
/// `UPT_ERR_UNSUPPORTED`, `UPT_ERR_GUARD`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`; the state does
/// not change.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_step_field(
    scene: *mut upt_scene,
    displacement: *const f32,
    collision: *const f32,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_step_field", scene, |scene| {
        // SAFETY: the host passes NULL or `[K,3]`, as the header asks.
        let collision = unsafe { field(scene, collision, "collision") }?;
        let input = StepInput {
            // SAFETY: the host passes NULL or `[K,3]`, as the header asks.
            displacement: unsafe { field(scene, displacement, "displacement") }?,
            contact: collision.map_or(Contact::None, Contact::Dense),
            ..StepInput::default()
        };
        // SAFETY: the host passes `out_count` floats of room, as the header asks.
        unsafe { step(scene, input, out, out_count) }
    })
}

/// Copies the last published state.
///
/// - `view`: the region (all nodes where there is none), or the attached points; NULL: the region.
/// - `out`: `[n,3]`, mm, in the view's order.
/// - `out_count`: number of floats in `out`, 3 n.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: `UPT_ERR_STATE` for the points when none are attached, `UPT_ERR_UNSUPPORTED` for another view,
/// `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_read(
    scene: *mut upt_scene,
    view: *const upt_view,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_read", scene, |scene| {
        // SAFETY: NULL, or a struct whose first field is its size, as the header asks.
        let view = unsafe { kept_view(scene, view) }?;
        // SAFETY: the host passes room for that many elements, as the header asks.
        scene.read_to(view, unsafe { output(out, out_count, "out") }?)?;
        Ok(UPT_OK)
    })
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
    scene.check_len(View::Region, out.len())?;
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
    let forces = (input.loads.forces.map(|forces| apart(forces, &out))).transpose()?;
    let mut regions: [Cow<'_, [u32]>; MAX_PRESSURES] = Default::default();
    let mut pressures = [Pressure::default(); MAX_PRESSURES];
    let count = input.loads.pressures.len();
    for (region, pressure) in regions.iter_mut().zip(input.loads.pressures) {
        *region = apart(pressure.nodes, &out)?;
    }
    for ((own, region), pressure) in (pressures.iter_mut().zip(&regions)).zip(input.loads.pressures)
    {
        *own = Pressure {
            nodes: region,
            ..*pressure
        };
    }
    let mut moves: [Cow<'_, [f32]>; MAX_SUPPORTS] = std::array::from_fn(|_| Cow::Borrowed(&[][..]));
    let mut supports = [GroupMotion::default(); MAX_SUPPORTS];
    let groups = input.loads.supports.len();
    for (given, support) in moves.iter_mut().zip(input.loads.supports) {
        *given = apart(support.displacements.unwrap_or_default(), &out)?;
    }
    for ((own, given), support) in (supports.iter_mut().zip(&moves)).zip(input.loads.supports) {
        *own = GroupMotion {
            displacements: support.displacements.map(|_| &**given),
            ..*support
        };
    }
    let input = StepInput {
        displacement: displacement.as_deref(),
        contact,
        loads: Loads {
            forces: forces.as_deref(),
            pressures: &pressures[..count],
            supports: &supports[..groups],
            ..input.loads
        },
        time_s: input.time_s,
    };
    scene.step_to(input, Some(out))?;
    Ok(UPT_OK)
}
