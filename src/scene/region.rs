//! Which nodes a scene shows: regions, attached points, nodes decoded on demand, and the way back to rest.

use std::sync::{Arc, RwLock};

use super::core::{Core, lock_read, lock_write};
use super::counters::Source;
use super::inputs::{Decode, Which};
use super::plan::NodePlan;
use super::points::AttachedPoints;
use super::published::{Frame, Published};
use super::verdict::enforce;
use crate::error::{Error, Result};
use crate::kernels::FlushToZero;
use crate::memory;
use crate::output::Output;

const WHAT: &str = "a scene's region and points";

impl Core {
    /// A copy of the host's region.
    pub(super) fn region_copy(&self, published: &RwLock<Published>) -> Result<Option<Vec<u32>>> {
        let shared = lock_read(published);
        let region = shared.region.as_deref();
        region
            .map(|region| memory::copied(region, WHAT))
            .transpose()
    }

    /// Decodes any nodes of the last state into `out [n,3]`, mm. Nothing of the scene changes but the spare frame.
    ///
    /// # Errors
    /// [`Error::Argument`] for a node that is not of the mesh and a wrong length, [`Error::State`] before the first step.
    pub(super) fn decode(
        &mut self,
        published: &RwLock<Published>,
        nodes: &[u32],
        out: Output<'_, f32>,
    ) -> Result<()> {
        let count = self.mesh.node_count();
        if out.len() != 3 * nodes.len() {
            return Err(Error::Argument(format!(
                "out has {} floats, must have {}",
                out.len(),
                3 * nodes.len()
            )));
        }
        check_nodes(nodes, count)?;
        if nodes.is_empty() {
            return Ok(());
        }
        if self.counters.step_count == 0 {
            return Err(Error::State(
                "there is no state to decode before the first step; step the scene first".into(),
            ));
        }
        let _mode = FlushToZero::of(self.machine.isa);
        let plan = NodePlan::new(&[nodes], count, self.engine.planned_prior())?;
        let points = AttachedPoints::default();
        self.decode_published(published, Which::Last, &plan, &points, &mut [])?;
        let field = self.next.field.as_chunks::<3>().0;
        out.write_rows(nodes.iter().map(|&node| field[node as usize]));
        Ok(())
    }

    /// Decodes the nodes of a plan in a published state into the spare frame `next.field`, and into `detail` what a network says at attached
    /// points beyond the interpolation of their nodes.
    ///
    /// A state is decoded by what made it: rest is zero, a model's state comes from its record, and a replaced one from the linear
    /// response. Where every node is kept, the published field is copied instead.
    pub(super) fn decode_published(
        &mut self,
        published: &RwLock<Published>,
        which: Which,
        plan: &NodePlan,
        points: &AttachedPoints,
        detail: &mut [f32],
    ) -> Result<()> {
        let (source, contact) = match which {
            Which::Last => (self.counters.source, &self.contact),
            Which::Next | Which::Before => (self.counters.source_before, &self.contact_before),
        };
        let shared = lock_read(published);
        let frame = if which == Which::Last {
            &shared.last
        } else {
            &shared.before
        };
        let kept = self.keeps_all_nodes();
        let field = &mut self.next.field;
        if kept && points.queries().1.is_empty() {
            detail.fill(0.0);
            field.copy_from_slice(&frame.field);
            return Ok(());
        }
        let compute = self.machine.compute();
        match source {
            Source::Rest => {
                detail.fill(0.0);
                field.fill(0.0);
                return Ok(());
            }
            Source::Model => {
                let what = Decode {
                    which,
                    plan,
                    displacement: &shared.before.field,
                    points,
                };
                self.engine.decode(compute, &what, field, detail)?;
            }
            Source::Fallback => {
                detail.fill(0.0);
                self.engine.decode_fallback(compute, which, plan, field)?;
            }
        }
        if kept {
            field.copy_from_slice(&frame.field);
        } else if self.options.boundary {
            enforce(&self.mesh.held_nodes, &self.held, contact, field);
        }
        Ok(())
    }

    /// Takes a new plan, and decodes the nodes of both published states for it: a reader that interpolates between them needs both.
    ///
    /// All that may fail comes before the first change, so that an error leaves region, points and states as they were.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`], and what the engine says of a plan.
    pub(super) fn set_plan(
        &mut self,
        published: &RwLock<Published>,
        region: Option<Vec<u32>>,
        points: Arc<AttachedPoints>,
    ) -> Result<()> {
        let count = self.mesh.node_count();
        let table = self.engine.planned_prior();
        let plan = match &region {
            Some(region) if !self.keeps_all_nodes() => NodePlan::new(
                &[
                    region,
                    self.engine.recurrence_nodes(),
                    points.needed_nodes(),
                ],
                count,
                table,
            )?,
            _ => NodePlan::all(count, table)?,
        };
        let _mode = FlushToZero::of(self.machine.isa);
        let compute = self.machine.compute();
        self.engine.replan(compute, &plan)?;
        let mut frames = [Frame::default(), Frame::default()];
        for (which, frame) in [Which::Last, Which::Before].into_iter().zip(&mut frames) {
            frame.points = memory::zeros(3 * points.len(), WHAT)?;
            self.decode_published(published, which, &plan, &points, &mut frame.points)?;
            memory::replace(&mut frame.field, &self.next.field, WHAT)?;
            points.add_interpolated(1.0, &frame.field, &mut frame.points);
        }
        let spare = memory::zeros(3 * points.len(), WHAT)?;
        let mut planned_tets = Vec::new();
        if self.options.check_inversion {
            let mut known = memory::filled(count, false, WHAT)?;
            plan.nodes()
                .iter()
                .for_each(|&node| known[node as usize] = true);
            let tets = self.mesh.tets.chunks_exact(4);
            let tets = tets.filter(|tet| tet.iter().all(|&node| known[node as usize]));
            memory::reserve(&mut planned_tets, 4 * tets.clone().count(), WHAT)?;
            planned_tets.extend(tets.flatten());
        }
        let mut shared = lock_write(published);
        let shared = &mut *shared;
        if let Some(earlier) = &mut shared.earlier {
            // Both lists have room before the first one changes.
            let copy = Frame {
                field: memory::copied(&frames[1].field, WHAT)?,
                points: memory::copied(&frames[1].points, WHAT)?,
            };
            *earlier = copy;
        }
        [shared.last, shared.before] = frames;
        self.planned_tets = planned_tets;
        self.next.points = spare;
        shared.region = region;
        self.plan = plan;
        shared.attached.clone_from(&points);
        self.points = points;
        Ok(())
    }
}

/// Checks that all nodes exist.
pub(super) fn check_nodes(nodes: &[u32], count: usize) -> Result<()> {
    match nodes.iter().position(|&node| node as usize >= count) {
        Some(at) => Err(Error::Argument(format!(
            "nodes[{at}] is {}, the mesh has {count} nodes",
            nodes[at]
        ))),
        None => Ok(()),
    }
}
