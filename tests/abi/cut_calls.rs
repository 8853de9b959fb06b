//! Calls that change the body of a scene.

use upt::ffi::*;

use super::inputs::*;
use super::{Call, Function, Odd, Size, World};

impl World<'_> {
    pub(super) fn call_cuts(&mut self, call: &Call, scene: *mut upt_scene) -> (&'static str, i32) {
        let mut random = Random(call.seed | 1);
        let mut out: [upt_cut; 1] = [unsafe { std::mem::zeroed() }];
        out[0].struct_size = sized::<upt_cut>(call);
        let place = pointer_mut(&mut out, call, 1);
        let (name, status) = unsafe {
            match call.function {
                Function::Cut => {
                    let mut points: Vec<f32> = (0..18)
                        .map(|_| random.next(300) as f32 / 10.0 - 5.0)
                        .collect();
                    spoil(&mut points, call.odd, call.seed as usize % 18);
                    let (poses, edge) = match call.size {
                        Size::Right => (3, 2),
                        Size::Zero => (0, 2),
                        Size::Short => (2, 1),
                        Size::Long => (2, 3),
                        Size::Absurd => (u64::MAX, 3),
                    };
                    let points = pointer(&points, call, 0);
                    let stroke = call.seed as u32 % 3;
                    (
                        "upt_scene_cut",
                        upt_scene_cut(scene, stroke, points, poses, edge, place),
                    )
                }
                Function::CutWith => {
                    let mut points: Vec<f32> = (0..12)
                        .map(|_| random.next(300) as f32 / 10.0 - 5.0)
                        .collect();
                    spoil(&mut points, call.odd, call.seed as usize % 12);
                    let mut blade: [upt_blade; 1] = [std::mem::zeroed()];
                    blade[0].struct_size = sized::<upt_blade>(call);
                    blade[0].fracture_energy = random.next(90) as f32 - 5.0;
                    blade[0].pushed = if call.odd == Odd::NaN { f32::NAN } else { 9.0 };
                    blade[0].ahead = [0.0, random.next(3) as f32 - 1.0, 0.0];
                    let blade = pointer(&blade, call, 0);
                    let points = pointer(&points, call, 2);
                    let status = upt_scene_cut_with(scene, blade, 7, points, 2, 2, place);
                    ("upt_scene_cut_with", status)
                }
                Function::Remove => {
                    let one = Call {
                        seed: call.seed % 1000 * 3 + 1,
                        ..call.clone()
                    };
                    let tools = self.instruments(&one, 3);
                    let most = if call.odd == Odd::NaN { f32::NAN } else { 30.0 };
                    let tool = pointer(&tools, call, 0);
                    (
                        "upt_scene_remove",
                        upt_scene_remove(scene, tool, most, place),
                    )
                }
                Function::Tear => {
                    let stretch = match call.odd {
                        Odd::NaN => f32::NAN,
                        Odd::Wrong => 0.5,
                        _ => 1.05 + 0.1 * random.next(4) as f32,
                    };
                    let most = random.next(4) as u32;
                    let status = upt_scene_tear(scene, 9, stretch, most, place);
                    ("upt_scene_tear", status)
                }
                Function::ScaleStiffness => {
                    let elements = [
                        0,
                        call.seed as u32 % 7,
                        if call.odd == Odd::Wrong { u32::MAX } else { 3 },
                    ];
                    let count = match call.size {
                        Size::Right | Size::Long => 3,
                        Size::Zero => 0,
                        Size::Short => 1,
                        Size::Absurd => u64::MAX,
                    };
                    let factor = if call.odd == Odd::NaN {
                        f32::NAN
                    } else {
                        0.5 + random.next(4) as f32
                    };
                    let elements = pointer(&elements, call, 0);
                    let status = upt_scene_scale_stiffness(scene, elements, count, factor, place);
                    ("upt_scene_scale_stiffness", status)
                }
                _ => (
                    "upt_scene_drop_fragments",
                    upt_scene_drop_fragments(scene, place),
                ),
            }
        };
        if status == UPT_OK {
            assert!(
                out[0].node_count > 0
                    && out[0].removed_mm3.is_finite()
                    && out[0].area_mm2.is_finite()
            );
        }
        (name, status)
    }
}
