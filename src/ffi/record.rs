//! `upt_scene`: recordings.

use super::constants::*;
use super::failure::fail;
use super::output::{output, place};
use super::registry::call_scene;
use super::structs::*;

/// Begins to record what the scene is given: steps, submitted ones when they are made, cuts and what is like them, resets, restored snapshots and
/// regions, each as a line of JSON that `upt replay --verify` follows on any machine. Calls that fail have no line. A scene that is not at rest puts
/// its state first. The lines stay in memory until `upt_scene_take_record` takes them.
///
/// - `every`: after how many steps the SHA-256 of what `upt_scene_read` gives is written, 1 or more; 0 ends the recording.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_STATE` where a recording is on, where there is none to end, and where the last one has not been taken; `UPT_ERR_UNSUPPORTED` for a scene
/// with a budget of time or with a mesh of its own; `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_BUSY`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_record(scene: *mut upt_scene, every: u32) -> upt_status {
    call_scene("upt_scene_record", scene, |scene| {
        scene.record(every)?;
        Ok(UPT_OK)
    })
}

/// Copies the lines of the recording that were not taken before, and forgets them. One after the other they make the file: take them now and then in a long
/// session, and once after its end, whose line says that nothing is missing.
///
/// - `out`: whole lines, UTF-8, without a NUL; NULL with capacity 0 only queries the size.
/// - `capacity`: size of `out` in bytes; more than enough is fine, since a step in flight may add a line after the size was asked for.
/// - `needed`: bytes that there are, 0 where there is no recording; always written.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_ARGUMENT` if capacity is too small, `UPT_ERR_PANIC`; the lines stay.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_take_record(
    scene: *mut upt_scene,
    out: *mut u8,
    capacity: u64,
    needed: *mut u64,
) -> upt_status {
    call_scene("upt_scene_take_record", scene, |scene| {
        // SAFETY: the header asks for a place to write.
        let needed = unsafe { place(needed, "needed") }?;
        let only_asks = out.is_null() && capacity == 0;
        let answer = scene.with_record(|text| {
            let size = text.len() as u64;
            needed.set(size);
            if only_asks {
                return Ok((Ok(UPT_OK), false));
            }
            if capacity < size {
                let why = format!("capacity is {capacity}, {size} are needed");
                return Ok((fail(UPT_ERR_ARGUMENT, why), false));
            }
            // SAFETY: the host passes room for that many elements, as the header asks.
            Ok(match unsafe { output(out, size, "out") } {
                Ok(room) => {
                    room.copy_from(text);
                    (Ok(UPT_OK), true)
                }
                Err(failure) => (Err(failure), false),
            })
        });
        answer?
    })
}
