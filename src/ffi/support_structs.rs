//! The structs of support groups, as the header has them.

use core::ptr::null;
use safer_ffi::derive_ReprC;

/// What a support group of the bundle does at the end of a step, an element of `upt_input.supports`. `upt_model_read_support` names the groups.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_support {
    /// `sizeof(upt_support)`, the same in every element of an array.
    pub struct_size: u32,
    /// Its place among the bundle's groups, from 0.
    pub group: u32,
    /// As a rigid body in the mesh's frame: a node `x` of the group ends at `R x + position`, mm; at most 40 mm from where it is.
    pub position: [f32; 3],
    /// `R` as a unit quaternion x, y, z, w; all zero is no rotation.
    pub rotation: [f32; 4],
    /// 1: the group holds nothing, and its nodes move as all free ones do. Held again, it holds them where they are then. 0: it holds.
    pub let_go: u8,
    /// Zero.
    pub reserved: [u8; 3],
    /// `[n,3]`, mm, instead of a pose: the displacement of each of the group's nodes at the end of the step; NULL: the pose.
    pub displacements: *const f32,
    /// 3 n, or 0.
    pub displacement_count: u64,
}

/// For hosts in Rust.
impl upt_support {
    /// Group 0, held where it was meshed.
    pub const HELD: upt_support = upt_support {
        struct_size: size_of::<upt_support>() as u32,
        group: 0,
        position: [0.0; 3],
        rotation: [0.0; 4],
        let_go: 0,
        reserved: [0; 3],
        displacements: null(),
        displacement_count: 0,
    };
}
