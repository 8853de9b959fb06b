//! `upt_scene`: instruments -> contacts, displacement -> forces.

use super::call::fail;
use super::convert;
use super::pointers::{place, required, slice_mut};
use super::registry::call_scene;
use super::status::*;
use super::structs::*;

/// Finds the nodes that rigid instruments touch and the displacement that they impose: the input of a step.
///
/// instruments: array; every element has its `struct_size` set. contact_nodes: `[capacity]`, contact_vectors:
/// `[capacity,3]`, mm; both may be NULL with capacity 0, which only asks. contact_count: contacts found, always written.
/// Threads: one at a time. Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "contact", `UPT_ERR_NULL`,
/// `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT` (also when capacity
/// is too small), `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_contacts_from_instruments(
    scene: *mut upt_scene,
    instruments: *const upt_instrument,
    instrument_count: u64,
    contact_nodes: *mut u32,
    contact_vectors: *mut f32,
    capacity: u64,
    contact_count: *mut u64,
) -> upt_status {
    call_scene("upt_scene_contacts_from_instruments", scene, |_scene| {
        let _count = place(contact_count, "contact_count")?;
        for index in 0..instrument_count {
            let raw = instruments.wrapping_add(index as usize);
            let raw = unsafe { required(raw, "instruments[]") }?;
            convert::flag("sticking", raw.sticking)?;
            convert::reserved(&raw.reserved)?;
        }
        unsafe { slice_mut(contact_nodes, capacity, "contact_nodes") }?;
        unsafe {
            slice_mut(
                contact_vectors,
                capacity.saturating_mul(3),
                "contact_vectors",
            )
        }?;
        fail(UPT_ERR_UNSUPPORTED, "this build has no feature \"contact\"")
    })
}

/// Copies the reaction of the tissue at the last step's contact nodes, in their order.
///
/// out: `[m,3]`, mN, the force on the instrument. out_count: floats in out, 3 m.
/// Threads: one at a time. Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "forces", `UPT_ERR_NULL`,
/// `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_STATE`, `UPT_ERR_ARGUMENT`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_contact_force(
    scene: *mut upt_scene,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_contact_force", scene, |_scene| {
        place(out, "out")?;
        unsafe { slice_mut(out, out_count, "out") }?;
        fail(UPT_ERR_UNSUPPORTED, "this build has no feature \"forces\"")
    })
}
