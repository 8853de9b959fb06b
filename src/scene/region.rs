//! Which nodes a scene shows: regions, attached points, nodes decoded on demand, and the way back to rest.

use std::sync::{Arc, RwLock};

use super::core::Core;
use super::inputs::Which;
use super::plan::NodePlan;
use super::points::AttachedPoints;
use super::published::lock_write;
use super::published::{Frame, Published};
use crate::error::{Error, Result};
use crate::kernels::FlushToZero;
use crate::memory;
use crate::output::Output;

const WHAT: &str = "a scene's region and points";

impl Published {
    /// A copy of the host's region.
    pub(super) fn region_copy(&self) -> Result<Option<Vec<u32>>> {
        let region = self.region.as_deref();
        region
            .map(|region| memory::copied(region, WHAT))
            .transpose()
    }
}

impl Core {
    /// Decodes any nodes of the last state into `out [n,3]`, mm; `None`: all. Nothing of the scene changes but the spare frame.
    ///
    /// # Errors
    /// [`Error::Argument`] for a node that is not of the mesh and a wrong length, [`Error::State`] before the first step.
    pub(super) fn decode(
        &mut self,
        published: &RwLock<Published>,
        nodes: Option<&[u32]>,
        out: Output<'_, f32>,
    ) -> Result<()> {
        let count = self.maker.body.mesh.node_count();
        let wanted = nodes.map_or(count, <[u32]>::len);
        if out.len() != 3 * wanted {
            return Err(Error::Argument(format!(
                "out has {} floats, must have {}",
                out.len(),
                3 * wanted
            )));
        }
        check_nodes(nodes.unwrap_or_default(), count)?;
        if wanted == 0 {
            return Ok(());
        }
        if self.maker.states.counters.step_count == 0 {
            return Err(Error::State(
                "there is no state to decode before the first step; step the scene first".into(),
            ));
        }
        let _mode = FlushToZero::of(self.maker.machine.isa);
        let table = self.maker.engine.planned_prior();
        let plan = match nodes {
            Some(nodes) => NodePlan::new(&[nodes], count, table)?,
            None => NodePlan::all(count, table)?,
        };
        // No attached points: only nodes are asked for.
        let points = AttachedPoints::default();
        self.maker
            .decode_published(published, Which::Last, &plan, &points, &mut [])?;
        let field = self.maker.states.next.field.as_chunks::<3>().0;
        match nodes {
            Some(nodes) => out.write_rows(nodes.iter().map(|&node| field[node as usize])),
            None => out.write_rows(field.iter().copied()),
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
        let maker = &mut self.maker;
        let count = maker.body.mesh.node_count();
        let table = maker.engine.planned_prior();
        let plan = match &region {
            Some(region) if !maker.keeps_all_nodes() => NodePlan::new(
                &[
                    region,
                    maker.engine.recurrence_nodes(),
                    points.needed_nodes(),
                ],
                count,
                table,
            )?,
            _ => NodePlan::all(count, table)?,
        };
        let _mode = FlushToZero::of(maker.machine.isa);
        let compute = maker.machine.compute();
        maker.engine.replan(compute, &plan)?;
        let mut frames = [Frame::default(), Frame::default()];
        for (which, frame) in [Which::Last, Which::Before].into_iter().zip(&mut frames) {
            frame.points = memory::zeros(3 * points.len(), WHAT)?;
            maker.decode_published(published, which, &plan, &points, &mut frame.points)?;
            memory::replace(&mut frame.field, &maker.states.next.field, WHAT)?;
            points.add_interpolated(1.0, &frame.field, &mut frame.points);
        }
        // The third frame, that of the state being made, has as many points.
        let spare = memory::zeros(3 * points.len(), WHAT)?;
        let mut planned_tets = Vec::new();
        if maker.options.check_inversion {
            // An element can be looked at for inversion only where all of its corners are decoded.
            let mut known = memory::filled(count, false, WHAT)?;
            plan.nodes()
                .iter()
                .for_each(|&node| known[node as usize] = true);
            let tets = maker.body.mesh.tets.chunks_exact(4);
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
        maker.shown.tets = planned_tets;
        maker.states.next.points = spare;
        shared.region = region;
        maker.shown.plan = plan;
        shared.attached.clone_from(&points);
        maker.shown.points = points;
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
