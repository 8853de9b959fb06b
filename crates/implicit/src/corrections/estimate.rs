//! How far a corrected state is from the truth, without the truth: from what the iterations leave near the tools and far from them, what
//! a step of this length leaves out, and the past. The weights were found on 15 cases of schemes 1 to 5 at K = 3,152 with 1, 3, 5 and 10 corrections
//! (`docs/reference/corrections.md`); the bundle's `calibration` makes millimetres of it.
//!
//! REQ-037: The estimated error of a step falls as its residual does, and above the host's limit a flag says so.

use super::input::{Enough, Report};
use super::motion::Motion;

/// Part of a state's error that the next one keeps.
const KEPT: f32 = 0.7;
/// The error far from the tools over what a smoothing there moves: it takes a small part of a smooth error (livers of 1,178 and 4,038 nodes).
const FAR_ERROR: f32 = 150.0;
/// What the last state left excuses so much of what further iterations would move at most, in targets: iterations take away the error of a state that none had
/// corrected.
pub(super) const EXCUSED: f32 = 10.0;
/// The same under tools in a body that has been cut: its error lies beside the cut, where few of a large body's nodes are, and its forces with it. A pressed cavity of
/// 21,708 nodes: 5.1 % of the force off for 7.9; intact bodies gain nothing by it.
pub(super) const EXCUSED_IN_CUT: f32 = 2.5;
/// Iterations that a target does not end: what the first one moves says little of what the next would.
const LEAST: u32 = 2;

impl Motion {
    /// The estimated error of this state, the one being made after `last`: what further iterations would move, what a step of this length leaves out, and
    /// what is left of the error of the state before, from which this one started. `uncorrected_mm` is how far a step went that no iteration corrected, root mean square
    /// over the nodes.
    pub(super) fn estimate(
        &mut self,
        last: &Motion,
        report: &mut Report,
        uncorrected_mm: Option<f32>,
    ) {
        let far = FAR_ERROR * report.far_mm;
        // Without an iteration all that a step goes may be wrong, and the error of the state before stays whole.
        let (left, kept) = match uncorrected_mm {
            Some(went) => (went, 1.0),
            None => (report.remaining_mm, KEPT),
        };
        let own = libm::hypotf(libm::hypotf(left, far), self.truncated_mm);
        report.error_mm = libm::hypotf(own, kept * last.error_mm);
        // What no number describes is told once, and not remembered.
        self.error_mm = match report.error_mm.is_finite() {
            true => report.error_mm,
            false => 0.0,
        };
    }

    /// Whether `iterations` have corrected the step after this state enough: the error is as small as was asked, or further iterations could not make it smaller, by
    /// what the last step left and left out. `excused` is [`EXCUSED`] or [`EXCUSED_IN_CUT`].
    pub(super) fn suffices(
        &self,
        iterations: u32,
        remaining_mm: f32,
        enough: Enough,
        excused: f32,
    ) -> bool {
        let wanted = enough.error_mm;
        let past = self.error_mm.min(excused * wanted);
        let rest = libm::hypotf(self.truncated_mm, KEPT * past);
        wanted > 0.0
            && iterations >= LEAST
            && (libm::hypotf(remaining_mm, rest) < wanted
                || (rest >= wanted && remaining_mm < 0.1 * rest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An intact body is let off for what the last step left; one that has been cut goes on until little is left beside that.
    #[test]
    fn a_pressed_cut_body_is_let_off_less() {
        let enough = Enough {
            iterations: 10,
            error_mm: 0.02,
            until: None,
        };
        let mut last = Motion::at_rest(3).unwrap();
        last.error_mm = 0.3;
        let ends = |left, excused| last.suffices(LEAST, left, enough, excused);
        assert!(ends(0.01, EXCUSED) && !ends(0.01, EXCUSED_IN_CUT));
        assert!(ends(0.003, EXCUSED_IN_CUT));
        assert!(!last.suffices(LEAST - 1, 0.003, enough, EXCUSED_IN_CUT));
    }
}
