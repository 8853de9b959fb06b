//! A tool that a hand feels, by the functions `upt_haptics_*`.

use anyhow::Result;
use contact::Pose;
use upt::ffi;

use super::{check, size, zeroed};

/// A haptics object; destroyed when dropped.
pub struct Hand {
    handle: *mut ffi::upt_haptics,
}

impl Hand {
    /// `upt_haptics_create` for the first instrument of a scene's steps, which arrive `latency_ms` after their poses were taken.
    pub(super) fn create(
        scene: *mut ffi::upt_scene,
        tool: &ffi::upt_instrument,
        latency_ms: f32,
    ) -> Result<Self> {
        let mut handle = std::ptr::null_mut();
        // SAFETY: zeros are valid numbers; options and tool live across the call, and `handle` is a place to write to.
        unsafe {
            let mut options: ffi::upt_haptics_options = zeroed();
            options.struct_size = size::<ffi::upt_haptics_options>();
            options.tool = tool;
            options.step_latency_ms = latency_ms;
            check(ffi::upt_haptics_create(scene, &options, &mut handle))?;
        }
        Ok(Self { handle })
    }

    /// `upt_haptics_render`: how many points of the surface push or hold the tool.
    pub fn contacts(&mut self, time_s: f64, pose: &Pose) -> Result<u32> {
        // SAFETY: zeros are valid numbers; both structs live across the call.
        unsafe {
            let mut at: ffi::upt_haptic_pose = zeroed();
            at.struct_size = size::<ffi::upt_haptic_pose>();
            at.time_s = time_s;
            at.position_m = (pose.translation * 1e-3).to_array();
            at.rotation = pose.rotation.to_array();
            let mut force: ffi::upt_haptic_force = zeroed();
            force.struct_size = size::<ffi::upt_haptic_force>();
            check(ffi::upt_haptics_render(self.handle, &at, &mut force))?;
            Ok(force.contact_count)
        }
    }
}

impl Drop for Hand {
    fn drop(&mut self) {
        // SAFETY: the handle came from upt_haptics_create and is destroyed once.
        unsafe { ffi::upt_haptics_destroy(self.handle) };
    }
}
