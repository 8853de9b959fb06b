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
    /// Such clusters, ascending, and the volume of their far elements, mm³; zero where all are near.
    volumes: Vec<(u32, f64)>,
    /// `sum v grad Phi` over the far elements of those that have some, one after another `[9,r]`.
    on_modes: Vec<f32>,
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
        let size = NINE * env.space.count();
        self.volumes.clear();
        self.on_modes.clear();
        memory::fit(&mut self.on_modes, size * near.parts.iter().count(), WHAT)?;
        for part in near.parts.iter() {
            let chunks = far.chunks_of(part.cluster);
            let whole: f64 = far.volumes[chunks].iter().sum();
            let volume = whole - part.volume;
            // What rounding leaves of a cluster is nothing.
            let volume = if volume > 1e-4 * whole { volume } else { 0.0 };
            memory::push(&mut self.volumes, (part.cluster as u32, volume), WHAT)?;
            if volume == 0.0 {
                continue;
            }
            let start = self.on_modes.len();
            self.on_modes.resize(start + size, 0.0);
            let own = &mut self.on_modes[start..];
            add_chunks(far, part.cluster, own);
            room.products_on_modes(env, near, near.parts.weights(part))?;
            add(-1.0, &room.linear, own);
        }
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
#[derive(HeldBytes)]
pub(super) struct Clusters {
    /// `sum v grad Phi` over the far elements of each cluster `[C,9,r]`, mm³ a mode's mm.
    on_modes: Vec<f32>,
    /// `0..9 C`.
    rows: Vec<u32>,
    /// Volume of the far elements, mm³; whether some of a cluster's elements are near.
    volumes: Vec<f64>,
    is_cut: Vec<bool>,
    /// `V H` at the base, mm³, and there what the law adds to the stress, Pa.
    base: Vec<f64>,
    base_stress: Vec<f64>,
    /// `V (H - H_base)`, and the stress beyond that of the base.
    moved: Vec<f32>,
    stress: Vec<f32>,
}

impl Clusters {
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
        let mut tables = left.on_modes.chunks_exact(size.max(1));
        let mut cut = left.volumes.iter().peekable();
        for cluster in 0..self.volumes.len() {
            let own = &mut self.on_modes[cluster * size..][..size];
            let left = cut.next_if(|(number, _)| *number as usize == cluster);
            if left.is_none() && !self.is_cut[cluster] {
                continue;
            }
            self.is_cut[cluster] = left.is_some();
            own.fill(0.0);
            match left {
                Some((_, volume)) => {
                    self.volumes[cluster] = *volume;
                    if *volume > 0.0
                        && let Some(table) = tables.next()
                    {
                        own.copy_from_slice(table);
                    }
                }
                None => {
                    self.volumes[cluster] = far.volumes[far.chunks_of(cluster)].iter().sum();
                    add_chunks(far, cluster, own);
                }
            }
        }
    }

    /// Takes the field `[K,3]` as the base.
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

    fn added(&self, far: &FarField, cluster: usize) -> ([f64; NINE], f64) {
        let volume = self.volumes[cluster];
        if volume <= 0.0 {
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
                *to = (stress - base) as f32;
            }
        }
        accumulate_rows(isa, pool, table, &self.rows, &self.stress, false, out)?;
        Ok(smallest as f32)
    }
}
