//! Tissue that is stretched too far parts, across the direction in which it is.
//!
//! The largest principal stretch of a cell is the root of the largest eigenvalue of `C = F^T F`, with `F` from its corners now and at rest; the plane through
//! its middle across `F N`, with the eigenvector `N`, parts it as a blade there would.

use nalgebra::{Matrix3, Vector3};

use crate::body::{Body, Change};
use crate::rest::{cross, dot, length, minus};
use crate::room::push;
use crate::{Point, Sweep, TopologyError};

/// Half the side of what a cell's tear sweeps, of how far its corners lie from the middle: what is
/// touched at all parts, and a sweep of the whole cell would reach far into its neighbours.
const WIDE: f64 = 0.6;

/// A cell that is to part.
/// It names its cell by element and nodes and not by a place in a list, because earlier tears of
/// the same call may have divided the element.
struct Torn {
    stretch: f64,
    element: u32,
    nodes: [u32; 4],
    /// Unit direction of its largest stretch, as it is now.
    along: Point,
}

impl Body {
    /// Parts what is longer than `stretch` times its length at rest in some direction, the most stretched cells first, `most` of them at most;
    /// `positions` says where each node is now, copies included. Calls with the same `stroke` are one tear that goes on: what it has parted it does not part again.
    ///
    /// # Errors
    /// A stretch that is not above 1, positions of another number of nodes or not finite, more copies than there is room for; nothing has then changed.
    pub fn tear(
        &mut self,
        stretch: f64,
        most: usize,
        stroke: u32,
        positions: &[Point],
    ) -> Result<Change, TopologyError> {
        if !stretch.is_finite() || stretch <= 1.0 {
            return Err(TopologyError::Stretch { stretch });
        }
        self.check(positions)?;
        let mut torn = self.stretched(stretch, stroke, positions)?;
        // Element and nodes decide between equal stretches: an order without ties gives the same
        // tears everywhere.
        torn.sort_unstable_by(|a, b| {
            b.stretch
                .total_cmp(&a.stretch)
                .then((a.element, a.nodes).cmp(&(b.element, b.nodes)))
        });
        let (mut next, mut change) = (self.clone(), Change::default());
        // Positions with the copies that earlier tears of this call have made.
        let mut places = crate::room::copied(positions)?;
        let mut left = most;
        for one in torn {
            // What one cell's tear has parted or given other nodes is looked at in the next call, where the tissue has come to.
            let cells = next.cells(one.element);
            let is_there = (cells.iter()).any(|cell| {
                cell.is_alive && cell.nodes == one.nodes && cell.side_of(stroke).is_none()
            });
            if left == 0 || !is_there {
                continue;
            }
            let sweep = across(&one.nodes.map(|node| places[node as usize]), one.along)?;
            let own = next.cut_in_place(
                &sweep,
                (stroke, Some(one.element)),
                &places,
                &mut Vec::new(),
            )?;
            // A copy begins where its source is: a tear moves nothing.
            for &copied in &own.copied {
                let place = places[copied as usize];
                push(&mut places, place)?;
                push(&mut change.copied, copied)?;
            }
            for element in own.elements {
                push(&mut change.elements, element)?;
            }
            // A tear that has opened nothing does not count.
            left -= usize::from(own.area_mm2 > 0.0);
            change.area_mm2 += own.area_mm2;
        }
        change.elements.sort_unstable();
        change.elements.dedup();
        *self = next;
        Ok(change)
    }

    /// Living cells that are stretched by more than `stretch` and that `stroke` has not parted.
    fn stretched(
        &self,
        stretch: f64,
        stroke: u32,
        positions: &[Point],
    ) -> Result<Vec<Torn>, TopologyError> {
        let gradients = self.mesh().gradients()?;
        let mut found = Vec::new();
        // What an element's corners have moved against each other bounds its stretch, and ends the look at most of them.
        // With `F = I + D E^-1`, `D` the differences of displacements and `E` the edges at rest, no
        // stretch is above `1 + |D| |E^-1|` in Frobenius norms; the second factor is of the rest
        // shape alone.
        let may_be = |element: u32, nodes: [u32; 4]| {
            let rest = self.mesh().tet(element);
            let moved =
                |k: usize| minus(positions[nodes[k] as usize], self.mesh().position(rest[k]));
            let first = moved(0);
            let square = |k: usize| {
                let apart = minus(moved(k), first);
                dot(apart, apart)
            };
            let apart = (square(1) + square(2) + square(3)).sqrt();
            1.0 + apart * f64::from(gradients[element as usize]) > stretch
        };
        let mut look = |element: u32, nodes: [u32; 4]| -> Result<(), TopologyError> {
            let rest = self
                .mesh()
                .tet(element)
                .map(|node| self.mesh().position(node));
            let now = nodes.map(|node| positions[node as usize]);
            if may_be(element, nodes)
                && let Some((own, along)) = largest_stretch(rest, now, stretch)
            {
                let torn = Torn {
                    stretch: own,
                    element,
                    nodes,
                    along,
                };
                push(&mut found, torn)?;
            }
            Ok(())
        };
        for element in 0..self.mesh().element_count() as u32 {
            match self.cells.get(&element) {
                None => look(element, self.mesh().tet(element))?,
                Some(cells) => {
                    let is_open =
                        |cell: &&crate::Cell| cell.is_alive && cell.side_of(stroke).is_none();
                    for cell in cells.iter().filter(is_open) {
                        look(element, cell.nodes)?;
                    }
                }
            }
        }
        Ok(found)
    }
}

/// The largest principal stretch of a tetrahedron and its direction now; none where it is not above `least`.
fn largest_stretch(rest: [Point; 4], now: [Point; 4], least: f64) -> Option<(f64, Point)> {
    let edges = |[a, b, c, d]: [Point; 4]| {
        let columns = [b, c, d].map(|corner| Vector3::from(minus(corner, a)));
        Matrix3::from_columns(&columns)
    };
    let f = edges(now) * edges(rest).try_inverse()?;
    let c = f.transpose() * f;
    // No eigenvalue is above the largest sum of a row: most cells end here.
    let bound = (c.row_iter()).map(|row| row.iter().map(|x| x.abs()).sum::<f64>());
    if bound.fold(0.0, f64::max) <= least * least {
        return None;
    }
    // Costly beside the bounds, and reached by few cells.
    let eigen = c.symmetric_eigen();
    let place = eigen.eigenvalues.imax();
    let stretch = eigen.eigenvalues[place].sqrt();
    let along = (f * eigen.eigenvectors.column(place)).normalize();
    (stretch > least).then(|| (stretch, along.into()))
}

/// A square through the middle of a tetrahedron across a direction: it parts the cell, and those beside it that it reaches.
fn across(corners: &[Point; 4], along: Point) -> Result<Sweep, TopologyError> {
    let middle = crate::polygon::middle(corners);
    let least = [0, 1, 2]
        .into_iter()
        .min_by(|a, b| along[*a].abs().total_cmp(&along[*b].abs()));
    // The axis that the direction has least of: the cross product with it cannot vanish.
    let mut axis = [0.0; 3];
    axis[least.unwrap_or(0)] = 1.0;
    let side = cross(along, axis);
    let side = side.map(|x| x / length(side));
    let other = cross(along, side);
    let wide = corners.iter().map(|corner| {
        let away = minus(*corner, middle);
        dot(away, side).abs().max(dot(away, other).abs())
    });
    let wide = WIDE * wide.fold(0.0, f64::max);
    let at = |a: f64, b: f64| [0, 1, 2].map(|k| middle[k] + wide * (a * side[k] + b * other[k]));
    Sweep::new(&[
        vec![at(-1.0, -1.0), at(1.0, -1.0)],
        vec![at(-1.0, 1.0), at(1.0, 1.0)],
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RestMesh;
    use std::sync::Arc;

    /// Tetrahedra of any shape, turned and moved at random.
    #[test]
    fn the_bound_leaves_out_no_cell_that_is_stretched() {
        let mut seed = 5u64;
        let mut draw = || {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (seed >> 40) as f32 / (1u64 << 24) as f32
        };
        let mut positions = Vec::new();
        let mut tets = Vec::new();
        while tets.len() < 3000 {
            let first = positions.len() as u32;
            let corners = [(); 4].map(|()| [(); 3].map(|()| 10.0 * draw()));
            let [a, b, c, d] = corners.map(|corner| corner.map(f64::from));
            if dot(cross(minus(b, a), minus(c, a)), minus(d, a)) > 1.0 {
                positions.extend(corners);
                tets.push([first, first + 1, first + 2, first + 3]);
            }
        }
        let body = Body::new(Arc::new(RestMesh::new(&positions, &tets).unwrap()));
        let places: Vec<Point> = (positions.iter())
            .map(|at| at.map(|x| f64::from(x) + 2.0 * f64::from(draw())))
            .collect();
        let of = |element: u32| {
            let nodes = body.mesh().tet(element);
            let rest = nodes.map(|node| body.mesh().position(node));
            largest_stretch(rest, nodes.map(|node| places[node as usize]), 1.3)
        };
        let all = (0..3000).filter(|element| of(*element).is_some()).count();
        assert!(all > 100 && all < 2900, "{all}");
        assert_eq!(body.stretched(1.3, 0, &places).unwrap().len(), all);
    }
}
