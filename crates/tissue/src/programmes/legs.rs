//! A motion as legs: where the tool is relative to its start, and how long it takes to get there.

use super::Specification;
use crate::schemes::SplitMix;
use contact::{Pose, Rotation, Vector};

/// How far off the tissue a tool starts, mm.
pub(super) const CLEARANCE_MM: f64 = 0.3;
/// Slack at the end, s: what the tissue does when it is let go.
const SETTLE_S: f64 = 0.6;

/// A state of the hand, relative to the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct State {
    /// Into the tissue, mm.
    inward: f64,
    /// Along the tool's own z, mm.
    along: f64,
    /// About the tool's x through its tip, radians.
    tilt: f64,
    /// About its shaft, radians.
    turn: f64,
    grasp: bool,
}

/// Legs of one tool, each a state and the time at which it is reached.
#[derive(Clone, Debug, Default)]
pub(super) struct Legs {
    legs: Vec<(f64, State)>,
    end: f64,
    slide: f64,
}

impl Legs {
    /// Draws them; none goes in farther than `deepest`, mm.
    pub fn new(specification: &Specification, deepest: f64, random: &mut SplitMix) -> Self {
        let depth = random.within(specification.depth_mm).min(deepest);
        let press = random.speed(specification.press_mm_s);
        let slide = random.within(specification.slide_mm);
        let slide_speed = random.speed(specification.slide_mm_s);
        let pull = random.within(specification.pull_mm);
        let hold = random.within(specification.hold_s);
        let lift = random.speed(specification.lift_mm_s);
        let mut legs = Self {
            slide,
            ..Self::default()
        };
        let mut now = State::default();
        legs.go(now, 0.1);
        now.inward = depth + CLEARANCE_MM;
        legs.go(now, now.inward / press);
        if slide > 0.0 {
            legs.go(now, 0.1);
            now.along = slide;
            legs.go(now, slide / slide_speed);
        }
        if specification.wobble_rad[0] > 0.0 {
            let [tilt, turn] = specification.wobble_rad;
            for sign in [1.0, -1.0, 0.0] {
                (now.tilt, now.turn) = (sign * tilt, -sign * turn);
                legs.go(now, 0.5);
            }
        }
        if pull > 0.0 {
            now.grasp = true;
            legs.go(now, 0.1);
            now.inward -= pull;
            legs.go(now, pull / 10.0);
        }
        legs.go(now, hold);
        if now.grasp {
            now.grasp = false;
            legs.go(now, 0.05);
        }
        // Out at its speed to where it touched first, then away.
        if now.inward > -0.5 {
            let way = now.inward + 0.5;
            now.inward = -0.5;
            legs.go(now, way / lift);
        }
        now.inward -= 5.0;
        legs.go(now, 0.1);
        legs.go(now, SETTLE_S);
        legs
    }

    /// The same after a pause before it all.
    pub fn delayed(mut self, seconds: f64) -> Self {
        self.legs.iter_mut().for_each(|(at, _)| *at += seconds);
        self.end += seconds;
        self
    }

    fn go(&mut self, to: State, seconds: f64) {
        self.end += seconds;
        self.legs.push((self.end, to));
    }

    /// Time of the whole motion, s.
    pub fn seconds(&self) -> f64 {
        self.end
    }

    /// Way along the surface, mm.
    pub fn slide(&self) -> f64 {
        self.slide
    }

    fn state(&self, seconds: f64) -> State {
        let mut before = (0.0, State::default());
        for leg in &self.legs {
            if seconds <= leg.0 {
                let t = ((seconds - before.0) / (leg.0 - before.0).max(1e-9)).clamp(0.0, 1.0);
                let mix = |a: f64, b: f64| a + (b - a) * t;
                let (a, b) = (before.1, leg.1);
                return State {
                    inward: mix(a.inward, b.inward),
                    along: mix(a.along, b.along),
                    tilt: mix(a.tilt, b.tilt),
                    turn: mix(a.turn, b.turn),
                    grasp: b.grasp,
                };
            }
            before = *leg;
        }
        before.1
    }

    /// Pose at a time, and whether it grasps. `start` is the pose at the start, its y up the shaft; `tip` is the pivot on the
    /// shaft, in the tool's frame; `inward` the way in.
    pub fn pose(&self, seconds: f64, start: &Pose, tip: Vector, inward: Vector) -> (Pose, bool) {
        let state = self.state(seconds);
        let turn = Rotation::from_rotation_y(state.turn as f32)
            * Rotation::from_rotation_x(state.tilt as f32);
        let along = start.rotation * Vector::Z;
        let moved = inward * state.inward as f32 + along * state.along as f32;
        let pivot = start.transform_point(tip) + moved;
        let rotation = (start.rotation * turn).normalize();
        let pose = Pose::from_parts(pivot - rotation * tip, rotation);
        (pose, state.grasp)
    }
}
