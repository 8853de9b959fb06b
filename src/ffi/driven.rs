//! `upt_scene`: steps that instruments drive, and what the tissue does to them; `upt_hull`.

use super::call::call;
use super::constants::*;
use super::convert;
use super::failure::Failure;
use super::output::{copy_out, fill, optional_output, place};
use super::pointers::{each, slice};
use super::registry::{add_hull, call_scene, remove_hull};
use super::structs::*;
use crate::contact::{MAX_TOOLS, Tool};
use crate::error::Error;
use crate::features;
use crate::scene::{Contact, Scene, StepInput};
use ::contact::{Body, Shape};

/// One step from the scene's own state, driven by rigid instruments. Their contact with the tissue is solved.
///
/// Give the pose of each instrument at the end of the step; the instrument moves there on a straight line from its last
/// pose. An instrument that would move more than 40 mm in a step is placed there without a motion. Contact is unilateral, with Coulomb
/// friction, at points of the domain's surface at most 1.7 mm apart. A scene with corrections solves it inside each
/// correction, as a load; with `corrections = UPT_CORRECTIONS_NONE` it is solved once, on the linear response. The scene
/// remembers each place of the array: pass every instrument every time, in the same order.
///
/// - `instruments`: at most 64, all with the same `struct_size`; NULL with count 0 makes a step without contact.
/// - `out`, `out_count`, threads and errors: as in `upt_scene_step`; also `UPT_ERR_UNSUPPORTED` in a build without
///   feature "instruments" and for a bundle without a linear response, `UPT_ERR_STRUCT_SIZE`, and `UPT_ERR_HANDLE` for a hull
///   that was destroyed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_step_instruments(
    scene: *mut upt_scene,
    instruments: *const upt_instrument,
    instrument_count: u64,
    out: *mut f32,
    out_count: u64,
) -> upt_status {
    call_scene("upt_scene_step_instruments", scene, |scene| {
        features::instruments()?;
        scene.with_tools(|tools| {
            // SAFETY: the host passes that many instruments, as the header asks.
            unsafe { read_tools(instruments, instrument_count, tools) }?;
            let input = StepInput {
                displacement: None,
                contact: Contact::Tools(tools),
            };
            // SAFETY: the host passes room for that many elements, as the header asks.
            let out = unsafe { optional_output(out, out_count, "out") }?;
            scene.step_to(input, out)?;
            Ok(UPT_OK)
        })
    })
}

/// Starts a step driven by rigid instruments on the scene's worker thread and returns at once.
///
/// - `instruments`, `instrument_count`: as in `upt_scene_step_instruments`; checked and copied before the call returns.
///
/// Threads and errors: those of `upt_scene_submit` and of `upt_scene_step_instruments`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_submit_instruments(
    scene: *mut upt_scene,
    instruments: *const upt_instrument,
    instrument_count: u64,
) -> upt_status {
    call_scene("upt_scene_submit_instruments", scene, |scene| {
        features::instruments()?;
        scene.with_tools(|tools| {
            // SAFETY: the host passes that many instruments, as the header asks.
            unsafe { read_tools(instruments, instrument_count, tools) }?;
            scene.submit_tools(tools)?;
            Ok(UPT_OK)
        })
    })
}

/// Copies the force, torque and penetration of each instrument at the end of the last step.
///
/// - `out`: `[count]`, in the order of the step's instruments; set `struct_size` of every element.
/// - `count`: instruments of that step.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`,
/// `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT` if the last step had another number of instruments.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_instrument_readings(
    scene: *mut upt_scene,
    out: *mut upt_instrument_reading,
    count: u64,
) -> upt_status {
    call_scene("upt_scene_instrument_readings", scene, |scene| {
        features::instruments()?;
        scene.with_contact_report(|report| {
            let have = report.readings.len() as u64;
            if count != have {
                return Err(Error::Argument(format!(
                    "count is {count}, the last step had {have} instruments"
                ))
                .into());
            }
            for (index, reading) in report.readings.iter().enumerate() {
                let make = |struct_size| {
                    Ok(upt_instrument_reading {
                        struct_size,
                        contact_count: reading.contacts,
                        force: reading.force,
                        torque: reading.torque,
                        penetration_mm: reading.penetration_mm,
                        torn: reading.torn.into(),
                        reserved: [0; 3],
                        residual_mm: reading.residual_mm,
                    })
                };
                // SAFETY: `out` points to a struct whose first field is its size, as the header asks.
                unsafe { fill(out.wrapping_add(index), make) }?;
            }
            Ok(UPT_OK)
        })
    })
}

/// Copies the points of the surface that pushed or held instruments at the end of the last step, ascending by instrument.
///
/// - `out`: `[capacity]`; NULL with capacity 0 only queries the size.
/// - `needed`: number of points, always written; may be NULL.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`,
/// `UPT_ERR_ARGUMENT` if capacity is too small.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_instrument_contacts(
    scene: *mut upt_scene,
    out: *mut upt_instrument_contact,
    capacity: u64,
    needed: *mut u64,
) -> upt_status {
    call_scene("upt_scene_instrument_contacts", scene, |scene| {
        if let Err(error) = features::instruments() {
            // SAFETY: `out` has room for `capacity` elements and `needed` is NULL or writable, as the header asks.
            let _ = unsafe { copy_out::<upt_instrument_contact>(&[], out, capacity, needed) };
            return Err(error.into());
        }
        scene.with_contact_report(|report| {
            let contacts = report.pushes.iter().map(|push| upt_instrument_contact {
                instrument: push.tool,
                position: push.point,
                force: push.force,
            });
            let count = report.pushes.len();
            let contacts = crate::memory::collected(count, contacts, "the contacts")?;
            // SAFETY: `out` has room for `capacity` elements and `needed` is NULL or writable, as the header asks.
            unsafe { copy_out(&contacts, out, capacity, needed) }
        })
    })
}

/// Creates the convex hull of a tool's points, for `UPT_SHAPE_HULL`.
///
/// - `points`: `[n,3]`, mm, in the tool's own frame.
/// - `point_count`: n, 4 to 100,000.
/// - `out`: the new hull.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_ARGUMENT` for points that are not finite, too many, or without volume,
/// `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_OUT_OF_MEMORY`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_hull_create(
    points: *const f32,
    point_count: u64,
    out: *mut *mut upt_hull,
) -> upt_status {
    call(
        "upt_hull_create",
        || (),
        || {
            // SAFETY: the header asks for a place to write.
            let out = unsafe { place(out, "out") }?;
            const MOST: u64 = 100_000;
            if !(4..=MOST).contains(&point_count) {
                return Err(Error::Argument(format!(
                    "point_count is {point_count}, must be 4 to {MOST}"
                ))
                .into());
            }
            // SAFETY: the host passes that many elements, as the header asks.
            let points = unsafe { slice(points, 3 * point_count, "points") }?;
            features::instruments()?;
            crate::memory::probe(1024 * point_count as usize, "a hull")?;
            let bad = |error: ::contact::ShapeError| Error::Argument(format!("points: {error}"));
            let shape = Shape::hull_of(points.as_chunks().0).map_err(bad)?;
            let body = Body::new(&shape).map_err(bad)?;
            out.set(add_hull(body));
            Ok(UPT_OK)
        },
    )
}

/// Destroys a hull. Steps that were submitted with it keep what they need.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also if it was destroyed before).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_hull_destroy(hull: *mut upt_hull) -> upt_status {
    call(
        "upt_hull_destroy",
        || (),
        || {
            features::instruments()?;
            drop(remove_hull(hull)?);
            Ok(UPT_OK)
        },
    )
}

/// The host's instruments as tools.
pub(super) unsafe fn read_tools(
    instruments: *const upt_instrument,
    count: u64,
    tools: &mut Vec<Tool>,
) -> Result<(), Failure> {
    if count > MAX_TOOLS as u64 {
        return Err(Error::Argument(format!(
            "instrument_count is {count}, must be at most {MAX_TOOLS}"
        ))
        .into());
    }
    tools.clear();
    crate::memory::fit(tools, count as usize, "the instruments")?;
    let read = |index: usize, raw: upt_instrument| {
        tools.push(convert::tool(index, &raw)?);
        Ok(())
    };
    // SAFETY: the host passes that many instruments, as the header asks.
    unsafe { each(instruments, count, "instruments[]", read) }
}

impl Scene {
    /// Calls with the list that instruments are read into.
    fn with_tools(
        &self,
        call: impl FnOnce(&mut Vec<Tool>) -> super::failure::Answer,
    ) -> super::failure::Answer {
        let mut list = self.tool_list()?;
        call(&mut list)
    }
}
