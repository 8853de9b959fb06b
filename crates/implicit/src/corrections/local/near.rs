//! The elements near the tools: which they are, their forces, and how coordinates of the block bases reach their nodes.
//!
//! Near are the elements of the nodes that lie within a reach of the set's *centres*, nodes that tools have touched. How
//! they are numbered [`Places`] tells.

use std::ops::Range;

use ::elements::{ElementForces, Subset};

use super::centres::{Reached, is_by, nearest_squared, reach_of};
use super::linear::{LinearElements, Parts, WHAT};
use super::places::Places;
use crate::corrections::extent::LEVELS;
use crate::corrections::far::FarField;
use crate::corrections::precondition::Env;
use crate::error::Result;
use crate::kernels::rows::{RowPlan, decode_rows, project_products, project_rows};
use crate::memory::{self, HeldBytes};

/// Nodes are near that lie this close to a centre at rest, mm, or as many mean edges of the mesh.
const REACH_MM: f32 = 25.0;
const REACH_EDGES: f32 = 3.0;
/// What multiplies it in each level of the reach.
const WIDER: [f32; LEVELS] = [1.0, 1.5, 2.25, f32::INFINITY];
/// A level beyond the first is not taken with more nodes than these, but the widest below it that has fewer.
const MOST_NODES: usize = 4500;
/// Where a larger part of the nodes would be near, all are, and so they are in a body of fewer nodes: whole, it costs no more than its modes do.
const LARGEST_PART: f32 = 0.5;
const FEWEST_NODES: usize = 1000;
/// Nodes are of the core that lie this close to a centre at rest, mm, and as many mean edges.
const CORE_MM: f32 = 20.0;
const CORE_EDGES: f32 = 4.0;
/// Nodes of the core, unless so few lie within an edge of the centres: so many, or where a body has been cut at many nodes, [`CORE_A_CENTRE`] for each centre
/// and [`LARGEST_CORE`] at most. What a cut has made loose no mode knows, and beyond the core nothing else moves it.
const MOST_CORE: usize = 700;
const CORE_A_CENTRE: usize = 4;
const LARGEST_CORE: usize = 1600;

/// What is near.
#[derive(HeldBytes)]
pub(in crate::corrections) struct NearSet {
    pub centres: Vec<u32>,
    /// Index of [`WIDER`].
    pub level: usize,
    pub places: Places,
    /// By chunk of the body: the share of its volume that is not near.
    pub far_share: Vec<f32>,
    marks: Marks,
    chosen: Chosen,
    pub(super) elements: LinearElements,
    /// What of the far field's clusters is near.
    pub(super) parts: Parts,
    pub blocks: NearBlocks,
    /// How many of the parts that follow from the centres have been made for it.
    pub(super) made: u32,
}

/// What is known of nodes while a set is filled.
#[derive(HeldBytes)]
struct Marks {
    /// By node: within reach of a centre, in a set that is filled of the core or around it; and how many near elements it has.
    is_reached: Vec<bool>,
    counts: Vec<u16>,
    /// Of the near nodes from the nearest centre, squared, mm².
    distances: Vec<f32>,
    /// The centres that reach into a chunk's box.
    close: Vec<u32>,
}

/// The near elements with their law.
#[derive(HeldBytes)]
struct Chosen {
    subset: Subset,
    /// By number in the mesh.
    is_near: Vec<bool>,
}

/// The blocks of the basis that near nodes, or some of them, are of.
#[derive(HeldBytes)]
pub(in crate::corrections) struct Blocks {
    plan: RowPlan,
    /// Their coordinates.
    pub ranges: Vec<Range<usize>>,
}

/// Those of all near nodes, and of the core with the nodes around it, which share an element with it.
#[derive(HeldBytes)]
pub(in crate::corrections) struct NearBlocks {
    pub all: Blocks,
    pub around: Blocks,
}

impl Blocks {
    /// None, of an empty set.
    fn new(env: Env<'_>) -> Result<Blocks> {
        Ok(Blocks {
            plan: RowPlan::try_region(&env.prior.basis(), &[], true)?,
            ranges: Vec::new(),
        })
    }

    /// Takes those of the free nodes with places that are wanted.
    fn refill(
        &mut self,
        env: Env<'_>,
        places: &Places,
        is_wanted: impl Fn(u32) -> bool,
    ) -> Result<()> {
        let basis = env.prior.basis();
        let row_of = |node: u32| places.free_of(node).filter(|_| is_wanted(node));
        self.plan.refill(&basis, places.free, row_of)?;
        self.ranges.clear();
        memory::fit(&mut self.ranges, basis.rank_offsets.len(), WHAT)?;
        for block in self.plan.blocks() {
            let ends = &basis.rank_offsets[block..block + 2];
            self.ranges.push(ends[0] as usize..ends[1] as usize);
        }
        Ok(())
    }

    /// The field of coordinates `[Q]` at these nodes, into those rows of `out [3 free]`.
    pub fn decode(&self, env: Env<'_>, q: &[f32], out: &mut [f32]) -> Result<()> {
        let basis = env.prior.basis();
        Ok(decode_rows(env.isa, env.pool, &basis, &self.plan, q, out)?)
    }

    /// `q = U^T r` in these blocks of a field `[3 free]` that is zero at other nodes.
    pub fn project(&self, env: Env<'_>, r: &[f32], q: &mut [f32]) {
        for range in &self.ranges {
            q[range.clone()].fill(0.0);
        }
        project_rows(env.isa, &env.prior.basis(), &self.plan, r, q);
    }
}

impl NearSet {
    /// Nothing is near yet; lists by node and by chunk have their sizes for good.
    pub fn new(env: Env<'_>) -> Result<NearSet> {
        let (count, chunks) = (env.body.mass.len(), env.body.forces.chunk_count());
        Ok(NearSet {
            centres: Vec::new(),
            level: 0,
            places: Places::new(count)?,
            far_share: memory::filled(chunks, 1.0, WHAT)?,
            marks: Marks {
                is_reached: memory::filled(count, false, WHAT)?,
                counts: memory::filled(count, 0, WHAT)?,
                distances: Vec::new(),
                close: Vec::new(),
            },
            chosen: Chosen {
                subset: memory::tried(Subset::new(&env.body.forces), WHAT)?,
                is_near: Vec::new(),
            },
            elements: LinearElements::default(),
            parts: Parts::default(),
            blocks: NearBlocks {
                all: Blocks::new(env)?,
                around: Blocks::new(env)?,
            },
            made: 0,
        })
    }

    /// Whether it is what lies about some centres, as far as a level reaches.
    pub fn is_of(&self, centres: &[u32], level: usize) -> bool {
        self.made > 0 && self.level == level && self.centres == centres
    }

    /// Takes the elements about some centres, as far as a level reaches.
    pub fn fill(
        &mut self,
        (env, far, rest): (Env<'_>, &FarField, &[f32]),
        centres: &[u32],
        level: usize,
    ) -> Result<()> {
        self.made = 0;
        self.level = level;
        memory::replace(&mut self.centres, centres, WHAT)?;
        self.places.forget();
        let count = self.places.node_count();
        let reach = match count < FEWEST_NODES {
            true => f32::MAX,
            false => reach(far, level),
        };
        self.take_elements(env, far, rest, reach)?;
        // Where most nodes are near, all are: what the far ones save is less than their clusters cost.
        let most = LARGEST_PART * count as f32;
        if reach < f32::MAX && self.places.nodes.len() as f32 > most {
            self.take_elements(env, far, rest, f32::MAX)?;
        }
        self.find_core(far, rest)?;
        let marks = &self.marks;
        self.places.order(|node| {
            let whole = marks.counts[node] == far.elements_at[node];
            (env.held.is[node], !whole, !marks.is_reached[node])
        });
        self.elements.take_places(self.places.by_node());
        let by_place = (self.places.nodes.as_slice(), self.places.free);
        self.parts.fill(&self.elements, far, by_place)?;
        self.blocks.all.refill(env, &self.places, |_| true)?;
        self.mark_around();
        let is_around = &self.marks.is_reached;
        (self.blocks.around).refill(env, &self.places, |node| is_around[node as usize])
    }

    /// Whether a node is of the core or around it.
    pub fn is_around(&self, node: u32) -> bool {
        self.marks.is_reached[node as usize]
    }

    /// Marks the nodes of the core and those that share an element with it as reached, and no others that are near.
    fn mark_around(&mut self) {
        let is_reached = &mut self.marks.is_reached;
        for &node in &self.places.nodes {
            is_reached[node as usize] = false;
        }
        let is_core = |place: &u32| (*place as usize) < self.places.core;
        for places in self.elements.places().filter(|p| p.iter().any(is_core)) {
            for place in places {
                is_reached[self.places.nodes[place as usize] as usize] = true;
            }
        }
    }

    /// Marks the nodes of the core as reached, and no others that are near.
    fn find_core(&mut self, far: &FarField, rest: &[f32]) -> Result<()> {
        let mut reach = CORE_MM.min(CORE_EDGES * far.edge_mm);
        self.marks.distances.clear();
        memory::fit(&mut self.marks.distances, self.places.nodes.len(), WHAT)?;
        let nearest = |node: &u32| nearest_squared(rest, &self.centres, *node);
        self.marks
            .distances
            .extend(self.places.nodes.iter().map(nearest));
        let distances = &self.marks.distances;
        let within = |reach: f32| distances.iter().filter(|d| **d < reach * reach).count();
        let most = (CORE_A_CENTRE * self.centres.len()).clamp(MOST_CORE, LARGEST_CORE);
        while within(reach) > most && reach > far.edge_mm {
            reach *= 0.75;
        }
        for (&node, distance) in self.places.nodes.iter().zip(&self.marks.distances) {
            self.marks.is_reached[node as usize] = *distance < reach * reach;
        }
        Ok(())
    }

    /// The elements of the nodes within reach, and their nodes; `elements` have these for places.
    fn take_elements(
        &mut self,
        env: Env<'_>,
        far: &FarField,
        rest: &[f32],
        reach: f32,
    ) -> Result<()> {
        self.marks.is_reached.fill(false);
        self.marks.counts.fill(0);
        self.places.nodes.clear();
        self.elements.clear();
        self.chosen.is_near.clear();
        memory::fit(&mut self.chosen.is_near, far.cluster_of.len(), WHAT)?;
        self.chosen.is_near.resize(far.cluster_of.len(), false);
        self.chosen.subset.clear();
        let forces = &env.body.forces;
        for (chunk, bounds) in far.packed.boxes.iter().enumerate() {
            self.far_share[chunk] = 1.0;
            // Chunks whose box no centre reaches are not looked at node by node, nor those that one reaches whole.
            let close = &mut self.marks.close;
            let reached = reach_of((rest, &self.centres), reach, bounds, close)?;
            if reached != Reached::Nothing {
                for &node in forces.chunk_nodes(chunk) {
                    self.marks.is_reached[node as usize] =
                        reached == Reached::Whole || is_by(rest, close, node, reach);
                }
                let is_reached = &self.marks.is_reached;
                let near =
                    (self.chosen.subset).push(forces, chunk, |node| is_reached[node as usize]);
                let near = memory::tried(near, WHAT)?;
                let whole = far.packed.volumes[chunk];
                // What rounding leaves of a chunk is nothing.
                let share = if whole > 0.0 { near / whole } else { 1.0 };
                self.far_share[chunk] = match share > 1.0 - 1e-4 {
                    true => 0.0,
                    false => 1.0 - share as f32,
                };
            }
        }
        memory::tried(self.chosen.subset.finish(rest.as_chunks().0), WHAT)?;
        for (number, element) in self.chosen.subset.tetrahedra() {
            for node in element.corners {
                let count = &mut self.marks.counts[node as usize];
                if *count == 0 {
                    memory::push(&mut self.places.nodes, node, WHAT)?;
                }
                *count += 1;
            }
            self.chosen.is_near[number as usize] = true;
            self.elements.push(far, number, &element)?;
        }
        Ok(())
    }

    /// The smallest det F of those elements of a chunk that are not near, of a field `[K,3]`.
    pub fn far_det(&self, forces: &ElementForces, chunk: usize, u: &[f32]) -> f32 {
        let nodes = forces.chunk_nodes(chunk);
        let elements = forces.chunk_tetrahedra(chunk);
        let far = elements.filter(|(number, _)| !self.chosen.is_near[*number as usize]);
        let dets = far.map(|(_, element)| {
            let corners = element.corners.map(|corner| nodes[corner as usize]);
            let u = corners.map(|node| [0, 1, 2].map(|k| f64::from(u[3 * node as usize + k])));
            element.deformation(u).det as f32
        });
        dets.fold(f32::MAX, f32::min)
    }

    /// `f_int` of the near elements at the free nodes, `[3 free]`, µN; the smallest det F of them all. `u [K,3]` is read at near nodes.
    pub fn internal(&mut self, u: &[f32], out: &mut [f32]) -> f32 {
        out.fill(0.0);
        let (places, out) = (self.places.by_node(), out.as_chunks_mut::<3>().0);
        self.chosen.subset.evaluate(u, |node, force| {
            if let Some(out) = out.get_mut(places[node as usize] as usize) {
                for (out, force) in out.iter_mut().zip(force) {
                    *out -= force;
                }
            }
        })
    }

    /// `(K + kappa M) v` of the near elements, or of some, at the free nodes, `[3 free]`, µN, of a field `[.., 3]` by place; without inertia at
    /// those that are not inside.
    pub fn linear(&self, env: Env<'_>, v: &[f32], some: Option<&[u32]>, out: &mut [f32]) {
        self.elements.apply(v, some, out);
        let kappa = env.time_step.integrator.kappa() as f32;
        let rows = out.as_chunks_mut::<3>().0.iter_mut();
        let inside = self.places.nodes[..self.places.inside].iter();
        for ((out, v), &node) in rows.zip(v.as_chunks::<3>().0).zip(inside) {
            let inertia = kappa * env.body.mass[node as usize];
            for (out, v) in out.iter_mut().zip(v) {
                *out += inertia * v;
            }
        }
    }

    /// The field of coordinates `[Q]` at the near nodes, `[.., 3]` by place: zero where they are held.
    pub fn decode(&self, env: Env<'_>, q: &[f32], out: &mut [f32]) -> Result<()> {
        let (free, held) = out.split_at_mut(3 * self.places.free);
        held.fill(0.0);
        self.blocks.all.decode(env, q, free)
    }

    /// Adds `U^T (e_i w_j)` of vectors `w` at some places to `q [9,Q]`, field `3 i + j`.
    pub fn project_products(&self, env: Env<'_>, vectors: &[(u32, [f32; 3])], q: &mut [f32]) {
        project_products(
            env.isa,
            &env.prior.basis(),
            &self.blocks.all.plan,
            vectors,
            q,
        );
    }

    /// Coordinates of the blocks that some places are of.
    pub fn ranges_of(
        &self,
        env: Env<'_>,
        vectors: &[(u32, [f32; 3])],
        ranges: &mut Vec<Range<usize>>,
    ) -> Result<()> {
        let offsets = env.prior.basis().rank_offsets;
        ranges.clear();
        for (place, _) in vectors {
            let block = self.blocks.all.plan.block_of(*place);
            let own = offsets[block] as usize..offsets[block + 1] as usize;
            if !ranges.contains(&own) {
                memory::push(ranges, own, WHAT)?;
            }
        }
        Ok(())
    }
}

/// How far from the centres nodes are near, mm.
fn reach(far: &FarField, level: usize) -> f32 {
    WIDER[level] * REACH_MM.max(REACH_EDGES * far.edge_mm)
}

/// The widest level up to one that is asked for which has few enough nodes about some centres; the first has as many as it has.
pub(super) fn level_of(far: &FarField, rest: &[f32], centres: &[u32], asked: usize) -> usize {
    let fits = |level: &usize| {
        let nodes = 0..(rest.len() / 3) as u32;
        let near = nodes.filter(|node| is_by(rest, centres, *node, reach(far, *level)));
        near.take(MOST_NODES + 1).count() <= MOST_NODES
    };
    (1..=asked).rev().find(fits).unwrap_or(0)
}
