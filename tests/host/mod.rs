//! A host of the C ABI: what its tests need of it.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]
#![allow(dead_code)]

use std::ffi::{CStr, CString};
use std::ptr::{null, null_mut};

use upt::ffi::*;

use crate::fixture;

/// A model and a scene of a bundle in `tests/fixtures`.
pub struct Host {
    pub model: *mut upt_model,
    pub scene: *mut upt_scene,
    pub nodes: usize,
}

pub fn open(bundle: &std::path::Path) -> *mut upt_model {
    let path = CString::new(bundle.to_str().unwrap()).unwrap();
    let mut model = null_mut();
    let status = unsafe { upt_model_create(path.as_ptr(), null(), &mut model) };
    assert_eq!(status, UPT_OK, "{}", message());
    model
}

/// Zeroed, with its size.
pub fn scene_options() -> upt_scene_options {
    let mut options: upt_scene_options = unsafe { std::mem::zeroed() };
    options.struct_size = size_of::<upt_scene_options>() as u32;
    options
}

pub fn create(model: *mut upt_model, options: &upt_scene_options) -> *mut upt_scene {
    let mut scene = null_mut();
    let status = unsafe { upt_scene_create(model, options, &mut scene) };
    assert_eq!(status, UPT_OK, "{}", message());
    scene
}

pub fn node_count(model: *mut upt_model) -> usize {
    let mut info: upt_model_info = unsafe { std::mem::zeroed() };
    info.struct_size = size_of::<upt_model_info>() as u32;
    assert_eq!(unsafe { upt_model_read_info(model, &mut info) }, UPT_OK);
    info.node_count as usize
}

pub fn stats(scene: *mut upt_scene) -> upt_scene_stats {
    let mut stats: upt_scene_stats = unsafe { std::mem::zeroed() };
    stats.struct_size = size_of::<upt_scene_stats>() as u32;
    assert_eq!(unsafe { upt_scene_read_stats(scene, &mut stats) }, UPT_OK);
    stats
}

/// A ball of 3 mm in the middle of the domain, this deep in it, mm.
pub fn ball(host: &Host, depth: f32) -> upt_instrument {
    let mut positions = vec![0.0f32; 3 * host.nodes];
    let floats = positions.len() as u64;
    let read = unsafe { upt_model_read_positions(host.model, positions.as_mut_ptr(), floats) };
    assert_eq!(read, UPT_OK);
    let domain = indices(host.model, UPT_SET_DOMAIN_NODES);
    let at = 3 * domain[domain.len() / 2] as usize;
    // SAFETY: zeros are a value of this struct.
    let mut tool: upt_instrument = unsafe { std::mem::zeroed() };
    tool.struct_size = size_of::<upt_instrument>() as u32;
    tool.radius = 3.0;
    tool.rotation[3] = 1.0;
    tool.position = [
        positions[at],
        positions[at + 1],
        positions[at + 2] + 3.0 - depth,
    ];
    tool
}

pub fn indices(model: *mut upt_model, set: i32) -> Vec<u32> {
    let mut needed = 0;
    let status = unsafe { upt_model_read_indices(model, set, null_mut(), 0, &mut needed) };
    assert_eq!(status, UPT_OK);
    let mut out = vec![0; needed as usize];
    let status =
        unsafe { upt_model_read_indices(model, set, out.as_mut_ptr(), needed, null_mut()) };
    assert_eq!(status, UPT_OK);
    out
}

pub fn message() -> String {
    let text = unsafe { CStr::from_ptr(upt_last_error()) };
    text.to_string_lossy().into_owned()
}

impl Host {
    pub fn new(bundle: &str, change: impl FnOnce(&mut upt_scene_options)) -> Host {
        fixture::find_runtime();
        let model = open(&fixture::path(bundle));
        let mut options = scene_options();
        options.guard_policy = UPT_GUARD_REPORT;
        change(&mut options);
        Host {
            model,
            scene: create(model, &options),
            nodes: node_count(model),
        }
    }

    /// Steps with these nodes pushed by `push`.
    pub fn step(&self, nodes: &[u32], push: [f32; 3]) -> i32 {
        let vectors = push.repeat(nodes.len());
        let input = upt_input::of_contacts(nodes, &vectors);
        unsafe { upt_scene_step(self.scene, &input, null_mut(), 0) }
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        assert_eq!(unsafe { upt_scene_destroy(self.scene) }, UPT_OK);
        assert_eq!(unsafe { upt_model_destroy(self.model) }, UPT_OK);
    }
}
