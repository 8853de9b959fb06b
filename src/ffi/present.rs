//! `upt_scene`: frames between steps.

use super::constants::*;
use super::driven::read_tools;
use super::failure::Failure;
use super::output::output;
use super::registry::call_scene;
use super::scene::contacts;
use super::structs::*;
use crate::features;
use crate::scene::{Contact, Scene, Values};

/// What the tissue is driven by at the moment of a frame.
enum Driver {
    Instruments(*const upt_instrument, u64),
    Contacts(*const u32, *const f32, u64),
}

/// The frame that the host wants, of the region or of the points.
struct Frame {
    seconds: f64,
    values: Values,
    out: *mut f32,
    out_count: u64,
}

/// Makes a frame.
///
/// # Safety
/// The host passes as many elements as it says, in `driver` and in `out`.
unsafe fn present(
    name: &'static str,
    scene: *mut upt_scene,
    driver: Driver,
    frame: Frame,
) -> upt_status {
    call_scene(name, scene, |scene| {
        features::instruments()?;
        // SAFETY: the caller's.
        unsafe { made(scene, driver, frame) }?;
        Ok(UPT_OK)
    })
}

/// # Safety
/// As [`present`].
unsafe fn made(scene: &Scene, driver: Driver, frame: Frame) -> Result<(), Failure> {
    match driver {
        Driver::Instruments(instruments, count) => {
            let mut tools = scene.frame_tools()?;
            // SAFETY: the host passes that many instruments, as the header asks.
            unsafe { read_tools(instruments, count, &mut tools) }?;
            // SAFETY: the caller's.
            unsafe { shown(scene, Contact::Tools(&tools), frame) }
        }
        Driver::Contacts(nodes, vectors, count) => {
            // SAFETY: the host passes that many nodes and vectors, as the header asks.
            let (nodes, vectors) = unsafe { contacts(scene, nodes, vectors, count) }?;
            // SAFETY: the caller's.
            unsafe { shown(scene, Contact::Sparse { nodes, vectors }, frame) }
        }
    }
}

/// # Safety
/// The host passes room for that many elements, as the header asks.
unsafe fn shown(scene: &Scene, contact: Contact<'_>, frame: Frame) -> Result<(), Failure> {
    // SAFETY: the caller's.
    let out = unsafe { output(frame.out, frame.out_count, "out") }?;
    scene.frame_to(frame.values, frame.seconds, contact, out)?;
    Ok(())
}

/// The tissue at a moment between steps, with the instruments where they are at that moment: frames without lag.
///
/// The velocities of the last published state continue as far as the instruments do, and contact is solved at the poses given here with
/// the compliance of that time. Any frame rate works, even an uneven one, and a submitted step may be in flight. When a step arrives, the
/// frames start from where they would have been without it. They blend into the new step within two fifths of a step, or at 25 mm/s where
/// that takes longer, but always within two steps.
///
/// - `seconds`: time since the last published step, 0 or more; velocities are followed for two steps at most.
/// - `instruments`: as `upt_scene_step_instruments`.
/// - `out`: `[n,3]`, mm, in the region's order.
/// - `out_count`: number of floats in `out`, 3 n.
///
/// Threads: one thread at a time presents; another may step or submit meanwhile.
/// Errors: `UPT_ERR_BUSY` while another thread presents, and if a step is in flight at the first call;
/// `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", for a bundle without a linear response or corrections, and
/// for a scene without corrections; `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT`,
/// `UPT_ERR_NON_FINITE`, `UPT_ERR_STATE`, `UPT_ERR_RUNTIME`, `UPT_ERR_IO`, `UPT_ERR_BUNDLE`, `UPT_ERR_OUT_OF_MEMORY`,
/// `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_present(
    scene: *mut upt_scene,
    seconds: f64,
    instruments: *const upt_instrument,
    instrument_count: u64,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    let frame = Frame {
        seconds,
        values: Values::Region,
        out,
        out_count,
    };
    let driver = Driver::Instruments(instruments, instrument_count);
    // SAFETY: the host's promise in the header.
    unsafe { present("upt_scene_present", scene, driver, frame) }
}

/// As `upt_scene_present`, at the attached points.
///
/// - `seconds`, `instruments`: as `upt_scene_present`.
/// - `out`: `[n,3]`, mm.
/// - `out_count`: number of floats in `out`, 3 n.
///
/// Threads: one thread at a time presents, the region or points; another may step or submit meanwhile.
/// Errors: those of `upt_scene_present`; `UPT_ERR_STATE` when no points are attached.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_present_points(
    scene: *mut upt_scene,
    seconds: f64,
    instruments: *const upt_instrument,
    instrument_count: u64,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    let frame = Frame {
        seconds,
        values: Values::Points,
        out,
        out_count,
    };
    let driver = Driver::Instruments(instruments, instrument_count);
    // SAFETY: the host's promise in the header.
    unsafe { present("upt_scene_present_points", scene, driver, frame) }
}

/// As `upt_scene_present`, with a collision field in place of instruments, for scenes that `upt_scene_step_contacts` drives.
///
/// The listed nodes go where the list says; the others follow by the compliance of that time. Nodes of the last step that are no longer
/// listed are released: they lose the force that held them.
///
/// - `seconds`: as `upt_scene_present`.
/// - `contact_nodes`: `[m]` node indices, each at most once, in any order.
/// - `contact_vectors`: `[m,3]`, mm: the displacement of these nodes at that moment.
/// - `contact_count`: m; 0 means no contact and both may be NULL.
/// - `out`: `[n,3]`, mm, in the region's order.
/// - `out_count`: number of floats in `out`, 3 n.
///
/// Threads: as `upt_scene_present`.
/// Errors: those of `upt_scene_present`; also `UPT_ERR_ARGUMENT` for an index or a count beyond K.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_present_contacts(
    scene: *mut upt_scene,
    seconds: f64,
    contact_nodes: *const u32,
    contact_vectors: *const f32,
    contact_count: u64,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    let frame = Frame {
        seconds,
        values: Values::Region,
        out,
        out_count,
    };
    let driver = Driver::Contacts(contact_nodes, contact_vectors, contact_count);
    // SAFETY: the host's promise in the header.
    unsafe { present("upt_scene_present_contacts", scene, driver, frame) }
}

/// As `upt_scene_present_contacts`, at the attached points.
///
/// - `seconds`, `contact_nodes`, `contact_vectors`, `contact_count`: as `upt_scene_present_contacts`.
/// - `out`: `[n,3]`, mm.
/// - `out_count`: number of floats in `out`, 3 n.
///
/// Threads: as `upt_scene_present_points`.
/// Errors: those of `upt_scene_present_contacts`; `UPT_ERR_STATE` when no points are attached.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_present_points_contacts(
    scene: *mut upt_scene,
    seconds: f64,
    contact_nodes: *const u32,
    contact_vectors: *const f32,
    contact_count: u64,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    let frame = Frame {
        seconds,
        values: Values::Points,
        out,
        out_count,
    };
    let driver = Driver::Contacts(contact_nodes, contact_vectors, contact_count);
    // SAFETY: the host's promise in the header.
    unsafe { present("upt_scene_present_points_contacts", scene, driver, frame) }
}
