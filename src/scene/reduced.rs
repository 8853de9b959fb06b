//! The step of kind `reduced`: `u' = L(c') + Phi b'`, with `b'` from the correction network, bounded relative to the
//! linear response and faded out beyond the trained pushes (`docs/reference/formats.md`). A bundle without a learned map has `b' = 0`
//! and swings freely after a release ([`super::free_motion`]).

mod record;

use std::sync::Arc;

use super::inputs::Inputs;
use super::linear::{Linear, solve_flags};
use super::timing::Stopwatch;
use crate::bundle::ReducedInput;
use crate::error::Result;
use crate::field::ContactSet;
use crate::kernels::Compute;
use crate::kernels::project::{project_field, row_dots};
use crate::kernels::respond::accumulate_rows;
use crate::kernels::rows::Stored;
use crate::memory::{self, HeldBytes};
use crate::model::{LearnedMap, Model, ReducedModel};
use crate::onnx::Stage;
use crate::options::{Precision, Provider};
use crate::prior::PriorTable;
use crate::stats::{SceneStats, flag};

pub use record::ReducedRecord;
use record::STATE;

/// Buffers and session of a scene of kind `reduced`.
#[derive(HeldBytes)]
pub struct ReducedEngine {
    /// The linear response.
    pub linear: Linear,
    #[held(skip)]
    kind: Arc<ReducedModel>,
    /// The correction `b'`; none in a bundle that was made without training.
    learned: Option<LearnedStage>,
    /// Scratch: block coordinates `[Q]` of a field that is projected on the basis.
    pub(super) given_q: Vec<f32>,
    /// Amplitudes of the natural modes in a field `[m]`.
    pub(super) swing: Vec<f32>,
    /// The step being made, the last published one, the one before it.
    pub next: ReducedRecord,
    /// Last published.
    pub last: ReducedRecord,
    /// The one before.
    pub before: ReducedRecord,
}

/// Session and buffers of the correction network.
#[derive(HeldBytes)]
struct LearnedStage {
    /// One input with the groups of the manifest one after another, one output `b' [r]`.
    stage: Stage,
    #[held(skip)]
    precision: Precision,
    /// `0..r`: the rows of `Phi`, all of which are used.
    mode_rows: Vec<u32>,
    /// `b [r]` of a host's displacement, mm.
    given_b: Vec<f32>,
}

impl LearnedStage {
    fn new(model: &Model, map: &LearnedMap) -> Result<LearnedStage> {
        let mut stage = map.stage(&model.execution.plan)?;
        stage.warm_up()?;
        let modes = map.entry.modes;
        Ok(LearnedStage {
            stage,
            precision: map.precision,
            mode_rows: memory::collected(modes, 0..modes as u32, STATE)?,
            given_b: memory::zeros(modes, STATE)?,
        })
    }
}

/// Euclidean norm, summed in f64 in index order.
fn norm(values: &[f32]) -> f32 {
    values
        .iter()
        .map(|&x| x as f64 * x as f64)
        .sum::<f64>()
        .sqrt() as f32
}

/// Euclidean distance, summed in f64 in index order.
fn distance(a: &[f32], b: &[f32]) -> f32 {
    a.iter()
        .zip(b)
        .map(|(&x, &y)| (x as f64 - y as f64).powi(2))
        .sum::<f64>()
        .sqrt() as f32
}

impl ReducedEngine {
    /// Makes the session and the buffers.
    pub fn new(
        model: &Model,
        kind: &Arc<ReducedModel>,
        table: &Arc<PriorTable>,
    ) -> Result<ReducedEngine> {
        let learned = kind.learned.as_ref();
        Ok(ReducedEngine {
            linear: Linear::new(table)?,
            kind: Arc::clone(kind),
            learned: learned
                .map(|map| LearnedStage::new(model, map))
                .transpose()?,
            given_q: memory::zeros(table.width(), STATE)?,
            swing: memory::zeros(table.vibration.as_ref().map_or(0, |v| v.count()), STATE)?,
            next: ReducedRecord::new(kind, table)?,
            last: ReducedRecord::new(kind, table)?,
            before: ReducedRecord::new(kind, table)?,
        })
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.last.clear();
        self.before.clear();
    }

    /// Precision of the correction network; float32 without one.
    pub fn precision(&self) -> Precision {
        let learned = self.learned.as_ref();
        learned.map_or(Precision::F32, |learned| learned.precision)
    }

    /// What runs the correction network; the CPU without one.
    pub fn provider(&self) -> Provider {
        let learned = self.learned.as_ref();
        learned.map_or(Provider::Cpu, |learned| learned.stage.choice().provider)
    }

    /// Wall time of the network's last copies to a device and back, ms.
    pub fn transfer_ms(&self) -> [f64; 2] {
        let Some(learned) = &self.learned else {
            return [0.0; 2];
        };
        let times = learned.stage.times();
        [times.upload, times.download]
    }

    /// Computes `next` from `last`, `before`, the contact and, where given, the host's displacement `[K,3]`.
    /// In order: the linear response to the contact, the network, the bound on its correction, and
    /// the sum of both. Nothing of `last` changes before [`ReducedEngine::commit`].
    pub fn predict(
        &mut self,
        compute: Compute<'_>,
        inputs: &Inputs<'_>,
        stats: &mut SceneStats,
    ) -> Result<()> {
        let (given, contact) = (inputs.given, inputs.contact);
        let mut watch = Stopwatch::start();
        let span = tracing::trace_span!("prior").entered();
        let report = self
            .linear
            .solve_contact(compute.isa, inputs.held, contact)?;
        stats.flags |= solve_flags(report);
        self.next.contact = !contact.is_empty();
        if let Some(field) = given {
            self.set_amplitudes(compute, field)?;
        }
        let next = &mut self.next;
        let (last, swung, q) = (&self.last.vibration, &mut next.vibration, &mut next.q_prior);
        self.linear.respond(compute, next.contact, last, swung, q)?;
        leading(&self.linear, compute, next)?;
        next.prior_norm = norm(&next.q_prior);
        let (Some(map), Some(own), true) = (&self.kind.learned, &mut self.learned, inputs.learned)
        else {
            self.drop_correction();
            stats.timing.prior_ms = watch.lap();
            return Ok(());
        };
        let table = &self.linear.table;
        let b_now = match given {
            Some(field) => {
                self.given_q.fill(0.0);
                table.project(field, &mut self.given_q);
                for (q, prior) in self.given_q.iter_mut().zip(&self.last.q_prior) {
                    *q -= prior;
                }
                for (b, mode) in own
                    .given_b
                    .iter_mut()
                    .zip(table.learned.residual.chunks_exact(self.given_q.len()))
                {
                    *b = mode.iter().zip(&self.given_q).map(|(m, q)| m * q).sum();
                }
                &own.given_b
            }
            None => &self.last.b,
        };
        drop(span);
        stats.timing.prior_ms = watch.lap();
        let span = tracing::trace_span!("latent").entered();

        let input = own.stage.input(0);
        let mut at = 0;
        for group in &map.entry.inputs {
            let flags =
                [self.next.contact, self.last.contact].map(|on| if on { 1.0f32 } else { 0.0 });
            let values: &[f32] = match group {
                ReducedInput::B => b_now,
                ReducedInput::BPrev => &self.before.b,
                ReducedInput::Z => &self.next.z,
                ReducedInput::ZPrev => &self.last.z,
                ReducedInput::P => &self.next.p,
                ReducedInput::PPrev => &self.last.p,
                ReducedInput::Contact => &flags[..1],
                ReducedInput::ContactPrev => &flags[1..],
            };
            input[at..at + values.len()].copy_from_slice(values);
            at += values.len();
        }
        own.stage.run()?;
        let next = &mut self.next;
        next.b.copy_from_slice(own.stage.output(0));

        // The correction may not grow by itself: it decays from where it was, and only a new
        // contact or the response to it gives it room.
        let energy = if given.is_some() {
            norm(b_now)
        } else {
            self.last.bound
        };
        let jump = if inputs.contact_changed {
            distance(&next.q_prior, &self.last.q_prior)
        } else {
            0.0
        };
        let bound = &map.entry.bound;
        next.bound = (bound.relative * next.prior_norm).max(bound.decay * (energy + jump));
        let size = norm(&next.b);
        let mut scale = 1.0;
        if size > next.bound {
            scale = next.bound / size;
            stats.flags |= flag::CLAMPED;
        }
        // The correction fades out beyond the pushes that the network was trained on.
        let fade = &map.entry.fade;
        let push = contact.max_push();
        scale *=
            ((fade.end_push_mm - push) / (fade.end_push_mm - fade.start_push_mm)).clamp(0.0, 1.0);
        if scale != 1.0 {
            next.b.iter_mut().for_each(|b| *b *= scale);
        }
        drop(span);
        stats.timing.latent_ms = watch.lap();
        combine(compute, table, &own.mode_rows, next)?;
        stats.timing.prior_ms += watch.lap();
        Ok(())
    }

    /// Takes corrected fields `[K,3]` as those that the last two records stand for, `b = Phi^T (u - L(c))`; where a record was
    /// not corrected there is none.
    pub fn adopt_fields(
        &mut self,
        compute: Compute<'_>,
        starts: &[usize],
        fields: [Option<&[f32]>; 2],
    ) -> Result<()> {
        let Some(learned) = &self.learned else {
            return Ok(());
        };
        let (Compute { isa, pool }, table) = (compute, &self.linear.table);
        let records = [&mut self.last, &mut self.before];
        for (record, field) in records.into_iter().zip(fields) {
            let Some(field) = field else { continue };
            let q = &mut self.given_q;
            project_field(isa, pool, &table.basis(), starts, field, q)?;
            for (given, prior) in q.iter_mut().zip(&record.q_prior) {
                *given -= prior;
            }
            let modes = Stored::F32(&table.learned.residual);
            row_dots(isa, pool, modes, &learned.mode_rows, q, &mut record.b)?;
            record.bound = norm(&record.b);
        }
        Ok(())
    }

    /// Drops the correction of `next`: the linear response alone.
    pub fn drop_correction(&mut self) {
        self.next.b.fill(0.0);
        self.next.bound = 0.0;
        let next = &mut self.next;
        next.q.copy_from_slice(&next.q_prior);
    }

    /// Makes `next` the state of rest.
    pub fn rest_next(&mut self) {
        self.next.clear();
    }

    /// `next` becomes `last`.
    /// Records change places; what `next` then holds does not count.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.before, &mut self.last);
        std::mem::swap(&mut self.last, &mut self.next);
    }

    /// After a restore: field coordinates from `b` and the contact, with the factor of the last contact.
    pub fn rebuild(
        &mut self,
        compute: Compute<'_>,
        held: &[bool],
        before: &ContactSet,
        last: &ContactSet,
    ) -> Result<()> {
        let Compute { isa, pool } = compute;
        for (record, contact) in [(&mut self.before, before), (&mut self.last, last)] {
            self.linear.solve_contact(isa, held, contact)?;
            let (linear, table) = (&self.linear, &self.linear.table);
            match &table.vibration {
                Some(vibration) if contact.is_empty() => {
                    vibration.field(isa, pool, &record.vibration, &mut record.q_prior)?;
                }
                _ => linear.solve.field(isa, pool, table, &mut record.q_prior)?,
            }
            record.q.copy_from_slice(&record.q_prior);
            if let Some(learned) = &self.learned {
                leading(linear, compute, record)?;
                combine(compute, table, &learned.mode_rows, record)?;
            }
        }
        Ok(())
    }

    /// `|b|` of the last state, or where it swings freely the largest it may swing to, mm.
    pub fn last_norm(&self) -> f32 {
        norm(&self.last.b).max(norm(&self.last.vibration))
    }
}

/// The response in the learned map's coordinates.
fn leading(linear: &Linear, compute: Compute<'_>, record: &mut ReducedRecord) -> Result<()> {
    let (Compute { isa, pool }, table) = (compute, &linear.table);
    let (to_z, to_p) = (
        Stored::F32(&table.learned.force_to_z),
        Stored::F32(&table.learned.force_to_p),
    );
    linear.solve.expand(isa, pool, to_z, &mut record.z)?;
    linear.solve.expand(isa, pool, to_p, &mut record.p)
}

/// `q = q_prior + sum_j b_j residual[j]`.
fn combine(
    compute: Compute<'_>,
    table: &PriorTable,
    rows: &[u32],
    record: &mut ReducedRecord,
) -> Result<()> {
    let Compute { isa, pool } = compute;
    record.q.copy_from_slice(&record.q_prior);
    let modes = Stored::F32(&table.learned.residual);
    Ok(accumulate_rows(
        isa,
        pool,
        modes,
        rows,
        &record.b,
        true,
        &mut record.q,
    )?)
}
