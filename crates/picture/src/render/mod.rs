//! Pictures without a graphics card: a triangle surface, shaded and coloured by a value at each node.
//!
//! An orthographic camera, a z-buffer and one light; 2 x 2 samples a pixel. The colour shows a scalar
//! field (mm) on tissue: pale where it is zero.

mod camera;
mod colour;
mod contact;
mod raster;

pub use camera::Camera;
pub use colour::Palette;
pub use contact::{contact_camera, deformed, lengths};
pub use raster::{Image, Surface, draw};
