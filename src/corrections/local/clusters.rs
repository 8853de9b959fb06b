//! The far clusters of a scene: which elements they have beside the near ones, and what their law adds on the modes.

use super::near::{NearSet, WHAT};
use crate::corrections::far::{FarField, NINE};
use crate::corrections::precondition::Env;
use crate::error::Result;
use crate::kernels::project::row_dots;
use crate::kernels::respond::accumulate_rows;
use crate::kernels::rows::Stored;
use crate::memory::{self, HeldBytes};

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
        let mut own = Clusters {
            on_modes: memory::zeros(count * NINE * modes, WHAT)?,
            rows: memory::collected(count * NINE, 0..(count * NINE) as u32, WHAT)?,
            volumes: memory::filled(count, 0.0, WHAT)?,
            is_cut: memory::filled(count, true, WHAT)?,
            base: memory::filled(count * NINE, 0.0, WHAT)?,
            base_stress: memory::filled(count * NINE, 0.0, WHAT)?,
            moved: memory::zeros(count * NINE, WHAT)?,
            stress: memory::zeros(count * NINE, WHAT)?,
        };
        let none = memory::filled(far.volumes.len(), false, WHAT)?;
        own.leave_out(far, &none, modes);
        Ok(own)
    }

    /// Takes the near chunks out.
    pub fn leave_out(&mut self, far: &FarField, is_near: &[bool], modes: usize) {
        for cluster in 0..self.volumes.len() {
            let chunks = far.chunks_of(cluster);
            let is_cut = is_near[chunks.clone()].contains(&true);
            if !is_cut && !self.is_cut[cluster] {
                continue;
            }
            self.is_cut[cluster] = is_cut;
            let size = NINE * modes;
            let own = &mut self.on_modes[cluster * size..(cluster + 1) * size];
            own.fill(0.0);
            self.volumes[cluster] = 0.0;
            for chunk in chunks.filter(|chunk| !is_near[*chunk]) {
                self.volumes[cluster] += far.volumes[chunk];
                let table = &far.on_modes[chunk * size..(chunk + 1) * size];
                for (sum, value) in own.iter_mut().zip(table) {
                    *sum += value;
                }
            }
        }
    }

    /// Takes the field `[K,3]` as the base.
    pub fn begin(&mut self, far: &FarField, near: &NearSet, u: &[f32]) {
        for (cluster, base) in self.base.chunks_exact_mut(NINE).enumerate() {
            base.fill(0.0);
            for chunk in far.chunks_of(cluster).filter(|&at| !near.is_near[at]) {
                for (sum, value) in base.iter_mut().zip(far.gradient(chunk, u)) {
                    *sum += f64::from(value);
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
        far.added_stress(h)
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
