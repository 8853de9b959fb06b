//! A host's calls, one after another, each with what it gave.

use std::ffi::CString;
use std::path::Path;
use std::ptr::{null, null_mut};

use upt::ffi::*;

use crate::allocator::counted;
use fixture::host;

/// A model, its scene and a hand, and what the host gives them.
pub struct Rig {
    options: upt_scene_options,
    path: CString,
    model: *mut upt_model,
    pub scene: *mut upt_scene,
    hand: *mut upt_haptics,
    pub positions: Vec<f32>,
    domain: Vec<u32>,
    pub tools: [upt_instrument; 2],
    snapshot: Vec<u8>,
    pub is_recorded: bool,
    /// Bytes that the last call gave.
    pub given: Vec<u8>,
}

/// A call's name, and what it does.
pub type Call = (&'static str, fn(&mut Rig) -> i32);

impl Rig {
    /// A rig of a bundle; nothing is open.
    pub fn new(bundle: &Path, options: upt_scene_options) -> Rig {
        // SAFETY: zeros are a value of this struct.
        let mut tool: upt_instrument = unsafe { std::mem::zeroed() };
        tool.struct_size = size_of::<upt_instrument>() as u32;
        (tool.radius, tool.friction) = (4.0, 0.2);
        tool.rotation[3] = 1.0;
        Rig {
            options,
            path: CString::new(bundle.to_str().unwrap()).unwrap(),
            model: null_mut(),
            scene: null_mut(),
            hand: null_mut(),
            positions: Vec::new(),
            domain: Vec::new(),
            tools: [tool; 2],
            snapshot: Vec::new(),
            is_recorded: false,
            given: Vec::new(),
        }
    }

    pub fn give<T: Copy>(&mut self, status: i32, values: &[T]) -> i32 {
        let bytes = size_of_val(values);
        // SAFETY: plain numbers without padding.
        let values = unsafe { std::slice::from_raw_parts(values.as_ptr().cast::<u8>(), bytes) };
        if status >= 0 {
            self.given.extend_from_slice(values);
        }
        status
    }

    pub fn open(&mut self) -> i32 {
        let status =
            counted(|| unsafe { upt_model_create(self.path.as_ptr(), null(), &mut self.model) });
        if status == UPT_OK {
            // What the host has of its own is no call's request.
            self.positions = vec![0.0; 3 * host::node_count(self.model)];
            let floats = self.positions.len() as u64;
            let out = self.positions.as_mut_ptr();
            assert_eq!(
                unsafe { upt_model_read_positions(self.model, out, floats) },
                0
            );
            self.domain = host::indices(self.model, UPT_SET_DOMAIN_NODES);
            self.given.reserve(1 << 20);
        }
        status
    }

    pub fn create(&mut self) -> i32 {
        counted(|| unsafe { upt_scene_create(self.model, &self.options, &mut self.scene) })
    }

    /// Poses of the tools, this deep in the surface at two of its nodes.
    fn pose(&mut self, depth: f32) {
        for (at, tool) in self.tools.iter_mut().enumerate() {
            let node = self.domain[self.domain.len() * (2 * at + 1) / 5] as usize;
            let place = &self.positions[3 * node..3 * node + 3];
            tool.position = [place[0], place[1], place[2] + tool.radius - depth];
        }
    }

    pub fn drive(&mut self, depth: f32) -> i32 {
        self.pose(depth);
        let input = upt_input::of_instruments(&self.tools);
        let status = counted(|| unsafe { upt_scene_step(self.scene, &input, null_mut(), 0) });
        self.shown(status)
    }

    /// What the scene shows after a call.
    pub fn shown(&mut self, status: i32) -> i32 {
        if status != UPT_OK {
            return status;
        }
        let mut nodes = 0;
        assert_eq!(
            unsafe { upt_scene_read_node_count(self.scene, &mut nodes) },
            UPT_OK
        );
        let mut out = vec![0.0f32; 3 * nodes as usize];
        let mut floats = out.len() as u64;
        let mut read =
            counted(|| unsafe { upt_scene_read(self.scene, null(), out.as_mut_ptr(), floats) });
        if read != UPT_OK {
            floats = 3 * self.few().len() as u64;
            read =
                counted(|| unsafe { upt_scene_read(self.scene, null(), out.as_mut_ptr(), floats) });
        }
        assert_eq!(read, UPT_OK, "{}", host::message());
        self.give(status, &out)
    }

    pub fn readings(&mut self) -> i32 {
        // SAFETY: zeros are a value of this struct.
        let mut out: [upt_instrument_reading; 2] = unsafe { std::mem::zeroed() };
        for reading in &mut out {
            reading.struct_size = size_of::<upt_instrument_reading>() as u32;
        }
        let status =
            counted(|| unsafe { upt_scene_read_instruments(self.scene, out.as_mut_ptr(), 2) });
        let forces = out.map(|reading| (reading.force, reading.torque));
        let status = self.give(status, &forces);
        let mut needed = 0;
        let asked = counted(|| unsafe {
            upt_scene_read_instrument_contacts(self.scene, null_mut(), 0, &mut needed)
        });
        match asked {
            UPT_OK => self.give(status, &[needed]),
            _ => asked,
        }
    }

    pub fn present(&mut self, seconds: f64) -> i32 {
        let mut out = vec![0.0f32; self.positions.len()];
        let input = upt_input::of_instruments(&self.tools);
        let (scene, to) = (self.scene, out.as_mut_ptr());
        let frame = |floats| {
            counted(|| unsafe { upt_scene_present(scene, &input, seconds, null(), to, floats) })
        };
        let status = match frame(out.len() as u64) {
            UPT_ERR_ARGUMENT => frame(3 * self.few().len() as u64),
            status => status,
        };
        self.give(status, &out)
    }

    /// A step, or a frame after it where `seconds` is not zero, in which a group is led up by `lift` mm or let go, under a little gravity.
    pub fn lead(&mut self, lift: f32, let_go: bool, seconds: f64) -> i32 {
        let groups = [upt_support {
            group: 1,
            let_go: let_go.into(),
            position: [0.0, 0.0, lift],
            ..upt_support::HELD
        }];
        let input = upt_input {
            supports: groups.as_ptr(),
            support_count: 1,
            gravity: [0.0, 0.0, -0.5],
            ..upt_input::of_instruments(&self.tools[..1])
        };
        let scene = self.scene;
        if seconds > 0.0 {
            let mut out = vec![0.0f32; self.positions.len()];
            let (to, floats) = (out.as_mut_ptr(), out.len() as u64);
            let status = counted(|| unsafe {
                upt_scene_present(scene, &input, seconds, null(), to, floats)
            });
            return self.give(status, &out);
        }
        let status = counted(|| unsafe { upt_scene_step(scene, &input, null_mut(), 0) });
        self.shown(status)
    }

    pub fn present_points(&mut self) -> i32 {
        let mut out = vec![0.0f32; self.positions.len()];
        let input = upt_input::of_instruments(&self.tools);
        let (to, floats) = (out.as_mut_ptr(), out.len() as u64);
        let status = counted(|| unsafe {
            upt_scene_present(self.scene, &input, 0.01, &upt_view::POINTS, to, floats)
        });
        self.give(status, &out)
    }

    pub fn attach(&mut self) -> i32 {
        let count = self.positions.len() as u64 / 3;
        counted(|| unsafe { upt_scene_attach_points(self.scene, self.positions.as_ptr(), count) })
    }

    pub fn feel(&mut self) -> i32 {
        // SAFETY: zeros are a value of this struct.
        let mut options: upt_haptics_options = unsafe { std::mem::zeroed() };
        options.struct_size = size_of::<upt_haptics_options>() as u32;
        options.step_latency_ms = 10.0;
        options.tool = &self.tools[0];
        counted(|| unsafe { upt_haptics_create(self.scene, &options, &mut self.hand) })
    }

    pub fn render(&mut self) -> i32 {
        // SAFETY: zeros are values of these structs.
        let (mut pose, mut out): (upt_haptic_pose, upt_haptic_force) =
            unsafe { std::mem::zeroed() };
        pose.struct_size = size_of::<upt_haptic_pose>() as u32;
        out.struct_size = size_of::<upt_haptic_force>() as u32;
        pose.position_m = self.tools[0].position.map(|x| 1e-3 * x);
        pose.rotation = self.tools[0].rotation;
        let status = counted(|| unsafe { upt_haptics_render(self.hand, &pose, &mut out) });
        self.give(status, &[out.force_n, out.torque_n_m])
    }

    fn few(&self) -> &[u32] {
        &self.domain[..self.domain.len() / 2]
    }

    fn pushed(&self) -> &[u32] {
        &self.domain[..3]
    }

    pub fn region(&mut self) -> i32 {
        let few = self.few();
        let status =
            counted(|| unsafe { upt_scene_set_region(self.scene, few.as_ptr(), few.len() as u64) });
        self.shown(status)
    }

    pub fn decode(&mut self) -> i32 {
        let mut out = vec![0.0f32; 3 * self.domain.len()];
        let view = upt_view::of_nodes(&self.domain);
        let floats = out.len() as u64;
        let status =
            counted(|| unsafe { upt_scene_decode(self.scene, &view, out.as_mut_ptr(), floats) });
        self.give(status, &out)
    }

    pub fn submit(&mut self, depth: f32) -> i32 {
        self.pose(depth);
        let (scene, input) = (self.scene, upt_input::of_instruments(&self.tools));
        let status = counted(|| unsafe {
            match upt_scene_submit(scene, &input) {
                UPT_OK => upt_scene_wait(scene, u32::MAX),
                failed => failed,
            }
        });
        self.shown(status)
    }

    pub fn submit_nodes(&mut self) -> i32 {
        let nodes = self.pushed();
        let push = [0.0f32, 0.0, -0.7].repeat(nodes.len());
        let (scene, input) = (self.scene, upt_input::of_contacts(nodes, &push));
        let status = counted(|| unsafe {
            match upt_scene_submit(scene, &input) {
                UPT_OK => upt_scene_wait(scene, u32::MAX),
                failed => failed,
            }
        });
        self.shown(status)
    }

    pub fn save(&mut self) -> i32 {
        let mut needed = 0;
        let status = counted(|| unsafe { upt_scene_save(self.scene, null_mut(), 0, &mut needed) });
        if status != UPT_OK {
            return status;
        }
        self.snapshot = vec![0; needed as usize];
        let out = self.snapshot.as_mut_ptr();
        let status = counted(|| unsafe { upt_scene_save(self.scene, out, needed, null_mut()) });
        let snapshot = std::mem::take(&mut self.snapshot);
        let status = self.give(status, &snapshot);
        self.snapshot = snapshot;
        status
    }

    pub fn restore(&mut self) -> i32 {
        let (bytes, count) = (self.snapshot.as_ptr(), self.snapshot.len() as u64);
        let status = counted(|| unsafe { upt_scene_restore(self.scene, bytes, count) });
        self.shown(status)
    }

    pub fn contact_force(&mut self) -> i32 {
        let count = host::stats(self.scene).contact_count;
        let mut out = vec![0.0f32; 3 * count as usize];
        let status = counted(|| unsafe {
            upt_scene_read_contact_force(self.scene, out.as_mut_ptr(), out.len() as u64)
        });
        self.give(status, &out)
    }

    pub fn free(&mut self) -> i32 {
        let status = counted(|| unsafe { upt_scene_step(self.scene, null(), null_mut(), 0) });
        self.shown(status)
    }

    pub fn reset(&mut self) -> i32 {
        let status = counted(|| unsafe { upt_scene_reset(self.scene) });
        self.shown(status)
    }

    pub fn contacts(&mut self, depth: f32) -> i32 {
        self.pose(depth);
        let mut tools = self.tools;
        for tool in &mut tools {
            (tool.mode, tool.friction) = (UPT_MODE_SLIDE, 0.0);
            tool.half_extents = [0.0, 1.0, 0.0];
        }
        let mut needed = 0;
        let status = counted(|| unsafe {
            upt_scene_contacts_from_instruments(
                self.scene,
                tools.as_ptr(),
                2,
                null_mut(),
                null_mut(),
                0,
                &mut needed,
            )
        });
        self.give(status, &[needed])
    }

    pub fn push(&mut self, by: f32) -> i32 {
        let nodes = self.pushed();
        let push = [0.0, 0.0, by].repeat(nodes.len());
        let (scene, input) = (self.scene, upt_input::of_contacts(nodes, &push));
        let status = counted(|| unsafe { upt_scene_step(scene, &input, null_mut(), 0) });
        self.shown(status)
    }

    pub fn present_contacts(&mut self) -> i32 {
        let mut out = vec![0.0f32; 3 * self.few().len()];
        let nodes = self.pushed();
        let push = [0.0f32, 0.0, -0.8].repeat(nodes.len());
        let input = upt_input::of_contacts(nodes, &push);
        let (scene, to, floats) = (self.scene, out.as_mut_ptr(), out.len() as u64);
        let status =
            counted(|| unsafe { upt_scene_present(scene, &input, 0.01, null(), to, floats) });
        self.give(status, &out)
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        if !self.hand.is_null() {
            assert_eq!(unsafe { upt_haptics_destroy(self.hand) }, UPT_OK);
        }
        if !self.scene.is_null() {
            assert_eq!(unsafe { upt_scene_destroy(self.scene) }, UPT_OK);
        }
        if !self.model.is_null() {
            assert_eq!(unsafe { upt_model_destroy(self.model) }, UPT_OK);
        }
    }
}
