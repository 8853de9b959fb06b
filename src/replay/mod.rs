//! What a scene was given, as lines of JSON that `upt replay` steps through again (`docs/reference/formats.md`).
//!
//! The lines are types with names of the C ABI ([`lines`], [`drive`], [`loads`]); a recorder writes them as they are made. All numbers are written
//! so that they are read to the bit.
//!
//! REQ-097: A recording holds all that a scene is given, to the bit, in the order in which it was done.

pub mod base64;
pub mod drive;
pub mod lines;
pub mod loads;
mod recorder;

pub(crate) use recorder::Recorder;
