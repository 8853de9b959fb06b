//! The linear response of a scene: the model's tables and the scene's own contact solve.
//!
//! The tables say how the body answers at rest to unit forces, in block coordinates `q`: the field
//! of a node's block is `u = B q_b` with the block's basis `B`. A contact prescribes displacements
//! at nodes; the solve finds the forces there that make them, and `q` is what these forces do
//! everywhere.

use std::sync::Arc;

use super::plan::NodePlan;
use crate::error::Result;
use crate::field::ContactSet;
use crate::kernels::rows::decode_rows;
use crate::kernels::{Compute, Isa};
use crate::memory::HeldBytes;
use crate::prior::{ContactResponse, PriorTable, SolveReport};
use crate::stats::flag;

/// Tables, and the solve of the last contact.
#[derive(HeldBytes)]
pub struct Linear {
    /// The model's tables.
    #[held(skip)]
    pub table: Arc<PriorTable>,
    /// The contact solve.
    pub solve: ContactResponse,
}

impl Linear {
    /// Makes the solve's buffers.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`].
    pub fn new(table: &Arc<PriorTable>) -> Result<Linear> {
        Ok(Linear {
            solve: ContactResponse::new(table)?,
            table: Arc::clone(table),
        })
    }

    /// Solves for the forces of a contact.
    pub fn solve_contact(
        &mut self,
        isa: Isa,
        held: &[bool],
        contact: &ContactSet,
    ) -> Result<SolveReport> {
        let (nodes, vectors) = (&contact.nodes, &contact.vectors);
        self.solve.solve(isa, &self.table, held, nodes, vectors)
    }

    /// Block coordinates `[Q]` and state of the free vibration (empty where the tables have none) after `contact`, which
    /// has been solved for: static while it lasts, swinging on from the state `last` without it.
    pub fn respond(
        &self,
        compute: Compute<'_>,
        contact: bool,
        last: &[f32],
        next: &mut [f32],
        q: &mut [f32],
    ) -> Result<()> {
        let Compute { isa, pool } = compute;
        let Some(vibration) = &self.table.vibration else {
            return self.solve.field(isa, pool, &self.table, q);
        };
        if !contact {
            vibration.advance(last, next);
            return vibration.field(isa, pool, next, q);
        }
        self.solve.field(isa, pool, &self.table, q)?;
        let (next, learned) = next.split_at_mut(2 * vibration.count());
        learned.fill(0.0);
        let (place, velocity) = next.split_at_mut(vibration.count());
        self.solve
            .expand(isa, pool, vibration.force_to_mode(), place)?;
        // By the step: the record has velocities as change of amplitude over one step.
        for ((velocity, now), before) in velocity.iter_mut().zip(place).zip(last) {
            *velocity = *now - before;
        }
        Ok(())
    }

    /// The field `[K,3]` of block coordinates at the nodes of a plan.
    pub fn decode(
        &self,
        compute: Compute<'_>,
        plan: &NodePlan,
        q: &[f32],
        field: &mut [f32],
    ) -> Result<()> {
        let Compute { isa, pool } = compute;
        Ok(decode_rows(
            isa,
            pool,
            &self.table.basis(),
            plan.rows(),
            q,
            field,
        )?)
    }
}

/// Envelope flags of a contact solve.
pub fn solve_flags(report: SolveReport) -> u32 {
    let mut flags = 0;
    if report.outside {
        flags |= flag::SITE;
    }
    if report.regularised {
        flags |= flag::REGULARISED;
    }
    flags
}
