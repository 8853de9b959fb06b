//! The yardstick: libupt as a host gets it, held against the reference solver's answer to the same poses of the same tools.
//!
//! A [`BundleFolder`](bundle_folder::BundleFolder) is driven by [`drive`] through recorded [`cases`], or by [`surrogate`] through
//! prescribed contact, step by step from its own last state. [`measure`] compares each step with the truth, and [`CaseFigures`] are
//! what a case comes to: errors in mm², forces, penetration, det F, times. `upt make` writes certificates with it, and `crates/study`
//! every page of results.
//!
//! | module | what |
//! |---|---|
//! | [`bundle_folder`], [`setting`] | a bundle's folder, and what a configuration of it is chosen from |
//! | [`manifest`] | its `bundle.json`, changed and sealed again |
//! | [`cases`] | recorded trajectories with tools: the truth |
//! | [`tool_scale`] | how large the tools of the programmes are on a body |
//! | [`drive`], [`surrogate`] | how the library is driven, by tools and by prescribed contact |
//! | [`prior_alone`] | a bundle's linear response alone, for comparison |
//! | [`yard`] | det F and penetration of one state |
//! | [`measure`], [`errors`] | a case, step by step |
//! | [`machine`] | where a measurement was made |
//! | [`Watch`] | who hears how far it is |

pub mod bundle_folder;
pub mod cases;
pub mod drive;
pub mod errors;
mod figures;
pub mod finished;
pub mod machine;
pub mod manifest;
pub mod measure;
mod method;
pub mod prior_alone;
pub mod setting;
pub mod surrogate;
pub mod tool_scale;
mod watch;
pub mod yard;

pub use figures::CaseFigures;
pub use finished::finished;
pub use method::{Method, solved};
pub use watch::{Bar, Counter, Listener, Watch};
