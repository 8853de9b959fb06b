//! An aspirator takes material: each element has 64 fixed points, and a cell keeps the share of those that are left.

use std::sync::OnceLock;

use crate::body::{Body, Cell, Change, place};
use crate::elements::LEAST_SHARE;
use crate::elements::filled;
use crate::polytope::{Polytope, Weights};
use crate::room::{collected, push};
use crate::{Point, TopologyError};

/// A cell of which less is left, as a part of its element, goes. It is [`LEAST_SHARE`] of an element: of a node that hangs by a fiftieth, a tool that touched
/// it made a step of 50 mm.
pub const LEAST_LEFT: f64 = LEAST_SHARE;

impl Body {
    /// Takes what lies where `depth` is positive, the deepest first, up to `most_mm3`; `positions` says where each node is now, copies included. `depth` must
    /// not change by more than a millimetre a millimetre. Cells of which next to
    /// nothing is left go, and nodes part where tissue hung by an edge or a point.
    ///
    /// # Errors
    /// A volume or a position that is not a number, nothing left, no room for copies; nothing has then changed.
    /// Volume is counted by points, so what is taken is right to half a point of the last cell.
    pub fn remove(
        &mut self,
        depth: impl Fn(Point) -> f64,
        most_mm3: f64,
        positions: &[Point],
    ) -> Result<Change, TopologyError> {
        self.check(positions)?;
        if most_mm3.is_nan() {
            return Err(TopologyError::NotFinite {
                field: "most_mm3",
                index: 0,
            });
        }
        let mut found = Vec::new();
        let depths = collected(positions.len(), positions.iter().map(|at| depth(*at)))?;
        let mut cut = self.cells.keys().peekable();
        for element in 0..self.mesh().element_count() as u32 {
            let is_whole = cut.next_if_eq(&&element).is_none();
            // A bound by the corners' depths spares the look at 64 points of most elements.
            if is_whole && is_outside(self.mesh().tet(element), positions, &depths) {
                continue;
            }
            let cells = self.cells(element);
            for (index, (cell, share)) in cells.iter().zip(filled(&cells)).enumerate() {
                if cell.is_alive {
                    self.inside((element, index, cell), share, &depth, positions, &mut found)?;
                }
            }
        }
        // The key decides between equal depths, so that the same points go on every machine.
        found.sort_unstable_by(|a, b| (b.depth.total_cmp(&a.depth)).then(a.key().cmp(&b.key())));
        // All that follows may fail, and works on a copy.
        let mut next = self.clone();
        let mut change = Change::default();
        let mut taken = 0.0;
        for point in found {
            // Rounded to the nearest number of points: one is taken if at least half of it is
            // within what may be taken.
            if taken + 0.5 * point.volume > most_mm3 {
                break;
            }
            let whole = self.mesh().volume(point.element);
            let cell = &mut next.cells_mut(point.element)[point.cell];
            if !cell.is_alive {
                continue;
            }
            // At least 1: the point that is taken here is among them.
            let before = cell.points_left();
            cell.gone |= 1 << point.at;
            cell.kept *= f64::from(before - 1) / f64::from(before);
            taken += point.volume;
            let left = cell.share * cell.kept;
            if left < LEAST_LEFT {
                cell.is_alive = false;
                taken += left * whole;
            }
            push(&mut change.elements, point.element)?;
        }
        change.elements.sort_unstable();
        change.elements.dedup();
        next.account(self, &mut change);
        if next.is_nothing() {
            return Err(TopologyError::NothingLeft);
        }
        next.part_nodes(&mut change)?;
        *self = next;
        Ok(change)
    }

    /// Drops cells, by element and place in its list.
    ///
    /// # Errors
    /// Nothing left, no room for copies; nothing has then changed.
    pub fn drop_cells(&mut self, cells: &[(u32, u32)]) -> Result<Change, TopologyError> {
        let mut next = self.clone();
        let mut change = Change::default();
        for &(element, index) in cells {
            if let Some(cell) = next.cells_mut(element).get_mut(index as usize) {
                cell.is_alive = false;
                push(&mut change.elements, element)?;
            }
        }
        if next.is_nothing() {
            return Err(TopologyError::NothingLeft);
        }
        change.elements.sort_unstable();
        change.elements.dedup();
        next.account(self, &mut change);
        next.part_nodes(&mut change)?;
        *self = next;
        Ok(change)
    }

    /// What has been lost since `before`.
    fn account(&self, before: &Body, change: &mut Change) {
        let elements = change.elements.iter();
        let lost = elements.map(|element| before.volume_of(*element) - self.volume_of(*element));
        change.removed_mm3 = lost.sum();
    }

    /// A body without tissue has no step: whoever removes the last of it gets an error and keeps
    /// the body.
    fn is_nothing(&self) -> bool {
        let is_dead = |cells: &Vec<Cell>| cells.iter().all(|cell| !cell.is_alive);
        self.cells.len() == self.mesh().element_count() && self.cells.values().all(is_dead)
    }

    /// The points of a cell that are left and lie deep.
    fn inside(
        &self,
        (element, index, cell): (u32, usize, &Cell),
        share: f64,
        depth: &impl Fn(Point) -> f64,
        positions: &[Point],
        found: &mut Vec<Inside>,
    ) -> Result<(), TopologyError> {
        let corners = cell.nodes.map(|node| positions[node as usize]);
        let left = f64::from(cell.points_left().max(1));
        let volume = share * self.mesh().volume(element) / left;
        // A sphere around the element that lies outside needs no points: depth falls by at most a millimetre a millimetre.
        let middle = place(&[0.25; 4], &corners);
        let reach = corners
            .iter()
            .map(|at| crate::rest::length(crate::rest::minus(*at, middle)));
        if depth(middle) <= -reach.fold(0.0, f64::max) {
            return Ok(());
        }
        for (at, weights) in points().iter().enumerate() {
            if cell.points & !cell.gone & (1 << at) == 0 {
                continue;
            }
            let depth = depth(place(weights, &corners));
            if depth > 0.0 {
                let point = Inside {
                    depth,
                    element,
                    cell: index,
                    at: at as u32,
                    volume,
                };
                push(found, point)?;
            }
        }
        Ok(())
    }
}

/// Whether depth at its first corner says that no point of an element is deep: depth changes by at most a millimetre a millimetre.
fn is_outside([first, rest @ ..]: [u32; 4], positions: &[Point], depths: &[f64]) -> bool {
    let (own, depth) = (positions[first as usize], depths[first as usize]);
    let squares = rest.map(|node| {
        let way = crate::rest::minus(positions[node as usize], own);
        crate::rest::dot(way, way)
    });
    depth < 0.0 && squares.iter().all(|square| *square <= depth * depth)
}

/// A point to be taken.
/// Depth in mm, and the volume that the point stands for, mm³.
struct Inside {
    depth: f64,
    element: u32,
    cell: usize,
    at: u32,
    volume: f64,
}

impl Inside {
    fn key(&self) -> (u32, usize, u32) {
        (self.element, self.cell, self.at)
    }
}

/// Which of the fixed points lie in a polytope; the one nearest to its middle where it holds none.
/// A part that holds none would weigh something and have nothing that could be removed.
pub(crate) fn points_in(polytope: &Polytope) -> u64 {
    let mut mask = 0;
    for (at, point) in points().iter().enumerate() {
        mask |= u64::from(polytope.holds(point)) << at;
    }
    if mask == 0 {
        let middle = polytope.middle();
        let off = |point: &Weights| (0..4).map(|k| (point[k] - middle[k]).powi(2)).sum::<f64>();
        let nearest = (points().iter().enumerate()).min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
        mask = 1 << nearest.map_or(0, |(at, _)| at);
    }
    mask
}

/// 64 points of a tetrahedron, evenly: the middles of its 64 parts by halving edges twice.
/// They are 64 because the points of a cell are the bits of a `u64`.
fn points() -> &'static [Weights; 64] {
    static POINTS: OnceLock<[Weights; 64]> = OnceLock::new();
    POINTS.get_or_init(|| {
        let corner =
            |at: usize| -> Weights { std::array::from_fn(|k| f64::from(u8::from(k == at))) };
        let mut parts = vec![[0, 1, 2, 3].map(corner)];
        for _ in 0..2 {
            parts = parts.iter().flat_map(eighths).collect();
        }
        std::array::from_fn(|at| crate::polygon::middle(&parts[at]))
    })
}

/// A tetrahedron halved along its edges.
fn eighths([a, b, c, d]: &[Weights; 4]) -> [[Weights; 4]; 8] {
    let half =
        |p: &Weights, q: &Weights| -> Weights { std::array::from_fn(|k| 0.5 * (p[k] + q[k])) };
    let [ab, ac, ad] = [half(a, b), half(a, c), half(a, d)];
    let [bc, bd, cd] = [half(b, c), half(b, d), half(c, d)];
    [
        [*a, ab, ac, ad],
        [ab, *b, bc, bd],
        [ac, bc, *c, cd],
        [ad, bd, cd, *d],
        [ab, bc, ac, bd],
        [ab, ac, ad, bd],
        [ac, bc, cd, bd],
        [ac, ad, cd, bd],
    ]
}
