//! The host's `upt_input` -> the library's input of a step; `upt_view` -> what is shown.
//!
//! REQ-011: A mistake in the input of a step is a typed error that names the field, and nothing changes.

use super::constants::*;
use super::convert;
use super::failure::{Failure, fail};
use super::load_structs::{upt_point_force, upt_pressure};
use super::pointers::{each, options, slice};
use super::step_structs::*;
use super::support_structs::upt_support;
use super::ties::taken;
use crate::contact::{MAX_TIES, MAX_TOOLS, Tool};
use crate::features;
use crate::scene::{
    Contact, GroupMotion, Lists, Loads, MAX_POINT_FORCES, MAX_PRESSURES, MAX_SUPPORTS, PointForce,
    Pressure, Scene, StepInput, SupportPose,
};
use ::contact::Tie;

/// Room for what of an input points into the host's arrays.
pub(super) struct Arrays {
    pressures: [Pressure<'static>; MAX_PRESSURES],
    supports: [GroupMotion<'static>; MAX_SUPPORTS],
}

impl Default for Arrays {
    fn default() -> Arrays {
        Arrays {
            pressures: [Pressure::default(); MAX_PRESSURES],
            supports: [GroupMotion::default(); MAX_SUPPORTS],
        }
    }
}

/// The host's input; its instruments, ties and pressures are read into lists, its arrays stay where they are.
///
/// # Safety
/// NULL, or a struct whose first field is its size; its pointers lead to as many elements as the header says.
pub(super) unsafe fn read_input<'a>(
    scene: &Scene,
    raw: *const upt_input,
    Lists {
        tools,
        ties,
        point_forces,
    }: &'a mut Lists,
    arrays: &'a mut Arrays,
) -> Result<StepInput<'a>, Failure> {
    // SAFETY: the caller's.
    let raw = unsafe { options(raw, "input") }?;
    if raw.reserved != [0; 4] || raw.reserved_end != [0; 4] {
        return fail(
            UPT_ERR_ARGUMENT,
            "input.reserved or reserved_end is not zero; clear the struct before you set its fields",
        );
    }
    let drives = [
        ("instruments", raw.instrument_count != 0),
        ("contact_nodes", raw.contact_count != 0),
        ("collision", !raw.collision.is_null()),
    ];
    let mut given = drives.iter().filter(|(_, given)| *given);
    if let (Some((one, _)), Some((other, _))) = (given.next(), given.next()) {
        return fail(
            UPT_ERR_ARGUMENT,
            format!("input.{one} and input.{other} are both set; one thing drives a step"),
        );
    }
    let contact = if raw.instrument_count != 0 {
        features::instruments()?;
        // SAFETY: the caller's.
        unsafe { read_tools(raw.instruments, raw.instrument_count, tools) }?;
        Contact::Tools(tools)
    } else if raw.contact_count != 0 {
        scene.check_node_count("input.contact_count", raw.contact_count)?;
        let floats = 3 * raw.contact_count;
        Contact::Sparse {
            // SAFETY: the caller's.
            nodes: unsafe { slice(raw.contact_nodes, raw.contact_count, "input.contact_nodes") }?,
            // SAFETY: the caller's.
            vectors: unsafe { slice(raw.contact_vectors, floats, "input.contact_vectors") }?,
        }
    } else {
        // SAFETY: the caller's.
        unsafe { field(scene, raw.collision, "input.collision") }?
            .map_or(Contact::None, Contact::Dense)
    };
    Ok(StepInput {
        // SAFETY: the caller's.
        displacement: unsafe { field(scene, raw.displacement, "input.displacement") }?,
        contact,
        // SAFETY: the caller's.
        loads: unsafe { read_loads(scene, &raw, arrays, (ties, point_forces)) }?,
        time_s: raw.time_s,
    })
}

/// The host's loads.
///
/// # Safety
/// As [`read_input`]; the lists of nodes outlive what is read.
unsafe fn read_loads<'a>(
    scene: &Scene,
    raw: &upt_input,
    Arrays {
        pressures,
        supports,
    }: &'a mut Arrays,
    (ties, point_forces): (&'a mut Vec<Tie>, &'a mut Vec<PointForce>),
) -> Result<Loads<'a>, Failure> {
    if raw.tie_count != 0 {
        features::instruments()?;
    }
    if raw.tie_count > MAX_TIES as u64 {
        return fail(
            UPT_ERR_ARGUMENT,
            format!(
                "input.tie_count is {}, must be at most {MAX_TIES}",
                raw.tie_count
            ),
        );
    }
    ties.clear();
    crate::memory::fit(ties, raw.tie_count as usize, "the ties")?;
    let read_tie = |index: usize, one: upt_tie| {
        ties.push(taken(index, &one)?);
        Ok(())
    };
    // SAFETY: the caller's.
    unsafe { each(raw.ties, raw.tie_count, "input.ties", read_tie) }?;
    if raw.pressure_count > MAX_PRESSURES as u64 {
        return fail(
            UPT_ERR_ARGUMENT,
            format!(
                "input.pressure_count is {}, must be at most {MAX_PRESSURES}",
                raw.pressure_count
            ),
        );
    }
    let read = |index: usize, pressure: upt_pressure| {
        let name = format!("input.pressures[{index}].nodes");
        scene.check_node_count(&name, pressure.node_count)?;
        pressures[index] = Pressure {
            // SAFETY: the caller's.
            nodes: unsafe { slice(pressure.nodes, pressure.node_count, &name) }?,
            pascal: pressure.pascal,
        };
        Ok(())
    };
    // SAFETY: the caller's.
    unsafe { each(raw.pressures, raw.pressure_count, "input.pressures", read) }?;
    if raw.point_force_count > MAX_POINT_FORCES as u64 {
        return fail(
            UPT_ERR_ARGUMENT,
            format!(
                "input.point_force_count is {}, must be at most {MAX_POINT_FORCES}",
                raw.point_force_count
            ),
        );
    }
    point_forces.clear();
    let count = raw.point_force_count;
    crate::memory::fit(point_forces, count as usize, "the forces at points")?;
    let read = |_, own: upt_point_force| {
        point_forces.push(PointForce {
            nodes: own.nodes,
            weights: own.weights,
            force: own.force,
        });
        Ok(())
    };
    // SAFETY: the caller's.
    unsafe { each(raw.point_forces, count, "input.point_forces", read) }?;
    // SAFETY: the caller's.
    let supports = unsafe { read_supports(raw, supports) }?;
    Ok(Loads {
        supports,
        gravity: raw.gravity,
        gravity_at_rest: raw.gravity_at_rest,
        // SAFETY: the caller's.
        forces: unsafe { field(scene, raw.forces, "input.forces") }?,
        point_forces,
        pressures: &pressures[..raw.pressure_count as usize],
        ties,
        support: (raw.support_rotation != [0.0; 4] || raw.support_position != [0.0; 3]).then_some(
            SupportPose {
                position: raw.support_position,
                rotation: convert::rotation(raw.support_rotation),
            },
        ),
    })
}

/// What the support groups do.
///
/// # Safety
/// As [`read_input`]; the lists of displacements outlive what is read.
unsafe fn read_supports<'a>(
    raw: &upt_input,
    supports: &'a mut [GroupMotion<'static>; MAX_SUPPORTS],
) -> Result<&'a [GroupMotion<'static>], Failure> {
    if raw.support_count > MAX_SUPPORTS as u64 {
        return fail(
            UPT_ERR_ARGUMENT,
            format!(
                "input.support_count is {}, must be at most {MAX_SUPPORTS}",
                raw.support_count
            ),
        );
    }
    let read = |index: usize, one: upt_support| {
        if one.reserved != [0; 3] || one.let_go > 1 {
            return fail(
                UPT_ERR_ARGUMENT,
                format!("input.supports[{index}]: let_go must be 0 or 1, and reserved zero"),
            );
        }
        let has_pose = one.rotation != [0.0; 4] || one.position != [0.0; 3];
        let name = format!("input.supports[{index}].displacements");
        supports[index] = GroupMotion {
            group: one.group,
            let_go: one.let_go != 0,
            pose: has_pose.then_some(SupportPose {
                position: one.position,
                rotation: convert::rotation(one.rotation),
            }),
            displacements: match one.displacements.is_null() && one.displacement_count == 0 {
                true => None,
                // SAFETY: the caller's.
                false => Some(unsafe { slice(one.displacements, one.displacement_count, &name) }?),
            },
        };
        Ok(())
    };
    // SAFETY: the caller's.
    unsafe { each(raw.supports, raw.support_count, "input.supports", read) }?;
    Ok(&supports[..raw.support_count as usize])
}

/// A dense field `[K,3]` of the intact mesh, or none.
///
/// # Safety
/// NULL, or a pointer to 3 K floats.
pub(super) unsafe fn field<'a>(
    scene: &Scene,
    pointer: *const f32,
    name: &str,
) -> Result<Option<&'a [f32]>, Failure> {
    if pointer.is_null() {
        return Ok(None);
    }
    let floats = scene.mesh().positions.len() as u64;
    // SAFETY: the caller's.
    unsafe { slice(pointer, floats, name) }.map(Some)
}

/// The host's instruments as tools.
///
/// # Safety
/// The host passes that many instruments.
unsafe fn read_tools(
    instruments: *const upt_instrument,
    count: u64,
    tools: &mut Vec<Tool>,
) -> Result<(), Failure> {
    if count > MAX_TOOLS as u64 {
        return fail(
            UPT_ERR_ARGUMENT,
            format!("input.instrument_count is {count}, must be at most {MAX_TOOLS}"),
        );
    }
    tools.clear();
    crate::memory::fit(tools, count as usize, "the instruments")?;
    let read = |index: usize, raw: upt_instrument| {
        tools.push(convert::tool(index, &raw)?);
        Ok(())
    };
    // SAFETY: the caller's.
    unsafe { each(instruments, count, "input.instruments", read) }
}
