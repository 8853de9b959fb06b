//! `upt_scene`: instruments -> contacts, displacement -> forces.

use super::constants::*;
use super::convert;
use super::failure::Failure;
use super::output::{output, place};
use super::pointers::each;
use super::registry::call_scene;
use super::step_structs::*;
use super::structs::*;
use crate::contact::MAX_TOOLS;
use crate::error::Error;
use crate::features;
use crate::instrument::Instrument;
use crate::memory;

/// Finds the nodes that rigid instruments touch, and the displacement that they impose there: the input of a step.
///
/// The scene remembers what each place of the array touches until the array's length changes or `upt_scene_reset`: pass
/// every instrument every time, in the same order. NULL with count 0 releases all.
///
/// - `instruments`: at most 64, all with the same `struct_size`, of every shape that `upt_scene_step` takes.
/// - `contact_nodes`: `[capacity]`, `contact_vectors`: `[capacity,3]`, mm; both may be NULL with capacity 0, which only
///   queries the count.
/// - `contact_count`: number of contacts found, always written.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`,
/// `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT` (also when capacity is too small),
/// `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
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
    call_scene("upt_scene_contacts_from_instruments", scene, |scene| {
        // SAFETY: the header asks for a place to write.
        let count_out = unsafe { place(contact_count, "contact_count") }?;
        let capacity_floats = capacity.saturating_mul(3);
        // SAFETY: the host passes room for that many elements, as the header asks.
        let nodes_out = unsafe { output(contact_nodes, capacity, "contact_nodes") }?;
        let vectors_out =
            // SAFETY: the host passes room for that many elements, as the header asks.
            unsafe { output(contact_vectors, capacity_floats, "contact_vectors") }?;
        let mut list = scene.instrument_list()?;
        // SAFETY: the host passes that many instruments, as the header asks.
        unsafe { read_instruments(instruments, instrument_count, &mut list) }?;
        features::instruments()?;
        scene.contacts_from_instruments(&list, |nodes, vectors| {
            count_out.set(nodes.len() as u64);
            if capacity == 0 {
                return Ok(());
            }
            if nodes_out.len() < nodes.len() {
                return Err(Error::Argument(format!(
                    "capacity is {capacity}, {} are needed",
                    nodes.len()
                )));
            }
            nodes_out.first(nodes.len()).copy_from(nodes);
            vectors_out.first(vectors.len()).copy_from(vectors);
            Ok(())
        })?;
        Ok(UPT_OK)
    })
}

/// The host's instruments.
unsafe fn read_instruments(
    instruments: *const upt_instrument,
    count: u64,
    list: &mut Vec<Instrument>,
) -> Result<(), Failure> {
    if count > MAX_TOOLS as u64 {
        return Err(Error::Argument(format!(
            "instrument_count is {count}, must be at most {MAX_TOOLS}"
        ))
        .into());
    }
    list.clear();
    memory::fit(list, count as usize, "the instruments")?;
    let read = |index: usize, raw: upt_instrument| {
        let sticking = convert::flag("sticking", raw.sticking)?;
        convert::reserved(&raw.reserved)?;
        // A build without tools finds these mistakes too.
        features::instruments()?;
        let tool = convert::tool(index, &raw)?;
        list.push(Instrument { sticking, tool });
        Ok(())
    };
    // SAFETY: the host passes that many instruments, as the header asks.
    unsafe { each(instruments, count, "instruments[]", read) }
}

/// Copies the reaction of the tissue at the last step's contact nodes, in their order.
///
/// A bundle with a linear response (`prior_forces` of the statistics is 1) gives the contact forces of that response,
/// `-A_CC^-1 c`: nodes that borrow a column of the compliance share its force, and held nodes and nodes far from the
/// domain get zero. Other bundles give the elastic force of the elements around each node at the last state. Both leave
/// out inertia and damping.
///
/// - `out`: `[m,3]`, mN, the force on the instrument.
/// - `out_count`: number of floats in `out`, 3 m.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`,
/// `UPT_ERR_ARGUMENT`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`; `UPT_ERR_UNSUPPORTED` also for a cut body.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_read_contact_force(
    scene: *mut upt_scene,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_read_contact_force", scene, |scene| {
        // SAFETY: the host passes room for that many elements, as the header asks.
        let out = unsafe { output(out, out_count, "out") }?;
        features::instruments()?;
        scene.contact_force_to(out)?;
        Ok(UPT_OK)
    })
}
