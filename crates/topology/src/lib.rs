//! The topology of a body that is cut: virtual nodes on a tetrahedral mesh that is never re-meshed.
//!
//! An element that a blade has touched becomes two or more *cells* with the element's rest shape, each with a share of its volume and with nodes of its own
//! where the material around a node has come apart (Molino, Bao and Fedkiw 2004; Sifakis, Der and Fedkiw 2007). Copies of nodes move with what
//! they belong to, so that a cut lies on the blade's path whatever the mesh, and nothing moves at the moment of a cut.
//!
//! | module | what |
//! |---|---|
//! | [`rest`] | the uncut mesh: neighbours over faces, elements of a node |
//! | [`sweep`] | what a blade's edge passes: triangles, distances to them |
//! | [`polytope`], [`polygon`] | the material of a cell, in barycentric coordinates of its element |
//! | [`body`] | cells, copies of nodes; cuts, removal, stiffness |
//! | [`connect`] | which cells are joined, and where nodes part |
//! | [`elements`] | what a solver takes: nodes, shares and stiffness of each cell |
//! | [`surface`] | the closed surface, inside faces included; what outside pressure acts on |
//! | [`blade`] | what a blade feels |
//! | `tear` | what is stretched too far |
//! | `carry` | which nodes take what acts on a node of the mesh |
//! | `touchable` | where tools may touch |
//!
//! Lengths are millimetres. Nothing here knows an element law or a time.
//!
//! REQ-061: Random cuts, removals and tools leave every state finite and lose no tissue.

pub mod blade;
pub mod body;
mod carry;
pub mod connect;
mod cut;
pub mod elements;
mod error;
mod fragments;
mod kept;
pub mod polygon;
pub mod polytope;
mod push;
mod remove;
pub mod rest;
mod room;
pub mod surface;
pub mod sweep;
mod tear;
mod touchable;

pub use blade::Blade;
pub use body::{Body, Cell, Change};
pub use elements::{Changes, Element, origin};
pub use error::TopologyError;
pub use fragments::Fragment;
pub use kept::Kept;
pub use push::Push;
pub use rest::RestMesh;
pub use surface::{Skin, SkinTriangle, Surface, SurfaceChange, Vertex};
pub use sweep::Sweep;
pub use touchable::{Bounds, Corner, Touchable};

/// A point, mm.
pub type Point = [f64; 3];
