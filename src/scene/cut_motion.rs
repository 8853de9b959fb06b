//! A body that is cut goes on as it moved: velocities, inertia, and what relaxing tissue remembers, by the nodes and elements that
//! each new one stems from.

use topology::{Element, origin};

use super::body::SceneBody;
use super::corrected::Corrector;
use crate::corrections::{Course, History, Motion, SolverContext, follow_set};
use crate::error::Result;
use crate::memory;

const WHAT: &str = "the motion of a cut body";

impl Corrector {
    /// Takes velocities, inertia and stresses from before the body was cut; `source` is the node there of each node.
    /// Called on the corrections of the new body while those of the old one are still whole.
    pub(super) fn follow(
        &mut self,
        context: SolverContext<'_>,
        (old, before): (&Corrector, &SceneBody),
        body: &SceneBody,
        source: impl Fn(usize) -> usize + Copy,
    ) -> Result<()> {
        let len = 3 * body.mesh.node_count();
        // Velocity is a node's, and its copies have it as it is; inertia and loads are sums over
        // the mass at a node, and are shared out below.
        let was = &old.solver.motion;
        // The pairs of before are of another body: the first step after a cut begins with none.
        let mut motion = Motion {
            velocity: memory::zeros(len, WHAT)?,
            velocity_before: memory::zeros(len, WHAT)?,
            inertia: memory::zeros(len, WHAT)?,
            load: memory::zeros(if was.load.is_empty() { 0 } else { len }, WHAT)?,
            min_det: was.min_det,
            extent: was.extent,
            truncated_mm: was.truncated_mm,
            error_mm: was.error_mm,
            // It is of the old nodes, and the next step makes its own.
            reaction: Vec::new(),
        };
        spread(&was.velocity, &mut motion.velocity, source);
        spread(&was.velocity_before, &mut motion.velocity_before, source);
        spread(&was.inertia, &mut motion.inertia, source);
        if !was.load.is_empty() {
            spread(&was.load, &mut motion.load, source);
        }
        // Inertia is that of the mass which is at the node now, and the loads with it.
        let (now, then) = (body.model.corrections()?, before.model.corrections()?);
        let (mass, mass_then) = (&now.body.mass, &then.body.mass);
        // A copy has a part of its source's mass; fields per node that carry mass are shared out by it, so that their sum stays.
        let part = |node: usize| mass[node] / mass_then[source(node)].max(f32::MIN_POSITIVE);
        for field in [&mut motion.inertia, &mut motion.load] {
            let rows = field.chunks_exact_mut(3).enumerate();
            rows.for_each(|(node, row)| row.iter_mut().for_each(|x| *x *= part(node)));
        }
        // Both bodies use the modes of the intact one, so that a set of modes that was chosen for
        // the old body means the same in the new one.
        debug_assert_eq!(self.basis_starts.len(), old.basis_starts.len());
        let history = History {
            motion,
            pairs: Vec::new(),
            local: Vec::new(),
            course: Course::default(),
            relaxing: None,
        };
        self.solver.restore(context, &history)?;
        follow_set(context, &old.solver, &mut self.solver)?;
        // Only tissue that relaxes remembers stresses by element.
        if !self.solver.relaxes() {
            return Ok(());
        }
        let sources = element_sources(body, before, source)?;
        self.solver.remember_as(now, (&old.solver, then), &sources)
    }
}

/// The number, in the body before, of what each element stems from, by its own number. Cells of one mesh element that an earlier cut has parted have been
/// strained on their own since.
/// By element of the body as it is now, first those of the intact mesh in their order, then the
/// cells of the cut ones.
fn element_sources(
    body: &SceneBody,
    before: &SceneBody,
    source: impl Fn(usize) -> usize,
) -> Result<Vec<u32>> {
    let intact = body.intact_mesh().tets.len() as u32 / 4;
    let mut sources = memory::collected(intact as usize, 0..intact, WHAT)?;
    let cells = |body: &SceneBody| -> Result<Vec<Element>> {
        match &body.cut {
            Some(cut) => Ok(cut.body.changes()?.new),
            None => Ok(Vec::new()),
        }
    };
    let (own, old) = (cells(body)?, cells(before)?);
    memory::reserve(&mut sources, own.len(), WHAT)?;
    for element in &own {
        let place = origin(element, &old, |node| source(node as usize) as u32);
        sources.push(place.map_or(element.parent, |place| intact + place as u32));
    }
    Ok(sources)
}

/// Values `[K,3]` of the nodes that each node comes from.
pub(super) fn spread(from: &[f32], to: &mut [f32], source: impl Fn(usize) -> usize) {
    for (node, to) in to.chunks_exact_mut(3).enumerate() {
        to.copy_from_slice(&from[3 * source(node)..][..3]);
    }
}
