//! Structs of the C interface: what acts on the tissue at points and on its surface.

use safer_ffi::derive_ReprC;

/// A force at a point of the tissue, an element of `upt_input.point_forces`; `upt_model_locate_points` finds the point.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_point_force {
    /// `sizeof(upt_point_force)`, the same in every element of an array.
    pub struct_size: u32,
    /// Nodes of the model's mesh around the point, which share the force (where the scene has been cut, the tissue at their places does), ...
    pub nodes: [u32; 4],
    /// ... and their weights, 0 or more, with the sum 1; all zero: the first node alone.
    pub weights: [f32; 4],
    /// mN, at most 1000000 in each direction, in the mesh's frame.
    pub force: [f32; 3],
}

/// A pressure on a part of the surface, which follows the surface as it moves. A face in several of them takes their sum.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_pressure {
    /// `sizeof(upt_pressure)`, the same in every element of an array.
    pub struct_size: u32,
    /// From outside on the body, Pa, at most 1000000; negative for suction.
    pub pascal: f32,
    /// `[node_count]`: it acts on the boundary triangles with all three corners among these nodes; where the scene has been cut, on what is left of them.
    pub nodes: *const u32,
    /// At most K; 0: it acts on the domain, and on all that cuts and removal have laid bare.
    pub node_count: u64,
}
