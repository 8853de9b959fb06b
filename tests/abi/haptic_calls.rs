//! Calls with tools that a hand feels.

use std::ptr::{null_mut, without_provenance_mut};

use upt::ffi::*;

use super::inputs::*;
use super::{Call, Function, Odd, World};

impl World<'_> {
    pub(super) fn call_haptics(
        &mut self,
        call: &Call,
        scene: *mut upt_scene,
    ) -> (&'static str, i32) {
        unsafe {
            match call.function {
                Function::HapticsCreate => {
                    let tools = self.instruments(call, 4);
                    let mut options: upt_haptics_options = std::mem::zeroed();
                    options.struct_size = sized::<upt_haptics_options>(call);
                    options.instrument = (call.seed % 3) as u32;
                    options.tool = pointer(&tools, call, 0);
                    if tools.is_empty() {
                        options.tool = std::ptr::null();
                    }
                    options.passivity = (call.seed >> 8) as u8 % 3;
                    let mut numbers = [(call.seed % 30) as f32, 0.0, 0.0, 0.0];
                    spoil(&mut numbers, call.odd, call.seed as usize);
                    [
                        options.blend_ms,
                        options.step_latency_ms,
                        options.force_limit_n,
                        options.damping_limit_n_s_per_m,
                    ] = numbers;
                    let mut hand = null_mut();
                    let out = match call.null >> 1 & 1 {
                        1 => null_mut(),
                        _ => &raw mut hand,
                    };
                    let from = pointer(std::slice::from_ref(&options), call, 2);
                    let status = upt_haptics_create(scene, from, out);
                    assert_eq!(status == UPT_OK, !hand.is_null());
                    if status == UPT_OK {
                        self.hands.push((hand, 0.0));
                    }
                    ("upt_haptics_create", status)
                }
                Function::HapticsRender => {
                    let count = self.hands.len();
                    let at = call.handle as usize % (count + 1);
                    let hand = match (at < count, call.odd) {
                        (true, _) => self.hands[at].0,
                        (false, Odd::Wrong) => scene.cast(),
                        (false, Odd::Huge) => without_provenance_mut(call.seed as usize),
                        (false, _) => null_mut(),
                    };
                    let mut random = Random(call.seed | 1);
                    let mut pose: upt_haptic_pose = std::mem::zeroed();
                    pose.struct_size = sized::<upt_haptic_pose>(call);
                    pose.has_velocity = (call.seed >> 5) as u8 % 2;
                    if let Some((_, time)) = self.hands.get_mut(at) {
                        *time += 1e-3 * (call.seed % 4) as f64;
                        pose.time_s = *time - if call.odd == Odd::Huge { 1.0 } else { 0.0 };
                    }
                    pose.position_m = [0.01, 0.01, 0.014 - random.next(60) as f32 / 1e4];
                    pose.rotation = [0.0, 0.0, 0.0, 1.0];
                    spoil(&mut pose.position_m, call.odd, call.seed as usize % 3);
                    spoil(&mut pose.velocity_m_per_s, call.odd, call.seed as usize % 7);
                    let mut out: upt_haptic_force = std::mem::zeroed();
                    out.struct_size = size_of::<upt_haptic_force>() as u32;
                    out.force_n = [UNTOUCHED; 3];
                    let place = pointer_mut(std::slice::from_mut(&mut out), call, 1);
                    let from = pointer(std::slice::from_ref(&pose), call, 0);
                    let status = upt_haptics_render(hand, from, place);
                    let felt = out.force_n.into_iter().chain(out.torque_n_m);
                    if status == UPT_OK {
                        let stiffness = out.stiffness_n_per_m.into_iter();
                        assert!(felt.chain(stiffness).all(f32::is_finite));
                    } else if !place.is_null() {
                        assert_eq!(out.force_n, [0.0; 3], "a force of a failed call");
                    }
                    ("upt_haptics_render", status)
                }
                Function::HapticsDestroy => {
                    // Mostly a live one; one that was destroyed, or a scene, at times.
                    let live = self.hands.pop();
                    let hand = match call.odd {
                        Odd::Wrong => scene.cast(),
                        _ => live.map_or(null_mut(), |live| live.0),
                    };
                    let status = upt_haptics_destroy(hand);
                    match live {
                        Some((hand, _)) if status == UPT_OK => {
                            assert_eq!(upt_haptics_destroy(hand), UPT_ERR_HANDLE);
                        }
                        live => self.hands.extend(live),
                    }
                    ("upt_haptics_destroy", status)
                }
                other => unreachable!("{other:?} is no call of haptics"),
            }
        }
    }
}
