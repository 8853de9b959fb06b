//! What bounds the step of an element in its present shape.
//!
//! Pressure waves cross it along its thinnest direction: the largest eigenvalue of its stiffness over volume and modulus at rest is near
//! `sum_a |cof F dN_a/dX|²`, the gradients in the present shape. A law that stiffens adds to the wave's modulus `kappa + 4/3 mu`: its second part
//! goes with the steepest principal stress. Fibres add what they pull with along their direction; slack ones what they will as soon as they are taut.

use elements::vector::dot;
use elements::{Deformation, Law, Moduli, stiffening, stiffest_pull};

/// Least `det F` by which the second part grows.
const LEAST_DET: f64 = 0.05;

/// An estimate of the largest eigenvalue, 1/mm²; `gradients` are those of the four shape functions.
pub(super) fn stiffest(gradients: &[[f64; 3]; 4], state: &Deformation, moduli: Moduli) -> f64 {
    let mut bound = 0.0;
    for gradient in gradients {
        for row in state.cofactor {
            let image = dot(row, *gradient);
            bound += image * image;
        }
    }
    let own = match moduli.law.matrix() {
        Law::NeoHookean(_) | Law::MooneyRivlin(_) => bound,
        Law::Ogden(_) | Law::Yeoh(_) | Law::VerondaWestmann(_) | Law::Fibred(_) => {
            let shear = 4.0 / 3.0 * moduli.shear_pa;
            let stiff = stiffening(state, moduli.law).max(1.0) / state.det.max(LEAST_DET);
            bound * (moduli.bulk_pa + shear * stiff) / (moduli.bulk_pa + shear)
        }
    };
    match moduli.law.fibres() {
        None => own,
        Some(_) => {
            let wave = moduli.bulk_pa + 4.0 / 3.0 * moduli.shear_pa;
            own + stiffest_pull(gradients, state, &moduli) / wave
        }
    }
}

#[cfg(test)]
mod tests {
    use super::stiffest;
    use elements::{Deformation, Law, Material, Moduli, Tetrahedron};

    const CORNERS: [[f64; 3]; 4] = [[0.0; 3], [2.0, 0.1, 0.0], [0.3, 1.5, -0.2], [0.2, 0.4, 1.8]];

    fn element() -> Tetrahedron {
        Tetrahedron::new([0, 1, 2, 3], CORNERS, 1.0)
    }

    /// Stretched by a part along x and sheared, with its volume.
    fn deformed(part: f64, shear: f64) -> Deformation {
        let across = (1.0 + part).sqrt().recip() - 1.0;
        element()
            .deformation(CORNERS.map(|[x, y, z]| [part * x + shear * z, across * y, across * z]))
    }

    /// By squaring the stiffness that the tangent gives.
    fn largest_eigenvalue(state: &Deformation, moduli: Moduli) -> f64 {
        let mut square = element().stiffness(state, moduli);
        let (mut scale, mut power) = (1.0, 1.0);
        for _ in 0..12 {
            let trace = (0..12).map(|i| square[i][i]).sum::<f64>();
            scale *= trace.powf(1.0 / power);
            power *= 2.0;
            let unit = square.map(|row| row.map(|x| x / trace));
            square = [0; 12].map(|_| [0.0; 12]);
            for i in 0..12 {
                for j in 0..12 {
                    square[i][j] = (0..12).map(|k| unit[i][k] * unit[k][j]).sum();
                }
            }
        }
        scale
    }

    fn estimate(state: &Deformation, moduli: Moduli) -> f64 {
        let [a, b, c] = element().gradients;
        let first = [0, 1, 2].map(|k| -(a[k] + b[k] + c[k]));
        stiffest(&[first, a, b, c], state, moduli)
    }

    #[test]
    fn it_follows_the_largest_eigenvalue_of_the_tangent() {
        for text in ["ogden:-157,-18.7", "ogden:-83.9,-24", "ogden:-430,-4.7"] {
            let law: Law = text.parse().unwrap();
            let moduli = Material::default().with_law(law).moduli();
            let rest = deformed(0.0, 0.0);
            let unit = largest_eigenvalue(&rest, moduli) / estimate(&rest, moduli);
            for part in [-0.4, -0.3, -0.2, -0.1, 0.1, 0.2, 0.3] {
                for shear in [0.0, 0.3] {
                    let state = deformed(part, shear);
                    let ratio =
                        estimate(&state, moduli) * unit / largest_eigenvalue(&state, moduli);
                    assert!(
                        (0.85..1.5).contains(&ratio),
                        "{text}, {part}, {shear}: {ratio}"
                    );
                }
            }
        }
    }

    #[test]
    fn compression_beyond_the_data_shortens_the_step() {
        let law: Law = "ogden:-83.9,-24".parse().unwrap();
        let ratio = |law| {
            let moduli = Material::default().with_law(law).moduli();
            estimate(&deformed(-0.3, 0.0), moduli) / estimate(&deformed(0.0, 0.0), moduli)
        };
        assert!(ratio(law) > 1.1 * ratio(Law::default()));
    }
}
