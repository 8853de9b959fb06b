//! A model of the C ABI for random calls: what can be called with what, and what the header promises.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]

mod cut_calls;
mod driven_calls;
mod haptic_calls;
mod header;
mod inputs;
mod instrument_calls;
mod library_calls;
mod scene_calls;
mod surface_calls;
mod tie_calls;
mod traps;
mod world;

pub use header::{Documented, declared, documented};
pub use world::World;

use proptest::prelude::{Strategy, any};
use proptest::prop_oneof;

/// The functions that are called, all that take a handle and those around them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Function {
    Init,
    Shutdown,
    Providers,
    ModelOpen,
    ModelClose,
    ModelInfo,
    ModelDescribe,
    ModelPositions,
    ModelIndices,
    ModelSupport,
    ModelRegion,
    ModelLocate,
    SceneCreate,
    SceneDestroy,
    SceneReset,
    Step,
    StepField,
    Read,
    Submit,
    Poll,
    Wait,
    Sample,
    SetRegion,
    Decode,
    AttachPoints,
    Instruments,
    Present,
    Readings,
    InstrumentContacts,
    HullCreate,
    HullDestroy,
    HapticsCreate,
    HapticsRender,
    HapticsDestroy,
    ContactForce,
    Stats,
    Timing,
    Save,
    Restore,
    Record,
    TakeRecord,
    SetLog,
    Texts,
    Cut,
    CutWith,
    Remove,
    Tear,
    ScaleStiffness,
    DropFragments,
    NodeCount,
    UpdateSurface,
    Surface,
    SurfacePositions,
    TieReadings,
    TiePoints,
    Bed,
}

/// What each function of `include/upt.h` is called by.
pub const CALLED_BY: &[(&str, Function)] = &[
    ("upt_init", Init),
    ("upt_shutdown", Shutdown),
    ("upt_version", Texts),
    ("upt_abi_version", Texts),
    ("upt_last_error", Texts),
    ("upt_status_name", Texts),
    ("upt_set_log", SetLog),
    ("upt_providers", Providers),
    ("upt_model_create", ModelOpen),
    ("upt_model_destroy", ModelClose),
    ("upt_model_read_info", ModelInfo),
    ("upt_model_describe", ModelDescribe),
    ("upt_model_read_positions", ModelPositions),
    ("upt_model_read_indices", ModelIndices),
    ("upt_model_read_support", ModelSupport),
    ("upt_model_read_region", ModelRegion),
    ("upt_model_locate_points", ModelLocate),
    ("upt_scene_create", SceneCreate),
    ("upt_scene_destroy", SceneDestroy),
    ("upt_scene_reset", SceneReset),
    ("upt_scene_step", Step),
    ("upt_scene_step_field", StepField),
    ("upt_scene_read", Read),
    ("upt_scene_submit", Submit),
    ("upt_scene_poll", Poll),
    ("upt_scene_wait", Wait),
    ("upt_scene_sample", Sample),
    ("upt_scene_set_region", SetRegion),
    ("upt_scene_decode", Decode),
    ("upt_scene_attach_points", AttachPoints),
    ("upt_scene_contacts_from_instruments", Instruments),
    ("upt_scene_present", Present),
    ("upt_scene_read_instruments", Readings),
    ("upt_scene_read_instrument_contacts", InstrumentContacts),
    ("upt_hull_create", HullCreate),
    ("upt_hull_destroy", HullDestroy),
    ("upt_haptics_create", HapticsCreate),
    ("upt_haptics_render", HapticsRender),
    ("upt_haptics_destroy", HapticsDestroy),
    ("upt_scene_read_contact_force", ContactForce),
    ("upt_scene_read_stats", Stats),
    ("upt_scene_read_timing", Timing),
    ("upt_scene_save", Save),
    ("upt_scene_restore", Restore),
    ("upt_scene_record", Record),
    ("upt_scene_take_record", TakeRecord),
    ("upt_scene_cut", Cut),
    ("upt_scene_cut_with", CutWith),
    ("upt_scene_remove", Remove),
    ("upt_scene_tear", Tear),
    ("upt_scene_scale_stiffness", ScaleStiffness),
    ("upt_scene_drop_fragments", DropFragments),
    ("upt_scene_read_node_count", NodeCount),
    ("upt_scene_update_surface", UpdateSurface),
    ("upt_scene_read_surface", Surface),
    ("upt_scene_read_surface_positions", SurfacePositions),
    ("upt_scene_read_ties", TieReadings),
    ("upt_scene_tie_points", TiePoints),
    ("upt_scene_bed", Bed),
];

use Function::*;

/// What a number of an input becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Odd {
    None,
    NaN,
    Infinity,
    Huge,
    Denormal,
    /// An index beyond the end, an unknown enum, a wrong `struct_size`, a damaged byte.
    Wrong,
}

/// A count that is passed, compared with the right one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    Right,
    Zero,
    Short,
    Long,
    Absurd,
}

/// One call; how its parts are read is up to the function.
#[derive(Debug, Clone)]
pub struct Call {
    pub function: Function,
    /// Chooses the handle.
    pub handle: u8,
    /// Bit i: pointer i is NULL.
    pub null: u8,
    pub size: Size,
    pub odd: Odd,
    pub seed: u64,
}

/// Calls that mostly make sense, so that sequences reach deep states.
pub fn call() -> impl Strategy<Value = Call> {
    let function = prop_oneof![
        3 => few(&[ModelOpen, Init, Shutdown, Providers, ModelClose]),
        1 => few(&[SetLog, Texts]),
        3 => few(&[ModelInfo, ModelDescribe, ModelPositions, ModelIndices, ModelSupport, ModelRegion, ModelLocate]),
        8 => few(&[SceneCreate, SceneCreate, SceneDestroy]),
        60 => few(&[Step, Step, Step, Step, StepField, Present, Present, Readings]),
        2 => few(&[HullCreate, HullCreate, HullDestroy]),
        20 => few(&[HapticsCreate, HapticsRender, HapticsRender, HapticsRender, HapticsDestroy]),
        6 => few(&[Cut, CutWith, Remove, Tear, ScaleStiffness, DropFragments]),
        6 => few(&[TieReadings, TieReadings, TiePoints, Bed]),
        6 => few(&[NodeCount, UpdateSurface, UpdateSurface, Surface, SurfacePositions]),
        3 => few(&[Function::Record, TakeRecord]),
        12 => few(&[Submit, Submit, Poll, Wait, Wait]),
        30 => few(&[
            Read, Sample, SetRegion, Decode, AttachPoints, Instruments,
            InstrumentContacts, ContactForce, Stats, Timing, Save, Restore, Restore, SceneReset,
        ]),
    ];
    let null = prop_oneof![8 => few(&[0u8]), 1 => few(&[1, 2, 4, 3, 7])];
    let size = prop_oneof![
        10 => few(&[Size::Right]),
        1 => few(&[Size::Zero, Size::Short, Size::Long, Size::Absurd]),
    ];
    let odd = prop_oneof![
        8 => few(&[Odd::None]),
        1 => few(&[Odd::NaN, Odd::Infinity, Odd::Huge, Odd::Denormal, Odd::Wrong, Odd::Wrong]),
    ];
    (function, any::<u8>(), null, size, odd, any::<u64>()).prop_map(
        |(function, handle, null, size, odd, seed)| Call {
            function,
            handle,
            null,
            size,
            odd,
            seed,
        },
    )
}

fn few<T: Clone + std::fmt::Debug + 'static>(values: &'static [T]) -> impl Strategy<Value = T> {
    proptest::sample::select(values)
}
