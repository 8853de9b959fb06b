//! The reference solver against what others computed: closed forms, conservation,
//! wave speed, refinement, CalculiX; and the promises of the files it writes.

mod body_loads;
mod calculix;
mod closed_forms;
mod contact;
mod cuts;
mod dataset;
mod determinism;
mod dynamics;
mod failures;
#[cfg(feature = "linear")]
mod fibres;
mod groups;
#[cfg(feature = "linear")]
mod laws;
mod metrics;
mod stiffness;
mod ties;
