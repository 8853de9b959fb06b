//! Equilibria of a cube whose ends are glued to plates, in f64: the plates are pulled apart, pressed together, or one slides along the other at its distance.
//!
//! Bricks of twenty nodes with eight points of integration, which do not lock where tissue is nearly incompressible as linear tetrahedra do; the laws are
//! those of [`elements`]. Cells are smaller towards plates and sides. Newton's method on the laws' tangent, from strain to strain. A quarter of a half of the
//! cube is solved where its ends are pulled, a half where they slide. The side is 1 mm, so that forces over it are stresses.

mod brick;
mod equilibrium;
mod grid;

use crate::axisymmetric::NoEquilibrium;
use crate::material::Material;
use equilibrium::Equilibrium;
use grid::Grid;

/// What the plates do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// They move apart or together, by a part of the cube's length.
    Pull,
    /// One slides along the other, by a part of the cube's length.
    Slide,
}

/// The side of the cube, mm.
const SIDE: f64 = 1.0;

/// The part of a cube that is solved.
struct Part {
    grid: Grid,
    /// Unknowns that are held, each with its motion at a strain of 1, mm.
    held: Vec<(usize, f64)>,
    /// The plate's nodes, the axis along which it moves, and how often the part stands in the cube.
    plate: Vec<usize>,
    axis: usize,
    share: f64,
}

impl Part {
    fn new(motion: Motion, cells: usize) -> Self {
        let half = 0.5 * SIDE;
        let whole = grid::lines(cells, half, true);
        let upper = grid::lines(cells, half, false);
        let (grid, axis, share) = match motion {
            Motion::Pull => (Grid::new([&upper, &upper, &upper]), 2, 4.0),
            Motion::Slide => (Grid::new([&whole, &upper, &whole]), 0, 2.0),
        };
        let mut held = Vec::new();
        let mut plate = Vec::new();
        for (node, place) in grid.places.iter().enumerate() {
            let is_plate = place[2].abs() == half;
            for k in 0..3 {
                // Planes of symmetry: all three where ends are pulled, that across y where they slide.
                let is_mirror = place[k] == 0.0 && (motion == Motion::Pull || k == 1);
                if is_plate {
                    held.push((3 * node + k, if k == axis { place[2] } else { 0.0 }));
                } else if is_mirror {
                    held.push((3 * node + k, 0.0));
                }
            }
            if place[2] == half {
                plate.push(node);
            }
        }
        Self {
            grid,
            held,
            plate,
            axis,
            share,
        }
    }
}

/// Nominal stress of a glued cube, Pa: the force that moves the plate, along its motion, over the area at rest, by strain. Strains go on from each other, in
/// steps of a few per cent; half of the cube has `cells` cells along each side.
///
/// # Errors
/// [`NoEquilibrium`] of a law that is not stable, or where cells fold; it says which part of the last strain was reached.
pub fn stresses(
    motion: Motion,
    material: &Material,
    strains: &[f64],
    cells: usize,
) -> Result<Vec<f64>, NoEquilibrium> {
    let part = Part::new(motion, cells);
    let mut body = Equilibrium::new(&part.grid, material.moduli(), &part.held);
    let last = strains.last().copied().unwrap_or(0.0);
    let mut reached = 0.0;
    let mut out = Vec::with_capacity(strains.len());
    for strain in strains {
        if !body.settle(*strain) {
            return Err(NoEquilibrium { reached });
        }
        reached = strain / last;
        let forces = part
            .plate
            .iter()
            .map(|node| body.force(3 * node + part.axis));
        out.push(part.share * forces.sum::<f64>() / (SIDE * SIDE));
    }
    Ok(out)
}

#[cfg(test)]
mod tests;
