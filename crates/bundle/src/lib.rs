//! Bundles: bytes on disk -> checked values. The format is `docs/reference/formats.md`.
//!
//! REQ-001: A bundle with a missing, short or altered file is refused with an error that names the file or the field.

mod checks;
mod cut_mesh;
mod domain;
mod faults;
mod files;
mod geometry;
mod known;
mod laws;
pub mod limits;
mod maker;
mod manifest;
mod mesh;
mod mesh_laws;
mod node_set;
mod parse;
mod place;
mod seal;
mod surface;
mod tensors;

// `derive(HeldBytes)` looks for it here.
pub use domain::{Bounds, Domain, Opened};
use field::memory;
pub use files::BundleFiles;
pub use files::hex;
pub use geometry::volume;
pub use laws::ElementLaws;
pub use manifest::{
    Base, Bound, Boundary, Coordinates, CorrectionsEntry, Dims, Envelope, Fade, Feature, FileEntry,
    Graph, Manifest, ManifestKind, MeshEntry, Normalisation, PriorEntry, ReducedEntry,
    ReducedInput, ToolEnvelope, UptEntry,
};
pub use mesh::Mesh;
pub use node_set::NodeSet;
pub use place::read_regular;
pub use place::{Place, file_of};
pub use surface::Surface;
pub use tensors::TensorFile;
