//! The laws in f64: stress as the derivative of energy, tangent at rest, and closed forms.

#![allow(
    clippy::needless_range_loop,
    reason = "components of tensors read best by index"
)]

use elements::vector::dot;
use elements::{
    Deformation, Law, Material, Moduli, MooneyRivlin, VerondaWestmann, Yeoh, energy_density, stress,
};

type Matrix = [[f64; 3]; 3];

fn laws() -> Vec<Moduli> {
    let shares = [0.0, 0.3, MooneyRivlin::default().c01_share, 1.0];
    let mooney = shares.map(|c01_share| Law::MooneyRivlin(MooneyRivlin { c01_share }));
    let all = [Law::default()].into_iter().chain(mooney);
    all.map(|law| {
        Material {
            law,
            ..Material::default()
        }
        .moduli()
    })
    .collect()
}

/// Those that stiffen: within what the exponential is, and beyond its cap.
fn growing() -> Vec<Moduli> {
    let yeoh = Yeoh {
        c2_over_c1: 1.5,
        c3_over_c1: 0.4,
    };
    let exponential = |beta| Law::VerondaWestmann(VerondaWestmann { beta });
    let all = [Law::Yeoh(yeoh), exponential(2.0), exponential(9.0)];
    all.map(|law| {
        Material {
            law,
            ..Material::default()
        }
        .moduli()
    })
    .into()
}

/// Cauchy stress `P F^T / J`.
fn cauchy(f: Matrix, moduli: Moduli) -> Matrix {
    let state = Deformation::of(f);
    let p = stress(&state, moduli);
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| dot(p[i], f[j]) / state.det))
}

/// `C10`, `C01`, Pa.
fn constants(moduli: Moduli) -> [f64; 2] {
    let share = match moduli.law {
        Law::MooneyRivlin(law) => law.c01_share,
        _ => 0.0,
    };
    [1.0 - share, share].map(|part| 0.5 * moduli.shear_pa * part)
}

fn near(got: f64, want: f64, scale: f64) {
    assert!((got - want).abs() < 1e-9 * scale, "{got} for {want}");
}

/// Verifies REQ-081.
#[test]
fn stress_is_the_derivative_of_the_energy() {
    let f = [[1.3, 0.2, -0.1], [-0.15, 0.8, 0.25], [0.05, -0.3, 1.1]];
    for moduli in laws().into_iter().chain(growing()) {
        let p = stress(&Deformation::of(f), moduli);
        for i in 0..3 {
            for j in 0..3 {
                let at = |step: f64| {
                    let mut f = f;
                    f[i][j] += step;
                    energy_density(&Deformation::of(f), moduli)
                };
                let step = 1e-3;
                // Fourth order.
                let slope = (8.0 * (at(step) - at(-step)) - (at(2.0 * step) - at(-2.0 * step)))
                    / (12.0 * step);
                near(p[i][j], slope, 30.0 * moduli.bulk_pa);
                assert!((p[i][j] - slope).abs() < 1e-3 * moduli.shear_pa);
            }
        }
    }
}

#[test]
fn at_rest_every_law_is_linear_elasticity() {
    let gradient = [[0.3, -0.2, 0.5], [0.1, 0.4, -0.6], [0.7, 0.2, -0.1]];
    let trace = gradient[0][0] + gradient[1][1] + gradient[2][2];
    for moduli in laws().into_iter().chain(growing()) {
        assert!(
            stress(&Deformation::of(identity()), moduli)
                .as_flattened()
                .iter()
                .all(|p| p.abs() < 1e-9)
        );
        let at = |step: f64| {
            let mut f = identity();
            for i in 0..3 {
                for j in 0..3 {
                    f[i][j] += step * gradient[i][j];
                }
            }
            stress(&Deformation::of(f), moduli)
        };
        let step = 1e-4;
        let (ahead, behind) = (at(step), at(-step));
        for i in 0..3 {
            for j in 0..3 {
                let tangent = (ahead[i][j] - behind[i][j]) / (2.0 * step);
                let shear = moduli.shear_pa * (gradient[i][j] + gradient[j][i]);
                let lambda = moduli.bulk_pa - 2.0 / 3.0 * moduli.shear_pa;
                let want = shear + if i == j { lambda * trace } else { 0.0 };
                assert!(
                    (tangent - want).abs() < 1e-6 * moduli.bulk_pa,
                    "{tangent} for {want}"
                );
            }
        }
    }
}

fn identity() -> Matrix {
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
}

/// `sigma_1 - sigma_2 = 2 (l² - 1/l) (C10 + C01 / l)` of a stretch `l` without change of volume.
#[test]
fn uniaxial_stretch() {
    for moduli in laws() {
        let [c10, c01] = constants(moduli);
        for l in [0.5, 0.8, 1.2, 2.0f64] {
            let across = l.powf(-0.5);
            let sigma = cauchy(
                [[l, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, across]],
                moduli,
            );
            let want = 2.0 * (l * l - 1.0 / l) * (c10 + c01 / l);
            near(sigma[0][0] - sigma[1][1], want, moduli.bulk_pa);
        }
    }
}

/// The same with `2 dW/dI1 = mu a h(x)` and `2 dW/dI2 = mu b`: `sigma_1 - sigma_2 = mu (l² - 1/l) (a h + b / l)`.
#[test]
fn uniaxial_stretch_of_laws_that_stiffen() {
    for moduli in growing() {
        for l in [0.6, 0.9, 1.1, 1.6f64] {
            let across = l.powf(-0.5);
            let sigma = cauchy(
                [[l, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, across]],
                moduli,
            );
            let x = l * l + 2.0 / l - 3.0;
            let (first, second) = match moduli.law {
                Law::Yeoh(law) => (
                    1.0 + x * (2.0 * law.c2_over_c1 + 3.0 * x * law.c3_over_c1),
                    0.0,
                ),
                Law::VerondaWestmann(law) => {
                    let y = law.beta * x;
                    let slope = y.min(3.0).exp() * (1.0 + (y - 3.0).max(0.0));
                    (2.0 * slope, -1.0)
                }
                _ => unreachable!(),
            };
            let want = moduli.shear_pa * (l * l - 1.0 / l) * (first + second / l);
            near(sigma[0][0] - sigma[1][1], want, 10.0 * moduli.bulk_pa);
        }
    }
}

/// `sigma_12 = 2 (C10 + C01) g`, `sigma_11 - sigma_33 = 2 C10 g²`, `sigma_22 - sigma_33 = -2 C01 g²`.
#[test]
fn simple_shear() {
    for moduli in laws() {
        let [c10, c01] = constants(moduli);
        for g in [-1.0, 0.2, 0.7] {
            let sigma = cauchy([[1.0, g, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], moduli);
            near(sigma[0][1], 2.0 * (c10 + c01) * g, moduli.bulk_pa);
            near(sigma[0][0] - sigma[2][2], 2.0 * c10 * g * g, moduli.bulk_pa);
            near(
                sigma[1][1] - sigma[2][2],
                -2.0 * c01 * g * g,
                moduli.bulk_pa,
            );
        }
    }
}

/// `sigma = kappa (J - 1) I`, whatever the law.
#[test]
fn dilation() {
    for moduli in laws() {
        for a in [0.7, 0.95, 1.3f64] {
            let sigma = cauchy([[a, 0.0, 0.0], [0.0, a, 0.0], [0.0, 0.0, a]], moduli);
            let want = moduli.bulk_pa * (a.powi(3) - 1.0);
            for i in 0..3 {
                for j in 0..3 {
                    near(sigma[i][j], if i == j { want } else { 0.0 }, moduli.bulk_pa);
                }
            }
        }
    }
}

#[test]
fn a_law_is_named_by_text_and_by_json() {
    let all = laws().into_iter().chain(growing());
    for law in all.map(|moduli| moduli.law) {
        assert_eq!(law.to_string().parse::<Law>().unwrap(), law);
    }
    for (text, word) in [
        ("ogden", "unknown"),
        ("mooney-rivlin:x", "not a number"),
        ("mooney-rivlin:1.5", "law.c01_share"),
        ("mooney-rivlin:NaN", "law.c01_share"),
        ("neo-hookean:1", "unknown"),
        ("yeoh", "unknown"),
        ("yeoh:1,x", "`x` is not a number"),
        ("yeoh:-0.1", "law.c2_over_c1"),
        ("yeoh:-0.1", "not elliptic"),
        ("yeoh:1,-0.1", "law.c3_over_c1"),
        ("yeoh:1,1e9", "at most 1000"),
        ("veronda-westmann:0.1", "law.beta"),
        ("veronda-westmann:NaN", "law.beta"),
    ] {
        let error = text.parse::<Law>().unwrap_err();
        assert!(error.contains(word), "{error}");
    }
}
