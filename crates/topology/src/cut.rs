//! A blade passes: touched elements become cells on both sides of it.
//!
//! Of each stroke a node has one signed distance from the blade, linear in each element, fixed once used: so neighbours see the same
//! line on their common face, whatever the blade's form.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::blade::Blade;
use crate::body::{Body, Cell, Change, place};
use crate::polygon::middle;
use crate::polytope::{Polytope, Side, Weights};
use crate::push::Opened;
use crate::rest::{length, minus};
use crate::room::{push, room};
use crate::{Point, Sweep, TopologyError};

/// A node nearer to the blade than this part of the edges around it is put onto it.
pub const SNAP: f64 = 0.1;
/// An element is touched where the blade has passed more than this part of its cut.
const TOUCHED: f64 = 0.01;
/// A part of an element that is smaller than this is nothing.
const LEAST_SHARE: f64 = 1e-9;

impl Body {
    /// Cuts along a sweep; `positions` says where each node is now, copies included. Calls with the same `stroke` are one blade that goes on: what it
    /// has parted it does not part again.
    ///
    /// # Errors
    /// Positions of another number of nodes or not finite, more copies than there is room for; nothing has then changed.
    pub fn cut(
        &mut self,
        sweep: &Sweep,
        stroke: u32,
        positions: &[Point],
    ) -> Result<Change, TopologyError> {
        self.cut_with(&Blade::default(), sweep, stroke, positions)
    }

    /// As [`Body::cut`], and not whole where it fails; the element `torn` parts wherever its nodes have the cut, though the sweep does not reach it there.
    pub(crate) fn cut_in_place(
        &mut self,
        sweep: &Sweep,
        (stroke, torn): (u32, Option<u32>),
        positions: &[Point],
        parts: &mut Vec<Opened>,
    ) -> Result<Change, TopologyError> {
        let mut opened = self.opened.remove(&stroke).unwrap_or_default();
        let mut distances = self.strokes.remove(&stroke).unwrap_or_default();
        let mut change = Change::default();
        let mut fixed = Vec::new();
        let near = self.near(sweep, positions)?;
        // A blade that goes back within its stroke turns its strip over. Without the sign, nodes
        // that it passes now would have their distances from the other side, and one cut would have
        // both signs.
        let turned = self.is_turned(sweep, positions, &near, &distances);
        let sign = if turned { -1.0 } else { 1.0 };
        for element in near {
            // The cells as they were when the call began: halves that are made here are not met
            // again.
            let mut cells = self.cells(element).into_owned();
            let mut parted = Vec::with_capacity(2 * cells.len());
            let mut is_touched = false;
            // What a blade goes over again is not new once all of its cut through the element is open, and many small pieces of a way touch as one
            // long one does.
            let before = opened.get(&element).copied().unwrap_or(0.0);
            let mut all = 0.0;
            for cell in cells.drain(..) {
                let corners = cell.nodes.map(|node| positions[node as usize]);
                let distance: Weights = std::array::from_fn(|corner| {
                    let node = cell.nodes[corner];
                    // The first distance of a node stands for the whole stroke: another one now
                    // would move the cut on faces that have been parted already.
                    (distances.get(&node).copied())
                        .unwrap_or_else(|| sign * self.distance(sweep, node, corners[corner]))
                });
                let edge = longest(&corners);
                let met = match cell.is_alive {
                    true => meet(&cell, &distance, stroke),
                    false => None,
                };
                let Some(met) = met else {
                    parted.push(cell);
                    continue;
                };
                let points: Vec<Point> = (met.cut.iter()).map(|at| place(at, &corners)).collect();
                let whole = length(crate::polygon::normal(&points));
                let area = match torn == Some(element) {
                    true => whole,
                    false => sweep.overlap(&points, edge),
                };
                // Both sides have the cut; it is counted once.
                if met.counts && area > 0.0 {
                    all += whole;
                    let entry = opened.entry(element).or_default();
                    // All that a stroke opens in an element is at most its whole cut through it,
                    // however often the strip passes there.
                    let new = area.min(all - *entry).max(0.0);
                    *entry += new;
                    change.area_mm2 += new;
                    // What its stroke has laid open before, the blade does not feel: nothing has then changed.
                    if new > 0.0 {
                        let at = middle(&met.cut);
                        let part = Opened {
                            element,
                            at,
                            area_mm2: new,
                        };
                        push(parts, part)?;
                    }
                }
                if area <= 0.0 || before + area <= TOUCHED * whole {
                    parted.push(cell);
                    continue;
                }
                // Distances are fixed at the nodes of touched cells alone. A node that the blade
                // has only come near may get another one when the stroke goes on.
                for pair in cell.nodes.into_iter().zip(distance) {
                    push(&mut fixed, pair)?;
                }
                if met.cells.is_empty() {
                    parted.push(cell);
                } else {
                    is_touched = true;
                    parted.extend(met.cells);
                }
            }
            if is_touched {
                push(&mut change.elements, element)?;
                *self.cells_mut(element) = parted;
            }
        }
        // Only now, so that all elements of this call have read the same distances.
        distances.extend(fixed);
        self.strokes.insert(stroke, distances);
        self.opened.insert(stroke, opened);
        // Cells first, nodes after: which cells are joined is known only when all of them have been
        // made.
        self.part_nodes(&mut change)?;
        Ok(change)
    }

    /// Elements whose box meets that of the sweep.
    fn near(&self, sweep: &Sweep, positions: &[Point]) -> Result<Vec<u32>, TopologyError> {
        let [low, high] = sweep.bounds();
        let meets = |nodes: [u32; 4]| {
            let corners = nodes.map(|node| positions[node as usize]);
            // Nodes near the blade count as on it.
            let more = 2.0 * SNAP * longest(&corners);
            (0..3).all(|k| {
                let is_below = corners.iter().any(|at| at[k] <= high[k] + more);
                is_below && corners.iter().any(|at| at[k] >= low[k] - more)
            })
        };
        // Cheaper, and true of all of these and some others: no edge is longer than the box of its element is wide in all. Where an element may meet the sweep
        // its coordinates are as large as the sweep's, its own width, or both; so is what f32 rounds off them.
        let mut rounded = room(positions.len())?;
        rounded.extend(
            positions
                .iter()
                .map(|at| [at[0] as f32, at[1] as f32, at[2] as f32, 0.0]),
        );
        let [least_of_sweep, most_of_sweep] =
            [low, high].map(|at| [at[0] as f32, at[1] as f32, at[2] as f32, 0.0]);
        let largest = low
            .iter()
            .chain(&high)
            .fold(0.0f64, |most, x| most.max(x.abs()));
        let rounding = 16.0 * f32::EPSILON * largest as f32;
        let may_meet = |nodes: [u32; 4]| {
            let [a, b, c, d] = nodes.map(|node| rounded[node as usize]);
            let least = lower(lower(a, b), lower(c, d));
            let most = higher(higher(a, b), higher(c, d));
            let wide: [f32; 4] = std::array::from_fn(|k| most[k] - least[k]);
            let more = (2.0 * SNAP as f32 + 1e-3) * (wide[0] + wide[1] + wide[2]) + rounding;
            // How far it lies outside: of all elements but a few more than its margin.
            let outside: [f32; 4] = std::array::from_fn(|k| {
                let (over, under) = (least[k] - most_of_sweep[k], least_of_sweep[k] - most[k]);
                if over > under { over } else { under }
            });
            (outside[0] <= more) & (outside[1] <= more) & (outside[2] <= more)
        };
        let mut near = Vec::new();
        let mut cut = self.cells.iter().peekable();
        for element in 0..self.mesh().element_count() as u32 {
            let is_near = match cut.next_if(|(own, _)| **own == element) {
                Some((_, cells)) => cells.iter().any(|cell| meets(cell.nodes)),
                None => {
                    let nodes = self.mesh().tet(element);
                    may_meet(nodes) && meets(nodes)
                }
            };
            if is_near {
                push(&mut near, element)?;
            }
        }
        Ok(near)
    }

    /// Whether a sweep has its positive side where the stroke before it had the negative one, as one that goes back does.
    fn is_turned(
        &self,
        sweep: &Sweep,
        positions: &[Point],
        near: &[u32],
        distances: &BTreeMap<u32, f64>,
    ) -> bool {
        let mut sum = 0.0;
        for element in near {
            for node in self.cells(*element).iter().flat_map(|cell| cell.nodes) {
                if let Some(own) = distances.get(&node).filter(|own| **own != 0.0) {
                    sum += own * self.distance(sweep, node, positions[node as usize]);
                }
            }
        }
        sum < 0.0
    }

    /// Of a node from the blade: 0 where it is near.
    fn distance(&self, sweep: &Sweep, node: u32, at: Point) -> f64 {
        let own = sweep.distance(at);
        match own.abs() < SNAP * self.mesh().edge_length(self.parent(node)) {
            true => 0.0,
            false => own,
        }
    }
}

/// How a blade meets a cell.
/// Polygons are in barycentric coordinates of the element, so they hold however the tissue has been
/// deformed.
struct Met {
    /// Where: the polygon of the cut.
    cut: Vec<Weights>,
    /// What becomes of the cell; nothing where the stroke has parted it before.
    cells: Vec<Cell>,
    /// Whether the area counts here. Both sides of a cut that is there already have the same
    /// polygon, and only the positive one counts it.
    counts: bool,
}

/// `None` where the blade's surface does not go through the cell, or only along an edge.
fn meet(cell: &Cell, distance: &Weights, stroke: u32) -> Option<Met> {
    let material = cell.material();
    if let Some(positive) = cell.side_of(stroke) {
        // The stroke has been here: nothing is parted again. Its cut is still measured, because the
        // blade may have passed a part of it only.
        let own = |(side, _): &&(Side, Vec<Weights>)| *side == Side::Cut { stroke, positive };
        let face = material.faces.iter().find(own).map(|(_, points)| points);
        let cut = match face {
            Some(points) => points.clone(),
            None => face_on_plane(material, distance)?,
        };
        return Some(Met {
            cut,
            cells: Vec::new(),
            counts: positive,
        });
    }
    let [low, high] = material.range(distance);
    if low < 0.0 && high > 0.0 {
        let parts = [true, false].map(|positive| material.part(distance, stroke, positive));
        if let [Some(above), Some(below)] = parts {
            let whole: f64 = material.share();
            let part = above.share() / whole;
            // A sliver could not be told from rounding: the cell is not divided, and below it is at
            // most marked as lying on one side.
            if (LEAST_SHARE..=1.0 - LEAST_SHARE).contains(&(cell.share * part)) {
                let (_, cut) = above.faces.last()?;
                let cut = cut.clone();
                let shares = [cell.share * part, cell.share - cell.share * part];
                let sides = [(true, above), (false, below)];
                let halves = sides.into_iter().zip(shares);
                let cells = halves.map(|((positive, part), share)| {
                    let mut half = cell.clone();
                    half.sides.push((stroke, positive));
                    // What has been removed (`gone`) stays as it was for the whole cell; which of
                    // these points count for this half is said by its material.
                    half.points = crate::remove::points_in(&part);
                    half.share = share;
                    half.polytope = Some(Arc::new(part));
                    half
                });
                let mut cells: Vec<Cell> = cells.collect();
                divide_removed(cell, &mut cells);
                return Some(Met {
                    cut,
                    cells,
                    counts: true,
                });
            }
        }
    }
    // A face of it lies on the blade: the cell is on one side, and is parted from what is on the other.
    let cut = face_on_plane(material, distance)?;
    // The larger part decides: the smaller one is rounding, or nothing.
    let positive = high > -low;
    let mut marked = cell.clone();
    marked.sides.push((stroke, positive));
    Some(Met {
        cut,
        cells: vec![marked],
        counts: positive,
    })
}

/// What has been removed of a cell is missing in its halves, by the points that they have lost.
fn divide_removed(cell: &Cell, halves: &mut [Cell]) {
    if cell.gone == 0 {
        return;
    }
    let left = |half: &Cell| f64::from(half.points_left()) / f64::from(half.points.count_ones());
    let sum: f64 = halves.iter().map(|half| half.share * left(half)).sum();
    for half in halves {
        half.kept = match sum > 0.0 {
            true => left(half) * cell.share * cell.kept / sum,
            false => cell.kept,
        };
        half.is_alive = half.kept > 0.0;
    }
}

/// The face of a polytope that lies on the plane of a cut.
fn face_on_plane(material: &Polytope, distance: &Weights) -> Option<Vec<Weights>> {
    let largest = distance.iter().fold(0.0f64, |most, d| most.max(d.abs()));
    let value = |at: &Weights| (0..4).map(|k| at[k] * distance[k]).sum::<f64>();
    let lies = |points: &[Weights]| points.iter().all(|at| value(at).abs() <= 1e-9 * largest);
    let mut faces = material.faces.iter();
    let found = faces.find(|(_, points)| lies(points));
    found.map(|(_, points)| points.clone())
}

/// The smaller of each pair of numbers; comparisons alone, which compile to one instruction for all four.
fn lower(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|k| if a[k] < b[k] { a[k] } else { b[k] })
}

/// The larger, likewise.
fn higher(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    std::array::from_fn(|k| if a[k] > b[k] { a[k] } else { b[k] })
}

/// Longest edge of a cell as it is now, mm: what [`Sweep::overlap`] and the margin of a box measure
/// by.
fn longest(corners: &[Point; 4]) -> f64 {
    let ends = (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b)));
    let lengths = ends.map(|(a, b)| length(minus(corners[a], corners[b])));
    lengths.fold(0.0, f64::max)
}
