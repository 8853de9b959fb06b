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
pub(crate) mod stuffed;

pub use field::{Field, GridField, HalfSpace, Offset};

use lattice::Lattice;
pub(crate) use stuffed::volume6;
pub use stuffed::{StuffError, Stuffed};

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
