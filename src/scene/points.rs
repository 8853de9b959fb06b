//! Points attached to the tissue: each is a fixed barycentric combination `sum_i w_i u_i` of the nodes of the tetrahedron
//! around it. Where a network decodes, its own course inside of the tetrahedron is added, `N(p) - sum_i w_i N(p_i)`: at a
//! node a point moves with the node, boundary conditions included. A point outside of the mesh takes the closest combination of the nearest tetrahedra, weights clamped to `[0, 1]`; one
//! that is [`REACH`] or more away is refused, because a mesh in other axes or units is a mistake, not a surface.

use topology::Body;
use topology::surface::{NONE, Vertex};

use crate::bundle::Mesh;
use crate::error::{Error, Result};
use crate::field::check;
use crate::grid::PointGrid;
use crate::memory::{self, HeldBytes};

/// Farthest that an attached point may lie outside of the mesh, mm.
pub const REACH: f64 = 25.0;

const WHAT: &str = "attached points";

/// Most points that can be attached: they are counted in 32 bits, and each costs a row of the decoder.
const MOST_POINTS: u64 = 1 << 27;

/// A number of points that a host can mean: asked before its array is touched.
///
/// # Errors
/// [`Error::Argument`].
pub fn check_point_count(count: u64) -> Result<()> {
    if count <= MOST_POINTS {
        return Ok(());
    }
    Err(Error::Argument(format!(
        "count is {count} points; at most {MOST_POINTS} can be attached"
    )))
}

/// Attached points.
#[derive(Debug, Clone, Default, HeldBytes)]
pub struct AttachedPoints {
    /// Each point's tetrahedron of the intact mesh.
    tets: Vec<u32>,
    /// Its corners, or those of the part of it in which the point lies, and their weights: a point's displacement is that mean of its corners'.
    nodes: Vec<[u32; 4]>,
    weights: Vec<[f32; 4]>,
    /// Where the network is asked, `[n,3]` rest mm: the point, or for one outside of the mesh the closest combination.
    places: Vec<f32>,
    /// The decoder's query rows of the places `[n,2h]`, and `0..n`; empty where nothing is added.
    queries: Vec<f32>,
    rows: Vec<u32>,
}

/// A point this close to its combination is inside of the mesh, mm.
const INSIDE: f64 = 1e-3;

impl AttachedPoints {
    /// Finds the tetrahedra of points `[n,3]`, rest mm.
    pub fn new(mesh: &Mesh, points: &[f32]) -> Result<AttachedPoints> {
        if !points.len().is_multiple_of(3) {
            return Err(Error::Argument(format!(
                "points has {} floats, must have 3 per point",
                points.len()
            )));
        }
        for (at, point) in points.chunks_exact(3).enumerate() {
            check("points", at, point)?;
        }
        let finder = TetFinder::new(mesh)?;
        let count = points.len() / 3;
        let mut attached = AttachedPoints {
            tets: memory::room(count, WHAT)?,
            nodes: memory::room(count, WHAT)?,
            weights: memory::room(count, WHAT)?,
            places: memory::room(3 * count, WHAT)?,
            ..AttachedPoints::default()
        };
        for (index, p) in points.chunks_exact(3).enumerate() {
            let (tet, weights, miss) = finder.locate([p[0], p[1], p[2]]);
            let nodes = [0, 1, 2, 3].map(|k| mesh.tets[4 * tet as usize + k]);
            if miss >= REACH {
                return Err(Error::Argument(format!(
                    "points: point {index} at ({}, {}, {}) lies {miss:.0} mm outside the mesh; check axes (RAS) and units (mm)",
                    p[0], p[1], p[2]
                )));
            }
            if miss < INSIDE {
                attached.places.extend_from_slice(p);
            } else {
                attached.places.extend((0..3).map(|axis| {
                    let combination = (0..4).map(|k| weights[k] * mesh.position(nodes[k])[axis]);
                    combination.sum::<f32>()
                }));
            }
            attached.tets.push(tet);
            attached.nodes.push(nodes);
            attached.weights.push(weights);
        }
        Ok(attached)
    }

    /// The same points in a body that the mesh has been cut to, or in the intact one: each goes with the part of its tetrahedron in which it lies.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn following(&self, mesh: &Mesh, body: Option<&Body>) -> Result<AttachedPoints> {
        let places = self.tets.iter().zip(&self.weights);
        let nodes = places.map(|(&tet, weights)| match body {
            Some(body) => body.nodes_at(tet, &weights.map(f64::from)),
            None => [0, 1, 2, 3].map(|k| mesh.tets[4 * tet as usize + k]),
        });
        Ok(AttachedPoints {
            nodes: memory::collected(self.tets.len(), nodes, WHAT)?,
            tets: memory::copied(&self.tets, WHAT)?,
            weights: memory::copied(&self.weights, WHAT)?,
            places: memory::copied(&self.places, WHAT)?,
            queries: memory::copied(&self.queries, WHAT)?,
            rows: memory::copied(&self.rows, WHAT)?,
        })
    }

    /// Points at fixed weights on nodes, such as the vertices of a surface: up to four nodes each, [`NONE`] for less.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn on_nodes(vertices: &[Vertex]) -> Result<AttachedPoints> {
        let all = |vertex: &Vertex| {
            vertex
                .nodes
                .map(|node| if node == NONE { vertex.nodes[0] } else { node })
        };
        let nodes = vertices.iter().map(all);
        let weights = vertices.iter().map(|vertex| {
            [0, 1, 2, 3].map(|k| {
                if vertex.nodes[k] == NONE {
                    0.0
                } else {
                    vertex.weights[k] as f32
                }
            })
        });
        Ok(AttachedPoints {
            nodes: memory::collected(vertices.len(), nodes, WHAT)?,
            weights: memory::collected(vertices.len(), weights, WHAT)?,
            ..AttachedPoints::default()
        })
    }

    /// Of each point the corners of its tetrahedron and their weights.
    pub(super) fn corners(&self) -> impl Iterator<Item = ([u32; 4], [f32; 4])> {
        self.nodes.iter().copied().zip(self.weights.iter().copied())
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// All nodes that the points need.
    pub fn needed_nodes(&self) -> &[u32] {
        self.nodes.as_flattened()
    }

    /// Where a network is evaluated, `[n,3]`, rest mm.
    pub fn places(&self) -> &[f32] {
        &self.places
    }

    /// Takes the decoder's query rows of [`AttachedPoints::places`].
    pub fn set_queries(&mut self, queries: Vec<f32>) -> Result<()> {
        let count = self.nodes.len();
        self.rows = memory::collected(count, 0..count as u32, WHAT)?;
        self.queries = queries;
        Ok(())
    }

    /// Query rows and their list; both empty where points are interpolated only.
    pub fn queries(&self) -> (&[f32], &[u32]) {
        (&self.queries, &self.rows)
    }

    /// Adds `factor` times the interpolation of a field `[K,3]` to `out [n,3]`.
    pub fn add_interpolated(&self, factor: f32, field: &[f32], out: &mut [f32]) {
        for ((nodes, weights), out) in self
            .nodes
            .iter()
            .zip(&self.weights)
            .zip(out.chunks_exact_mut(3))
        {
            for axis in 0..3 {
                out[axis] += factor
                    * ((weights[0] * field[3 * nodes[0] as usize + axis]
                        + weights[1] * field[3 * nodes[1] as usize + axis])
                        + (weights[2] * field[3 * nodes[2] as usize + axis]
                            + weights[3] * field[3 * nodes[3] as usize + axis]));
            }
        }
    }
}

/// Tetrahedra by the grid of their centres.
struct TetFinder<'a> {
    /// Positions and tetrahedra at rest.
    mesh: &'a Mesh,
    /// Centres of the tetrahedra, numbered as these.
    centres: PointGrid,
    /// The largest distance of a corner from its tetrahedron's centre, mm: what holds a point has
    /// its centre no farther than this from it.
    reach: f64,
}

impl<'a> TetFinder<'a> {
    fn new(mesh: &'a Mesh) -> Result<TetFinder<'a>> {
        let mut centres = memory::room(3 * mesh.tets.len() / 4, WHAT)?;
        let mut reach = 0.0f64;
        for tet in mesh.tets.chunks_exact(4) {
            let corners = [0, 1, 2, 3].map(|k| mesh.position(tet[k]));
            let centre = [0, 1, 2]
                .map(|a| (corners[0][a] + corners[1][a] + corners[2][a] + corners[3][a]) / 4.0);
            for corner in corners {
                reach = reach.max(crate::grid::squared_distance(centre, corner));
            }
            centres.extend_from_slice(&centre);
        }
        Ok(TetFinder {
            mesh,
            centres: PointGrid::try_new(centres)?,
            reach: reach.sqrt(),
        })
    }

    /// The tetrahedron that holds `p`, or the one whose clamped combination comes closest to it.
    fn locate(&self, p: [f32; 3]) -> (u32, [f32; 4], f64) {
        let mut best: Option<(f64, u32, [f64; 4])> = None;
        // A little more, so that rounding leaves out no tetrahedron that just reaches the point.
        let mut radius = self.reach * (1.0 + 1e-6);
        loop {
            self.centres.within(p, radius, |tet, _| {
                let weights = clamp(self.barycentric(tet, p));
                let miss = self.miss(tet, weights, p);
                // Of equal misses the lowest number wins: on a shared face the order in which the
                // grid is walked must not decide.
                if best.is_none_or(|(d, t, _)| (miss, tet) < (d, t)) {
                    best = Some((miss, tet, weights));
                }
            });
            if let Some((miss, tet, weights)) = best {
                return (tet, weights.map(|w| w as f32), miss.sqrt());
            }
            // Nothing within reach, so the point lies outside. The tetrahedron with the nearest
            // centre is no farther than its farthest corner; one that comes closer has its centre
            // within that distance plus the reach.
            let nearest = self.centres.nearest(p);
            let tet = &self.mesh.tets[4 * nearest as usize..4 * nearest as usize + 4];
            radius = tet
                .iter()
                .map(|&node| crate::grid::squared_distance(p, self.mesh.position(node)).sqrt())
                .fold(0.0, f64::max)
                + self.reach;
        }
    }

    /// `w` with `p = sum w_i x_i` and `sum w_i = 1`, by Cramer's rule: each weight is the volume of
    /// the tetrahedron with `p` in the place of that corner over the whole volume. Outside some are
    /// negative.
    fn barycentric(&self, tet: u32, p: [f32; 3]) -> [f64; 4] {
        let corners =
            [0, 1, 2, 3].map(|k| self.mesh.position(self.mesh.tets[4 * tet as usize + k]));
        let edge = |k: usize| [0, 1, 2].map(|a| corners[k][a] as f64 - corners[0][a] as f64);
        let (a, b, c) = (edge(1), edge(2), edge(3));
        let d = [0, 1, 2].map(|axis| p[axis] as f64 - corners[0][axis] as f64);
        let det = |x: [f64; 3], y: [f64; 3], z: [f64; 3]| {
            x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0])
                + x[2] * (y[0] * z[1] - y[1] * z[0])
        };
        let volume = det(a, b, c);
        let (wa, wb, wc) = (
            det(d, b, c) / volume,
            det(a, d, c) / volume,
            det(a, b, d) / volume,
        );
        [1.0 - wa - wb - wc, wa, wb, wc]
    }

    /// Squared distance from `p` to the combination.
    fn miss(&self, tet: u32, weights: [f64; 4], p: [f32; 3]) -> f64 {
        (0..3)
            .map(|axis| {
                let x: f64 = (0..4)
                    .map(|k| {
                        weights[k]
                            * self.mesh.position(self.mesh.tets[4 * tet as usize + k])[axis] as f64
                    })
                    .sum();
                (x - p[axis] as f64).powi(2)
            })
            .sum()
    }
}

/// To a combination inside of the tetrahedron. For a point outside it is a close one and not the
/// closest, which a projection onto faces and edges would give; points on a surface lie nearly
/// inside, where the two agree.
fn clamp(weights: [f64; 4]) -> [f64; 4] {
    let clamped = weights.map(|w| w.max(0.0));
    let sum: f64 = clamped.iter().sum();
    clamped.map(|w| w / sum)
}
