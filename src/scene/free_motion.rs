//! A bundle without a learned map: while in contact the static response, after a release the free vibration of the last
//! corrected state, `z = N^T M u` and `dz/dt = N^T M v` in the natural modes `N` (`docs/reference/formats.md`, "`vibration.safetensors`").

use super::reduced::ReducedEngine;
use crate::error::{Error, Result};
use crate::kernels::project::project_field;
use crate::kernels::{Isa, Pool};
use crate::prior::{FreeVibration, PriorTable};

impl ReducedEngine {
    /// Response and amplitudes of `next`, whose contact has been solved. A host's displacement `given [K,3]` sets the amplitudes
    /// and leaves the velocities.
    pub(super) fn swing(
        &mut self,
        isa: Isa,
        pool: &Pool,
        table: &PriorTable,
        vibration: &FreeVibration,
        given: Option<&[f32]>,
    ) -> Result<()> {
        let count = vibration.count();
        if let Some(field) = given {
            self.given_q.fill(0.0);
            table.project(field, &mut self.given_q);
            let amplitudes = &mut self.last.vibration[..count];
            vibration.amplitudes(isa, pool, &self.given_q, amplitudes)?;
        }
        let (last, next) = (&self.last, &mut self.next);
        if !next.contact {
            vibration.advance(&last.vibration, &mut next.vibration);
            return vibration.field(isa, pool, &next.vibration, &mut next.q_prior);
        }
        self.response.field(isa, pool, table, &mut next.q_prior)?;
        let (place, velocity) = next.vibration.split_at_mut(count);
        self.response
            .expand(isa, pool, vibration.force_to_mode(), place)?;
        for ((velocity, now), before) in velocity.iter_mut().zip(place).zip(&last.vibration) {
            *velocity = *now - before;
        }
        Ok(())
    }

    /// The last state swings on from a corrected field `[K,3]`, mm, with its velocity `[K,3]`, mm/s; the step in s.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn swing_from(
        &mut self,
        isa: Isa,
        pool: &Pool,
        table: &PriorTable,
        starts: &[usize],
        field: &[f32],
        velocity: &[f32],
        step_s: f32,
    ) -> Result<()> {
        let Some(vibration) = &table.vibration else {
            return Ok(());
        };
        let failed = |error: crate::kernels::PoolError| Error::Panic(error.to_string());
        let (place, speed) = self.last.vibration.split_at_mut(vibration.count());
        let q = &mut self.given_q;
        project_field(isa, pool, &table.basis(), starts, field, q).map_err(failed)?;
        vibration.amplitudes(isa, pool, q, place)?;
        project_field(isa, pool, &table.basis(), starts, velocity, q).map_err(failed)?;
        vibration.amplitudes(isa, pool, q, speed)?;
        speed.iter_mut().for_each(|speed| *speed *= step_s);
        Ok(())
    }
}
