//! Trajectories and meshes for other programs: ParaView (`vtu`), viewers and engines (`surface`).

#[cfg(feature = "files")]
mod gltf;
#[cfg(feature = "files")]
mod skin;
#[cfg(feature = "files")]
mod surface;
mod vtu;

#[cfg(feature = "files")]
pub use surface::{SurfaceFormat, write_surface};
pub use vtu::{Cells, Collection, write_frame};
