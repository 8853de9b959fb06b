//! The largest eigenvalue of an element's stiffness in its present shape: what bounds the step of a law that stiffens.

use elements::{Deformation, Moduli, Tetrahedron};

/// Enough for a per cent; the safety factor covers the rest.
const ITERATIONS: u32 = 16;

/// Largest eigenvalue of the stiffness over the rest volume and the modulus of pressure waves at rest, `kappa + 4/3 mu`, 1/mm².
pub(super) fn stiffest(element: &Tetrahedron, state: &Deformation, moduli: Moduli) -> f64 {
    let unit = Tetrahedron {
        volume: 1.0,
        ..*element
    };
    let stiffness = unit.stiffness(state, moduli);
    let gradients = element.gradients;
    // Corners along the normals of their faces, as a pressure wave moves them, and a part of everything else.
    let mut vector = [0.0; 12];
    for (at, value) in vector.iter_mut().enumerate() {
        let along = match at / 3 {
            0 => -gradients.iter().map(|g| g[at % 3]).sum::<f64>(),
            corner => gradients[corner - 1][at % 3],
        };
        *value = along * (1.0 + 0.3 * (1.7 * at as f64).sin());
    }
    let mut largest = 0.0;
    for _ in 0..ITERATIONS {
        let image = stiffness.map(|row| row.iter().zip(&vector).map(|(k, v)| k * v).sum::<f64>());
        let length = image.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length == 0.0 || !length.is_finite() {
            return length;
        }
        largest = length / vector.iter().map(|x| x * x).sum::<f64>().sqrt();
        vector = image.map(|x| x / length);
    }
    largest / (moduli.bulk_pa + 4.0 / 3.0 * moduli.shear_pa)
}

#[cfg(test)]
mod tests {
    use super::stiffest;
    use elements::{Law, Material, Tetrahedron};

    fn element() -> Tetrahedron {
        let corners = [[0.0; 3], [2.0, 0.1, 0.0], [0.3, 1.5, -0.2], [0.2, 0.4, 1.8]];
        Tetrahedron::new([0, 1, 2, 3], corners, 1.0)
    }

    /// Corners of a body that is pressed by a part along x and keeps its volume.
    fn pressed(part: f64) -> [[f64; 3]; 4] {
        let corners = [[0.0; 3], [2.0, 0.1, 0.0], [0.3, 1.5, -0.2], [0.2, 0.4, 1.8]];
        let across = (1.0 - part).sqrt().recip() - 1.0;
        corners.map(|[x, y, z]| [-part * x, across * y, across * z])
    }

    fn brain(law: &str) -> Material {
        Material::default().with_law(law.parse::<Law>().unwrap())
    }

    #[test]
    fn no_motion_is_stiffer_than_it_tells() {
        let moduli = brain("ogden:-157,-18.7").moduli();
        let wave = moduli.bulk_pa + 4.0 / 3.0 * moduli.shear_pa;
        for part in [0.0, 0.2, 0.3] {
            let state = element().deformation(pressed(part));
            let stiffness = element().stiffness(&state, moduli);
            let largest = stiffest(&element(), &state, moduli) * wave * element().volume;
            for seed in 0..500 {
                let v: [f64; 12] = std::array::from_fn(|k| {
                    (seed as f64 * 0.37 + k as f64 * (1.3 + seed as f64)).sin()
                });
                let square: f64 = v.iter().map(|x| x * x).sum();
                let product: f64 = (0..12)
                    .map(|i| v[i] * (0..12).map(|j| stiffness[i][j] * v[j]).sum::<f64>())
                    .sum();
                assert!(
                    product / square < 1.02 * largest,
                    "{part}: {}",
                    product / square
                );
            }
        }
    }

    /// The table of measured stiffening: 30 % of compression, neo-Hookean's critical step to 0.88, a capped exponent of -24 to 0.78.
    #[test]
    fn compression_stiffens_ogden_more_than_neo_hookean() {
        let factor = |material: &Material| {
            let at = |part| {
                let state = element().deformation(pressed(part));
                stiffest(&element(), &state, material.moduli())
            };
            (at(0.0) / at(0.3)).sqrt()
        };
        let ogden = factor(&brain("ogden:-83.9,-24"));
        let neo_hookean = factor(&Material::default());
        assert!(ogden < neo_hookean, "{ogden} {neo_hookean}");
        assert!((0.5..1.0).contains(&ogden), "{ogden}");
    }
}
