//! The elements near the tools: which they are, their forces, and how coordinates of the block bases reach their nodes.
//!
//! Whole chunks of elements are near. A *place* is the position of a node in [`NearSet::nodes`]: first the free nodes all of whose elements
//! are near ([`NearSet::inside`] of them, `S` in the formulas), then the other free ones, then those that are held.

use std::ops::Range;

use ::elements::{ElementForces, Scratch};

use crate::corrections::far::FarField;
use crate::corrections::precondition::Env;
use crate::error::Result;
use crate::kernels::rows::{RowPlan, decode_rows, project_rows};
use crate::memory::{self, HeldBytes};

pub(super) const WHAT: &str = "the elements near the tools";
/// Chunks are near that come this close to a node that a tool touches, at rest, mm.
const REACH_MM: f32 = 20.0;
/// A node that is not near.
const NONE: u32 = u32::MAX;

/// One element of the linear part.
#[derive(HeldBytes)]
struct Linear {
    places: [u32; 4],
    /// Of the shape functions 1, 2, 3, 1/mm.
    gradients: [[f32; 3]; 3],
    /// Lame's constants times the rest volume, µN mm.
    shear: f32,
    lambda: f32,
}

/// What is near.
#[derive(HeldBytes)]
pub(in crate::corrections) struct NearSet {
    /// Ascending.
    pub chunks: Vec<u32>,
    /// By chunk.
    pub is_near: Vec<bool>,
    pub nodes: Vec<u32>,
    /// Places that are inside, and those that are free.
    pub inside: usize,
    pub free: usize,
    /// By node; [`NONE`] elsewhere.
    places: Vec<u32>,
    /// Near chunks at a node, while they are counted.
    counts: Vec<u16>,
    /// Places of the nodes of each near chunk, one chunk after another.
    of_slots: Vec<u32>,
    elements: Vec<Linear>,
    plan: RowPlan,
    /// Coordinates of the blocks that near nodes are of.
    pub ranges: Vec<Range<usize>>,
    wanted: Vec<bool>,
    /// No error has left the lists half made.
    is_whole: bool,
}

impl NearSet {
    pub fn new(env: Env<'_>, far: &FarField) -> Result<NearSet> {
        let (count, chunks) = (env.body.mass.len(), env.body.forces.chunk_count());
        Ok(NearSet {
            chunks: memory::room(chunks, WHAT)?,
            is_near: memory::filled(chunks, false, WHAT)?,
            nodes: Vec::new(),
            inside: 0,
            free: 0,
            places: memory::filled(count, NONE, WHAT)?,
            counts: memory::filled(far.chunks_at.len(), 0, WHAT)?,
            of_slots: Vec::new(),
            elements: Vec::new(),
            plan: RowPlan::try_region(&env.prior.basis(), &[], true)?,
            ranges: Vec::new(),
            wanted: memory::filled(chunks, false, WHAT)?,
            is_whole: true,
        })
    }

    /// The place of a node, where it has one.
    pub fn place(&self, node: u32) -> Option<usize> {
        let place = self.places[node as usize];
        (place != NONE).then_some(place as usize)
    }

    /// Whether a free node is inside.
    pub fn holds(&self, node: u32) -> bool {
        (self.places[node as usize] as usize) < self.inside
    }

    /// Marks the chunks about some nodes at rest, and those of `also`.
    pub fn mark(
        &mut self,
        far: &FarField,
        rest: &[f32],
        touched: &[u32],
        also: impl Iterator<Item = u32>,
    ) {
        self.wanted.fill(false);
        also.for_each(|chunk| self.wanted[chunk as usize] = true);
        for (wanted, [low, high]) in self.wanted.iter_mut().zip(&far.boxes) {
            *wanted |= touched.iter().any(|&node| {
                let at = &rest[3 * node as usize..][..3];
                let outside =
                    |axis: usize| (low[axis] - at[axis]).max(at[axis] - high[axis]).max(0.0);
                let [x, y, z] = [0, 1, 2].map(outside);
                x * x + y * y + z * z < REACH_MM * REACH_MM
            });
        }
    }

    /// The marked chunks.
    pub fn marked(&self) -> impl Iterator<Item = u32> + '_ {
        let wanted = self.wanted.iter().enumerate();
        wanted
            .filter(|(_, wanted)| **wanted)
            .map(|(at, _)| at as u32)
    }

    /// Takes the marked chunks; tells whether others are near now.
    pub fn take_marked(&mut self, env: Env<'_>, far: &FarField) -> Result<bool> {
        if self.is_whole && self.wanted == self.is_near {
            return Ok(false);
        }
        self.fill(env, far)?;
        Ok(true)
    }

    fn fill(&mut self, env: Env<'_>, far: &FarField) -> Result<()> {
        // Nothing is near until all is known.
        self.is_whole = false;
        self.is_near.fill(false);
        for &node in &self.nodes {
            self.places[node as usize] = NONE;
            self.counts[node as usize] = 0;
        }
        self.nodes.clear();
        self.chunks.clear();
        self.of_slots.clear();
        self.elements.clear();
        (self.inside, self.free) = (0, 0);
        let forces = &env.body.forces;
        let wanted = self.wanted.iter().enumerate();
        let marked = wanted
            .filter(|(_, wanted)| **wanted)
            .map(|(at, _)| at as u32);
        self.chunks.extend(marked);
        let slots: usize = (self.chunks.iter())
            .map(|chunk| forces.chunk_nodes(*chunk as usize).len())
            .sum();
        memory::fit(&mut self.nodes, slots, WHAT)?;
        memory::fit(&mut self.of_slots, slots, WHAT)?;
        for &chunk in &self.chunks {
            for &node in forces.chunk_nodes(chunk as usize) {
                if self.counts[node as usize] == 0 {
                    self.nodes.push(node);
                }
                self.counts[node as usize] += 1;
            }
        }
        let rank = |node: u32| {
            let at = node as usize;
            let whole = self.counts[at] == far.chunks_at[at];
            (env.body.held[at], !whole, node)
        };
        self.nodes.sort_unstable_by_key(|node| rank(*node));
        for (place, &node) in self.nodes.iter().enumerate() {
            let (is_held, is_cut, _) = rank(node);
            self.places[node as usize] = place as u32;
            self.free += usize::from(!is_held);
            self.inside += usize::from(!is_held && !is_cut);
        }
        self.fill_elements(env, far)?;
        let (places, free) = (&self.places, self.free);
        let row_of = |node: u32| {
            let place = places[node as usize];
            ((place as usize) < free).then_some(place)
        };
        let basis = env.prior.basis();
        self.plan.refill(&basis, free, row_of)?;
        self.ranges.clear();
        memory::fit(&mut self.ranges, basis.rank_offsets.len(), WHAT)?;
        for block in self.plan.blocks() {
            let ends = &basis.rank_offsets[block..block + 2];
            self.ranges.push(ends[0] as usize..ends[1] as usize);
        }
        self.is_near.copy_from_slice(&self.wanted);
        self.is_whole = true;
        Ok(())
    }

    fn fill_elements(&mut self, env: Env<'_>, far: &FarField) -> Result<()> {
        let forces = &env.body.forces;
        let moduli = far.moduli;
        let lambda = moduli.bulk_pa - 2.0 / 3.0 * moduli.shear_pa;
        for &chunk in &self.chunks {
            let start = self.of_slots.len();
            let nodes = forces.chunk_nodes(chunk as usize).iter();
            let places = &self.places;
            self.of_slots
                .extend(nodes.map(|&node| places[node as usize]));
            for element in forces.chunk_tetrahedra(chunk as usize) {
                let own = &self.of_slots[start..];
                let places = element.corners.map(|corner| own[corner as usize]);
                if places.iter().all(|place| *place as usize >= self.free) {
                    continue;
                }
                if self.elements.len() == self.elements.capacity() {
                    let more = self.elements.len().max(512);
                    memory::reserve(&mut self.elements, more, WHAT)?;
                }
                self.elements.push(Linear {
                    places,
                    gradients: element.gradients.map(|g| g.map(|x| x as f32)),
                    shear: (moduli.shear_pa * element.volume) as f32,
                    lambda: (lambda * element.volume) as f32,
                });
            }
        }
        Ok(())
    }

    /// `f_int` of the near elements at the free nodes, `[3 free]`, µN; the smallest det F of them all. `u [K,3]` is read at near nodes.
    pub fn internal(
        &self,
        forces: &ElementForces,
        u: &[f32],
        scratch: &mut Scratch,
        out: &mut [f32],
    ) -> f32 {
        out.fill(0.0);
        let mut smallest = f32::MAX;
        let mut slots = self.of_slots.as_slice();
        for &chunk in &self.chunks {
            let (det, own) = forces.evaluate_chunk(chunk as usize, u, scratch);
            smallest = smallest.min(det);
            let (places, rest) = slots.split_at(own.len());
            slots = rest;
            for (&place, force) in places.iter().zip(own) {
                if let Some(out) = out.as_chunks_mut::<3>().0.get_mut(place as usize) {
                    for (out, force) in out.iter_mut().zip(force) {
                        *out -= force;
                    }
                }
            }
        }
        smallest
    }

    /// `(K + kappa M) v` of the near elements at the free nodes, `[3 free]`, µN, of a field `[.., 3]` by place; without inertia at those that
    /// are not inside.
    pub fn linear(&self, env: Env<'_>, v: &[f32], out: &mut [f32]) {
        out.fill(0.0);
        let v = v.as_chunks::<3>().0;
        let out = out.as_chunks_mut::<3>().0;
        for element in &self.elements {
            let [first, rest @ ..] = element.places.map(|place| v[place as usize]);
            let mut h = [[0.0f32; 3]; 3];
            for (corner, gradient) in rest.iter().zip(&element.gradients) {
                for i in 0..3 {
                    let relative = corner[i] - first[i];
                    for j in 0..3 {
                        h[i][j] += relative * gradient[j];
                    }
                }
            }
            let pressure = element.lambda * (h[0][0] + h[1][1] + h[2][2]);
            let mut stress = [[0.0f32; 3]; 3];
            for i in 0..3 {
                for j in 0..3 {
                    stress[i][j] = element.shear * (h[i][j] + h[j][i]);
                }
                stress[i][i] += pressure;
            }
            let mut balance = [0.0f32; 3];
            for (&place, gradient) in element.places[1..].iter().zip(&element.gradients) {
                let mut force = [0.0f32; 3];
                for i in 0..3 {
                    force[i] = stress[i][0] * gradient[0]
                        + stress[i][1] * gradient[1]
                        + stress[i][2] * gradient[2];
                    balance[i] -= force[i];
                }
                if let Some(out) = out.get_mut(place as usize) {
                    for (out, force) in out.iter_mut().zip(force) {
                        *out += force;
                    }
                }
            }
            if let Some(out) = out.get_mut(element.places[0] as usize) {
                for (out, force) in out.iter_mut().zip(balance) {
                    *out += force;
                }
            }
        }
        let kappa = env.time_step.integrator.kappa() as f32;
        let inside = self.nodes[..self.inside].iter();
        for ((out, v), &node) in out.iter_mut().zip(v).zip(inside) {
            let inertia = kappa * env.body.mass[node as usize];
            for (out, v) in out.iter_mut().zip(v) {
                *out += inertia * v;
            }
        }
    }

    /// The field of coordinates `[Q]` at the near nodes, `[.., 3]` by place: zero where they are held.
    pub fn decode(&self, env: Env<'_>, q: &[f32], out: &mut [f32]) -> Result<()> {
        let (free, held) = out.split_at_mut(3 * self.free);
        held.fill(0.0);
        let basis = env.prior.basis();
        Ok(decode_rows(env.isa, env.pool, &basis, &self.plan, q, free)?)
    }

    /// `q = U^T r` in the near blocks of a field `[3 free]` that is zero elsewhere.
    pub fn project(&self, env: Env<'_>, r: &[f32], q: &mut [f32]) {
        for range in &self.ranges {
            q[range.clone()].fill(0.0);
        }
        project_rows(env.isa, &env.prior.basis(), &self.plan, r, q);
    }
}
