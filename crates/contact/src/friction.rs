//! Force at one contact: Signorini's condition and Coulomb's law in a local frame (normal, two tangents).
//!
//! The sweeps around it (block Gauss-Seidel) call this for one contact after another with the
//! forces of the others fixed; `W` is the 3x3 block of the compliance there. See Jourdan, Alart and
//! Jean, A Gauss-Seidel like algorithm to solve frictional contact problems, Comput. Methods Appl.
//! Mech. Engrg. 155, 1998.
//!
//! With `r = b + W f`, `r` the gap and the two components of slip under the force `f`, `W` symmetric positive definite:
//! `0 <= f_n _|_ r_n >= 0`, `|f_t| <= mu f_n`, and `f_t = -mu f_n r_t / |r_t|` where it slips.

use parry3d::math::{Matrix, Vector};

/// Rounds of the slip iteration; the sweeps around it go on from where it stops.
const ROUNDS: usize = 12;
/// A round that moves the force by less than this part of its normal component is the last: the sweeps leave more.
const SETTLED: f32 = 1e-5;

/// Unit tangents that complete a unit normal to a right-handed frame, the columns of a matrix: normal, tangent, tangent.
pub fn frame(normal: Vector) -> Matrix {
    // The axis that the normal is least along keeps the product long.
    let size = normal.abs();
    let axis = if size.x <= size.y && size.x <= size.z {
        Vector::X
    } else if size.y <= size.z {
        Vector::Y
    } else {
        Vector::Z
    };
    let first = axis.cross(normal).normalize();
    Matrix::from_cols(normal, first, normal.cross(first))
}

/// Length of the tangential part. Not `hypot`, which is the system's and differs between systems.
fn across(force: Vector) -> f32 {
    (force.y * force.y + force.z * force.z).sqrt()
}

/// The tangential part of a local force, cut to the friction cone.
pub fn clamp_tangential(force: Vector, friction: f32) -> Vector {
    let limit = friction * force.x.max(0.0);
    let size = across(force);
    if size <= limit {
        return force;
    }
    let scale = limit / size;
    Vector::new(force.x, force.y * scale, force.z * scale)
}

/// The force at one contact. `inverse` is that of `w`; `guess` is where a slip's direction is searched from.
/// Three cases: the gap is open and there is no force; the force that stops all slip lies in the
/// friction cone and is taken; or the contact slips and its direction is iterated for.
pub fn coulomb(w: &Matrix, inverse: &Matrix, b: Vector, friction: f32, guess: Vector) -> Vector {
    if b.x >= 0.0 {
        return Vector::ZERO;
    }
    if friction <= 0.0 {
        return Vector::new(-b.x / w.x_axis.x, 0.0, 0.0);
    }
    // Signorini and no slip at once: `b + W f = 0`.
    let stick = -(*inverse * b);
    if stick.x >= 0.0 && across(stick) <= friction * stick.x {
        return stick;
    }
    let mut force = clamp_tangential(guess, friction);
    for _ in 0..ROUNDS {
        let next = slide(w, b, friction, force);
        let moved = (next - force).abs().max_element();
        force = next;
        if moved <= SETTLED * force.x {
            break;
        }
    }
    force
}

/// A round of the slip iteration: the normal force that closes the gap, then a step against the slip, cut to the cone.
fn slide(w: &Matrix, b: Vector, friction: f32, mut force: Vector) -> Vector {
    let coupling = w.y_axis.x * force.y + w.z_axis.x * force.z;
    force.x = (-(b.x + coupling) / w.x_axis.x).max(0.0);
    let slip = b + *w * force;
    // Two over the sum of the tangential block's eigenvalues: the fastest step of a gradient method.
    let rate = 2.0 / (w.y_axis.y + w.z_axis.z);
    force.y -= rate * slip.y;
    force.z -= rate * slip.z;
    clamp_tangential(force, friction)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What ends early obeys Signorini's condition and Coulomb's law as well as all rounds do.
    #[test]
    fn the_force_slides_against_its_slip_within_the_cone() {
        let w = Matrix::from_cols(
            Vector::new(0.9, 0.1, -0.2),
            Vector::new(0.1, 0.7, 0.05),
            Vector::new(-0.2, 0.05, 0.8),
        );
        let inverse = w.inverse();
        let mut slides = 0;
        for at in 0..400 {
            let turn = 0.1 * at as f32;
            let b = Vector::new(-0.3, 0.5 * turn.cos(), 0.4 * (1.7 * turn).sin());
            let friction = 0.05 + 0.001 * at as f32;
            let mut force = clamp_tangential(Vector::new(0.4, 0.1, -0.1), friction);
            // The sweeps around it start where the last one stopped.
            for _ in 0..3 {
                force = coulomb(&w, &inverse, b, friction, force);
            }
            let slip = b + w * force;
            assert!(slip.x.abs() < 1e-4, "{at}: a gap of {} under load", slip.x);
            let limit = friction * force.x;
            assert!(
                across(force) <= limit * (1.0 + 1e-5),
                "{at}: outside of the cone"
            );
            let speed = across(slip);
            if speed > 1e-3 {
                slides += 1;
                let along = (force.y * slip.y + force.z * slip.z) / speed;
                assert!(
                    (along + limit).abs() < 1e-3 * limit,
                    "{at}: {along} of {limit}"
                );
            }
        }
        assert!(slides > 100, "{slides} slide");
    }
}
