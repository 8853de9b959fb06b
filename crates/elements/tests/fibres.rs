//! Fibres in a matrix, in f64: energy, stress, tangent, closed forms, and what is refused.

#![allow(
    clippy::needless_range_loop,
    reason = "components of tensors read best by index"
)]

mod differences;

use differences::{Matrix, largest, slope};
use elements::vector::dot;
use elements::{
    Deformation, Fibred, Law, Laws, Material, Moduli, Region, Tetrahedron, add_mean_stress,
    energy_density, stiffest_pull, stress, tangent,
};

const ALONG: [f64; 3] = [0.6, 0.0, 0.8];

const LAWS: [&str; 5] = [
    "fibres:20,3",
    "fibres:2,0",
    "ogden:-163,-18+fibres:5,40",
    "mooney-rivlin:0.3+fibres:1,1",
    "yeoh:0.5+fibres:100,0.1",
];

fn moduli(text: &str) -> Moduli {
    Material::default().with_law(text.parse().unwrap()).moduli()
}

fn state(f: Matrix) -> Deformation {
    Deformation::of(f).along(ALONG)
}

/// Stretched by a part along the fibres and by another across, then sheared.
fn stretched(along: f64, across: f64) -> Matrix {
    let own = [0, 1, 2].map(|i| [0, 1, 2].map(|j| (along - across) * ALONG[i] * ALONG[j]));
    let mut f = own;
    for i in 0..3 {
        f[i][i] += 1.0 + across;
    }
    f[0][1] += 0.07;
    f[2][1] -= 0.04;
    f[1][2] += 0.05;
    f
}

/// Below the cap, beyond it for the stiffer ones, and slack.
fn shapes() -> [Matrix; 4] {
    [(0.1, -0.04), (0.45, -0.15), (-0.12, 0.05), (0.02, 0.1)].map(|(a, b)| stretched(a, b))
}

/// Verifies REQ-081.
#[test]
fn stress_is_the_derivative_of_the_energy() {
    for moduli in LAWS.map(moduli) {
        for f in shapes() {
            let p = stress(&state(f), moduli);
            let scale = largest(p.as_flattened());
            for i in 0..3 {
                for j in 0..3 {
                    let want = slope(f, [i, j], |f| energy_density(&state(f), moduli));
                    let off = (p[i][j] - want).abs() / scale;
                    assert!(off < 1e-7, "{}: {off:e}", moduli.law);
                }
            }
        }
    }
}

#[test]
fn the_tangent_is_the_derivative_of_the_stress() {
    for moduli in LAWS.map(moduli) {
        for f in shapes() {
            let whole = tangent(&state(f), moduli);
            let scale = largest(whole.as_flattened());
            for row in 0..9 {
                let (i, j) = (row / 3, row % 3);
                for column in 0..9 {
                    let at = [column / 3, column % 3];
                    let want = slope(f, at, |f| stress(&state(f), moduli)[i][j]);
                    let off = (whole[row][column] - want).abs() / scale;
                    assert!(off < 1e-6, "{}: {off:e}", moduli.law);
                    let other = (whole[row][column] - whole[column][row]).abs();
                    assert!(other < 1e-9 * scale, "{}: not symmetric", moduli.law);
                }
            }
        }
    }
}

#[test]
fn an_element_has_the_forces_and_the_stiffness_of_the_stress() {
    let corners = [[0.0; 3], [2.0, 0.1, 0.0], [0.3, 1.5, -0.2], [0.2, 0.4, 1.8]];
    let tet = Tetrahedron::new([0, 1, 2, 3], corners, 1.3).along([0.6, 0.0, 0.8]);
    for moduli in LAWS.map(moduli) {
        for f in shapes() {
            let u = corners.map(|x| [0, 1, 2].map(|i| dot(f[i], x) - x[i]));
            let here = tet.deformation(u);
            let whole = tet.stiffness(&here, moduli);
            let scale = largest(whole.as_flattened());
            for column in 0..12 {
                let at = |h: f64| {
                    let mut u = u;
                    u[column / 3][column % 3] += h;
                    tet.forces(&tet.deformation(u), moduli)
                };
                let (ahead, behind) = (at(1e-5), at(-1e-5));
                for row in 0..12 {
                    let (a, i) = (row / 3, row % 3);
                    let want = (ahead[a][i] - behind[a][i]) / 2e-5;
                    let off = (whole[row][column] - want).abs() / scale;
                    assert!(off < 1e-6, "{}: {off:e}", moduli.law);
                }
            }
        }
    }
}

/// Verifies REQ-099.
#[test]
fn slack_fibres_and_elements_without_have_the_bits_of_the_matrix() {
    for moduli in LAWS.map(moduli) {
        let matrix = moduli.without_fibres();
        assert!(matrix.law.fibres().is_none());
        let slack = stretched(-0.12, 0.05);
        assert_eq!(stress(&state(slack), moduli), stress(&state(slack), matrix));
        assert_eq!(
            tangent(&state(slack), moduli),
            tangent(&state(slack), matrix)
        );
        for f in shapes() {
            let without = Deformation::of(f);
            assert_eq!(stress(&without, moduli), stress(&without, matrix));
            let energy = energy_density(&without, matrix);
            assert_eq!(energy_density(&without, moduli), energy);
        }
        // At rest there is no stress, and against compression no stiffness of fibres.
        let rest = state([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        assert_eq!(stress(&rest, moduli), stress(&rest, matrix));
        assert_eq!(tangent(&rest, moduli), tangent(&rest, matrix));
    }
}

/// Along the fibres, across them, and swelling alike in all directions, which stretches fibres, too.
#[test]
fn the_stress_is_that_of_the_closed_form() {
    for (text, k1, k2) in [("fibres:20,3", 20.0, 3.0), ("fibres:2,0", 2.0, 0.0)] {
        let moduli = moduli(text);
        for along in [0.9, 1.05, 1.2] {
            let across = 1.0 / f64::sqrt(along);
            for (axis, stretch) in [(0, along), (1, across)] {
                let mut f = [[0.0; 3]; 3];
                (f[0][0], f[1][1], f[2][2]) = (along, across, across);
                let mut direction = [0.0; 3];
                direction[axis] = 1.0;
                let here = Deformation::of(f).along(direction);
                let p = stress(&here, moduli);
                let matrix = stress(&here, moduli.without_fibres());
                let x = (stretch * stretch - 1.0f64).max(0.0);
                let own = 2.0 * moduli.shear_pa * k1 * x * f64::exp(k2 * x * x) * stretch;
                let got = p[axis][axis] - matrix[axis][axis];
                assert!((got - own).abs() <= 1e-9 * own.max(1.0), "{got} for {own}");
                let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
                assert_eq!([p[a][a], p[b][b]], [matrix[a][a], matrix[b][b]]);
            }
        }
        let swollen = [[1.1, 0.0, 0.0], [0.0, 1.1, 0.0], [0.0, 0.0, 1.1]];
        let p = stress(&state(swollen), moduli);
        assert!(p[2][0] > 0.0);
    }
}

#[test]
fn beyond_the_cap_the_slope_is_bounded() {
    let law: Law = "fibres:3,50".parse().unwrap();
    let fibres = *law.fibres().unwrap();
    let end = (3.0f64 / 50.0).sqrt();
    let steepest = fibres.rise(end);
    for x in [1.01 * end, 2.0 * end, 10.0] {
        assert_eq!(fibres.rise(x), steepest);
        let slope = (fibres.pull(x + 1e-6) - fibres.pull(x - 1e-6)) / 2e-6;
        assert!((slope / steepest - 1.0).abs() < 1e-6);
        let rise = (fibres.stored(x + 1e-5) - fibres.stored(x - 1e-5)) / 2e-5;
        assert!((rise / fibres.pull(x) - 1.0).abs() < 1e-6);
    }
    assert_eq!(
        [fibres.rise(-1e-9), fibres.pull(-1.0), fibres.stored(-1.0)],
        [0.0; 3]
    );
    assert_eq!(fibres.rise(0.0), 3.0);
}

/// What the solver's step is bounded by, against the eigenvalue of what the fibres add to the stiffness.
#[test]
fn the_bound_is_the_largest_eigenvalue() {
    let corners = [[0.0; 3], [2.0, 0.1, 0.0], [0.3, 1.5, -0.2], [0.2, 0.4, 1.8]];
    let tet = Tetrahedron::new([0, 1, 2, 3], corners, 1.0).along([0.6, 0.0, 0.8]);
    let [a, b, c] = tet.gradients;
    let gradients = [[0, 1, 2].map(|k| -(a[k] + b[k] + c[k])), a, b, c];
    for moduli in LAWS.map(moduli) {
        let f = stretched(0.1, -0.04);
        let here = tet.deformation(corners.map(|x| [0, 1, 2].map(|i| dot(f[i], x) - x[i])));
        let [with, without] =
            [moduli, moduli.without_fibres()].map(|moduli| tet.stiffness(&here, moduli));
        let along = gradients.map(|g| dot(g, tet.fibre));
        let image = here.f.map(|row| dot(row, tet.fibre));
        // The eigenvector: the fibres' slopes along F a.
        let vector: Vec<f64> = (0..12).map(|k| along[k / 3] * image[k % 3]).collect();
        let square: f64 = vector.iter().map(|x| x * x).sum();
        let mut product = 0.0;
        for i in 0..12 {
            for j in 0..12 {
                product += vector[i] * (with[i][j] - without[i][j]) * vector[j];
            }
        }
        let wanted = tet.volume * stiffest_pull(&gradients, &here, &moduli);
        assert!((product / square / wanted - 1.0).abs() < 1e-9);
        // Slack, they count with what they will pull with.
        let slack = tet.deformation([[0.0; 3]; 4]);
        let Some(Fibred { k1_over_mu, .. }) = moduli.law.fibres().copied() else {
            panic!("no fibres")
        };
        let squares: f64 = along.iter().map(|b| b * b).sum();
        let rest = 4.0 * k1_over_mu * moduli.shear_pa * squares;
        assert!((stiffest_pull(&gradients, &slack, &moduli) / rest - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_mean_of_one_direction_is_that_direction() {
    let structure = ALONG.map(|x| ALONG.map(|y| x * y));
    for moduli in LAWS.map(moduli) {
        for f in shapes() {
            let want = stress(&state(f), moduli);
            let mut got = stress(&state(f), moduli.without_fibres());
            let fibres = moduli.law.fibres().unwrap();
            add_mean_stress(fibres, &f, (&structure, moduli.shear_pa), &mut got);
            for (got, want) in got.as_flattened().iter().zip(want.as_flattened()) {
                let scale = largest(stress(&state(f), moduli).as_flattened());
                assert!((got - want).abs() < 1e-9 * scale, "{got} for {want}");
            }
        }
    }
}

#[test]
fn words_and_files_name_them() {
    for text in LAWS {
        let law: Law = text.parse().unwrap();
        let shown = law.to_string();
        assert_eq!(shown.parse::<Law>().unwrap(), law, "{shown}");
        let json = serde_json::to_string(&law).unwrap();
        assert_eq!(serde_json::from_str::<Law>(&json).unwrap(), law, "{json}");
    }
    let json = serde_json::to_value("fibres:2,0.5".parse::<Law>().unwrap()).unwrap();
    let want = serde_json::json!({
        "name": "fibres", "k1_over_mu": 2.0, "k2": 0.5, "matrix": {"name": "neo-hookean"}
    });
    assert_eq!(json, want);
    for (text, told) in [
        ("fibres:0,1", "law.k1_over_mu"),
        ("fibres:-1,1", "law.k1_over_mu"),
        ("fibres:NaN,1", "law.k1_over_mu"),
        ("fibres:2000,1", "at most 1000"),
        ("fibres:1,-1", "law.k2"),
        ("fibres:1,NaN", "law.k2"),
        ("fibres:1", "K1/MU,K2"),
        ("fibres:a,b", "K1/MU,K2"),
        ("fibres:1,2,3", "K1/MU,K2"),
        ("nothing+fibres:1,2", "unknown"),
        ("ogden:163,-18+fibres:1,2", "law.terms[0]"),
        ("fibres:1,2+fibres:1,2", "isotropic"),
    ] {
        let error = text.parse::<Law>().unwrap_err();
        assert!(error.contains(told), "{text}: {error}");
    }
    let twice = serde_json::json!({
        "name": "fibres", "k1_over_mu": 2.0, "k2": 0.5, "matrix": want
    });
    let error = serde_json::from_value::<Law>(twice)
        .unwrap_err()
        .to_string();
    assert!(error.contains("unknown variant `fibres`"), "{error}");
    // Young's modulus is the matrix's, and `k1` a multiple of its shear modulus.
    let law: Law = "ogden:-163,-18+fibres:5,40".parse().unwrap();
    assert_eq!(law.young_pa(0.49), law.matrix().young_pa(0.49));
}

#[test]
fn directions_that_are_none_are_refused() {
    let material = Material::default();
    let region = Region {
        name: "muscle".into(),
        law: "fibres:5,2".parse().unwrap(),
        source: String::new(),
        density_kg_m3: None,
        relaxation: None,
    };
    let regions = [region];
    let told = |of_tet: &[u8], fibre: &[[f32; 3]], material: &Material| {
        let laws = Laws {
            of_tet,
            regions: if of_tet.is_empty() { &[] } else { &regions },
            fibre,
        };
        match laws.check_with(3, &[], material) {
            Ok(()) => String::new(),
            Err(error) => error.to_string(),
        }
    };
    let (x, none) = ([1.0, 0.0, 0.0], [0.0; 3]);
    assert_eq!(told(&[0, 1, 1], &[none, x, none], &material), "");
    // Directions alone are no fault: a law with fibres may come later.
    assert_eq!(told(&[], &[none, x, none], &material), "");
    let no_unit = [none, x, [0.0, 0.5, 0.0]];
    assert!(told(&[0, 1, 1], &no_unit, &material).contains("`fibre` of tetrahedron 2` is 0.5"));
    for bad in [f32::NAN, f32::INFINITY, 1e30] {
        let own = [[bad, 0.0, 0.0], x, x];
        assert!(told(&[0, 1, 1], &own, &material).contains("`fibre` of tetrahedron 0"));
    }
    assert!(told(&[0, 1, 1], &[x, x], &material).contains("length of `fibre`"));
    for fibre in [&[][..], &[x, none, none]] {
        let error = told(&[0, 1, 1], fibre, &material);
        assert!(error.contains("region `muscle`") && error.contains("no tetrahedron a direction"));
    }
    let whole = material.with_law("fibres:5,2".parse().unwrap());
    assert_eq!(told(&[], &[none, x, none], &whole), "");
    assert!(told(&[], &[], &whole).contains("material: number of directions"));
    // None of the material's law is left to have fibres.
    assert_eq!(told(&[1, 1, 1], &[x, none, none], &whole), "");
}
