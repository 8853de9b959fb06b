//! Pages of one file that show an organ in 3D without a server: what is held, what may be touched, and a contact that plays.
//!
//! [`write()`] makes a page from a mesh and, where there is one, a [`Film`]; `upt make` writes the preview and the certificate's page with
//! it, `cargo xtask study tools` the demo's. [`three`] is three.js as these pages and that of `upt view` have it.

mod film;
mod organ;
pub mod three;
mod tools;

pub use film::Film;
pub use organ::{Content, page, write};
