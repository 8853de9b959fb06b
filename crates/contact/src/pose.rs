//! Where a tool is: a position (mm) and a rotation, checked, and the way from one pose to another.

use parry3d::math::{Pose, Rotation, Vector};

/// A pose that no tool can have.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PoseError {
    #[error("the pose is not finite")]
    NotFinite,
    #[error("the rotation has length {length}, not 1; give a unit quaternion x, y, z, w")]
    NotUnit { length: f32 },
}

/// A pose from a position in mm and a unit quaternion `x, y, z, w` (off by 1 % at most, then normalised).
///
/// # Errors
/// [`PoseError`] for numbers that are not finite or a quaternion that is no rotation.
pub fn checked(position: [f32; 3], rotation: [f32; 4]) -> Result<Pose, PoseError> {
    let finite = |values: &[f32]| values.iter().all(|v| v.is_finite());
    if !finite(&position) || !finite(&rotation) {
        return Err(PoseError::NotFinite);
    }
    let rotation = Rotation::from_array(rotation);
    let length = rotation.length();
    if length.is_nan() || (length - 1.0).abs() > 1e-2 {
        return Err(PoseError::NotUnit { length });
    }
    Ok(Pose::from_parts(
        Vector::from(position),
        rotation.normalize(),
    ))
}

/// The pose at part `t` in [0, 1] of the way: positions on a line, rotations at even speed the shorter way round.
/// The ends are exact.
pub fn between(from: &Pose, to: &Pose, t: f32) -> Pose {
    if t <= 0.0 {
        return *from;
    }
    if t >= 1.0 {
        return *to;
    }
    Pose::from_parts(
        from.translation + (to.translation - from.translation) * t,
        from.rotation.slerp(to.rotation, t),
    )
}

/// Angle between two rotations, radians in [0, pi]; exact for small ones too.
pub fn angle(from: &Rotation, to: &Rotation) -> f32 {
    let turn = from.inverse() * *to;
    2.0 * libm::atan2f(turn.xyz().length(), turn.w.abs())
}
