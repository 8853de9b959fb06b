//! A bundle from an organ: surface or mesh and [`Options`] in, bundle folder and [`Certificate`](check::Certificate) out.
//!
//! ```no_run
//! let mut options = make::Options::new("liver.obj", "liver");
//! options.unit = "cm".into();
//! options.fixed = vec!["plane:0,0,-1,-20".parse().unwrap()];
//! let made = make::run(&options)?;
//! # let make::Made::Bundle(made) = made else { return Ok(()) };
//! println!("{}", made.certificate.text());
//! # anyhow::Ok(())
//! ```
//!
//! [`run`] goes through the stages of `docs/guide/make.md`, each kept in a work folder and not made again. Its parts are there by
//! themselves, for bundles that were made elsewhere:
//!
//! | module | what |
//! |---|---|
//! | [`prior`] | compliance columns: the linear response to every touch |
//! | [`modes`] | natural modes: how the body swings |
//! | [`corrections`] | the coarse space that corrections need |
//! | [`check`] | held-out contacts against the reference solver: the certificate |
//!
//! [`Options::watch`] hears how far the work is. Errors name the option of `upt make` that mends them.

mod body;
mod bundle;
mod certify;
pub mod check;
mod clock;
pub mod corrections;
mod fibres;
mod fixed;
mod gravity;
mod laws;
mod learn;
mod material;
pub mod modes;
mod options;
mod parallel;
mod patches;
pub mod prior;
mod projected;
mod refine;
pub mod regions;
mod run;
mod sizes;
mod stages;
mod tables;
mod unload;
mod vibration;

pub use fibres::Fibre;
pub use fixed::Fixed;
pub use gravity::{Gravity, gravity};
pub use material::{Choice, ELASTIC};
pub use options::Options;
pub use run::{Finished, Made, run};
pub use yardstick::Watch;
