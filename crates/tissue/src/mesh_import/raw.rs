//! What importing is asked for, and tetrahedra and surfaces as a file has them.

use std::path::Path;

/// How large the elements of a filled surface are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resolution {
    /// Lattice spacing, mm.
    Spacing(f64),
    /// Wanted number of nodes, met within 15 %; where thin places do not allow it, a note says so.
    Nodes(usize),
}

/// What to do with a file.
#[derive(Clone, Debug)]
pub struct ImportOptions {
    /// Name of the mesh. Default: the file's stem.
    pub name: Option<String>,
    /// Millimetres a unit of the file. Default 1.
    pub scale: f64,
    /// For surfaces (and `refill`) only, and needed there.
    pub resolution: Option<Resolution>,
    /// Remove faults that can be removed safely, instead of failing. Default false.
    pub repair: bool,
    /// Of tetrahedra take only the boundary, and fill it anew; needs `resolution`. Default false.
    pub refill: bool,
    /// Which of several bodies is wanted: its number in the file's order, from 1, or its name.
    pub part: Option<String>,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self {
            name: None,
            scale: 1.0,
            resolution: None,
            repair: false,
            refill: false,
            part: None,
        }
    }
}

/// Tetrahedra as a file holds them, unchecked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawTets {
    /// `[K, 3]`, mm.
    pub positions: Vec<[f64; 3]>,
    /// `[T, 4]`.
    pub tets: Vec<[u32; 4]>,
}

/// Triangles as a file holds them, unchecked; coinciding points are one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RawSurface {
    /// `[V, 3]`, mm.
    pub positions: Vec<[f64; 3]>,
    /// `[F, 3]`.
    pub faces: Vec<[u32; 3]>,
}

/// In lower case; empty without one.
pub(super) fn extension_of(path: &Path) -> String {
    let extension = path.extension().unwrap_or_default();
    extension.to_string_lossy().to_lowercase()
}
