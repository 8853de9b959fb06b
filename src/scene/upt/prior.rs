//! The linear response inside a step of kind `upt`: static while in contact, free vibration without (where the bundle
//! has it), and its field at the planned nodes.

use super::UptEngine;
use super::record::UptRecord;
use crate::error::{Error, Result};
use crate::kernels::rows::decode_rows;
use crate::kernels::{Isa, Pool};
use crate::prior::{ContactResponse, PriorTable, SolveReport};
use crate::scene::contact::ContactSet;
use crate::scene::plan::NodePlan;

/// Fills the response of `next`, in block coordinates, from the contact at the end of the step and the record before.
#[allow(clippy::too_many_arguments)]
pub(super) fn respond(
    isa: Isa,
    pool: &Pool,
    table: &PriorTable,
    response: &mut ContactResponse,
    held: &[bool],
    contact: &ContactSet,
    last: &UptRecord,
    next: &mut UptRecord,
) -> Result<SolveReport> {
    let report = response.solve(isa, table, held, &contact.nodes, &contact.vectors)?;
    match &table.vibration {
        Some(vibration) if contact.is_empty() => {
            vibration.advance(&last.vibration, &mut next.vibration);
            vibration.field(isa, pool, &next.vibration, &mut next.q_prior)?;
        }
        Some(vibration) => {
            response.field(isa, pool, table, &mut next.q_prior)?;
            let (place, velocity) = next.vibration.split_at_mut(vibration.count());
            response.expand(isa, pool, vibration.force_to_mode(), place)?;
            for ((velocity, now), before) in velocity.iter_mut().zip(place).zip(&last.vibration) {
                *velocity = *now - before;
            }
        }
        None => response.field(isa, pool, table, &mut next.q_prior)?,
    }
    Ok(report)
}

/// The response's field `[K,3]` at the planned nodes.
pub(super) fn decode_prior(
    isa: Isa,
    pool: &Pool,
    table: &PriorTable,
    plan: &NodePlan,
    q: &[f32],
    field: &mut [f32],
) -> Result<()> {
    let rows = plan
        .rows()
        .ok_or_else(|| Error::Panic("a plan without rows of the prior".into()))?;
    decode_rows(isa, pool, &table.basis(), rows, q, field)
        .map_err(|error| Error::Panic(error.to_string()))
}

impl UptEngine {
    /// Recomputes the prior fields of the published records at a new plan's nodes.
    pub fn replan(
        &mut self,
        isa: Isa,
        pool: &Pool,
        table: Option<&PriorTable>,
        plan: &NodePlan,
    ) -> Result<()> {
        let Some(table) = table.filter(|_| self.response.is_some()) else {
            return Ok(());
        };
        for record in [&mut self.last, &mut self.before] {
            decode_prior(
                isa,
                pool,
                table,
                plan,
                &record.q_prior,
                &mut record.prior_field,
            )?;
        }
        Ok(())
    }
}
