//! `upt_scene`: ties, made and read.

use super::constants::*;
use super::failure::{Failure, fail};
use super::output::{fill, output, place};
use super::pointers::{check, options, slice};
use super::registry::call_scene;
use super::step_structs::*;
use super::structs::*;
use crate::error::Error;
use crate::features;
use crate::scene::Bed;
use ::contact::{End, Spring, Tie, TiePoint, Vector};

/// Places that one call finds points for at most.
const MOST_POINTS: u64 = 1_000_000;

/// Copies what each tie of the last step does at its end.
///
/// - `out`: `[count]`, in the order of the step's ties; set `struct_size` of every element.
/// - `count`: ties of that step.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: `UPT_ERR_UNSUPPORTED` in a build without feature "instruments", `UPT_ERR_NULL`, `UPT_ERR_HANDLE`,
/// `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_ARGUMENT` if the last step had another number of ties.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_read_ties(
    scene: *mut upt_scene,
    out: *mut upt_tie_reading,
    count: u64,
) -> upt_status {
    call_scene("upt_scene_read_ties", scene, |scene| {
        features::instruments()?;
        scene.with_contact_report(|report| {
            let have = report.ties.len() as u64;
            if count != have {
                return Err(Error::Argument(format!(
                    "count is {count}, the last step had {have} ties"
                ))
                .into());
            }
            for (index, reading) in report.ties.iter().enumerate() {
                let make = |struct_size| {
                    Ok(upt_tie_reading {
                        struct_size,
                        broken: reading.broken.into(),
                        broke: reading.broke.into(),
                        reserved: [0; 2],
                        force: reading.force,
                        length_mm: reading.length_mm,
                    })
                };
                // SAFETY: `out` points to a struct whose first field is its size, as the header asks.
                unsafe { fill(out.wrapping_add(index), make) }?;
            }
            Ok(UPT_OK)
        })
    })
}

/// Finds the points of the tissue nearest to places, for ties: of the domain, the surface that instruments may touch, where it is in the last state.
///
/// - `places`: `[count,3]`, mm, in the mesh's frame; at most 1,000,000.
/// - `nodes`: `[count,3]`, `weights`: `[count,3]`: of each the nodes of a face and the weights of its corners, for `upt_tie`.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT` for too many and for a bundle without a domain,
/// `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_UNSUPPORTED` for a cut body and in a build without feature "instruments"; nothing is written then.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_tie_points(
    scene: *mut upt_scene,
    places: *const f32,
    count: u64,
    nodes: *mut u32,
    weights: *mut f32,
) -> upt_status {
    call_scene("upt_scene_tie_points", scene, |scene| {
        features::instruments()?;
        if count > MOST_POINTS {
            return fail(
                UPT_ERR_ARGUMENT,
                format!("count is {count}, must be at most {MOST_POINTS}"),
            );
        }
        let floats = 3 * count;
        // SAFETY: the host passes that many elements, as the header asks.
        let places = unsafe { slice(places, floats, "places") }?;
        // SAFETY: the host passes room for that many elements, as the header asks.
        let nodes_out = unsafe { output(nodes, floats, "nodes") }?;
        // SAFETY: as above.
        let weights_out = unsafe { output(weights, floats, "weights") }?;
        let places = places.as_chunks::<3>().0;
        let found = places.iter().map(|place| scene.tie_point(*place));
        let mut points = crate::memory::room(places.len(), "points of ties")?;
        for point in found {
            points.push(point?);
        }
        let nodes = points.iter().flat_map(|point| point.nodes);
        let weights = points.iter().flat_map(|point| point.weights);
        nodes_out.copy_from(&crate::memory::collected(
            3 * places.len(),
            nodes,
            "points of ties",
        )?);
        weights_out.copy_from(&crate::memory::collected(
            3 * places.len(),
            weights,
            "points of ties",
        )?);
        Ok(UPT_OK)
    })
}

/// Makes a bed: a tie at each free node of the domain within a region, from where the node is in the last state. Pass them in every step; a bed tears node by node.
///
/// - `bed`: its region, and what holds there altogether: stiffness, damping and break force are shared among the ties by the area of surface around each node.
/// - `ties`: `[capacity]`, ascending by node; set `struct_size` of every element. NULL with capacity 0 only queries the size.
/// - `needed`: number of ties, written whenever there is a bed.
///
/// Threads: any, at any time, even while a step runs.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_NON_FINITE`, `UPT_ERR_ARGUMENT` for a region without such nodes or with more than
/// 256, for a number that no tie can have, and if capacity is too small; `UPT_ERR_UNSUPPORTED` for a cut body and in a build without feature "instruments";
/// `UPT_ERR_OUT_OF_MEMORY`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_bed(
    scene: *mut upt_scene,
    bed: *const upt_bed,
    ties: *mut upt_tie,
    capacity: u64,
    needed: *mut u64,
) -> upt_status {
    call_scene("upt_scene_bed", scene, |scene| {
        features::instruments()?;
        check(bed, "bed")?;
        // SAFETY: a struct whose first field is its size, as the header asks.
        let raw = unsafe { options(bed, "bed") }?;
        super::convert::reserved(&raw.reserved)?;
        scene.check_node_count("bed.node_count", raw.node_count)?;
        let made = scene.bed(&Bed {
            // SAFETY: the host passes that many elements, as the header asks.
            nodes: unsafe { slice(raw.nodes, raw.node_count, "bed.nodes") }?,
            centre: raw.centre,
            radius_mm: raw.radius_mm,
            spring: spring(raw.stiffness, raw.slack_mm, raw.damping, raw.pushes)?,
            break_mn: raw.break_mn,
            offset: raw.offset,
        })?;
        // SAFETY: the header asks for a place to write.
        unsafe { place(needed, "needed") }?.set(made.len() as u64);
        if capacity == 0 && ties.is_null() {
            return Ok(UPT_OK);
        }
        if capacity < made.len() as u64 {
            return fail(
                UPT_ERR_ARGUMENT,
                format!("capacity is {capacity}, {} are needed", made.len()),
            );
        }
        for (index, tie) in made.iter().enumerate() {
            let make = |struct_size| {
                Ok(upt_tie {
                    struct_size,
                    ..given(tie)
                })
            };
            // SAFETY: `ties` points to that many structs whose first field is their size, as the header asks.
            unsafe { fill(ties.wrapping_add(index), make) }?;
        }
        Ok(UPT_OK)
    })
}

fn spring(stiffness: f32, slack_mm: f32, damping: f32, pushes: u8) -> Result<Spring, Failure> {
    Ok(Spring {
        stiffness,
        slack_mm,
        damping,
        pushes: super::convert::flag("pushes", pushes)?,
    })
}

/// Weights that were never set are those of the first node.
fn point(nodes: [u32; 3], weights: [f32; 3]) -> TiePoint {
    let weights = match weights == [0.0; 3] {
        true => [1.0, 0.0, 0.0],
        false => weights,
    };
    TiePoint { nodes, weights }
}

/// A tie of the library's as a host's.
fn given(tie: &Tie) -> upt_tie {
    let [x, y, z] = match tie.end {
        End::World(place) | End::Support(place) | End::Tool { place, .. } => place.to_array(),
        End::Tissue(_) => [0.0; 3],
    };
    upt_tie {
        to: UPT_END_SUPPORT,
        nodes: tie.point.nodes,
        weights: tie.point.weights,
        place: [x, y, z],
        stiffness: tie.spring.stiffness,
        slack_mm: tie.spring.slack_mm,
        damping: tie.spring.damping,
        pushes: tie.spring.pushes.into(),
        break_mn: tie.break_mn,
        ..upt_tie::NONE
    }
}

/// A host's tie as the library's.
pub(super) fn taken(index: usize, raw: &upt_tie) -> Result<Tie, Failure> {
    super::convert::reserved(&raw.reserved)?;
    let place = Vector::from(raw.place);
    let end = match raw.to {
        UPT_END_SUPPORT => End::Support(place),
        UPT_END_WORLD => End::World(place),
        UPT_END_INSTRUMENT => End::Tool {
            tool: raw.instrument,
            place,
        },
        UPT_END_TISSUE => End::Tissue(point(raw.other_nodes, raw.other_weights)),
        value => {
            return fail(
                UPT_ERR_ARGUMENT,
                format!("input.ties[{index}].to is {value}, must be a UPT_END_*"),
            );
        }
    };
    Ok(Tie {
        point: point(raw.nodes, raw.weights),
        end,
        spring: spring(raw.stiffness, raw.slack_mm, raw.damping, raw.pushes)?,
        break_mn: raw.break_mn,
    })
}
