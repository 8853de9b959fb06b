//! Steps whose tools do not go at the pace of hands: the work of the whole step is bounded.

use super::ContactProblem;
use crate::contact::state::State;

/// Hands do not go so far in a step, mm: 600 mm/s in steps of 20 ms.
const FAR_MM: f32 = 12.0;

/// Bounds the work of the step that [`ContactProblem::begin`] has begun at `start`, where the tissue will be far from balance at its end: a tool comes to it over a
/// way that no hand goes, or lies in it, or the last state `is_lost`. Frames, which are not iterated, need none.
pub fn bound_work(problem: &mut ContactProblem, rest: &[f32], start: &[f32], is_lost: bool) {
    let ContactProblem {
        ways,
        surface,
        past,
        work,
        ..
    } = problem;
    // Where a tool comes to may be empty because another has pushed the tissue away.
    let states = [start, &[]].map(|u| State { rest, u, start: u });
    for (index, tool) in ways.tools.iter().enumerate() {
        let leaps = ways.put[index] && index < past.tools.len();
        let way = tool.body.motion(&ways.before[index], &tool.pose);
        // One that leaves the tissue, however fast, leaves it to swing as it does, and the others to press on.
        let comes = |state| surface.is_reached(tool, state);
        if (leaps || way > FAR_MM) && states.into_iter().any(comes) {
            work.bound(leaps);
        }
    }
    // The tip of a needle lies in the tissue before it has pushed it.
    let is_thin = ways.tools.iter().any(|tool| tool.body.pierces());
    if is_lost || (ways.lay_in_tissue && !is_thin) {
        work.bound(false);
    }
}
