//! The end of a round: the base, what the near nodes moved by, and the modes' amplitudes become one field.

use super::step::add;
use super::{LocalSolver, StepContext};
use crate::corrections::passes::add_smoothed;
use crate::error::Result;

impl LocalSolver {
    /// The whole field into `u`, which holds the base, of which `residual` is; `scratch [K,3]`. Leaves what the far nodes were smoothed by in `far_mm`,
    /// and how far one has gone at most in `far_moved_mm`.
    pub(in crate::corrections) fn settle(
        &mut self,
        step: &mut StepContext<'_>,
        residual: &[f32],
        (scratch, u): (&mut [f32], &mut [f32]),
        with_whole: bool,
    ) -> Result<()> {
        let env = step.context.env();
        let preconditioner = &mut *step.preconditioner;
        // `Phi c` at all nodes, once a round, and what the whole modes have been asked for with it.
        // A copy: `join` adds what is no part of the iterations' own amplitudes.
        let c = &mut self.spare.more_on_modes;
        c.copy_from_slice(&self.now.step.c);
        if with_whole {
            preconditioner.whole.join(c);
        }
        preconditioner.take_coordinates(env, c)?;
        preconditioner.decode(env, scratch)?;
        if with_whole {
            preconditioner.whole.add(env, scratch)?;
        }
        for (place, t) in self.now.step.t.as_chunks::<3>().0.iter().enumerate() {
            let node = self.set.near.places.nodes[place] as usize;
            // The inside nodes, which alone have a `t`, come first among the places.
            add(1.0, t, &mut scratch[3 * node..][..3]);
        }
        let (near, count) = (&self.set.near, u.len() / 3);
        // Far nodes get the preconditioner's first level of the base's residual: a smoothing, for what the modes do not span.
        let fields = (residual, &mut *scratch, u);
        let moved = add_smoothed(
            env,
            fields,
            |node| near.places.holds(node),
            &mut self.spare.partial,
        )?;
        self.measured.far_mm = (moved / count.max(1) as f64).sqrt() as f32;
        let changes = scratch.as_chunks::<3>().0.iter().zip(0..);
        let far = changes.filter(|(_, node)| !near.places.holds(*node));
        let squares = far.map(|(change, _)| change.iter().map(|x| x * x).sum::<f32>());
        self.measured.far_moved_mm = squares.fold(0.0, f32::max).sqrt();
        Ok(())
    }
}
