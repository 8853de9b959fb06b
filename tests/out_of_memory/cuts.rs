//! Calls that change the body of a scene, and what they leave.

use std::ptr::null_mut;

use upt::ffi::*;

use crate::allocator::counted;
use crate::calls::Rig;

impl Rig {
    /// A blade from above through the upper part of the body.
    pub fn cut(&mut self) -> i32 {
        let [mut low, mut high] = [[f32::MAX; 3], [f32::MIN; 3]];
        for at in self.positions.as_chunks::<3>().0 {
            low = std::array::from_fn(|k| low[k].min(at[k]));
            high = std::array::from_fn(|k| high[k].max(at[k]));
        }
        let [x, z] = [(0, 0.45), (2, 0.6)].map(|(k, part)| low[k] + part * (high[k] - low[k]));
        let edge = |z: f32| [[x, low[1] - 1.0, z], [x, high[1] + 1.0, z]];
        let blade = [edge(high[2] + 1.0), edge(z)];
        let points = blade.as_flattened().as_flattened().as_ptr();
        self.operate(|scene, out| unsafe { upt_scene_cut(scene, 0, points, 2, 2, out) })
    }

    pub fn remove(&mut self) -> i32 {
        let tool = self.tools[0];
        self.operate(|scene, out| unsafe { upt_scene_remove(scene, &tool, 20.0, out) })
    }

    pub fn tear(&mut self) -> i32 {
        self.operate(|scene, out| unsafe { upt_scene_tear(scene, 5, 1.02, 4, out) })
    }

    pub fn stiffen(&mut self) -> i32 {
        self.operate(|scene, out| unsafe {
            upt_scene_scale_stiffness(scene, [0, 1].as_ptr(), 2, 2.0, out)
        })
    }

    pub fn record(&mut self) -> i32 {
        let every = u32::from(!std::mem::replace(&mut self.is_recorded, true));
        let status = counted(|| unsafe { upt_scene_record(self.scene, every) });
        if status != UPT_OK {
            // The call is made again.
            self.is_recorded = every == 0;
        }
        self.give(status, &[every])
    }

    /// The lines of all that succeeded.
    pub fn take_record(&mut self) -> i32 {
        let mut needed = 0;
        let asked =
            counted(|| unsafe { upt_scene_take_record(self.scene, null_mut(), 0, &mut needed) });
        assert_eq!(asked, UPT_OK);
        let mut lines = vec![0u8; needed as usize];
        let room = lines.as_mut_ptr();
        let status =
            counted(|| unsafe { upt_scene_take_record(self.scene, room, needed, &mut needed) });
        self.give(status, &lines)
    }

    /// The surface, and where its vertices are.
    pub fn surface(&mut self) -> i32 {
        // SAFETY: zeros are a value of this struct.
        let mut out: upt_surface = unsafe { std::mem::zeroed() };
        out.struct_size = size_of::<upt_surface>() as u32;
        let status = counted(|| unsafe { upt_scene_update_surface(self.scene, &mut out) });
        let mut at = vec![0.0f32; 3 * out.vertex_count as usize];
        if status == UPT_OK {
            let place = at.as_mut_ptr();
            let read = counted(|| unsafe {
                upt_scene_read_surface_positions(self.scene, place, 3 * out.vertex_count)
            });
            assert_eq!(read, UPT_OK);
        }
        let counts = [out.triangle_count, out.first_vertex, out.changed_count];
        self.give(status, &at);
        self.give(status, &counts)
    }

    fn operate(&mut self, call: impl FnOnce(*mut upt_scene, &mut upt_cut) -> i32) -> i32 {
        // SAFETY: zeros are a value of this struct.
        let mut out: upt_cut = unsafe { std::mem::zeroed() };
        out.struct_size = size_of::<upt_cut>() as u32;
        let status = counted(|| call(self.scene, &mut out));
        let said = [out.node_count, out.copied_count];
        let status = self.give(status, &said);
        self.shown(status)
    }
}
