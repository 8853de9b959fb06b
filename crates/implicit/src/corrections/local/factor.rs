//! The exact factor of the tangent in the core, the inside nodes closest to the tools, and the preconditioner that it makes with the modes.
//!
//! ```text
//! B = (K_CC + kappa M_CC)^-1        K the tangent of the law at a state, C the core
//! P = B + (I - B K) Phi G^-1 Phi^T (I - K B)
//! ```
//!
//! Since `B K_CC` is the identity, what a move of the modes leaves in the core is `-B K_CR Phi_R`, with the near nodes `R` around the core: the field
//! that their move stretches over it. Contact takes the same operator for its compliance, `E^T P E`, unless it touches too many nodes
//! for that: with the compliance of the body at rest the forces that it finds are not those that the iterations balance
//! (`docs/decisions/026-near-factor.md`).

use super::linear::WHAT;
use super::linearisation::Linearisation;
use super::near::NearSet;
use crate::corrections::far::FarField;
use crate::corrections::precondition::Env;
use crate::error::{Error, Result};
use crate::kernels::Isa;
use crate::kernels::cholesky::{BlockRows, SparseFactor};
use crate::memory::{self, HeldBytes};

/// An entry that an element does not have: its row is not of the core.
const NONE: u32 = u32::MAX;
/// An element is taken at rest where its det F is less: its tangent would be that of a law at the
/// edge of what it describes, and the factor serves states on both sides of it.
const LEAST_DET: f64 = 0.2;
/// The tangent is taken anew where an entry of F has changed by more than this since: a factor is
/// dear, and the pairs make up for a tangent that is a little old.
const MOST_CHANGE: f32 = 0.2;
/// What is factored until it is positive: the tangent, or the stiffness at rest, with so much of its diagonal added. A tangent need not be
/// positive, and what rounding makes of a nearly incompressible body with slivers neither.
const ATTEMPTS: [(bool, f32); 5] = [
    (false, 0.0),
    (true, 0.0),
    (true, 1e-3),
    (true, 0.1),
    (true, 10.0),
];

/// See the module.
#[derive(Default, HeldBytes)]
pub(in crate::corrections) struct NearFactor {
    /// Where the tangent of the factor that there is was taken.
    made: Linearisation,
    /// Rows of the core, columns of the free nodes, by place.
    rows: BlockRows,
    /// Of each element with a corner in the core: which of the near ones it is, and the blocks of its corners.
    targets: Vec<(u32, [u32; 16])>,
    /// `U` of the core's rows and columns.
    factor: SparseFactor,
    /// Where the core's nodes are at rest.
    points: Vec<[f32; 3]>,
    /// Of each row: the elements at its node, each as four times its place in `targets` and the node's corner in it.
    entries: Vec<u32>,
    /// By free place: where the entry of that column is, while a row is made.
    entry_of: Vec<u32>,
    /// The number of the factor, for what is kept of one: no other has it.
    pub generation: u64,
}

impl NearFactor {
    /// Takes the pattern of another near set.
    /// The pattern depends on which nodes are near and on nothing else, so it is made once a set.
    pub fn plan(&mut self, near: &NearSet, rest: &[f32]) -> Result<()> {
        let (elements, core) = (&near.elements, near.places.core);
        self.factor.forget();
        self.made.clear();
        self.points.clear();
        memory::fit(&mut self.points, core, WHAT)?;
        let nodes = near.places.nodes[..core]
            .iter()
            .map(|node| 3 * *node as usize);
        self.points
            .extend(nodes.map(|at| [rest[at], rest[at + 1], rest[at + 2]]));
        self.targets.clear();
        let is_core = |places: &[u32; 4]| places.iter().any(|place| (*place as usize) < core);
        let count = elements.places().filter(is_core).count();
        memory::fit(&mut self.targets, count, WHAT)?;
        let all = (0..).zip(elements.places());
        let own = all.filter(|(_, places)| is_core(places));
        self.targets.extend(own.map(|(at, _)| (at, [NONE; 16])));
        self.fill_rows(near)?;
        let rows = &mut self.rows;
        rows.blocks.resize(rows.columns.len(), [0.0; 9]);
        self.factor.plan(&self.rows, &self.points)
    }

    /// Which nodes share an element with each of the core, and where the blocks of each element go.
    ///
    /// Three passes. The elements at each row are counted, which gives where the lists of rows
    /// start; then they are listed; then each row gathers the columns of its elements, sorted, and
    /// every element is told where its blocks lie in that row. Numbers are added through that table
    /// afterwards, without any search.
    fn fill_rows(&mut self, near: &NearSet) -> Result<()> {
        let (rows, core) = (&mut self.rows, near.places.core);
        let is_core = |place: &u32| (*place as usize) < core;
        rows.starts.clear();
        memory::fit(&mut rows.starts, core + 1, WHAT)?;
        rows.starts.resize(core + 1, 0);
        for row in near.elements.places().flatten().filter(is_core) {
            rows.starts[row as usize + 1] += 1;
        }
        for row in 0..core {
            rows.starts[row + 1] += rows.starts[row];
        }
        let most = rows.starts[core] as usize;
        self.entries.clear();
        memory::fit(&mut self.entries, most, WHAT)?;
        self.entries.resize(most, NONE);
        for ((element, _), at) in self.targets.iter().zip(0u32..) {
            let places = near.elements.places_of(*element as usize);
            let corners = places.into_iter().zip(0..);
            for (row, corner) in corners.filter(|(row, _)| is_core(row)) {
                // The start of a row moves to that of the next while it is filled.
                let start = &mut rows.starts[row as usize];
                self.entries[*start as usize] = 4 * at + corner;
                *start += 1;
            }
        }
        rows.columns.clear();
        memory::fit(&mut rows.columns, 4 * most, WHAT)?;
        let entry_of = &mut self.entry_of;
        entry_of.clear();
        memory::fit(entry_of, near.places.free, WHAT)?;
        entry_of.resize(near.places.free, NONE);
        let mut start = 0;
        for row in 0..core {
            let end = rows.starts[row] as usize;
            let own = &self.entries[start..end];
            let first = rows.columns.len();
            rows.starts[row] = first as u32;
            for entry in own {
                let element = self.targets[*entry as usize / 4].0;
                for column in near.elements.places_of(element as usize) {
                    if let Some(at) = entry_of.get_mut(column as usize)
                        && *at == NONE
                    {
                        *at = 0;
                        rows.columns.push(column);
                    }
                }
            }
            let columns = &mut rows.columns[first..];
            columns.sort_unstable();
            for (at, &column) in columns.iter().enumerate() {
                entry_of[column as usize] = (first + at) as u32;
            }
            for entry in own {
                let (at, corner) = (*entry as usize / 4, *entry as usize % 4);
                let (element, targets) = &mut self.targets[at];
                let places = near.elements.places_of(*element as usize);
                let own = targets[4 * corner..][..4].iter_mut();
                for (target, column) in own.zip(places) {
                    *target = entry_of.get(column as usize).copied().unwrap_or(NONE);
                }
            }
            // Only the entries of this row are taken back, so that a row costs what it has and not
            // what is near.
            for &column in columns.iter() {
                entry_of[column as usize] = NONE;
            }
            start = end;
        }
        rows.starts[core] = rows.columns.len() as u32;
        rows.blocks.clear();
        memory::fit(&mut rows.blocks, rows.columns.len(), WHAT)
    }

    /// Makes the factor that serves a state `[K,3]`: that of the state `at` where it was taken last, unless that is another's or has been deformed since. `last` is the
    /// number of the last factor that was made. Tells whether it is another state now.
    pub fn renew(
        &mut self,
        (env, near, far): (Env<'_>, &NearSet, &FarField),
        u: &[f32],
        at: &mut Linearisation,
        last: &mut u64,
    ) -> Result<bool> {
        let _span = tracing::trace_span!("factor").entered();
        let kappa = env.time_step.integrator.kappa() as f32;
        let serves =
            at.is_of(near.places.nodes.len(), kappa) && self.change(near, at, u) <= MOST_CHANGE;
        if !serves {
            at.set(&near.places.nodes, kappa, u)?;
        }
        self.make((env, near, far), at, last)?;
        Ok(!serves)
    }

    /// Makes the factor of the tangent at a state, unless it is that already.
    ///
    /// Between two states the pattern stays and numbers alone change. The number of the factor
    /// rises with each that is made, so that what others have computed with an older one is known
    /// to be of it.
    pub fn make(
        &mut self,
        (env, near, far): (Env<'_>, &NearSet, &FarField),
        at: &Linearisation,
        last: &mut u64,
    ) -> Result<()> {
        // Taking it afterwards cannot fail.
        self.made.fit(at)?;
        if self.made == *at {
            return Ok(());
        }
        // Until an attempt succeeds there is no factor: after an error nothing may be solved with
        // half of one.
        self.made.clear();
        *last += 1;
        self.generation = *last;
        for (is_at_rest, more) in ATTEMPTS {
            self.assemble((env, near, far), at, (is_at_rest, more));
            if self.factor.factor(env.isa, &self.rows) {
                self.made.take(at);
                return Ok(());
            }
        }
        Err(Error::bundle(
            "mesh.safetensors",
            format!(
                "the stiffness of {} nodes is not finite: remake the bundle",
                near.places.core
            ),
        ))
    }

    /// How far the core's elements have been deformed since the tangent was taken: the largest change of an entry of F.
    fn change(&self, near: &NearSet, at: &Linearisation, u: &[f32]) -> f32 {
        let before = at.u.as_chunks::<3>().0;
        let moved = |place: u32| {
            let now = &u[3 * near.places.nodes[place as usize] as usize..][..3];
            [0, 1, 2].map(|axis| now[axis] - before[place as usize][axis])
        };
        let core = self.targets.iter();
        let changes = core.map(|(at, _)| near.elements.largest_gradient(*at as usize, moved));
        changes.fold(0.0, f32::max)
    }

    /// The entries of the core's rows: the elements' stiffness at the state or at rest, inertia,
    /// and so much more of the diagonal.
    fn assemble(
        &mut self,
        (env, near, far): (Env<'_>, &NearSet, &FarField),
        at: &Linearisation,
        (is_at_rest, more): (bool, f32),
    ) {
        self.rows.blocks.fill([0.0; 9]);
        let (u, kappa) = (at.u.as_chunks::<3>().0, at.kappa);
        for (at, targets) in &self.targets {
            let (element, moduli) = near.elements.tetrahedron(*at as usize, far);
            let rest = element.deformation([[0.0; 3]; 4]);
            let moved = element
                .corners
                .map(|place| u[place as usize].map(f64::from));
            let state = match is_at_rest {
                true => rest,
                false => element.deformation(moved),
            };
            let state = if state.det > LEAST_DET { state } else { rest };
            let stiffness = element.steady_stiffness(&state, moduli);
            add(&mut self.rows.blocks, targets, &stiffness);
        }
        for (row, &node) in near.places.nodes[..near.places.core].iter().enumerate() {
            // The inertia is not scaled up with the diagonal: it is positive by itself.
            let inertia = kappa * env.body.mass[node as usize];
            if let Some(own) = self.rows.position(row, row as u32) {
                for axis in 0..3 {
                    let value = &mut self.rows.blocks[own][4 * axis];
                    *value += more * *value + inertia;
                }
            }
        }
    }

    /// `t = B t` in place, `[3 C]`, µN to mm.
    pub fn solve(&mut self, isa: Isa, t: &mut [f32]) {
        self.factor.solve(isa, t);
    }

    /// [`NearFactor::solve`] for each of the moves `[n, 3 C]`.
    pub fn solve_many(&mut self, isa: Isa, t: &mut [f32]) {
        self.factor.solve_many(isa, t);
    }

    /// `out = K_RC t`, µN, at the places beyond the core, `[3 R]`.
    pub fn around(&self, t: &[f32], out: &mut [f32]) {
        out.fill(0.0);
        let core = self.rows.rows();
        let out = out.as_chunks_mut::<3>().0;
        for (row, t) in t.as_chunks::<3>().0.iter().enumerate() {
            self.each_around(row, |column, block| {
                let out = &mut out[column - core];
                for (axis, out) in out.iter_mut().enumerate() {
                    *out += block[axis] * t[0] + block[3 + axis] * t[1] + block[6 + axis] * t[2];
                }
            });
        }
    }

    /// `out = K_CR v_R`, µN, `[3 C]`, of a field `[.., 3]` by place.
    pub fn stretch(&self, v: &[f32], out: &mut [f32]) {
        out.fill(0.0);
        let v = v.as_chunks::<3>().0;
        for (row, out) in out.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            self.each_around(row, |column, block| {
                let v = &v[column];
                for (axis, out) in out.iter_mut().enumerate() {
                    let line = &block[3 * axis..];
                    *out += line[0] * v[0] + line[1] * v[1] + line[2] * v[2];
                }
            });
        }
    }

    /// The entries of a row beyond the core: the last ones.
    ///
    /// Columns of a row are sorted, and the core's places come before the others.
    fn each_around(&self, row: usize, mut take: impl FnMut(usize, &[f32; 9])) {
        let core = self.rows.rows() as u32;
        let columns = self.rows.row(row);
        let first = columns.partition_point(|column| *column < core);
        let blocks = &self.rows.blocks[self.rows.starts[row] as usize..];
        for (column, block) in columns.iter().zip(blocks).skip(first) {
            take(*column as usize, block);
        }
    }
}

/// Adds an element's stiffness to the blocks of its corners.
fn add(blocks: &mut [[f32; 9]], targets: &[u32; 16], stiffness: &[[f64; 12]; 12]) {
    for (at, &target) in targets.iter().enumerate() {
        if let Some(block) = blocks.get_mut(target as usize) {
            let (row, column) = (3 * (at / 4), 3 * (at % 4));
            for (k, value) in block.iter_mut().enumerate() {
                *value += stiffness[row + k / 3][column + k % 3] as f32;
            }
        }
    }
}
