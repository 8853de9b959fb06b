//! Calls on a scene.

use std::ptr::{null, null_mut};

use upt::ffi::*;

use super::inputs::*;
use super::{Call, Function, Odd, Size, World};

impl World<'_> {
    /// Calls on a scene of `nodes` nodes.
    pub(super) fn call_scene(
        &mut self,
        call: &Call,
        scene: *mut upt_scene,
        nodes: usize,
    ) -> (&'static str, i32) {
        let mut random = Random(call.seed | 1);
        let wrong = call.odd == Odd::Wrong;
        let mut vectors = |length: usize, scale: f32| {
            let mut values: Vec<f32> = (0..length)
                .map(|_| scale * (random.next(2001) as f32 / 1000.0 - 1.0))
                .collect();
            spoil(&mut values, call.odd, call.seed as usize % 97);
            values
        };
        unsafe {
            match call.function {
                Function::SceneReset => ("upt_scene_reset", upt_scene_reset(scene)),
                Function::StepField => {
                    let displacement = vectors(3 * nodes, 0.5);
                    let mut collision = vec![0.0; 3 * nodes];
                    let at = call.seed as usize % (3 * nodes);
                    collision[at] = 1.5;
                    spoil(&mut collision, call.odd, at);
                    // Mostly the scene's own state.
                    let own = !call.seed.is_multiple_of(4) && call.odd == Odd::None;
                    let given = if own {
                        null()
                    } else {
                        pointer(&displacement, call, 0)
                    };
                    let status = Self::output(call, 2, 3 * nodes, true, |out, count| {
                        upt_scene_step_field(scene, given, pointer(&collision, call, 1), out, count)
                    });
                    ("upt_scene_step_field", status)
                }
                Function::Read => {
                    let (view, shown) = self.view(scene, call, nodes);
                    let view = view.as_ref().map_or(null(), |view| &raw const *view);
                    let status = Self::output(call, 0, 3 * shown, true, |out, count| {
                        upt_scene_read(scene, view, out, count)
                    });
                    ("upt_scene_read", status)
                }
                Function::Poll => ("upt_scene_poll", upt_scene_poll(scene)),
                Function::Wait => (
                    "upt_scene_wait",
                    upt_scene_wait(scene, (call.seed % 50) as u32),
                ),
                Function::Sample => {
                    let alpha = match call.odd {
                        Odd::None | Odd::Denormal => (call.seed % 101) as f64 / 100.0,
                        Odd::NaN => f64::NAN,
                        Odd::Infinity => f64::INFINITY,
                        Odd::Huge => 1e300,
                        Odd::Wrong => -0.5,
                    };
                    let (view, shown) = self.view(scene, call, nodes);
                    let view = view.as_ref().map_or(null(), |view| &raw const *view);
                    let status = Self::output(call, 0, 3 * shown, true, |out, count| {
                        upt_scene_sample(scene, alpha, view, out, count)
                    });
                    ("upt_scene_sample", status)
                }
                Function::SetRegion => {
                    // All nodes in another order: outputs keep their length.
                    let mut region: Vec<u32> = (0..nodes as u32).rev().collect();
                    if let (true, Some(first)) = (wrong, region.first_mut()) {
                        *first = u32::MAX;
                    }
                    let whole = call.seed.is_multiple_of(2);
                    let (listed, length) = if whole {
                        (null(), 0)
                    } else {
                        (pointer(&region, call, 0), absurd(nodes, nodes, call))
                    };
                    (
                        "upt_scene_set_region",
                        upt_scene_set_region(scene, listed, length),
                    )
                }
                Function::Decode => {
                    let listed: Vec<u32> = (0..nodes.min(9) as u32)
                        .map(|i| {
                            if wrong {
                                u32::MAX - i
                            } else {
                                (i * 3) % nodes as u32
                            }
                        })
                        .collect();
                    let mut view = upt_view::of_nodes(&listed);
                    view.struct_size = sized::<upt_view>(call);
                    view.nodes = pointer(&listed, call, 1);
                    view.node_count = absurd(listed.len(), nodes, call);
                    let status = Self::output(call, 0, 3 * listed.len(), true, |out, count| {
                        upt_scene_decode(scene, &view, out, count)
                    });
                    ("upt_scene_decode", status)
                }
                Function::AttachPoints => {
                    let points = call.seed as usize % 5;
                    let scale = if wrong { 1e7 } else { 20.0 };
                    let rest = vectors(3 * points, scale);
                    let passed = match absurd(points, nodes, call) {
                        // A count that may be right is followed.
                        count if count < 1 << 28 => points as u64,
                        count => count,
                    };
                    let status = upt_scene_attach_points(scene, pointer(&rest, call, 0), passed);
                    assert!(status != UPT_OK || passed == points as u64);
                    if status == UPT_OK {
                        self.points.insert(scene.addr(), points);
                    }
                    ("upt_scene_attach_points", status)
                }
                Function::ContactForce => {
                    let mut stats: upt_scene_stats = std::mem::zeroed();
                    stats.struct_size = size_of::<upt_scene_stats>() as u32;
                    upt_scene_read_stats(scene, &mut stats);
                    let contacts = stats.contact_count as usize;
                    let status = Self::output(call, 0, 3 * contacts, false, |out, count| {
                        upt_scene_read_contact_force(scene, out, count)
                    });
                    ("upt_scene_read_contact_force", status)
                }
                Function::Stats => {
                    let mut stats: upt_scene_stats = std::mem::zeroed();
                    stats.struct_size = sized::<upt_scene_stats>(call);
                    let out = pointer_mut(std::slice::from_mut(&mut stats), call, 0);
                    let status = upt_scene_read_stats(scene, out);
                    assert_eq!(stats.poisoned, 0, "a bug poisoned the scene");
                    ("upt_scene_read_stats", status)
                }
                Function::Timing => {
                    let mut timing: upt_scene_timing = std::mem::zeroed();
                    timing.struct_size = sized::<upt_scene_timing>(call);
                    let out = pointer_mut(std::slice::from_mut(&mut timing), call, 0);
                    ("upt_scene_read_timing", upt_scene_read_timing(scene, out))
                }
                Function::Save => {
                    let mut bytes = vec![0u8; 1 << 20];
                    let capacity = match call.size {
                        Size::Right | Size::Long | Size::Absurd => bytes.len() as u64,
                        Size::Zero => 0,
                        Size::Short => 10,
                    };
                    let mut needed = 0;
                    let status = upt_scene_save(
                        scene,
                        pointer_mut(&mut bytes, call, 0),
                        capacity,
                        &mut needed,
                    );
                    if status == UPT_OK && call.null & 1 == 0 && capacity > 0 {
                        self.snapshot = bytes[..needed as usize].to_vec();
                    }
                    ("upt_scene_save", status)
                }
                Function::Record => {
                    let every = (call.seed % 3) as u32;
                    ("upt_scene_record", upt_scene_record(scene, every))
                }
                Function::TakeRecord => {
                    let mut needed = [0u64];
                    let asked = upt_scene_take_record(scene, null_mut(), 0, &mut needed[0]);
                    assert!(asked == UPT_OK || needed[0] == 0);
                    let (capacity, room) = count(needed[0] as usize, call.size);
                    let mut lines = vec![7u8; room];
                    let status = upt_scene_take_record(
                        scene,
                        pointer_mut(&mut lines, call, 0),
                        capacity,
                        pointer_mut(&mut needed, call, 1),
                    );
                    let whole = &lines[..needed[0].min(room as u64) as usize];
                    let is_text = whole.is_empty() || whole.ends_with(b"\n");
                    let is_untouched = lines.iter().all(|byte| *byte == 7);
                    assert!(is_untouched || status == UPT_OK && is_text);
                    ("upt_scene_take_record", status)
                }
                Function::Restore => {
                    let mut bytes = self.snapshot.clone();
                    let length = bytes.len().max(1);
                    if let (true, Some(byte)) = (wrong, bytes.get_mut(call.seed as usize % length))
                    {
                        *byte ^= 0x41;
                    }
                    let passed = match call.size {
                        Size::Zero => 0,
                        Size::Short => bytes.len().saturating_sub(1) as u64,
                        Size::Absurd => u64::MAX,
                        Size::Right | Size::Long => bytes.len() as u64,
                    };
                    (
                        "upt_scene_restore",
                        upt_scene_restore(scene, pointer(&bytes, call, 0), passed),
                    )
                }
                other => unreachable!("{other:?} is not a call on a scene"),
            }
        }
    }
}
