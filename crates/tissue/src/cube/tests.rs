//! A cube of bricks against what is known without them.

use super::brick::{NODES, points};
use super::{Motion, stresses};
use crate::material::Material;
use elements::{Law, Ogden};

/// Sums of the shape functions' gradients over the nodes, times a linear and a quadratic displacement, are its derivatives.
#[test]
fn gradients_are_exact_for_quadratic_displacements() {
    let half = [0.2, 0.3, 0.5];
    let places = NODES.map(|n| [0, 1, 2].map(|k| 1.0 + f64::from(n[k]) * half[k]));
    let own = points(&places);
    let volume: f64 = own.iter().map(|point| point.volume).sum();
    assert!((volume - 8.0 * 0.03).abs() < 1e-14);
    for (corner, point) in own.iter().enumerate() {
        let at = [0, 1, 2].map(|k| 1.0 + half[k] * f64::from(NODES[corner][k]) / 3.0f64.sqrt());
        let sum = |of: &dyn Fn([f64; 3]) -> f64, k: usize| -> f64 {
            let pairs = places.iter().zip(&point.gradients);
            pairs
                .map(|(place, gradient)| of(*place) * gradient[k])
                .sum()
        };
        let of = |p: [f64; 3]| 2.0 * p[0] * p[1] - p[2] * p[2] + 3.0 * p[1];
        let wanted = [2.0 * at[1], 2.0 * at[0] + 3.0, -2.0 * at[2]];
        for k in 0..3 {
            assert!((sum(&of, k) - wanted[k]).abs() < 1e-12, "{corner} {k}");
            assert!(sum(&|_| 1.0, k).abs() < 1e-12);
        }
    }
}

fn material(poisson: f64) -> Material {
    Material {
        young_pa: 2.0 * (1.0 + poisson),
        poisson,
        ..Material::default()
    }
}

/// Ends that hold tissue of Poisson's ratio 0 do not hinder it: a bar; and meshes agree with each other where it is nearly incompressible.
#[test]
fn a_cube_is_a_bar_without_contraction_and_does_not_lock() {
    let small = 1e-4;
    let bar = stresses(Motion::Pull, &material(0.0), &[small], 2).unwrap();
    assert!((bar[0] / (2.0 * small) - 1.0).abs() < 1e-3, "{bar:?}");
    for (motion, range) in [(Motion::Pull, 1.22..1.27), (Motion::Slide, 0.72..0.77)] {
        let whole = if motion == Motion::Pull { 2.98 } else { 1.0 };
        let [coarse, fine] = [2, 3].map(|cells| {
            stresses(motion, &material(0.49), &[0.01], cells).unwrap()[0] / (0.01 * whole)
        });
        assert!(range.contains(&fine), "{motion:?}: {coarse} {fine}");
        assert!((coarse / fine - 1.0).abs() < 0.03, "{coarse} {fine}");
    }
}

/// Pulled and pressed, the strain energy's slope: what a small further motion takes is the force.
#[test]
fn a_law_that_stiffens_is_solved_to_a_tenth() {
    let law = Ogden::new(&[[-0.05, -40.0]]).unwrap();
    let own = material(0.4).with_law(Law::Ogden(law));
    let pressed = stresses(Motion::Pull, &own, &[-0.05, -0.1], 2).unwrap();
    assert!(
        pressed[1] < 2.0 * pressed[0] && pressed[0] < 0.0,
        "{pressed:?}"
    );
    let slid = stresses(Motion::Slide, &own, &[0.05, 0.1, 0.15, 0.2], 2).unwrap();
    assert!(slid[3] > 4.0 * slid[0] && slid[0] > 0.0, "{slid:?}");
}
