//! What follows the free update of an inner step: ties, then contact with the tools, by the first thread alone.

use super::march::{March, Shared};
use super::support::Support;
use super::ties::{Frames, Slots};
use super::touch::{Access, Touch};
use contact::Vector;

impl March<'_> {
    /// Ties and contact with the tools after the free update; all other threads wait.
    pub(super) unsafe fn touch_phase(&self, shared: Shared, step: u32) {
        // Poisoned only where this thread panicked, which ends the march.
        let mut touch = self.touch.as_ref().and_then(|touch| touch.lock().ok());
        let mut ties = self.ties.as_ref().and_then(|ties| ties.lock().ok());
        let load = self.load.as_ref().and_then(|load| load.lock().ok());
        let slots = Slots {
            displacement: shared.displacement,
            increment: shared.increment,
            force: shared.force,
            beta: self.beta,
        };
        let mut work = 0.0;
        if let Some(ties) = &mut ties {
            let mut frames = Ends {
                touch: touch.as_deref_mut().map(|touch| &mut **touch),
                support: load.as_ref().and_then(|load| load.support.as_ref()),
                step,
            };
            // SAFETY: the barriers around the phase keep other threads out of the arrays.
            unsafe { ties.resolve(slots, &mut frames, step) };
        }
        if let Some(touch) = &mut touch {
            let access = Access {
                displacement: shared.displacement,
                increment: shared.increment,
                force: shared.force,
                beta: self.beta,
            };
            let tied = |slot| {
                ties.as_ref()
                    .map_or(Vector::ZERO, |ties| ties.change_at(slot))
            };
            // SAFETY: as above.
            work += unsafe { touch.resolve(access, step, tied) };
        }
        if let Some(ties) = &ties {
            // SAFETY: as above.
            work += unsafe { ties.work(slots) };
        }
        // SAFETY: as above.
        unsafe { (*shared.tallies).work += work };
    }
}

/// What the far ends of ties are on.
struct Ends<'a> {
    touch: Option<&'a mut Touch>,
    support: Option<&'a Support>,
    step: u32,
}

impl Frames for Ends<'_> {
    fn at(&self, tool: Option<u32>, place: Vector, part: f32) -> Vector {
        match (tool, &self.touch, self.support) {
            (Some(tool), Some(touch), _) => touch.pose_at(tool, part).transform_point(place),
            (None, _, Some(support)) => support.carried(place, part),
            _ => place,
        }
    }

    fn feel(&mut self, tool: u32, point: Vector, force: Vector) {
        if let Some(touch) = &mut self.touch {
            touch.feel(tool, point, force, self.step);
        }
    }
}
