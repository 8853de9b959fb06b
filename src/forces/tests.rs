use super::*;
use elements::vector::{cross, dot, subtract};

const UNIT: Moduli = Moduli {
    shear_pa: 1000.0,
    bulk_pa: 5000.0,
    law: elements::Law::NeoHookean(elements::NeoHookean {}),
};

fn element(positions: &[f32], corners: [u32; 4]) -> Tetrahedron {
    Tetrahedron::new(corners, corners.map(|node| row_of(positions, node)), 1.0)
}

fn body<'a>(positions: &'a [f32], tets: &'a [u32]) -> Tetrahedra<'a> {
    Tetrahedra {
        positions: positions.as_chunks().0,
        tets: tets.as_chunks().0,
        stiffness: &[],
        laws: elements::Laws::default(),
    }
}

/// A cube of `n³` cells, five tetrahedra each, edge `n` mm.
fn cube(n: u32) -> (Vec<f32>, Vec<u32>) {
    let node = |x: u32, y: u32, z: u32| x + (n + 1) * (y + (n + 1) * z);
    let mut positions = Vec::new();
    for z in 0..=n {
        for y in 0..=n {
            for x in 0..=n {
                positions.extend([x as f32, y as f32, z as f32]);
            }
        }
    }
    let mut tets = Vec::new();
    for z in 0..n {
        for y in 0..n {
            for x in 0..n {
                let c = |i: u32| node(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2));
                let odd = [
                    [0, 3, 5, 1],
                    [0, 6, 3, 2],
                    [0, 5, 6, 4],
                    [3, 6, 5, 7],
                    [0, 3, 6, 5],
                ];
                let even = [
                    [1, 2, 4, 0],
                    [1, 7, 2, 3],
                    [1, 4, 7, 5],
                    [2, 7, 4, 6],
                    [1, 2, 7, 4],
                ];
                for tet in if (x + y + z) % 2 == 0 { odd } else { even } {
                    let mut tet = tet.map(c);
                    if element(&positions, tet).volume < 0.0 {
                        tet.swap(0, 1);
                    }
                    tets.extend(tet);
                }
            }
        }
    }
    (positions, tets)
}

fn energy(positions: &[f32], tets: &[u32], u: &[f32], moduli: Moduli) -> f64 {
    tets.chunks_exact(4)
        .map(|t| {
            let element = element(positions, [t[0], t[1], t[2], t[3]]);
            let x = |a: usize| {
                let at = 3 * t[a] as usize;
                [0, 1, 2].map(|k| f64::from(positions[at + k]) + f64::from(u[at + k]))
            };
            let edges = [1, 2, 3].map(|a| subtract(x(a), x(0)));
            let det = dot(edges[0], cross(edges[1], edges[2])) / (6.0 * element.volume);
            // I1 = |F|², F = sum edge_a (outer) gradient_a.
            let f = |i: usize, j: usize| -> f64 {
                let pairs = edges.iter().zip(&element.gradients);
                pairs.map(|(edge, gradient)| edge[i] * gradient[j]).sum()
            };
            let invariant: f64 = (0..9).map(|k| f(k / 3, k % 3).powi(2)).sum();
            let shear = moduli.shear_pa / 2.0 * (invariant / det.powf(2.0 / 3.0) - 3.0);
            element.volume * (shear + moduli.bulk_pa / 2.0 * (det - 1.0).powi(2))
        })
        .sum()
}

fn wavy(positions: &[f32], size: f32) -> Vec<f32> {
    let wave = |(i, x): (usize, &f32)| size * (x * (1.3 + 0.2 * (i % 3) as f32) + i as f32).sin();
    positions.iter().enumerate().map(wave).collect()
}

#[test]
fn forces_are_the_derivative_of_the_energy() {
    let (positions, tets) = cube(3);
    let nodes: Vec<u32> = (0..positions.len() as u32 / 3).collect();
    let mut forces = ReactionForces::new(body(&positions, &tets), &nodes, UNIT).unwrap();
    let mut u = wavy(&positions, 0.08);
    let mut out = vec![0.0; positions.len()];
    let report = forces.reaction(&u, &nodes, &mut out).unwrap();
    assert_eq!((report.elements, report.inverted), (tets.len() / 4, 0));
    for dof in [0, 7, 50, 101, 190] {
        let (step, start) = (1e-2f32, u[dof]);
        u[dof] = start + step;
        let up = energy(&positions, &tets, &u, UNIT);
        let wide = f64::from(u[dof]);
        u[dof] = start - step;
        let down = energy(&positions, &tets, &u, UNIT);
        let slope = 1e-3 * (up - down) / (wide - f64::from(u[dof]));
        u[dof] = start;
        let got = f64::from(out[dof]);
        assert!(
            (got + slope).abs() < 2e-3 * slope.abs().max(0.05),
            "{dof}: {got} {slope}"
        );
    }
}

#[test]
fn a_stretched_bar_pulls_with_the_closed_form() {
    // Uniform F = diag(a, b, b): P11 = mu J^(-2/3) (a - I1/(3 a)) + kappa (J - 1) J / a.
    let (positions, tets) = cube(2);
    let (a, b) = (1.2f64, 0.93f64);
    let mut u = positions.clone();
    for node in u.chunks_exact_mut(3) {
        node[0] *= (a - 1.0) as f32;
        node[1] *= (b - 1.0) as f32;
        node[2] *= (b - 1.0) as f32;
    }
    let face: Vec<u32> = (0..27).filter(|i| i % 3 == 2).collect();
    let mut out = vec![0.0; 27];
    let mut forces = ReactionForces::new(body(&positions, &tets), &face, UNIT).unwrap();
    forces.reaction(&u, &face, &mut out).unwrap();
    let (det, invariant) = (a * b * b, a * a + 2.0 * b * b);
    let stress = UNIT.shear_pa * det.powf(-2.0 / 3.0) * (a - invariant / (3.0 * a))
        + UNIT.bulk_pa * (det - 1.0) * det / a;
    let total: f64 = out.chunks_exact(3).map(|f| f64::from(f[0])).sum();
    let want = -1e-3 * stress * 4.0;
    assert!((total - want).abs() < 1e-5 * want.abs(), "{total} {want}");
}

#[test]
fn a_subset_gives_the_same_forces_and_rest_gives_none() {
    let (positions, tets) = cube(3);
    let all: Vec<u32> = (0..64).collect();
    let some = [3, 0, 17, 60];
    let u = wavy(&positions, 0.1);
    let (mut whole, mut part) = (vec![0.0; 192], vec![0.0; 12]);
    ReactionForces::new(body(&positions, &tets), &all, UNIT)
        .unwrap()
        .reaction(&u, &all, &mut whole)
        .unwrap();
    let mut forces = ReactionForces::new(body(&positions, &tets), &some, UNIT).unwrap();
    for _ in 0..3 {
        forces.reaction(&u, &some, &mut part).unwrap();
        for (entry, &node) in some.iter().enumerate() {
            for axis in 0..3 {
                let (x, y) = (part[3 * entry + axis], whole[3 * node as usize + axis]);
                assert!((x - y).abs() < 1e-5, "{x} {y}");
            }
        }
    }
    forces.reaction(&vec![0.0; 192], &some, &mut part).unwrap();
    assert!(part.iter().all(|f| f.abs() < 1e-6));
}

#[test]
fn the_neighbourhood_is_what_the_forces_depend_on() {
    let (positions, tets) = cube(3);
    let nodes = [21, 63];
    let mut forces = ReactionForces::new(body(&positions, &tets), &nodes, UNIT).unwrap();
    let mut around = Vec::new();
    forces.neighbourhood(&nodes, &mut around).unwrap();
    assert!(around.is_sorted() && around.contains(&21) && around.len() < 64);
    let u = wavy(&positions, 0.1);
    let mut reaction = |u: &[f32]| {
        let mut out = vec![0.0; 6];
        forces.reaction(u, &nodes, &mut out).map(|_| out)
    };
    let want = reaction(&u).unwrap();
    for node in 0..64u32 {
        let mut other = u.clone();
        other[3 * node as usize] += 0.05;
        let same = reaction(&other).unwrap() == want;
        assert_eq!(same, !around.contains(&node), "node {node}");
    }
}

#[test]
fn wrong_input_is_an_error_and_the_next_call_works() {
    let (positions, tets) = cube(2);
    let mut forces = ReactionForces::new(body(&positions, &tets), &[0, 1, 2], UNIT).unwrap();
    let u = vec![0.0; 81];
    let mut out = [0.0; 6];
    assert!(matches!(
        forces.reaction(&u, &[1, 1], &mut out),
        Err(Error::Argument(_))
    ));
    assert!(matches!(
        forces.reaction(&u, &[1, 99], &mut out),
        Err(Error::Argument(_))
    ));
    assert!(matches!(
        forces.reaction(&u[1..], &[1, 2], &mut out),
        Err(Error::Argument(_))
    ));
    let mut bad = u.clone();
    bad[4] = f32::NAN;
    assert!(matches!(
        forces.reaction(&bad, &[1, 2], &mut out),
        Err(Error::NonFinite(_))
    ));
    assert!(forces.reaction(&u, &[1, 2], &mut out).is_ok());
    let mut inverted = u.clone();
    inverted[0] = 5.0;
    assert!(
        forces
            .reaction(&inverted, &[1, 2], &mut out)
            .unwrap()
            .inverted
            > 0
    );
    assert!(out.iter().all(|f| f.is_finite()));
}
