//! The part of a march in which relaxing tissue takes its state into what it remembers.

use super::fields::Node;
use super::march::{March, Shared};
use super::relaxing::View;

impl March<'_> {
    /// What threads share of the tissue's memory.
    pub(super) fn relaxing_view(&self) -> Option<View> {
        let mut relaxing = self.relaxing.as_ref()?.lock().ok()?;
        Some(relaxing.view(self.dt))
    }

    /// Takes the present state into what relaxing elements of the chunks in `mine` remember, where that is due; `places` is scratch.
    ///
    /// # Safety
    /// As for the phases of [`Shared`].
    pub(super) unsafe fn remember(
        &self,
        shared: Shared,
        mine: std::ops::Range<usize>,
        places: &mut [Node],
        step: u32,
    ) {
        let Some(relaxing) = shared.relaxing.filter(|view| view.is_due(step)) else {
            return;
        };
        for chunk in &self.partition.chunks[mine] {
            // SAFETY: the caller's: these chunks are this worker's, and no displacement changes in this phase.
            unsafe {
                let owned = shared.displacement.add(chunk.first);
                std::ptr::copy_nonoverlapping(owned, places.as_mut_ptr(), chunk.owned);
                let ghosts = places[chunk.owned..].iter_mut();
                for (place, owner) in ghosts.zip(&chunk.ghosts) {
                    *place = *shared.displacement.add(*owner as usize);
                }
                relaxing.update((self.partition, &self.kernels), chunk, places, step);
            }
        }
    }
}
