//! `upt_scene`: cuts, removal, stiffness.

use super::constants::*;
use super::convert;
use super::failure::{Answer, Failure, fail};
use super::output::fill;
use super::pointers::{options, required, slice};
use super::registry::call_scene;
use super::step_structs::*;
use super::structs::*;
use crate::features;
use crate::scene::{Blade, Cut, Scene};

/// Points of a sweep, and elements of a list, at most: asked before the host's array is touched.
const MOST: u64 = 1 << 20;

/// Cuts along the way of a blade's edge through the tissue as it is now. Elements that the blade touches become two, with copies of
/// nodes where they have come apart, so that the lips lie on the blade's path to a tenth of an element's edge; mass and volume stay, and nothing moves before the
/// next step.
///
/// The scene has more nodes then (`out->node_count`): those that there were keep their numbers, and outputs have `3 * node_count` floats. The elements make each step from then on,
/// with instruments, nodes, loads or without. Frames between steps, regions, attached points (each goes with the side on which it lies) and haptics go on. A step that
/// starts from a displacement is `UPT_ERR_UNSUPPORTED` until `upt_scene_reset`, or until a snapshot from before is restored, which is undo.
///
/// - `stroke`: calls with the same number are one blade that goes on; another number cuts anew.
/// - `points`: `[pose_count, edge_count, 3]`, mm: the edge as a line of points, at each pose.
/// - `pose_count`: 2 or more.
/// - `edge_count`: 2 for a straight edge, or more.
/// - `out`: what was done; set `struct_size`.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` for a blade that sweeps no area or more copies than
/// nodes, `UPT_ERR_NON_FINITE`, `UPT_ERR_UNSUPPORTED` for a scene without corrections or one whose support moves,
/// `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then what it was.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_cut(
    scene: *mut upt_scene,
    stroke: u32,
    points: *const f32,
    pose_count: u64,
    edge_count: u64,
    out: *mut upt_cut,
) -> upt_status {
    call_scene("upt_scene_cut", scene, |scene| {
        // SAFETY: the host passes that many floats, and a struct whose first field is its size, as the header asks.
        unsafe {
            cut_with(
                scene,
                &Blade::default(),
                stroke,
                (points, pose_count, edge_count),
                out,
            )
        }
    })
}

/// Cuts as `upt_scene_cut`, by a blade that feels the tissue and that the tissue feels.
///
/// It cuts where it goes where its edge is sharp and, until its stroke has begun to cut, is pushed with the threshold at least. Else nothing changes and
/// `out->area_mm2` is 0: an instrument that is the blade's body presses meanwhile; leave it out while the blade cuts. What it lays open takes the fracture energy: `out->force` is
/// `-G dA / ds`, and the next step ends with its reaction on the tissue there. What goes over again what its stroke has laid open feels nothing.
///
/// - `blade`: NULL: `upt_scene_cut`.
/// - `stroke`, `points`, `pose_count`, `edge_count`, `out`: as there.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` as there and for an energy or a threshold below 0,
/// `UPT_ERR_NON_FINITE`, `UPT_ERR_UNSUPPORTED` as there, `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The
/// scene is then what it was.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_cut_with(
    scene: *mut upt_scene,
    blade: *const upt_blade,
    stroke: u32,
    points: *const f32,
    pose_count: u64,
    edge_count: u64,
    out: *mut upt_cut,
) -> upt_status {
    call_scene("upt_scene_cut_with", scene, |scene| {
        // SAFETY: NULL, or a struct whose first field is its size, as the header asks.
        let raw = unsafe { options(blade, "blade") }?;
        if raw.reserved != 0 {
            return fail(
                UPT_ERR_ARGUMENT,
                "blade.reserved is not zero; clear the struct before you set its fields",
            );
        }
        let blade = Blade {
            energy: f64::from(raw.fracture_energy),
            threshold_mn: f64::from(raw.threshold),
            pushed_mn: f64::from(raw.pushed),
            ahead: raw.ahead.map(f64::from),
        };
        // SAFETY: as above.
        unsafe { cut_with(scene, &blade, stroke, (points, pose_count, edge_count), out) }
    })
}

/// # Safety
/// As many floats as the counts say; `out` points to a struct whose first field is its size.
unsafe fn cut_with(
    scene: &Scene,
    blade: &Blade,
    stroke: u32,
    (points, pose_count, edge_count): (*const f32, u64, u64),
    out: *mut upt_cut,
) -> Answer {
    let count = pose_count.saturating_mul(edge_count);
    if pose_count < 2 || edge_count < 2 || count > MOST {
        return fail(
            UPT_ERR_ARGUMENT,
            format!(
                "pose_count is {pose_count} and edge_count {edge_count}; each must be 2 or more, and their product at most {MOST}"
            ),
        );
    }
    // SAFETY: the caller's.
    let points = unsafe { slice(points, 3 * count, "points") }?.as_chunks().0;
    let make = || Ok(scene.cut_with(blade, stroke, edge_count as usize, points)?);
    // SAFETY: the caller's.
    unsafe { report(scene, out, make) }
}

/// Removes what lies inside of an instrument, the deepest first, up to a volume: an aspirator with a rate takes that times the step. Elements go in 64 parts
/// each. What `upt_scene_cut` says of a cut scene holds.
///
/// - `instrument`: its shape and pose; friction and mode do not matter.
/// - `most_mm3`: largest volume.
/// - `out`: what was done; set `struct_size`.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` for the instrument or where nothing would be
/// left, `UPT_ERR_NON_FINITE`, `UPT_ERR_UNSUPPORTED` as `upt_scene_cut` and in a build without feature "instruments",
/// `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then what it was.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_remove(
    scene: *mut upt_scene,
    instrument: *const upt_instrument,
    most_mm3: f32,
    out: *mut upt_cut,
) -> upt_status {
    call_scene("upt_scene_remove", scene, |scene| {
        features::instruments()?;
        // SAFETY: the host passes a struct whose first field is its size, as the header asks.
        let tool = convert::tool(0, &unsafe { required(instrument, "instrument") }?)?;
        // SAFETY: `out` points to a struct whose first field is its size, as the header asks.
        unsafe { report(scene, out, || Ok(scene.remove(&tool, most_mm3)?)) }
    })
}

/// Parts tissue that is longer than `stretch` times its length at rest in some direction, across that direction as a blade would: the most stretched elements
/// first. Nothing tears unless this is called; called once before each step, a tear grows from step to step. What `upt_scene_cut` says of a cut scene holds.
///
/// - `stroke`: calls with the same number are one tear that goes on, as in `upt_scene_cut`: what it has parted it does not part again.
/// - `stretch`: the largest principal stretch that the tissue bears, above 1; it is a property of the tissue that no bundle states.
/// - `most`: elements at most whose stretch starts a tear in this call; those that it touches part with them.
/// - `out`: what was done; set `struct_size`. `area_mm2` is what has been laid open, 0 where nothing is stretched so far.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT` for a stretch that is not above 1 or more copies than
/// nodes, `UPT_ERR_UNSUPPORTED` as `upt_scene_cut`, `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then
/// what it was.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_tear(
    scene: *mut upt_scene,
    stroke: u32,
    stretch: f32,
    most: u32,
    out: *mut upt_cut,
) -> upt_status {
    call_scene("upt_scene_tear", scene, |scene| {
        // SAFETY: `out` points to a struct whose first field is its size, as the header asks.
        unsafe { report(scene, out, || Ok(scene.tear(stroke, stretch, most)?)) }
    })
}

/// Multiplies the stiffness of elements of the model's mesh: coagulation, oedema, softening. What `upt_scene_cut` says of a cut scene holds.
///
/// - `elements`: `[count]` rows of `UPT_INDICES_TETS`.
/// - `factor`: what an element has then must lie between 0.001 and 1000 times its own stiffness.
/// - `out`: what was done; set `struct_size`.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_UNSUPPORTED` as `upt_scene_cut`,
/// `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then what it was.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_scale_stiffness(
    scene: *mut upt_scene,
    elements: *const u32,
    count: u64,
    factor: f32,
    out: *mut upt_cut,
) -> upt_status {
    call_scene("upt_scene_scale_stiffness", scene, |scene| {
        let most = scene.mesh().tets.len() as u64 / 4;
        if count > most {
            return fail(
                UPT_ERR_ARGUMENT,
                format!("count is {count}, the mesh has {most} elements"),
            );
        }
        // SAFETY: the host passes that many elements, as the header asks.
        let elements = unsafe { slice(elements, count, "elements") }?;
        // SAFETY: `out` points to a struct whose first field is its size, as the header asks.
        unsafe { report(scene, out, || Ok(scene.scale_stiffness(elements, factor)?)) }
    })
}

/// Takes the pieces that nothing holds out of the body.
///
/// - `out`: what was done; set `struct_size`.
///
/// Threads: one at a time.
/// Errors: `UPT_ERR_NULL`, `UPT_ERR_HANDLE`, `UPT_ERR_STRUCT_SIZE`, `UPT_ERR_BUSY`, `UPT_ERR_ARGUMENT`, `UPT_ERR_UNSUPPORTED` as `upt_scene_cut`,
/// `UPT_ERR_BUNDLE`, `UPT_ERR_RUNTIME`, `UPT_ERR_OUT_OF_MEMORY`, `UPT_ERR_PANIC`. The scene is then what it was.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn upt_scene_drop_fragments(
    scene: *mut upt_scene,
    out: *mut upt_cut,
) -> upt_status {
    call_scene("upt_scene_drop_fragments", scene, |scene| {
        let make = |struct_size| {
            let volumes = scene.drop_fragments()?;
            Ok(upt_cut {
                struct_size,
                fragment_count: volumes.len() as u32,
                node_count: scene.node_count() as u64,
                copied_count: 0,
                area_mm2: 0.0,
                removed_mm3: volumes.iter().sum(),
                force: [0.0; 3],
                is_changed: u32::from(!volumes.is_empty()),
            })
        };
        // SAFETY: `out` points to a struct whose first field is its size, as the header asks.
        unsafe { fill(out, make) }
    })
}

/// Makes an operation and says what it did.
///
/// # Safety
/// NULL, or a struct whose first field is its size.
unsafe fn report(
    scene: &Scene,
    out: *mut upt_cut,
    operation: impl FnOnce() -> Result<Cut, Failure>,
) -> Answer {
    let make = |struct_size| {
        let cut = operation()?;
        Ok(upt_cut {
            struct_size,
            fragment_count: 0,
            node_count: scene.node_count() as u64,
            copied_count: cut.copied.len() as u64,
            area_mm2: cut.area_mm2,
            removed_mm3: cut.removed_mm3,
            force: cut.force,
            is_changed: u32::from(cut.is_changed),
        })
    };
    // SAFETY: the caller's.
    unsafe { fill(out, make) }
}
