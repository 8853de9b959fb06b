use super::{Axis, Equilibrium, Obstacle, Section, Shape};
use crate::material::Material;
use elements::{Deformation, Law, Ogden, stress};
use std::f64::consts::PI;

fn lines(count: usize, length: f64) -> Vec<f64> {
    (0..=count)
        .map(|k| length * k as f64 / count as f64)
        .collect()
}

/// Free ends: the state of each element is that of a bar, whatever the law.
#[test]
fn a_bar_between_slippery_plates_stays_a_bar() {
    let law = Law::Ogden(Ogden::new(&[[-150.0, -18.0]]).unwrap());
    for law in [Law::default(), law] {
        let material = Material::default().with_law(law);
        let section = Section::grid(&lines(4, 6.0), &lines(5, 10.0));
        let mut bar = Equilibrium::new(section, &material);
        let (low, high) = (bar.section().level(0), bar.section().level(5));
        bar.hold(&low, Axis::Along, 0.0);
        bar.hold(&high, Axis::Along, -2.0);
        bar.advance(0.5).unwrap();
        bar.advance(1.0).unwrap();
        let side = bar.section().node(4, 2);
        let across = 1.0 + bar.displacement(side, Axis::Across) / 6.0;
        let f = [[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, 0.8]];
        let stress = stress(&Deformation::of(f), material.moduli());
        assert!(stress[0][0].abs() < 1e-4 * stress[2][2].abs(), "{stress:?}");
        let force = bar.reaction(&high, Axis::Along);
        let wanted = 1e-3 * stress[2][2] * PI * 36.0;
        assert!((force / wanted - 1.0).abs() < 1e-6, "{force} of {wanted}");
        assert!((bar.reaction(&low, Axis::Along) / -wanted - 1.0).abs() < 1e-6);
    }
}

/// A glued cylinder's side rolls onto the plate; what plate and side take is what the middle bears.
#[test]
fn a_side_that_meets_the_plate_presses_on_it() {
    let material = Material::default();
    let section = Section::grid(&lines(16, 25.0), &lines(10, 15.0));
    let mut body = Equilibrium::new(section, &material);
    let (middle, plate) = (body.section().level(0), body.section().level(10));
    let side = body.section().side(16);
    body.hold(&middle, Axis::Along, 0.0);
    body.hold(&plate, Axis::Along, -6.0);
    body.hold(&plate, Axis::Across, 0.0);
    let obstacle = Obstacle {
        shape: Shape::Plate,
        low: 15.0,
        motion: -6.0,
        stiffness: 50.0 * material.shear_pa(),
    };
    body.meet(obstacle, side);
    body.advance(1.0).unwrap();
    let force = body.push() - body.reaction(&plate, Axis::Along);
    assert!(body.push() > 0.01 * force, "{}", body.push());
    let borne = body.reaction(&middle, Axis::Along);
    assert!((force / borne - 1.0).abs() < 1e-6, "{force} {borne}");
    // Beyond the reach of elements: the state that was found stays.
    let error = body.advance(2.6).unwrap_err();
    assert!(error.reached >= 1.0, "{error}");
    assert!(body.push() > 0.0);
}
