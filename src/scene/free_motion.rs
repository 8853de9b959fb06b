//! A bundle without a learned map swings freely after a release, from the last corrected state: `z = N^T M u` and
//! `dz/dt = N^T M v` in the natural modes `N` (`docs/reference/formats.md`, "`vibration.safetensors`"). What they leave out goes to the file's
//! learned map, where it has one.
//!
//! REQ-034: Tissue that nothing touches comes to rest.

use super::reduced::ReducedEngine;
use crate::error::Result;
use crate::kernels::Compute;
use crate::kernels::project::project_field;

impl ReducedEngine {
    /// A host's displacement `given [K,3]` sets the amplitudes of the last state and leaves the velocities.
    ///
    /// The learned part's own state becomes zero: it was not of this displacement.
    pub(super) fn set_amplitudes(&mut self, compute: Compute<'_>, given: &[f32]) -> Result<()> {
        let table = &self.linear.table;
        let Some(vibration) = &table.vibration else {
            return Ok(());
        };
        self.given_q.fill(0.0);
        table.project(given, &mut self.given_q);
        let (state, learned) = self.last.vibration.split_at_mut(2 * vibration.count());
        learned.fill(0.0);
        let amplitudes = &mut state[..vibration.count()];
        vibration.amplitudes(compute.isa, compute.pool, &self.given_q, amplitudes)
    }

    /// The last state swings on from a corrected field `[K,3]` and the one before it, mm, with its velocity `[K,3]`, mm/s; the step in s.
    ///
    /// A field goes to block coordinates `q`, these to amplitudes `z`. Velocities of the record are
    /// amplitudes a step, so rates per second are multiplied by the length of the step. The field
    /// before comes first, since what is left of `q` after the modes is kept for both, and `q` and
    /// `swing` must hold the last field's at the end.
    pub(super) fn swing_from(
        &mut self,
        compute: Compute<'_>,
        starts: &[usize],
        [field, before]: [&[f32]; 2],
        velocity: &[f32],
        step_s: f32,
    ) -> Result<()> {
        let Compute { isa, pool } = compute;
        let table = &self.linear.table;
        let Some(vibration) = &table.vibration else {
            return Ok(());
        };
        let count = vibration.count();
        let (q, swing) = (&mut self.given_q, &mut self.swing);
        let state = &mut self.last.vibration;
        for (field, earlier) in [(before, true), (field, false)] {
            project_field(isa, pool, &table.basis(), starts, field, q)?;
            vibration.amplitudes(isa, pool, q, swing)?;
            vibration.set_remainder(isa, pool, swing, q, state, earlier)?;
        }
        let (place, speed) = state[..2 * count].split_at_mut(count);
        place.copy_from_slice(swing);
        project_field(isa, pool, &table.basis(), starts, velocity, q)?;
        vibration.amplitudes(isa, pool, q, speed)?;
        speed.iter_mut().for_each(|speed| *speed *= step_s);
        Ok(())
    }
}
