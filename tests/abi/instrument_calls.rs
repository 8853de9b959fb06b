//! Calls with instruments and hulls.

use std::ptr::{null, null_mut};

use upt::ffi::*;

use super::inputs::*;
use super::{Call, Function, Odd, Size, World};

impl World<'_> {
    /// Instruments about the tiny body, with shapes up to `shapes`.
    pub(super) fn instruments(&self, call: &Call, shapes: u64) -> Vec<upt_instrument> {
        let mut random = Random(call.seed | 1);
        let hull = self.hulls.get(call.handle as usize / 4).copied();
        let made = (0..call.seed % 3).map(|i| {
            let mut one: upt_instrument = unsafe { std::mem::zeroed() };
            one.struct_size = sized::<upt_instrument>(call);
            one.shape = match call.odd {
                Odd::Wrong => 9,
                _ => ((call.seed + i) % shapes) as i32,
            };
            one.position = [10.0, 10.0, 14.0 - random.next(300) as f32 / 10.0];
            one.rotation = [0.0, 0.0, 0.0, 1.0];
            one.half_extents = [4.0, 6.0, 3.0];
            one.radius = 2.0;
            one.mode = random.next(2) as u8;
            one.friction = random.next(3) as f32 * 0.3;
            one.tear_off_mn = random.next(2) as f32 * 20.0;
            if one.shape == UPT_SHAPE_HULL {
                one.hull = hull.unwrap_or(null_mut()).cast_const();
            }
            spoil(&mut one.position, call.odd, call.seed as usize % 3);
            one
        });
        made.collect()
    }

    /// Calls on a scene of `nodes` nodes.
    pub(super) fn call_instruments(
        &mut self,
        call: &Call,
        scene: *mut upt_scene,
        nodes: usize,
    ) -> (&'static str, i32) {
        unsafe {
            match call.function {
                Function::Instruments => (
                    "upt_scene_contacts_from_instruments",
                    self.contacts(call, scene, nodes),
                ),
                Function::Readings => {
                    let mut out = [std::mem::zeroed::<upt_instrument_reading>(); 8];
                    for one in &mut out {
                        one.struct_size = sized::<upt_instrument_reading>(call);
                    }
                    let count = (call.seed % 3).min(out.len() as u64);
                    let place = pointer_mut(&mut out, call, 0);
                    let status = upt_scene_read_instruments(scene, place, count);
                    if status == UPT_OK {
                        let felt = out
                            .iter()
                            .flat_map(|one| one.force.into_iter().chain(one.torque));
                        assert!(felt.into_iter().all(f32::is_finite));
                    }
                    ("upt_scene_read_instruments", status)
                }
                Function::InstrumentContacts => {
                    let mut out = [std::mem::zeroed::<upt_instrument_contact>(); 64];
                    let capacity = match call.size {
                        Size::Right | Size::Long | Size::Absurd => out.len() as u64,
                        Size::Zero => 0,
                        Size::Short => 1,
                    };
                    let mut needed = 0;
                    let place = pointer_mut(&mut out, call, 0);
                    let status =
                        upt_scene_read_instrument_contacts(scene, place, capacity, &mut needed);
                    ("upt_scene_read_instrument_contacts", status)
                }
                Function::HullCreate => {
                    let mut points = [
                        [3.0f32, 0.0, -3.0],
                        [-2.0, 3.0, -3.0],
                        [-2.0, -3.0, -3.0],
                        [0.0, 0.0, 4.0],
                    ];
                    spoil(points.as_flattened_mut(), call.odd, call.seed as usize);
                    let count = absurd(points.len(), 100_000, call);
                    let mut hull = null_mut();
                    let out = match call.null >> 1 & 1 {
                        1 => null_mut(),
                        _ => &raw mut hull,
                    };
                    let from = pointer(points.as_flattened(), call, 0);
                    let sides = [0u32, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3];
                    // Every other one by its faces; one of them beyond the points at times.
                    let wrong = [0u32, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 77];
                    let (faces, face_count) = match call.seed % 4 {
                        0 => (sides.as_ptr(), 4),
                        1 => (wrong.as_ptr(), 4),
                        _ => (null(), 0),
                    };
                    let status = upt_hull_create(from, count, faces, face_count, out);
                    assert_eq!(status == UPT_OK, !hull.is_null());
                    if status == UPT_OK {
                        self.hulls.push(hull);
                    }
                    ("upt_hull_create", status)
                }
                Function::HullDestroy => {
                    // Mostly a live one; one that was destroyed, or a scene, at times.
                    let live = self.hulls.pop();
                    let hull = match call.odd {
                        Odd::Wrong => scene.cast(),
                        _ => live.unwrap_or(null_mut()),
                    };
                    let status = upt_hull_destroy(hull);
                    if let (Some(hull), true) = (live, status == UPT_OK) {
                        assert_eq!(upt_hull_destroy(hull), UPT_ERR_HANDLE);
                    } else {
                        self.hulls.extend(live);
                    }
                    ("upt_hull_destroy", status)
                }
                other => unreachable!("{other:?} has no instruments"),
            }
        }
    }

    fn contacts(&self, call: &Call, scene: *mut upt_scene, nodes: usize) -> i32 {
        let mut tools = self.instruments(call, 3);
        for one in &mut tools {
            one.hull = null();
        }
        let mut listed = vec![0u32; nodes];
        let mut imposed = vec![0f32; 3 * nodes];
        let capacity = if call.size == Size::Zero {
            0
        } else {
            nodes as u64
        };
        let mut found = 0;
        unsafe {
            upt_scene_contacts_from_instruments(
                scene,
                pointer(&tools, call, 0),
                tools.len() as u64,
                pointer_mut(&mut listed, call, 1),
                pointer_mut(&mut imposed, call, 2),
                capacity,
                &mut found,
            )
        }
    }
}
