//! The far clusters of a scene: which elements they have beside the near ones, and what their law adds on the modes.

use super::linear::WHAT;
use super::near::NearSet;
use super::pairs::Room;
use super::step::add;
use crate::corrections::far::{FarField, NINE};
use crate::corrections::precondition::Env;
use crate::error::Result;
use crate::kernels::project::row_dots;
use crate::kernels::respond::accumulate_rows;
use crate::kernels::rows::Stored;
use crate::memory::{self, HeldBytes};

/// What a near set leaves of the clusters that it has a part of.
#[derive(Default, HeldBytes)]
pub(super) struct LeftOut {
    /// By cluster, ascending.
    list: Vec<Left>,
    /// The room of those that were left of other sets.
    spare: Vec<Left>,
}

/// That of one cluster.
#[derive(Default, HeldBytes)]
struct Left {
    cluster: u32,
    /// Volume of the far elements, mm³; zero where all are near.
    volume: f64,
    /// `sum v grad Phi` over the *near* elements, `[9,r]`, and the weights at mesh nodes that it was made of: it follows from them alone, so where a
    /// set that grows with a cut, or moves on with a tool, has that part of a cluster again, it stands.
    near: Vec<f32>,
    weights: Vec<(u32, [f32; 3])>,
}

impl LeftOut {
    /// Takes what is near out of the clusters.
    ///
    /// Exactly: the law of the far elements is convex about their own mean alone. With the mean of whole clusters in its place steps grew to 100 mm.
    pub fn fill(
        &mut self,
        env: Env<'_>,
        far: &FarField,
        near: &NearSet,
        room: &mut Room,
    ) -> Result<()> {
        self.keep_those_of(near)?;
        for part in near.parts.iter() {
            let at = self.place_of(part.cluster as u32)?;
            let left = &mut self.list[at];
            let chunks = far.chunks_of(part.cluster);
            let whole: f64 = far.volumes[chunks].iter().sum();
            let volume = whole - part.volume;
            // What rounding leaves of a cluster is nothing.
            left.volume = if volume > 1e-4 * whole { volume } else { 0.0 };
            if left.volume > 0.0 {
                left.take(env, near, near.parts.weights(part), room)?;
            }
        }
        Ok(())
    }

    /// Puts those of clusters of which the set has no part aside.
    /// Their lists keep their room for clusters to come.
    fn keep_those_of(&mut self, near: &NearSet) -> Result<()> {
        memory::reserve(&mut self.spare, self.list.len(), WHAT)?;
        let mut parts = near.parts.iter().peekable();
        let (list, spare) = (&mut self.list, &mut self.spare);
        spare.extend(list.extract_if(.., |left| {
            while parts
                .next_if(|part| part.cluster < left.cluster as usize)
                .is_some()
            {}
            parts
                .next_if(|part| part.cluster == left.cluster as usize)
                .is_none()
        }));
        Ok(())
    }

    /// Where a cluster is in the list; a new one knows nothing.
    fn place_of(&mut self, cluster: u32) -> Result<usize> {
        match self
            .list
            .binary_search_by_key(&cluster, |left| left.cluster)
        {
            Ok(at) => Ok(at),
            Err(at) => {
                memory::reserve(&mut self.list, 1, WHAT)?;
                let mut left = self.spare.pop().unwrap_or_default();
                left.cluster = cluster;
                left.weights.clear();
                self.list.insert(at, left);
                Ok(at)
            }
        }
    }

    /// Takes over what was made for the body before a cut; `keeps` tells of a node whether it is the one that it was.
    pub fn follow(&mut self, before: &LeftOut, keeps: impl Fn(u32) -> bool) -> Result<()> {
        self.list.clear();
        memory::fit(&mut self.list, before.list.len(), WHAT)?;
        let kept = before
            .list
            .iter()
            .filter(|left| left.weights.iter().all(|(node, _)| keeps(*node)));
        for left in kept {
            self.list.push(Left {
                cluster: left.cluster,
                volume: left.volume,
                near: memory::copied(&left.near, WHAT)?,
                weights: memory::copied(&left.weights, WHAT)?,
            });
        }
        Ok(())
    }
}

impl Left {
    /// Takes the near part of the cluster, of these weights by place.
    fn take(
        &mut self,
        env: Env<'_>,
        near: &NearSet,
        weights: &[(u32, [f32; 3])],
        room: &mut Room,
    ) -> Result<()> {
        let nodes = &near.places.nodes;
        let by_node = weights
            .iter()
            .map(|(place, weight)| (nodes[*place as usize], *weight));
        if !self.weights.is_empty() && self.weights.iter().copied().eq(by_node.clone()) {
            return Ok(());
        }
        // Until the product is made there is nothing that it was made of.
        self.weights.clear();
        memory::fit(&mut self.weights, weights.len(), WHAT)?;
        room.products_on_modes(env, near, weights)?;
        memory::replace(&mut self.near, &room.linear, WHAT)?;
        self.weights.extend(by_node);
        Ok(())
    }
}

/// Adds `sum v grad Phi [9,r]` of all of a cluster.
fn add_chunks(far: &FarField, cluster: usize, own: &mut [f32]) {
    for chunk in far.chunks_of(cluster) {
        add(1.0, &far.on_modes[chunk * own.len()..][..own.len()], own);
    }
}

/// See [`crate::corrections::far`].
/// A cluster stands for its far elements by their mean deformation gradient alone. Their linear
/// part is in the modes' Gram matrix already, so only what the law adds to linear elasticity is
/// computed here (`docs/decisions/023-local-iterations.md`).
#[derive(HeldBytes)]
pub(super) struct Clusters {
    /// `sum v grad Phi` over the far elements of each cluster `[C,9,r]`, mm³ a mode's mm.
    pub(super) on_modes: Vec<f32>,
    /// `0..9 C`.
    rows: Vec<u32>,
    /// Volume of the far elements, mm³; whether some of a cluster's elements are near.
    /// In f64: near parts are subtracted from them, and a difference of large sums would lose a
    /// small rest.
    volumes: Vec<f64>,
    /// All are taken as cut at first, so that the first `take` fills every table.
    is_cut: Vec<bool>,
    /// `V H` at the base, mm³, and there what the law adds to the stress, Pa.
    base: Vec<f64>,
    base_stress: Vec<f64>,
    /// `V (H - H_base)`, and the stress beyond that of the base.
    moved: Vec<f32>,
    stress: Vec<f32>,
}

impl Clusters {
    /// For a body of `far`'s clusters; the first [`Clusters::take`] fills the tables.
    pub fn new(far: &FarField, modes: usize) -> Result<Clusters> {
        let count = far.clusters();
        Ok(Clusters {
            on_modes: memory::zeros(count * NINE * modes, WHAT)?,
            rows: memory::collected(count * NINE, 0..(count * NINE) as u32, WHAT)?,
            volumes: memory::filled(count, 0.0, WHAT)?,
            is_cut: memory::filled(count, true, WHAT)?,
            base: memory::filled(count * NINE, 0.0, WHAT)?,
            base_stress: memory::filled(count * NINE, 0.0, WHAT)?,
            moved: memory::zeros(count * NINE, WHAT)?,
            stress: memory::zeros(count * NINE, WHAT)?,
        })
    }

    /// Takes what clusters have without what is near; the others are whole.
    pub fn take(&mut self, far: &FarField, left: &LeftOut) {
        let size = self.on_modes.len() / self.volumes.len().max(1);
        let mut cut = left.list.iter().peekable();
        for cluster in 0..self.volumes.len() {
            let own = &mut self.on_modes[cluster * size..][..size];
            let left = cut.next_if(|left| left.cluster as usize == cluster);
            // Whole before and whole now: its table stands.
            if left.is_none() && !self.is_cut[cluster] {
                continue;
            }
            self.is_cut[cluster] = left.is_some();
            self.volumes[cluster] = match left {
                Some(left) => left.volume,
                None => far.volumes[far.chunks_of(cluster)].iter().sum(),
            };
            own.fill(0.0);
            if left.is_none_or(|left| left.volume > 0.0) {
                add_chunks(far, cluster, own);
            }
            if let Some(left) = left.filter(|left| left.volume > 0.0) {
                add(-1.0, &left.near, own);
            }
        }
    }

    /// Takes the field `[K,3]` as the base.
    /// `V H` of the far elements: that of whole chunks over their borders, less what the near
    /// elements have of it.
    pub fn begin(&mut self, far: &FarField, near: &NearSet, u: &[f32]) {
        for (cluster, base) in self.base.chunks_exact_mut(NINE).enumerate() {
            base.fill(0.0);
            for chunk in far.chunks_of(cluster) {
                for (sum, value) in base.iter_mut().zip(far.gradient(chunk, u)) {
                    *sum += f64::from(value);
                }
            }
        }
        for part in near.parts.iter() {
            let base = &mut self.base[part.cluster * NINE..][..NINE];
            for &(place, weight) in near.parts.weights(part) {
                let u = &u[3 * near.places.nodes[place as usize] as usize..][..3];
                for (row, u) in base.chunks_exact_mut(3).zip(u) {
                    for (sum, weight) in row.iter_mut().zip(weight) {
                        *sum -= f64::from(u * weight);
                    }
                }
            }
        }
        self.moved.fill(0.0);
        for cluster in 0..self.volumes.len() {
            let (stress, _) = self.added(far, cluster);
            self.base_stress[cluster * NINE..][..NINE].copy_from_slice(&stress);
        }
    }

    /// What the law adds in a cluster where it is now, Pa, and det F of its mean.
    fn added(&self, far: &FarField, cluster: usize) -> ([f64; NINE], f64) {
        let volume = self.volumes[cluster];
        if volume <= 0.0 {
            // Nothing far is left of it: no stress, and nothing that could be inverted.
            return ([0.0; NINE], 1.0);
        }
        let range = cluster * NINE..(cluster + 1) * NINE;
        let (base, moved) = (&self.base[range.clone()], &self.moved[range]);
        let h = std::array::from_fn(|at| (base[at] + f64::from(moved[at])) / volume);
        far.added_stress(cluster, h)
    }

    /// What the law adds on the modes, beyond what it adds at the base, where the modes have moved by `modal` since; µN. Gives the smallest det
    /// F of a cluster.
    pub fn added_on_modes(
        &mut self,
        env: Env<'_>,
        far: &FarField,
        modal: &[f32],
        out: &mut [f32],
    ) -> Result<f32> {
        let (isa, pool) = (env.isa, env.pool);
        let table = Stored::F32(&self.on_modes);
        row_dots(isa, pool, table, &self.rows, modal, &mut self.moved)?;
        let mut smallest = f64::MAX;
        for cluster in 0..self.volumes.len() {
            let (stress, det) = self.added(far, cluster);
            smallest = smallest.min(det);
            let range = cluster * NINE..(cluster + 1) * NINE;
            let base = &self.base_stress[range.clone()];
            for ((to, stress), base) in self.stress[range].iter_mut().zip(stress).zip(base) {
                // The base's own stress is in the base's residual, which was evaluated by all
                // elements.
                *to = (stress - base) as f32;
            }
        }
        accumulate_rows(isa, pool, table, &self.rows, &self.stress, false, out)?;
        Ok(smallest as f32)
    }
}
