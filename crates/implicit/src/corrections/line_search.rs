//! How far an iteration goes along its direction: the same rule for the whole field and for the elements near the tools.
//!
//! The step begins whole, as L-BFGS wants it, and is shortened to where the secant of the slopes puts the minimum. It is judged by the slopes
//! `phi'(t) = F(u + t d) . d` at its two ends and not by the energy, because in f32 the rounding of the energy drowns its change: `phi'(t) <= (2 delta - 1) phi'(0)`,
//! the decrease of the approximate Wolfe conditions (Hager and Zhang 2005, SIAM J. Optim. 16, 170).

/// `delta`: a step is accepted where the mean of its end slopes is below this part of the first.
const SLOPE: f64 = 1e-4;
/// Shortenings of one step at most; and where each of them is dear, in a step whose tool comes out of the tissue over a few steps anyway.
pub(super) const SHORTENINGS: u32 = 6;
pub(super) const DEAR_SHORTENINGS: u32 = 3;

/// The search along one direction.
pub(super) struct LineSearch {
    /// Slope at the start, nJ; below 0 where the direction leads down.
    slope: f64,
    /// Part of the direction that is tried.
    pub t: f32,
    shortenings: u32,
    most: u32,
}

/// What becomes of the part that was tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tried {
    /// It is the step.
    Accepted,
    /// `t` is shorter now, and is tried next.
    Shortened,
    /// The direction is of no use: the state stays, and the solver must forget what made the direction.
    GivenUp,
}

impl LineSearch {
    /// Begins with the whole direction, which is shortened `most` times.
    pub fn new(slope: f64, most: u32) -> LineSearch {
        LineSearch {
            slope,
            t: 1.0,
            shortenings: 0,
            most,
        }
    }

    /// Judges the part tried by the slope at its end. A state that `is_sound` says no to (inverted elements, a contact that was lost) is never
    /// accepted, and its slope says nothing of the minimum: the step is halved.
    pub fn judge(&mut self, is_sound: bool, slope_new: f64) -> Tried {
        if is_sound && 0.5 * (self.slope + slope_new) <= SLOPE * self.slope {
            return Tried::Accepted;
        }
        if self.shortenings == self.most || self.slope >= 0.0 {
            return Tried::GivenUp;
        }
        self.shortenings += 1;
        self.t *= if is_sound && slope_new.is_finite() {
            (-self.slope / (slope_new - self.slope)).clamp(0.1, 0.5) as f32
        } else {
            0.5
        };
        Tried::Shortened
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn takes_the_minimum_of_a_parabola_and_halves_what_is_not_sound() {
        // phi(t) = (t - 0.3)²: its slope is 2 (t - 0.3).
        let slope = |t: f32| 2.0 * (f64::from(t) - 0.3);
        let mut search = LineSearch::new(slope(0.0), SHORTENINGS);
        assert_eq!(search.judge(true, slope(1.0)), Tried::Shortened);
        assert!((search.t - 0.3).abs() < 1e-6, "{}", search.t);
        assert_eq!(search.judge(true, slope(search.t)), Tried::Accepted);

        let mut search = LineSearch::new(-1.0, SHORTENINGS);
        for shortenings in 1..=SHORTENINGS {
            assert_eq!(search.judge(false, -1.0), Tried::Shortened);
            assert_eq!(search.t, 0.5f32.powi(shortenings as i32));
        }
        assert_eq!(search.judge(false, -1.0), Tried::GivenUp);
        assert_eq!(
            LineSearch::new(1.0, SHORTENINGS).judge(true, 1.0),
            Tried::GivenUp
        );
    }
}
