//! The passivity observer and its controller (Hannaford and Ryu, *Time-domain passivity control of haptic interfaces*, IEEE Transactions on Robotics and
//! Automation 18(1), 2002): the energy that forces have given to the hand is summed exactly, from the force that a device held
//! over each interval and the way it went; where more came out than went in, a damper takes the difference back.

use ::contact::{Pose, Rotation, Vector};

/// What came out too much is taken back over this time, s: within one call it would be a blow.
const BACK_S: f64 = 0.02;

/// The observer of one tool; SI units.
#[derive(Debug, Default)]
pub struct Observer {
    held: [Vector; 2],
    /// Given to the hand since it last touched, J; negative: taken from it.
    given: f64,
}

/// Turn from one rotation to another, a rotation vector.
fn turn(from: &Rotation, to: &Rotation) -> Vector {
    let turn = *to * from.inverse();
    let sign = if turn.w < 0.0 { -2.0 } else { 2.0 };
    let axis = turn.xyz();
    let size = axis.length();
    match size > 1e-6 {
        true => axis * (sign * size.atan2(turn.w.abs()) / size),
        false => axis * sign,
    }
}

impl Observer {
    /// The tool has gone from one pose to another (mm) under the wrench that was held.
    pub fn observe(&mut self, from: &Pose, to: &Pose) {
        let way = (to.translation - from.translation) * 1e-3;
        let turn = turn(&from.rotation, &to.rotation);
        self.given += f64::from(self.held[0].dot(way)) + f64::from(self.held[1].dot(turn));
    }

    /// More energy out than in, J.
    pub fn excess(&self) -> f64 {
        self.given.max(0.0)
    }

    /// Damping that takes the excess back within [`BACK_S`] at a velocity, N s/m, at most `limit`.
    pub fn damping(&self, velocity: Vector, limit: f32) -> f32 {
        let power = f64::from(velocity.length_squared()) * BACK_S;
        if self.given <= 0.0 || power <= 0.0 {
            return 0.0;
        }
        (self.given / power).min(f64::from(limit)) as f32
    }

    /// The wrench that is held until the next call. Out of contact what the hand has put in is forgotten: nothing is stored.
    pub fn hold(&mut self, force: Vector, torque: Vector) {
        self.held = [force, torque];
        if force == Vector::ZERO && torque == Vector::ZERO {
            self.given = self.given.max(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_mm: f32) -> Pose {
        Pose::from_translation(Vector::new(x_mm, 0.0, 0.0))
    }

    #[test]
    fn a_spring_that_is_stiffer_on_the_way_out_is_damped_until_it_gives_nothing() {
        let mut observer = Observer::default();
        let (mut x, mut excess, mut total) = (0.0f32, 0.0f64, 0.0f64);
        for k in 0..4000 {
            let phase = k as f32 * 1e-3 * 6.0;
            let to = 3.0 * phase.sin().max(-0.2);
            observer.observe(&at(x), &at(to));
            total += f64::from(observer.held[0].x) * f64::from(to - x) * 1e-3;
            let v = Vector::new(to - x, 0.0, 0.0); // mm/ms, so m/s
            let stiffness = if to < x { 0.06 } else { 0.05 };
            let force = Vector::new(-stiffness * to.max(0.0), 0.0, 0.0);
            let damping = observer.damping(v, 1e3);
            let force = match to > 0.0 {
                true => force - v * damping,
                false => Vector::ZERO,
            };
            observer.hold(force, Vector::ZERO);
            x = to;
            excess = excess.max(observer.excess());
        }
        assert!(excess > 0.0, "the spring is active");
        // The spring by itself gives 45 µJ in each of four cycles.
        assert!(total < 1e-5, "{total} J given");
    }

    #[test]
    fn a_turn_is_read_as_a_rotation_vector() {
        let axis = Vector::new(0.6, 0.0, 0.8);
        let to = Rotation::from_axis_angle(axis, 0.3);
        let found = turn(&Rotation::IDENTITY, &to);
        assert!((found - axis * 0.3).length() < 1e-6);
    }
}
