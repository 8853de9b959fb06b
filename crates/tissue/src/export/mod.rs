//! Trajectories and meshes for other programs: ParaView (`vtu`), viewers and engines (`surface`).

mod gltf;
mod surface;
mod vtu;

pub use surface::{SurfaceFormat, write_surface};
pub use vtu::{Cells, Collection, write_frame};
