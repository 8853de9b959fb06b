//! `upt_scene`: what the tissue does to the instruments that drive it; `upt_hull`.

use super::call::call;
use super::constants::*;
use super::output::{copy_out, fill, place};
use super::pointers::slice;
use super::registry::{add_hull, call_scene, remove_hull};
use super::step_structs::*;
use super::structs::*;
use crate::error::Error;
use crate::features;
use ::contact::{Body, Shape};

/// Copies the force, torque and penetration of each instrument at the end of the last step.
///
/// - `out`: `[count]`, in the order of the step's instruments; set `struct_size` of every element.
/// - `count`: instruments of that step.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`,
/// `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT` if the last step had another number of instruments.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_read_instruments(
    scene: *mut upt_scene,
    out: *mut upt_instrument_reading,
    count: u64,
) -> upt_status {
    call_scene("upt_scene_read_instruments", scene, |scene| {
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
pub unsafe extern "C" fn upt_scene_read_instrument_contacts(
    scene: *mut upt_scene,
    out: *mut upt_instrument_contact,
    capacity: u64,
    needed: *mut u64,
) -> upt_status {
    call_scene("upt_scene_read_instrument_contacts", scene, |scene| {
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

/// Creates the shape of a tool of your own, for `UPT_SHAPE_HULL`: a closed surface of triangles with all its hollows, or the convex hull of points.
///
/// - `points`: `[n,3]`, mm, in the tool's own frame.
/// - `point_count`: n, 4 to 100,000.
/// - `faces`: `[m,3]`, points of each triangle, all clockwise or all anticlockwise; each edge belongs to two. NULL with `face_count` 0: the convex
///   hull of the points.
/// - `face_count`: m, at most 200,000.
/// - `out`: the new hull.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_ARGUMENT` for points that are not finite, too many, or without volume, and for a surface that is not closed,
/// crosses itself, has a part inside out or a wall of less than 0.2 mm,
/// `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_OUT_OF_MEMORY`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_hull_create(
    points: *const f32,
    point_count: u64,
    faces: *const u32,
    face_count: u64,
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
            const MOST_FACES: u64 = 200_000;
            if face_count > MOST_FACES {
                return Err(Error::Argument(format!(
                    "face_count is {face_count}, must be at most {MOST_FACES}; simplify the mesh"
                ))
                .into());
            }
            // SAFETY: the host passes that many elements, as the header asks.
            let points = unsafe { slice(points, 3 * point_count, "points") }?;
            // SAFETY: as above.
            let faces = unsafe { slice(faces, 3 * face_count, "faces") }?;
            features::instruments()?;
            crate::memory::probe(1024 * (point_count + face_count) as usize, "a hull")?;
            let what = if faces.is_empty() { "points" } else { "faces" };
            let bad = |error: ::contact::ShapeError| Error::Argument(format!("{what}: {error}"));
            let (points, faces) = (points.as_chunks().0, faces.as_chunks().0);
            let shape = match faces {
                [] => Shape::hull_of(points).map_err(bad)?,
                faces => Shape::Mesh {
                    points: points.to_vec(),
                    faces: faces.to_vec(),
                    margin: 0.0,
                },
            };
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
