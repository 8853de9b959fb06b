use super::super::random::Random;
use super::upper::factor_upper_scalar;
use super::*;

/// A compliance-like matrix: points on a patch, `1 / (distance + a)` between them, 3 axes.
fn compliance(random: &mut Random, nodes: usize) -> Vec<f32> {
    let points: Vec<[f64; 2]> = (0..nodes)
        .map(|_| [random.unit() * 30.0, random.unit() * 30.0])
        .collect();
    let n = 3 * nodes;
    let mut a = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..n {
            let (p, q) = (points[i / 3], points[j / 3]);
            let distance = (p[0] - q[0]).hypot(p[1] - q[1]);
            let same_axis = if i % 3 == j % 3 { 1.0 } else { 0.2 };
            a[i * n + j] = (same_axis * 0.01 / (1.0 + distance)) as f32;
        }
    }
    a
}

/// Writes the block of `dofs` of `a [n,n]`.
fn block<'a>(a: &'a [f32], n: usize, dofs: &'a [u32]) -> impl FnMut(&mut [f64]) + 'a {
    move |upper| {
        for (i, &row) in dofs.iter().enumerate() {
            for (j, &column) in dofs.iter().enumerate().skip(i) {
                upper[i * dofs.len() + j] = f64::from(a[row as usize * n + column as usize]);
            }
        }
    }
}

fn residual(a: &[f32], n: usize, dofs: &[u32], f: &[f32], c: &[f32]) -> f64 {
    let mut worst = 0.0f64;
    for (i, &row) in dofs.iter().enumerate() {
        let sum: f64 = dofs
            .iter()
            .zip(f)
            .map(|(&column, &f)| f64::from(a[row as usize * n + column as usize]) * f64::from(f))
            .sum();
        worst = worst.max((sum - f64::from(c[i])).abs());
    }
    worst
}

#[test]
fn forces_reproduce_the_displacement_on_every_isa() {
    let mut random = Random::new(2);
    let nodes = 150;
    let n = 3 * nodes;
    let a = compliance(&mut random, nodes);
    for isa in Isa::available() {
        let mut factor = ContactFactor::with_capacity(n);
        let room = factor.upper.capacity();
        for m in [1, 2, 7, 8, 9, 40, 150] {
            let dofs: Vec<u32> = (0..3 * m as u32).collect();
            let c = random.normal(3 * m, 5.0);
            let mut f = vec![0.0; 3 * m];
            let report = factor.factor(isa, &dofs, block(&a, n, &dofs)).unwrap();
            assert!(!report.regularised());
            factor.solve(isa, &c, &mut f);
            let error = residual(&a, n, &dofs, &f, &c);
            assert!(error < 2e-4, "{} m {m}: {error:e}", isa.name());
        }
        assert_eq!(
            factor.upper.capacity(),
            room,
            "no allocation within capacity"
        );
    }
}

#[test]
fn the_blocked_factor_equals_the_reference() {
    let mut random = Random::new(8);
    let a = compliance(&mut random, 40);
    let reference: Vec<f64> = a.iter().map(|&x| f64::from(x)).collect();
    let mut want = reference.clone();
    let mut positive = true;
    factor_upper_scalar(&mut want, 120, &mut positive);
    assert!(positive);
    for isa in Isa::available() {
        let mut got = reference.clone();
        factor_upper(isa, &mut got, 120, &mut positive);
        for i in 0..120 {
            for j in i..120 {
                let error = (want[i * 120 + j] - got[i * 120 + j]).abs();
                assert!(error < 1e-12, "{} {i} {j}: {error:e}", isa.name());
            }
        }
    }
}

#[test]
fn a_dof_given_twice_is_regularised_and_reported() {
    let mut random = Random::new(6);
    let a = compliance(&mut random, 20);
    let mut dofs: Vec<u32> = (0..60).collect();
    dofs.extend([0, 1, 2]);
    let mut c = random.normal(60, 5.0);
    c.extend_from_within(0..3);
    for isa in Isa::available() {
        let mut factor = ContactFactor::default();
        let report = factor.factor(isa, &dofs, block(&a, 60, &dofs)).unwrap();
        assert!(report.regularised() && report.term < 1e-3, "{report:?}");
        let mut f = vec![0.0; 63];
        factor.solve(isa, &c, &mut f);
        assert!(f.iter().all(|f| f.is_finite()));
        let error = residual(&a, 60, &dofs, &f, &c);
        assert!(error < 0.05, "{}: {error:e} mm", isa.name());
    }
}

#[test]
fn nonsense_is_an_error() {
    let mut factor = ContactFactor::default();
    for isa in Isa::available() {
        let nan = [1.0, 0.0, 0.0, f32::NAN];
        let result = factor.factor(isa, &[0, 1], block(&nan, 2, &[0, 1]));
        assert!(matches!(result, Err(FactorError::Diagonal { dof: 1, .. })));
        let indefinite = [1.0, 9.0, 9.0, 1.0];
        let result = factor.factor(isa, &[0, 1], block(&indefinite, 2, &[0, 1]));
        assert!(matches!(
            result,
            Err(FactorError::Indefinite { order: 2, .. })
        ));
        let hole = [1.0, f32::NAN, f32::NAN, 1.0];
        assert!(
            factor
                .factor(isa, &[0, 1], block(&hole, 2, &[0, 1]))
                .is_err()
        );
        assert_eq!(factor.order(), 0);
        factor.factor(isa, &[], block(&[], 0, &[])).unwrap();
        factor.solve(isa, &[], &mut []);
    }
}

#[test]
fn whitened_columns_have_the_gram_matrix_of_the_inverse() {
    let mut random = Random::new(8);
    let a = compliance(&mut random, 20);
    for count in [3, 16, 41] {
        let dofs: Vec<u32> = (0..45).collect();
        let z: Vec<f64> = random
            .normal(45 * count, 1.0)
            .iter()
            .map(|&x| f64::from(x))
            .collect();
        for isa in Isa::available() {
            let mut factor = ContactFactor::default();
            factor.factor(isa, &dofs, block(&a, 60, &dofs)).unwrap();
            let mut white = z.clone();
            factor.whiten(isa, count, &mut white);
            let mut found = vec![0.0; count * count];
            subtract_gram(isa, &white, count, 2.0, &mut found);
            for j in 0..count {
                let column: Vec<f32> = (0..45).map(|i| z[i * count + j] as f32).collect();
                let mut forces = vec![0.0; 45];
                factor.solve(isa, &column, &mut forces);
                for i in 0..=j {
                    let work = (0..45).map(|k| z[k * count + i] * f64::from(forces[k]));
                    let want = -2.0 * work.sum::<f64>();
                    let got = found[i * count + j];
                    let size = found[i * count + i].abs() + found[j * count + j].abs();
                    assert!(
                        (got - want).abs() < 1e-4 * size,
                        "{} {got} {want}",
                        isa.name()
                    );
                }
            }
        }
    }
}
