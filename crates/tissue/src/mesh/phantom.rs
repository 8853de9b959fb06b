//! Analytic bodies for tests and demonstrations: a box and an ellipsoid.
//!
//! A regular grid of cubes, each split into six tetrahedra along the same
//! diagonal, so that neighbours agree; the ellipsoid is the cube under a smooth
//! map that keeps every element's orientation.

use super::{Mesh, MeshError, boundary_faces};

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

/// An ellipsoid with half axes `radii` mm about the origin, `cells` cells an axis.
///
/// Held at the bottom cap (`fixed`); touched on the cap above 0.6 of the height
/// (`domain`); the rest of the lower half's surface is `supported`.
pub fn ellipsoid_phantom(radii: [f32; 3], cells: usize) -> Result<Mesh, MeshError> {
    let mut mesh = regular_box([2.0; 3], [cells; 3])?;
    mesh.name = "ellipsoid".into();
    mesh.source = format!("ellipsoid, half axes {radii:?} mm, {cells} cells an axis");
    let mut unit = Vec::with_capacity(mesh.positions.len());
    for p in &mut mesh.positions {
        let q = p.map(|v| v - 1.0);
        // Maps the cube's shells to spheres (Nowell): smooth and one to one.
        let ball = [0, 1, 2].map(|k| {
            let (a, b) = (q[(k + 1) % 3], q[(k + 2) % 3]);
            q[k] * (1.0 - a * a / 2.0 - b * b / 2.0 + a * a * b * b / 3.0)
                .max(0.0)
                .sqrt()
        });
        // Soften towards the centre, where the plain cube has the better elements.
        let shell = q.iter().fold(0.0f32, |m, v| m.max(v.abs()));
        let blend = [0, 1, 2].map(|k| 0.85 * q[k] * (1.0 - shell) + ball[k] * shell);
        unit.push((blend, shell >= 1.0 - 1e-5));
        *p = [0, 1, 2].map(|k| blend[k] * radii[k]);
    }
    for (node, (p, outside)) in unit.iter().enumerate() {
        if *outside && p[2] < -0.7 {
            mesh.fixed.push(node as u32);
        } else if *outside && p[2] < 0.0 {
            mesh.supported.push(node as u32);
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
