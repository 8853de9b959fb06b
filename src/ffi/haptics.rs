//! `upt_haptics`: forces of one tool for a hand, from a thread of its own.

use super::call::call;
use super::constants::*;
use super::failure::Failure;
use super::output::{fill, place};
use super::pointers::required;
use super::registry::call_scene;
use super::structs::*;
use super::{convert, hands};
use crate::features;
use crate::haptics::{HapticForce, HapticOptions, HapticPose};
use std::ptr::without_provenance_mut;

/// Lets a hand feel a tool: from now on, each step of the scene prepares what `upt_haptics_render` needs.
///
/// Drive the steps of the scene as before, with this tool among their instruments. The object does not keep the scene
/// alive.
///
/// - `options`: required, for its tool.
/// - `out`: the new object. At most 8 per scene and 64 per process.
///
/// Threads: one at a time on the scene.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also for a hull that was destroyed), `UPT_ERR_STRUCT_SIZE`,
/// `UPT_ERR_ARGUMENT`, `UPT_ERR_NON_FINITE`, `UPT_ERR_BUSY` also while a step is in flight, `UPT_ERR_UNSUPPORTED` in a
/// build without feature "instruments", for a bundle without a linear response or corrections, and for a scene without
/// corrections; `UPT_ERR_RUNTIME`, `UPT_ERR_IO`, `UPT_ERR_BUNDLE`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_haptics_create(
    scene: *mut upt_scene,
    options: *const upt_haptics_options,
    out: *mut *mut upt_haptics,
) -> upt_status {
    call_scene("upt_haptics_create", scene, |scene| {
        // SAFETY: the header asks for a place to write.
        let out = unsafe { place(out, "out") }?;
        // SAFETY: the host passes a struct whose first field is its size, as the header asks.
        let raw = unsafe { required(options, "options") }?;
        convert::reserved(&raw.reserved)?;
        let passivity = convert::switch("passivity", raw.passivity)?;
        // SAFETY: the host passes a struct whose first field is its size, as the header asks.
        let tool = unsafe { required(raw.tool, "options.tool") }?;
        features::instruments()?;
        let or = |value: f32, default: f32| if value == 0.0 { default } else { value };
        let tool = convert::tool(0, &tool)?;
        let latency = f64::from(raw.step_latency_ms);
        let options = HapticOptions {
            blend_s: 1e-3 * f64::from(or(raw.blend_ms, 25.0)),
            passivity,
            damping_limit_n_s_per_m: or(raw.damping_limit_n_s_per_m, 5.0),
            force_limit_n: raw.force_limit_n,
            latency_s: (latency != 0.0).then_some(1e-3 * latency),
            ..HapticOptions::new(raw.instrument, tool)
        };
        let hand = hands::add(scene.haptics(&options)?)?;
        out.set(without_provenance_mut(hand));
        Ok(UPT_OK)
    })
}

/// The force on the tool at a pose, with contact solved on what the last step prepared. Made for 1,000 calls a second.
///
/// Waits for nothing, whatever the scene does: no lock, and no allocation unless it fails. A new step is blended in
/// without a jump. Out of contact the force is zero. If the scene is no longer stepped, `age_s` grows and the tissue
/// stays as elastic as the last step left it. In this call lengths are metres, forces newtons and torques newton metres.
///
/// - `pose`: where the tool is now.
/// - `out`: set its `struct_size` first. If the call fails and `out` can be written, its force is zero.
///
/// Threads: one at a time on the object; any other on the scene.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_NON_FINITE` and `UPT_ERR_ARGUMENT` for the
/// pose and a time before the last; `UPT_ERR_BUSY` while another thread is in a call on this object; `UPT_ERR_STATE` once
/// the scene was destroyed; `UPT_ERR_UNSUPPORTED` in a build without feature "instruments"; `UPT_ERR_PANIC`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_haptics_render(
    haptics: *mut upt_haptics,
    pose: *const upt_haptic_pose,
    out: *mut upt_haptic_force,
) -> upt_status {
    call(
        "upt_haptics_render",
        || (),
        || {
            let none = |struct_size| {
                // SAFETY: every bit pattern of zeros is a value of these structs.
                let blank: upt_haptic_force = unsafe { std::mem::zeroed() };
                Ok(upt_haptic_force {
                    struct_size,
                    ..blank
                })
            };
            // SAFETY: `out` points to a struct whose first field is its size, as the header asks.
            unsafe { fill(out, none) }?;
            // SAFETY: the host passes a struct whose first field is its size, as the header asks.
            let raw = unsafe { required(pose, "pose") }?;
            convert::reserved(&raw.reserved)?;
            let has_velocity = convert::flag("has_velocity", raw.has_velocity)?;
            features::instruments()?;
            let velocity = [raw.velocity_m_per_s, raw.angular_velocity_rad_per_s];
            let at = HapticPose {
                time_s: raw.time_s,
                position_m: raw.position_m,
                rotation: convert::rotation(raw.rotation),
                velocity: has_velocity.then_some(velocity),
            };
            let force = hands::with(haptics.addr(), |hand| {
                hand.render(&at).map_err(Failure::from)
            })?;
            // SAFETY: `out` points to a struct whose first field is its size, as the header asks.
            unsafe { fill(out, |struct_size| Ok(written(struct_size, &force))) }
        },
    )
}

/// Destroys a haptics object. Its scene stays usable.
///
/// Threads: any.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE` (also if it was destroyed before), `UPT_ERR_BUSY` while another thread is in
/// a call on it, `UPT_ERR_UNSUPPORTED` in a build without feature "instruments".
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_haptics_destroy(haptics: *mut upt_haptics) -> upt_status {
    call(
        "upt_haptics_destroy",
        || (),
        || {
            features::instruments()?;
            hands::remove(haptics.addr())?;
            Ok(UPT_OK)
        },
    )
}

fn written(struct_size: u32, force: &HapticForce) -> upt_haptic_force {
    let block = |row: usize, column: usize| {
        std::array::from_fn(|at| force.stiffness[6 * (row + at / 3) + column + at % 3])
    };
    upt_haptic_force {
        struct_size,
        contact_count: force.contacts,
        contact: force.contact.into(),
        damped: force.damped.into(),
        reserved: [0; 6],
        step_count: force.steps,
        age_s: force.age_s,
        excess_energy_j: force.excess_energy_j,
        force_n: force.force_n,
        torque_n_m: force.torque_n_m,
        stiffness_n_per_m: block(0, 0),
        coupling_n_per_rad: block(0, 3),
        angular_stiffness_n_m_per_rad: block(3, 3),
    }
}
