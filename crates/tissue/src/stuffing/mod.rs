//! Isosurface stuffing: tetrahedra without slivers inside a level set.
//!
//! F. Labelle and J. R. Shewchuk, "Isosurface Stuffing: Fast Tetrahedral Meshes with Good
//! Dihedral Angles", SIGGRAPH 2007. A body-centred cubic (BCC) lattice is laid over the field,
//! lattice nodes too close to the surface are moved onto it (`lattice`), and every lattice
//! tetrahedron that the surface cuts is replaced by one of a few fixed stencils (`stencils`).
//! With the safe values of alpha below the dihedral angles are bounded away from 0 and 180 degrees,
//! which is what an explicit time step needs.
//!
//! A field is positive inside, negative outside, in the unit of length of the positions (mm here).

mod bisection;
mod field;
mod grid_file;
mod lattice;
mod manifold;
mod stencils;

pub use field::{Field, GridField, HalfSpace, Offset};

use lattice::Lattice;

/// Tetrahedra made by [`stuff`], before they become a checked mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stuffed {
    /// `[K, 3]`, in the unit of the field.
    pub positions: Vec<[f64; 3]>,
    /// `[T, 4]`, positive volume: `(b - a) . ((c - a) x (d - a)) > 0`.
    pub tets: Vec<[u32; 4]>,
    /// Tetrahedra dropped because they hung on by an edge, a node or not at all.
    pub dropped: usize,
}

/// Why nothing was stuffed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StuffError {
    /// The spacing is not a positive finite number.
    #[error("lattice spacing {0} is not a positive finite length; give one in mm")]
    Spacing(f64),
    /// The lattice would not fit in 32-bit node numbers.
    #[error("lattice of {0} nodes is too large; use a larger spacing than {1} mm")]
    TooLarge(u64, f64),
    /// The field is not a number at a lattice node.
    #[error("the field is {value} at ({x}, {y}, {z}); it must be finite")]
    NotFinite { value: f64, x: f64, y: f64, z: f64 },
    /// No lattice node is inside.
    #[error("no lattice node lies inside the surface at spacing {0} mm; use a smaller spacing")]
    Empty(f64),
}

/// Fills the region where `field` is positive with tetrahedra.
///
/// `spacing` is the lattice's cube edge (the long lattice edge; the short ones are sqrt(3)/2 of it).
/// Cube corners lie at integer multiples of `spacing`, so the plane x = 0 is a lattice plane and
/// two bodies cut by it fit together node by node.
///
/// The result is a pure function of the field and the spacing: the same bits on every run.
///
/// # Errors
/// [`StuffError`]; nothing is returned then.
pub fn stuff(field: &impl Field, spacing: f64) -> Result<Stuffed, StuffError> {
    if !(spacing.is_finite() && spacing > 0.0) {
        return Err(StuffError::Spacing(spacing));
    }
    let lattice = Lattice::sample(field, spacing, |values| values.iter().any(|&x| x > 0.0))?;
    fill(lattice, field, spacing, false)
}

/// [`stuff`] with a lattice that is finer where the body is thin: tetrahedra are bisected until
/// `too_large` (of their corners, and of the spacing of tetrahedra of their volume, mm) holds of none, down to a
/// sixteenth of `spacing`. Angles are bounded less well where sizes change. Tetrahedra between two
/// sheets of the surface, all of whose nodes were moved onto it, are kept too: walls as thin as the
/// spacing then have no holes.
///
/// `field` must be a distance: a tetrahedron farther from the surface than its size is outside.
///
/// # Errors
/// [`StuffError`]; nothing is returned then.
pub fn stuff_graded(
    field: &impl Field,
    spacing: f64,
    too_large: impl Fn([[f64; 3]; 4], f64) -> bool,
) -> Result<Stuffed, StuffError> {
    if !(spacing.is_finite() && spacing > 0.0) {
        return Err(StuffError::Spacing(spacing));
    }
    let mut lattice = Lattice::sample(field, spacing, |values| {
        values.iter().any(|&x| x > -spacing)
    })?;
    lattice.is_distance = true;
    bisection::refine(&mut lattice, field, spacing, too_large)?;
    fill(lattice, field, spacing, true)
}

fn fill(
    mut lattice: Lattice,
    field: &impl Field,
    spacing: f64,
    thin: bool,
) -> Result<Stuffed, StuffError> {
    if !lattice.values.iter().any(|&value| value > 0.0) {
        return Err(StuffError::Empty(spacing));
    }
    lattice.warp(field);
    let mut mesh = stencils::fill(&lattice, field, thin);
    manifold::repair(&mut mesh);
    Ok(mesh)
}

/// Six times the signed volume of the tetrahedron `a b c d`.
pub(crate) fn volume6(a: [f64; 3], b: [f64; 3], c: [f64; 3], d: [f64; 3]) -> f64 {
    let [u, v, w] = [b, c, d].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
}
