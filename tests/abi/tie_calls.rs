//! Ties of an input, and calls about ties.

use upt::ffi::*;

use super::inputs::*;
use super::{Call, Function, Odd, Size, World};

/// Ties of every kind about a body of `nodes` nodes.
pub fn ties(call: &Call, nodes: usize) -> Vec<upt_tie> {
    let mut random = Random(call.seed | 3);
    let made = (0..call.seed % 5).map(|_| {
        let mut one = upt_tie {
            struct_size: sized::<upt_tie>(call),
            to: random.next(4) as i32,
            nodes: [random.next(nodes) as u32; 3],
            other_nodes: [random.next(nodes) as u32; 3],
            place: [10.0, 10.0, random.next(300) as f32 / 10.0],
            stiffness: [0.5, 30.0, 1e4][random.next(3)],
            slack_mm: random.next(3) as f32,
            damping: random.next(2) as f32 * 0.1,
            break_mn: random.next(2) as f32 * 20.0,
            pushes: random.next(2) as u8,
            ..upt_tie::NONE
        };
        spoil(&mut one.place, call.odd, call.seed as usize % 5);
        if call.odd == Odd::Wrong {
            one.nodes[0] = nodes as u32;
        }
        one
    });
    made.collect()
}

impl World<'_> {
    pub(super) fn call_ties(
        &mut self,
        call: &Call,
        scene: *mut upt_scene,
        nodes: usize,
    ) -> (&'static str, i32) {
        unsafe {
            match call.function {
                Function::TieReadings => {
                    let mut out = [std::mem::zeroed::<upt_tie_reading>(); 8];
                    for one in &mut out {
                        one.struct_size = sized::<upt_tie_reading>(call);
                    }
                    let place = pointer_mut(&mut out, call, 0);
                    let status = upt_scene_read_ties(scene, place, call.seed % 5);
                    if status == UPT_OK {
                        let felt = out.iter().flat_map(|one| one.force);
                        assert!(felt.into_iter().all(f32::is_finite));
                    }
                    ("upt_scene_read_ties", status)
                }
                Function::TiePoints => {
                    let mut places = [10.0f32, 9.0, 12.0, 1.0, 2.0, 3.0];
                    spoil(&mut places, call.odd, call.seed as usize % 7);
                    let (mut found, mut weights) = ([0u32; 6], [0.0f32; 6]);
                    let count = absurd(2, 1 << 40, call);
                    let status = upt_scene_tie_points(
                        scene,
                        pointer(&places, call, 0),
                        count.min(if call.size == Size::Absurd {
                            u64::MAX
                        } else {
                            2
                        }),
                        pointer_mut(&mut found, call, 1),
                        pointer_mut(&mut weights, call, 2),
                    );
                    if status == UPT_OK {
                        assert!(found.iter().all(|node| (*node as usize) < nodes));
                    }
                    ("upt_scene_tie_points", status)
                }
                Function::Bed => {
                    let listed = [0, (nodes / 2) as u32, (nodes - 1) as u32];
                    let mut centre = [10.0, 10.0, 14.0];
                    spoil(&mut centre, call.odd, call.seed as usize % 4);
                    let bed = upt_bed {
                        struct_size: sized::<upt_bed>(call),
                        radius_mm: (call.seed % 40) as f32,
                        centre,
                        offset: [0.0, 0.0, 1.0],
                        nodes: listed.as_ptr(),
                        node_count: match call.seed % 3 {
                            0 => absurd(listed.len(), nodes, call),
                            _ => 0,
                        },
                        stiffness: 40.0,
                        slack_mm: 0.0,
                        damping: 0.0,
                        break_mn: 10.0,
                        pushes: 0,
                        reserved: [0; 7],
                    };
                    let mut out = vec![upt_tie::NONE; 256];
                    let capacity = match call.size {
                        Size::Right | Size::Long | Size::Absurd => out.len() as u64,
                        Size::Zero => 0,
                        Size::Short => 1,
                    };
                    let mut needed = 0;
                    let place = pointer_mut(&mut out, call, 0);
                    let status = upt_scene_bed(scene, &bed, place, capacity, &mut needed);
                    ("upt_scene_bed", status)
                }
                other => unreachable!("{other:?} has no ties"),
            }
        }
    }
}
