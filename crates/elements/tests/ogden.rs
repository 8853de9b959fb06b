//! Ogden's law in f64: energy, stress, tangent, closed forms, and the constants that it refuses.

#![allow(
    clippy::needless_range_loop,
    reason = "components of tensors read best by index"
)]

mod differences;

use differences::{Matrix, largest, slope};
use elements::vector::dot;
use elements::{
    Deformation, Law, Material, Moduli, MooneyRivlin, Ogden, Tetrahedron, energy_density, stress,
    tangent,
};

/// Laws of brain, of rubber, with terms of opposite exponents and of whole and broken ones.
const LAWS: [&[[f64; 2]]; 6] = [
    &[[-157.0, -18.7]],
    &[[-163.0, -18.0]],
    &[[-29.0, -24.0]],
    &[[-359.0, -4.7]],
    &[[500.0, 2.0], [-700.0, -2.0]],
    &[[630.0, 1.3], [1.2, 5.0], [-10.0, -2.0]],
];

fn moduli(law: Law) -> Moduli {
    Material::default().with_law(law).moduli()
}

fn ogden(terms: &[[f64; 2]]) -> Moduli {
    moduli(Law::Ogden(Ogden::new(terms).unwrap()))
}

fn laws() -> impl Iterator<Item = Moduli> {
    LAWS.into_iter().map(ogden)
}

fn diagonal([a, b, c]: [f64; 3]) -> Matrix {
    [[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]]
}

fn product(a: Matrix, b: Matrix) -> Matrix {
    a.map(|row| [0, 1, 2].map(|j| (0..3).map(|k| row[k] * b[k][j]).sum()))
}

/// A rotation about an axis that lies along no coordinate.
fn turned(angle: f64) -> Matrix {
    let (s, c) = angle.sin_cos();
    let about = |i: usize| {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        let mut q = diagonal([1.0; 3]);
        (q[j][j], q[j][k], q[k][j], q[k][k]) = (c, -s, s, c);
        q
    };
    product(about(0), product(about(1), about(2)))
}

/// Moderate, strongly compressed (beyond the cap of every brain law), and with equal stretches.
fn shapes() -> Vec<Matrix> {
    let moderate = [
        [1.05, 0.04, -0.03],
        [-0.02, 0.96, 0.05],
        [0.01, -0.06, 1.02],
    ];
    let pressed = diagonal([0.7, 1.2, 1.15]);
    let equal = diagonal([0.9, 1.05, 1.05]);
    [moderate, pressed, equal]
        .map(|f| product(turned(0.4), product(f, turned(0.7))))
        .into()
}

fn cauchy(f: Matrix, moduli: Moduli) -> Matrix {
    let state = Deformation::of(f);
    let p = stress(&state, moduli);
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| dot(p[i], f[j]) / state.det))
}

#[test]
fn stress_is_the_derivative_of_the_energy() {
    for moduli in laws() {
        for f in shapes() {
            let p = stress(&Deformation::of(f), moduli);
            let scale = largest(p.as_flattened());
            for i in 0..3 {
                for j in 0..3 {
                    let want = slope(f, [i, j], |f| energy_density(&Deformation::of(f), moduli));
                    let off = (p[i][j] - want).abs() / scale;
                    assert!(off < 1e-7, "{}: {off:e}", moduli.law);
                }
            }
        }
    }
}

#[test]
fn the_tangent_is_the_derivative_of_the_stress_for_every_law() {
    let others = [
        Law::default(),
        Law::MooneyRivlin(MooneyRivlin { c01_share: 0.3 }),
        "yeoh:1.5,0.4".parse().unwrap(),
        "veronda-westmann:0.5".parse().unwrap(),
        "veronda-westmann:9".parse().unwrap(),
    ];
    for moduli in laws().chain(others.map(moduli)) {
        for f in shapes() {
            let whole = tangent(&Deformation::of(f), moduli);
            let scale = largest(whole.as_flattened());
            for row in 0..9 {
                for column in 0..9 {
                    let [i, j] = [row / 3, row % 3];
                    let at = [column / 3, column % 3];
                    let want = slope(f, at, |f| stress(&Deformation::of(f), moduli)[i][j]);
                    let off = (whole[row][column] - want).abs() / scale;
                    assert!(off < 1e-7, "{}: {off:e}", moduli.law);
                    let off = (whole[row][column] - whole[column][row]).abs() / scale;
                    assert!(off < 1e-12, "{}: {off:e}", moduli.law);
                }
            }
        }
    }
}

#[test]
fn stress_turns_with_the_frame_and_not_with_the_material() {
    let q = turned(1.1);
    for moduli in laws() {
        for f in shapes() {
            let p = stress(&Deformation::of(f), moduli);
            let scale = largest(p.as_flattened());
            let framed = stress(&Deformation::of(product(q, f)), moduli);
            let turned = stress(&Deformation::of(product(f, q)), moduli);
            let (want_framed, want_turned) = (product(q, p), product(p, q));
            for i in 0..3 {
                for j in 0..3 {
                    assert!((framed[i][j] - want_framed[i][j]).abs() < 1e-11 * scale);
                    assert!((turned[i][j] - want_turned[i][j]).abs() < 1e-11 * scale);
                }
            }
        }
    }
}

/// `mu (l^alpha)` or its tangent beyond the cap.
fn pull(terms: &[[f64; 2]], stretch: f64) -> f64 {
    let sum = terms.iter().map(|[mu, alpha]| {
        let x = alpha * stretch.ln();
        mu * if x > 3.0 {
            3f64.exp() * (x - 2.0)
        } else {
            x.exp()
        }
    });
    sum.sum()
}

#[test]
fn stretches_that_nearly_coincide_are_right() {
    for terms in LAWS {
        let moduli = ogden(terms);
        for gap in [1e-2, 1e-4, 1e-5, 1e-6, 1e-7, 1e-9, 1e-12, 0.0] {
            for base in [[0.8, 1.1], [0.92, 1.04], [1.0, 1.0], [1.2, 0.9]] {
                let l = [base[0], base[1], base[1] * (1.0 + gap)];
                let volume = l.iter().product::<f64>();
                let root = volume.cbrt();
                let pulls = l.map(|l| pull(terms, l / root));
                let mean = pulls.iter().sum::<f64>() / 3.0;
                let p = stress(&Deformation::of(diagonal(l)), moduli);
                let pressure = moduli.bulk_pa * (volume - 1.0);
                let want =
                    [0, 1, 2].map(|i| ((pulls[i] - mean) / volume + pressure) * volume / l[i]);
                let scale = largest(&want).max(1e-3 * moduli.shear_pa);
                for i in 0..3 {
                    let off = (p[i][i] - want[i]).abs() / scale;
                    assert!(off < 1e-9, "{} {l:?}: {off:e}", moduli.law);
                }
            }
        }
    }
}

/// `sigma_1 - sigma_2 = sum mu (l^alpha - l^(-alpha/2))` of a stretch `l` without change of volume.
#[test]
fn uniaxial_stretch() {
    for terms in LAWS {
        let moduli = ogden(terms);
        for l in [0.7, 0.9, 0.95, 1.1, 1.5f64] {
            let across = l.powf(-0.5);
            let sigma = cauchy(diagonal([l, across, across]), moduli);
            let want = pull(terms, l) - pull(terms, across);
            let off = (sigma[0][0] - sigma[1][1] - want).abs();
            assert!(off < 1e-9 * want.abs(), "{} at {l}: {off:e}", moduli.law);
        }
    }
}

/// `sigma_12 = sum mu (l^alpha - l^-alpha) / (l + 1/l)` with `l = g/2 + (1 + g²/4)^(1/2)`.
#[test]
fn simple_shear() {
    for terms in LAWS {
        let moduli = ogden(terms);
        for g in [-0.4, -0.1, 0.05, 0.2, 0.6f64] {
            let sigma = cauchy([[1.0, g, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], moduli);
            let l = 0.5 * g + 0.5f64.mul_add(0.5 * g * g, 1.0).sqrt();
            let want = (pull(terms, l) - pull(terms, 1.0 / l)) / (l + 1.0 / l);
            let off = (sigma[0][1] - want).abs();
            assert!(off < 1e-9 * want.abs(), "{} at {g}: {off:e}", moduli.law);
        }
    }
}

#[test]
fn exponents_two_and_minus_two_are_the_other_laws() {
    let mu = Material::default().shear_pa();
    let mooney = Law::MooneyRivlin(MooneyRivlin { c01_share: 0.3 });
    let pairs = [
        (vec![[mu, 2.0]], Law::default()),
        (vec![[0.7 * mu, 2.0], [-0.3 * mu, -2.0]], mooney),
    ];
    for (terms, law) in pairs {
        for f in shapes() {
            let got = stress(&Deformation::of(f), ogden(&terms));
            let want = stress(&Deformation::of(f), moduli(law));
            let scale = largest(want.as_flattened());
            for (got, want) in got.as_flattened().iter().zip(want.as_flattened()) {
                assert!((got - want).abs() < 1e-12 * scale, "{got} for {want}");
            }
            let got = energy_density(&Deformation::of(f), ogden(&terms));
            let want = energy_density(&Deformation::of(f), moduli(law));
            assert!((got - want).abs() < 1e-12 * want);
        }
    }
}

#[test]
fn at_rest_the_stiffness_is_that_of_linear_elasticity() {
    let corners = [[0.0; 3], [2.0, 0.1, 0.0], [0.3, 1.5, -0.2], [0.2, 0.4, 1.8]];
    let tet = Tetrahedron::new([0, 1, 2, 3], corners, 1.3);
    let rest = tet.deformation([[0.0; 3]; 4]);
    let places = [[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]];
    for moduli in laws() {
        let whole = tet.stiffness(&rest, moduli);
        let blocks = tet.diagonal_blocks(moduli);
        let scale = largest(blocks.as_flattened());
        for (corner, block) in blocks.iter().enumerate() {
            for (want, [i, j]) in block.iter().zip(places) {
                let got = whole[3 * corner + i][3 * corner + j];
                assert!((got - want).abs() < 1e-10 * scale, "{got} for {want}");
            }
        }
    }
}

#[test]
fn the_stiffness_is_the_derivative_of_the_forces() {
    let corners = [[0.0; 3], [2.0, 0.1, 0.0], [0.3, 1.5, -0.2], [0.2, 0.4, 1.8]];
    let tet = Tetrahedron::new([0, 1, 2, 3], corners, 1.3);
    let u = [
        [0.0; 3],
        [-0.3, 0.1, 0.05],
        [0.1, 0.15, -0.1],
        [0.0, 0.2, 0.1],
    ];
    for moduli in laws() {
        let forces = |u| tet.forces(&tet.deformation(u), moduli);
        let whole = tet.stiffness(&tet.deformation(u), moduli);
        let scale = largest(whole.as_flattened());
        for column in 0..12 {
            let at = |step: f64| {
                let mut u = u;
                u[column / 3][column % 3] += step;
                forces(u)
            };
            let step = 1e-5;
            let (ahead, behind) = (at(step), at(-step));
            for row in 0..12 {
                let [a, i] = [row / 3, row % 3];
                let want = (ahead[a][i] - behind[a][i]) / (2.0 * step);
                assert!((whole[row][column] - want).abs() < 1e-6 * scale);
            }
        }
    }
}

#[test]
fn crushed_and_inverted_shapes_have_finite_stress() {
    for moduli in laws() {
        for l in [
            [0.05, 1.0, 1.0],
            [0.368_4; 3],
            [1e-3, 1.0, 1.0],
            [-0.2, 1.0, 1.0],
        ] {
            let p = stress(&Deformation::of(diagonal(l)), moduli);
            assert!(p.as_flattened().iter().all(|p| p.is_finite()), "{l:?}");
            let whole = tangent(&Deformation::of(diagonal(l)), moduli);
            assert!(whole.as_flattened().iter().all(|k| k.is_finite()), "{l:?}");
        }
        let density = energy_density(&Deformation::of(diagonal([0.05, 1.0, 1.0])), moduli);
        assert!(density.is_finite() && density > 0.0);
    }
}

#[test]
fn a_law_is_named_by_text_and_keeps_its_modulus() {
    let law: Law = "ogden:-0.157kPa,-18.7,20,3".parse().unwrap();
    assert_eq!(law.to_string(), "ogden:-157,-18.7,20,3");
    assert_eq!(law.to_string().parse::<Law>().unwrap(), law);
    let material = Material::default().with_law(law);
    let shear = 0.5 * (157.0 * 18.7 + 60.0);
    assert!((material.shear_pa() - shear).abs() < 1e-9 * shear);
    material.validate().unwrap();
    let other = Material {
        young_pa: 3000.0,
        ..material
    };
    let error = other.validate().unwrap_err();
    assert_eq!(error.field, "young_pa");
}

#[test]
fn constants_that_no_solid_has_are_named() {
    for (text, words) in [
        ("ogden", "unknown"),
        ("ogden:", "numbers"),
        ("ogden:1,2,3", "3 numbers"),
        ("ogden:1,2,3,4,5,6,7,8,9,10,11,12,13,14", "14 numbers"),
        ("ogden:a,2", "not a number"),
        ("ogden:NaN,2", "law.terms[0].mu_pa"),
        ("ogden:100,0", "law.terms[0].alpha"),
        ("ogden:100,500", "law.terms[0].alpha"),
        // The sign that an exponent of -18.7 needs is forgotten.
        ("ogden:157,-18.7", "law.terms[0].mu_pa"),
        ("ogden:157,-18.7", "shear modulus"),
        // kPa for Pa.
        ("ogden:-0.157,-18.7", "in Pa, not kPa"),
        // A positive modulus at rest, and softening at 13 % of compression.
        ("ogden:1000,4,50,-18", "law.terms[1].mu_pa"),
        ("ogden:1000,4,50,-18", "not elliptic"),
    ] {
        let error = text.parse::<Law>().unwrap_err();
        assert!(error.contains(words), "{text}: {error}");
    }
}
