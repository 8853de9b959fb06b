//! The C ABI: `include/upt.h` and the C# bindings are generated from this folder (`cargo xtask header`).
//!
//! A function checks its pointers, finds its handle, calls one safe function and turns the result into a status;
//! there is no other logic here. Conventions: `docs/reference/abi.md`; why it is built this way: `docs/decisions/001-ffi.md`.
//!
//! REQ-010: A call returns a status that its documentation names. One that fails writes no output and changes no state.

#![allow(non_camel_case_types, clippy::missing_safety_doc)]

mod call;
mod constants;
mod convert;
mod cut;
mod driven;
mod failure;
mod hands;
mod haptics;
#[cfg(target_family = "wasm")]
mod host;
mod input;
mod instrument;
mod library;
mod load_structs;
mod locate;
mod log;
mod model;
mod output;
mod pointers;
mod points;
mod present;
mod record;
mod region;
mod registry;
mod scene;
mod state;
mod step_structs;
mod structs;
mod support_structs;
mod surface;
mod ties;
mod trace;
mod views;
mod worker;

#[cfg(feature = "fault")]
mod fault;

pub use constants::*;
pub use cut::*;
pub use driven::*;
pub use haptics::*;
pub use instrument::*;
pub use library::*;
pub use load_structs::*;
pub use locate::*;
pub use model::*;
pub use points::*;
pub use present::*;
pub use record::*;
pub use region::*;
pub use scene::*;
pub use state::*;
pub use step_structs::*;
pub use structs::*;
pub use support_structs::*;
pub use surface::*;
pub use ties::*;
pub use worker::*;
