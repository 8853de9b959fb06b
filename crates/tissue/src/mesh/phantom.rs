//! Analytic bodies for tests and demonstrations: a box and an ellipsoid.
//!
//! The box is a regular grid of cubes, each split into six tetrahedra along the
//! same diagonal, so that neighbours agree; the ellipsoid is stuffed.

use super::{Mesh, MeshError, boundary_faces};
use crate::stuffing::{Field, stuff};

/// A box of `size` mm with `cells` cubes an axis, its minimum corner at the origin. No set is filled.
pub fn regular_box(size: [f32; 3], cells: [usize; 3]) -> Result<Mesh, MeshError> {
    let [nx, ny, nz] = cells.map(|n| n.max(1));
    let index = |i: usize, j: usize, k: usize| (i + (nx + 1) * (j + (ny + 1) * k)) as u32;
    let mut positions = Vec::with_capacity((nx + 1) * (ny + 1) * (nz + 1));
    for k in 0..=nz {
        for j in 0..=ny {
            for i in 0..=nx {
                positions.push([
                    size[0] * i as f32 / nx as f32,
                    size[1] * j as f32 / ny as f32,
                    size[2] * k as f32 / nz as f32,
                ]);
            }
        }
    }
    let mut tets = Vec::with_capacity(6 * nx * ny * nz);
    for k in 0..nz {
        for j in 0..ny {
            for i in 0..nx {
                let corner = |c: usize| index(i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2));
                // Kuhn's subdivision: every tetrahedron runs from corner 0 to corner 7.
                for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                    tets.push([corner(0), corner(a), corner(b), corner(7)]);
                }
            }
        }
    }
    let surface = boundary_faces(&tets)?;
    let mesh = Mesh {
        name: "box".into(),
        source: format!("regular box {nx} x {ny} x {nz}, {size:?} mm"),
        license: "CC0-1.0".into(),
        positions,
        tets,
        surface,
        ..Mesh::default()
    };
    mesh.validate()?;
    Ok(mesh)
}

/// A box held at its bottom (`fixed`), touched on its top (`domain`), and held at its sides under `supported`.
pub fn box_phantom(size: [f32; 3], cells: [usize; 3]) -> Result<Mesh, MeshError> {
    let mut mesh = regular_box(size, cells)?;
    let tolerance = 1e-4 * size[2];
    for (node, p) in mesh.positions.iter().enumerate() {
        if p[2] <= tolerance {
            mesh.fixed.push(node as u32);
        } else if p[0] <= tolerance
            || p[0] >= size[0] - tolerance
            || p[1] <= tolerance
            || p[1] >= size[1] - tolerance
        {
            mesh.supported.push(node as u32);
        }
    }
    mesh.domain = rows_where(&mesh, |corners| {
        corners.iter().all(|p| p[2] >= size[2] - tolerance)
    });
    mesh.validate()?;
    Ok(mesh)
}

/// Positive inside: a distance for a sphere, close to one near the surface of an ellipsoid.
struct Ellipsoid {
    radii: [f64; 3],
}

impl Field for Ellipsoid {
    fn value(&self, point: [f64; 3]) -> f64 {
        let scaled: f64 = (0..3).map(|k| (point[k] / self.radii[k]).powi(2)).sum();
        (1.0 - scaled.sqrt()) * self.radii.iter().copied().fold(f64::INFINITY, f64::min)
    }

    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        (self.radii.map(|r| -r), self.radii)
    }
}

/// An ellipsoid with half axes `radii` mm about the origin, stuffed with `cells` lattice cells
/// across its shortest axis.
///
/// Held at the bottom cap (`fixed`); touched on the cap above 0.6 of the height
/// (`domain`); the rest of the lower half's surface is `supported`.
pub fn ellipsoid_phantom(radii: [f32; 3], cells: usize) -> Result<Mesh, MeshError> {
    let field = Ellipsoid {
        radii: radii.map(f64::from),
    };
    let shortest = radii.iter().copied().fold(f32::INFINITY, f32::min);
    let spacing = 2.0 * f64::from(shortest) / cells.max(2) as f64;
    let Ok(stuffed) = stuff(&field, spacing) else {
        return Err(MeshError::Empty { what: "tetrahedra" });
    };
    let surface = boundary_faces(&stuffed.tets)?;
    let mut mesh = Mesh {
        name: "ellipsoid".into(),
        source: format!("ellipsoid, half axes {radii:?} mm, {cells} cells an axis"),
        license: "CC0-1.0".into(),
        positions: stuffed
            .positions
            .iter()
            .map(|p| p.map(|v| v as f32))
            .collect(),
        tets: stuffed.tets,
        surface,
        ..Mesh::default()
    };
    let mut outside: Vec<u32> = mesh.surface.iter().flatten().copied().collect();
    outside.sort_unstable();
    outside.dedup();
    for node in outside {
        let height = mesh.positions[node as usize][2] / radii[2];
        if height < -0.7 {
            mesh.fixed.push(node);
        } else if height < 0.0 {
            mesh.supported.push(node);
        }
    }
    mesh.domain = rows_where(&mesh, |corners| {
        corners.iter().all(|p| p[2] >= 0.6 * radii[2])
    });
    mesh.validate()?;
    Ok(mesh)
}

fn rows_where(mesh: &Mesh, keep: impl Fn([[f32; 3]; 3]) -> bool) -> Vec<u32> {
    (0..mesh.surface.len() as u32)
        .filter(|row| keep(mesh.surface[*row as usize].map(|node| mesh.positions[node as usize])))
        .collect()
}
