//! The structs of a step: what drives it, what is shown of it, and what instruments are told. Conventions: `structs.rs`.

use core::ptr::null;
use safer_ffi::derive_ReprC;

use super::constants::{upt_end, upt_mode, upt_shape, upt_view_kind};
use super::load_structs::{upt_point_force, upt_pressure};
use super::support_structs::upt_support;

/// The input of a step, submitted or not, and of a frame between steps. All zero but `struct_size`: the tissue moves on by itself.
///
/// One thing drives a step: `instruments`, the nodes in contact, or `collision`; two at once are `UPT_ERR_ARGUMENT`. Later versions add
/// fields at the end.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_input {
    /// `sizeof(upt_input)`.
    pub struct_size: u32,
    /// Zero.
    pub reserved: [u8; 4],
    /// `[instrument_count]`: where rigid instruments are at the end of the step, all with the same `struct_size`. Pass every instrument
    /// every time, in the same order.
    pub instruments: *const upt_instrument,
    /// At most 64.
    pub instrument_count: u64,
    /// `[contact_count]` nodes in contact, each at most once, in any order; of a scene that has been cut also copies.
    pub contact_nodes: *const u32,
    /// `[contact_count,3]`, mm: the displacement of these nodes at the end of the step.
    pub contact_vectors: *const f32,
    /// At most K.
    pub contact_count: u64,
    /// `[K,3]` of the model's mesh, also where the scene has been cut, mm; zero except at nodes in contact, where it is their displacement at the end of
    /// the step; NULL: no such field.
    pub collision: *const f32,
    /// `[K,3]`, mm, the displacement that the step starts from; NULL: the scene's own state. Not with `instruments`.
    pub displacement: *const f32,
    /// The moment of the end of the step on the host's clock, s, from which `upt_scene_present` counts; 0 for hosts that keep none.
    pub time_s: f64,
    /// `[K,3]`, mN: forces on the nodes of the model's mesh at the end of the step (where the scene has been cut, on the tissue at a node's place);
    /// NULL: none. Loads (this field and those after it) act beside whatever drives the step, in scenes with corrections; they change on a line over the step, and a frame goes on from those of its step.
    pub forces: *const f32,
    /// `[pressure_count]`: pressure on parts of the surface at the end of the step, all with the same `struct_size`.
    pub pressures: *const upt_pressure,
    /// At most 32.
    pub pressure_count: u64,
    /// `[tie_count]`: ties of the tissue, all with the same `struct_size`, beside instruments or alone. A tie's place in the array is its identity: pass every tie
    /// every time, in the same order. A broken one stays broken in its place until it has a stiffness of 0 there, the array ends before it, or the scene is reset.
    pub ties: *const upt_tie,
    /// At most 256.
    pub tie_count: u64,
    /// `[support_count]`: what support groups of the bundle do, each at most once, all with the same `struct_size`. A group that is not named is held where it was
    /// meshed, or where it was held again. Pass them in every step.
    pub supports: *const upt_support,
    /// At most 64.
    pub support_count: u64,
    /// `[point_force_count]`: forces at points of the tissue at the end of the step, beside `forces`, all with the same `struct_size`.
    pub point_forces: *const upt_point_force,
    /// At most 256.
    pub point_force_count: u64,
    /// Gravity in the mesh's frame at the end of the step, m/s², at most 1000 in each direction.
    pub gravity: [f32; 3],
    /// Gravity under which the mesh was scanned, m/s²: what acts is `gravity - gravity_at_rest`, on the mass of each node. Zeros: the bundle's, where `gravity` is not zero.
    pub gravity_at_rest: [f32; 3],
    /// Where what holds the body is at the end of the step, mm: a point `x` of the mesh's frame is at `R x + support_position` in the world. All else stays in
    /// the mesh's frame, which goes with the support, but `gravity`, which is the world's then; the body feels the support's motion as inertia. Pass it in every step; a
    /// support that goes farther than 40 mm or half a radian in a step is put there.
    pub support_position: [f32; 3],
    /// `R` as a unit quaternion x, y, z, w; all zero is no rotation. Position and rotation all zero: there is no support that moves.
    pub support_rotation: [f32; 4],
    /// Zero.
    pub reserved_end: [u8; 4],
}

/// For hosts in Rust; the pointers are the lists', which must outlive the call that reads them.
impl upt_input {
    /// Nothing happens.
    pub const NOTHING: upt_input = upt_input {
        struct_size: size_of::<upt_input>() as u32,
        reserved: [0; 4],
        instruments: null(),
        instrument_count: 0,
        contact_nodes: null(),
        contact_vectors: null(),
        contact_count: 0,
        collision: null(),
        displacement: null(),
        time_s: 0.0,
        forces: null(),
        pressures: null(),
        pressure_count: 0,
        ties: null(),
        tie_count: 0,
        supports: null(),
        support_count: 0,
        point_forces: null(),
        point_force_count: 0,
        gravity: [0.0; 3],
        gravity_at_rest: [0.0; 3],
        support_position: [0.0; 3],
        support_rotation: [0.0; 4],
        reserved_end: [0; 4],
    };

    /// Instruments drive the step.
    pub fn of_instruments(instruments: &[upt_instrument]) -> upt_input {
        upt_input {
            instruments: instruments.as_ptr(),
            instrument_count: instruments.len() as u64,
            ..Self::NOTHING
        }
    }

    /// These nodes are in contact; `vectors` is `[m,3]`, mm.
    pub fn of_contacts(nodes: &[u32], vectors: &[f32]) -> upt_input {
        debug_assert_eq!(vectors.len(), 3 * nodes.len());
        upt_input {
            contact_nodes: nodes.as_ptr(),
            contact_vectors: vectors.as_ptr(),
            contact_count: nodes.len() as u64,
            ..Self::NOTHING
        }
    }
}

/// A tie: a spring between a point of the tissue and something else, an element of `upt_input.ties`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_tie {
    /// `sizeof(upt_tie)`, the same in every element of an array.
    pub struct_size: u32,
    /// What it is tied to: `UPT_END_*`.
    pub to: upt_end,
    /// The point of the tissue: nodes, of which one at least is free and near the domain, ...
    pub nodes: [u32; 3],
    /// ... and their weights, 0 or more, with the sum 1; all zero: the first node alone. `upt_scene_tie_points` finds both.
    pub weights: [f32; 3],
    /// Where its far end is at the end of the step, mm: in the mesh's frame, in the world, or in the instrument's frame. It comes there on a line within the step; one
    /// that goes farther than 40 mm is put there.
    pub place: [f32; 3],
    /// Tied to an instrument: its place in `upt_input.instruments`.
    pub instrument: u32,
    /// Tied to the tissue: the other point, as `nodes` and `weights`.
    pub other_nodes: [u32; 3],
    /// See `other_nodes`.
    pub other_weights: [f32; 3],
    /// N/m, which is mN/mm, at most 1000000; 0: it does not pull.
    pub stiffness: f32,
    /// It pulls where it is longer than this, mm.
    pub slack_mm: f32,
    /// N s/m, which is mN s/mm.
    pub damping: f32,
    /// It breaks under a larger tension at the end of a step, mN; 0: never. Where several would, those break first that are pulled hardest for what they bear.
    pub break_mn: f32,
    /// 1: it pushes where it is shorter than `slack_mm`, as a rod does; 0: it is a thread.
    pub pushes: u8,
    /// Zero.
    pub reserved: [u8; 3],
}

/// For hosts in Rust.
impl upt_tie {
    /// It does not pull.
    pub const NONE: upt_tie = upt_tie {
        struct_size: size_of::<upt_tie>() as u32,
        to: super::constants::UPT_END_SUPPORT,
        nodes: [0; 3],
        weights: [1.0, 0.0, 0.0],
        place: [0.0; 3],
        instrument: 0,
        other_nodes: [0; 3],
        other_weights: [1.0, 0.0, 0.0],
        stiffness: 0.0,
        slack_mm: 0.0,
        damping: 0.0,
        break_mn: 0.0,
        pushes: 0,
        reserved: [0; 3],
    };
}

/// What a tie does at the end of a step; filled by `upt_scene_read_ties`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_tie_reading {
    /// `sizeof(upt_tie_reading)`, set by the caller, the same in every element of an array.
    pub struct_size: u32,
    /// 1: it has broken, in this step or before.
    pub broken: u8,
    /// 1: it broke in this step.
    pub broke: u8,
    /// Zero.
    pub reserved: [u8; 2],
    /// On the tissue at the tie's point, mN.
    pub force: [f32; 3],
    /// From end to end, mm.
    pub length_mm: f32,
}

/// A bed: what holds a region of the surface, for `upt_scene_bed`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_bed {
    /// `sizeof(upt_bed)`.
    pub struct_size: u32,
    /// mm: with no `nodes`, the region is what lies this close to `centre` in the last state.
    pub radius_mm: f32,
    /// mm, in the mesh's frame.
    pub centre: [f32; 3],
    /// From each node to where it is tied, mm; zeros: where it is in the last state.
    pub offset: [f32; 3],
    /// `[node_count]`: the nodes that it ties.
    pub nodes: *const u32,
    /// At most K; 0: those about `centre`.
    pub node_count: u64,
    /// Of all ties together, N/m.
    pub stiffness: f32,
    /// Of each tie, mm.
    pub slack_mm: f32,
    /// Of all ties together, N s/m.
    pub damping: f32,
    /// Of all ties together, mN; 0: it never breaks.
    pub break_mn: f32,
    /// As in `upt_tie`.
    pub pushes: u8,
    /// Zero.
    pub reserved: [u8; 7],
}

/// What is shown of a state. Where a call takes one, NULL is the region.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_view {
    /// `sizeof(upt_view)`.
    pub struct_size: u32,
    /// `UPT_VIEW_*`.
    pub kind: upt_view_kind,
    /// `[node_count]`, only with `UPT_VIEW_NODES`: indices, in the order of the output; NULL with count 0: all nodes.
    pub nodes: *const u32,
    /// At most K.
    pub node_count: u64,
}

/// The convex hull of a tool's points. Immutable; any number of threads may use it at once.
#[derive_ReprC]
#[repr(opaque)]
pub struct upt_hull {
    _opaque: [u8; 0],
}

/// A rigid instrument, as `upt_input` and `upt_scene_contacts_from_instruments` take it.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_instrument {
    /// `sizeof(upt_instrument)`, the same in every element of an array.
    pub struct_size: u32,
    /// `UPT_SHAPE_*`.
    pub shape: upt_shape,
    /// Centre, mm, in the mesh's frame.
    pub position: [f32; 3],
    /// Unit quaternion x, y, z, w; all zero is no rotation.
    pub rotation: [f32; 4],
    /// Half sizes along the local axes, mm; a capsule's half length is `[1]` (local y). A sphere has none.
    pub half_extents: [f32; 3],
    /// A sphere's or a capsule's radius or a spatula's corner radius, mm.
    pub radius: f32,
    /// Only for `upt_scene_contacts_from_instruments`. 1: touched nodes move with the instrument until it leaves; 0: they slide.
    pub sticking: u8,
    /// Only for `upt_input`: `UPT_MODE_*`.
    pub mode: upt_mode,
    /// Zero.
    pub reserved: [u8; 2],
    /// Only for `upt_input`: Coulomb's coefficient, 0 or more.
    pub friction: f32,
    /// A grasp tears off when its points together pull harder than this, mN; 0: never.
    pub tear_off_mn: f32,
    /// `UPT_SHAPE_HULL`: the `upt_hull`; otherwise NULL.
    pub hull: *const upt_hull,
}

/// What the tissue does to an instrument at the end of a step; filled by `upt_scene_read_instruments`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_instrument_reading {
    /// `sizeof(upt_instrument_reading)`, set by the caller, the same in every element of an array.
    pub struct_size: u32,
    /// Points of the surface that push or hold the instrument.
    pub contact_count: u32,
    /// On the instrument, mN.
    pub force: [f32; 3],
    /// On the instrument about its position, mN mm.
    pub torque: [f32; 3],
    /// Depth of the deepest point of the surface inside the instrument, mm.
    pub penetration_mm: f32,
    /// 1: its grasp tore off in this step.
    pub torn: u8,
    /// Zero.
    pub reserved: [u8; 3],
    /// What the last contact solve left unsolved, mm: 0 where it came to its end.
    pub residual_mm: f32,
}

/// A point of the surface that pushes or holds an instrument; filled by `upt_scene_read_instrument_contacts`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_instrument_contact {
    /// Place of the instrument in the step's array.
    pub instrument: u32,
    /// Position of the point, mm.
    pub position: [f32; 3],
    /// On the instrument, mN.
    pub force: [f32; 3],
}

/// What an operation has made of the body of a scene; filled by `upt_scene_cut` and the calls beside it.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_cut {
    /// `sizeof(upt_cut)`, set by the caller.
    pub struct_size: u32,
    /// Pieces that were dropped.
    pub fragment_count: u32,
    /// Nodes that the scene has now. Outputs have 3 floats for each.
    pub node_count: u64,
    /// New ones, the last of them.
    pub copied_count: u64,
    /// New area of the cut, mm².
    pub area_mm2: f32,
    /// Volume that the body has lost, mm³.
    pub removed_mm3: f32,
    /// What the tissue does to the blade of `upt_scene_cut_with`, mN.
    pub force: [f32; 3],
    /// 1: the body is another one, also where no area is new: its surface wants `upt_scene_update_surface` before it is read.
    pub is_changed: u32,
}

/// A blade that feels the tissue. All zero: it feels nothing, and cuts whatever way it goes.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_blade {
    /// `sizeof(upt_blade)`.
    pub struct_size: u32,
    /// Fracture energy of the tissue, J/m², which is mN/mm: what new area takes.
    pub fracture_energy: f32,
    /// With how much it must be pushed before a stroke begins to cut, mN, ...
    pub threshold: f32,
    /// ... and is, mN: of the reading of the instrument that is its body, what points against `ahead`.
    pub pushed: f32,
    /// Where the edge is sharp, of any length; zeros: everywhere. It cuts where its way leans from there by less than 60 degrees.
    pub ahead: [f32; 3],
    /// 0.
    pub reserved: u32,
}

/// The surface of a scene's body, and what of it is new; filled by `upt_scene_update_surface`.
#[derive_ReprC]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct upt_surface {
    /// `sizeof(upt_surface)`, set by the caller.
    pub struct_size: u32,
    /// 1: every vertex and triangle is new, so upload all. That is so at the first call, and at the first after `upt_scene_reset` or
    /// `upt_scene_restore` has put another body back.
    pub is_new: u32,
    /// Vertices now.
    pub vertex_count: u64,
    /// Slots of triangles now, empty ones included.
    pub triangle_count: u64,
    /// Vertices from this one on are new.
    pub first_vertex: u64,
    /// Slots whose corners have changed.
    pub changed_count: u64,
}
