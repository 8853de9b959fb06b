//! Linear elasticity against closed forms and against its own residual.

use super::*;
use crate::mesh::{Mesh, regular_box};

/// A box of `n` cells a side of length `size`, five or six tets a cell (Kuhn's six).
fn block(n: [usize; 3], size: f32) -> (Vec<[f32; 3]>, Vec<[u32; 4]>) {
    let id = |i: usize, j: usize, k: usize| ((k * (n[1] + 1) + j) * (n[0] + 1) + i) as u32;
    let mut positions = Vec::new();
    for k in 0..=n[2] {
        for j in 0..=n[1] {
            for i in 0..=n[0] {
                positions.push([i as f32 * size, j as f32 * size, k as f32 * size]);
            }
        }
    }
    let mut tets = Vec::new();
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                for order in [
                    [0, 1, 2],
                    [1, 2, 0],
                    [2, 0, 1],
                    [0, 2, 1],
                    [2, 1, 0],
                    [1, 0, 2],
                ] {
                    let mut at = [i, j, k];
                    let mut tet = [id(i, j, k); 4];
                    for (corner, axis) in order.into_iter().enumerate() {
                        at[axis] += 1;
                        tet[corner + 1] = id(at[0], at[1], at[2]);
                    }
                    if matches!(order, [0, 2, 1] | [2, 1, 0] | [1, 0, 2]) {
                        tet.swap(2, 3);
                    }
                    tets.push(tet);
                }
            }
        }
    }
    (positions, tets)
}

fn mesh(positions: &[[f32; 3]], tets: &[[u32; 4]]) -> Mesh {
    Mesh {
        positions: positions.to_vec(),
        tets: tets.to_vec(),
        ..Mesh::default()
    }
}

fn base(positions: &[[f32; 3]]) -> Vec<u32> {
    (0..positions.len() as u32)
        .filter(|&n| positions[n as usize][2] == 0.0)
        .collect()
}

#[test]
fn a_linear_field_needs_no_inner_forces() {
    // Patch test: nodal forces of u = G x vanish at nodes inside of the box.
    let (positions, tets) = block([3, 3, 3], 2.0);
    let held = vec![0u32];
    let lame = Lame::from_young(3000.0, 0.49).unwrap();
    let stiffness = Stiffness::assemble(&mesh(&positions, &tets), &held, lame).unwrap();
    let gradient = [[0.01, 0.02, -0.01], [0.0, -0.03, 0.02], [0.04, 0.0, 0.01]];
    let u: Vec<f64> = stiffness
        .free
        .nodes
        .iter()
        .flat_map(|&n| {
            let x = positions[n as usize].map(f64::from);
            gradient.map(|g| g[0] * x[0] + g[1] * x[1] + g[2] * x[2])
        })
        .collect();
    let force = stiffness.multiply(&u);
    let largest = force.iter().fold(0.0f64, |m, f| m.max(f.abs()));
    assert!(largest > 1.0, "the boundary carries forces");
    for (free, &node) in stiffness.free.nodes.iter().enumerate() {
        let inside = positions[node as usize].iter().all(|&x| x > 0.0 && x < 6.0);
        for axis in 0..3 {
            assert!(!inside || force[3 * free + axis].abs() < 1e-9 * largest);
        }
    }
}

#[test]
fn uniaxial_stress_has_youngs_modulus() {
    // Symmetry planes by held nodes is not available (whole nodes are held), so the energy of the
    // exact field is taken: u = (-nu e x, -nu e y, e z), W = E e² V / 2.
    let (positions, tets) = block([2, 2, 4], 1.5);
    let lame = Lame::from_young(3000.0, 0.3).unwrap();
    let stiffness = Stiffness::assemble(&mesh(&positions, &tets), &[0], lame).unwrap();
    let strain = 0.02;
    let u: Vec<f64> = stiffness
        .free
        .nodes
        .iter()
        .flat_map(|&n| {
            let x = positions[n as usize].map(f64::from);
            [-0.3 * strain * x[0], -0.3 * strain * x[1], strain * x[2]]
        })
        .collect();
    let force = stiffness.multiply(&u);
    let energy = 0.5 * u.iter().zip(&force).map(|(a, b)| a * b).sum::<f64>();
    let exact = 0.5 * 3.0 * strain * strain * (3.0 * 3.0 * 6.0);
    assert!(
        (energy / exact - 1.0).abs() < 1e-6,
        "{energy} against {exact}"
    );
}

#[test]
fn columns_solve_the_stiffness_and_the_block_is_symmetric_positive() {
    let (positions, tets) = block([5, 4, 3], 4.0);
    let lame = Lame::from_young(3000.0, 0.49).unwrap();
    let held = base(&positions);
    let stiffness = Stiffness::assemble(&mesh(&positions, &tets), &held, lame).unwrap();
    let factor = Factor::new(&stiffness, &positions, 1).unwrap();
    let nodes: Vec<u32> = (0..positions.len() as u32)
        .filter(|&n| positions[n as usize][2] == 12.0)
        .collect();
    let mut fields = Vec::new();
    let compliance = compliance_columns(&stiffness, &factor, &nodes, 7, |first, rows| {
        assert_eq!(first * 3 * positions.len(), fields.len());
        fields.extend_from_slice(rows);
        Ok(())
    })
    .unwrap();
    assert_eq!(fields.len(), 3 * nodes.len() * 3 * positions.len());
    let row = 3 * 4 + 2;
    let field = &fields[row * 3 * positions.len()..(row + 1) * 3 * positions.len()];
    let u: Vec<f64> = stiffness
        .free
        .nodes
        .iter()
        .flat_map(|&n| (0..3).map(move |axis| (n, axis)))
        .map(|(n, axis)| f64::from(field[3 * n as usize + axis]))
        .collect();
    let force = stiffness.multiply(&u);
    let loaded = 3 * stiffness.free.get(nodes[4]).unwrap() + 2;
    for (dof, f) in force.iter().enumerate() {
        let expected = if dof == loaded { 1.0 } else { 0.0 };
        assert!((f - expected).abs() < 2e-4, "dof {dof}: {f}");
    }
    let size = 3 * nodes.len();
    assert_eq!(
        compliance.block[row * size + 3],
        compliance.block[3 * size + row]
    );
    assert!(
        contact_forces(&compliance, &[0, 1, 2], &[[0.0, 0.0, -1.0]; 3])
            .unwrap()
            .forces[2]
            < 0.0
    );
}

#[test]
fn the_response_passes_through_the_contact_and_rests_at_the_held_nodes() {
    let (positions, tets) = block([6, 6, 4], 3.0);
    let held = base(&positions);
    let top: Vec<u32> = (0..positions.len() as u32)
        .filter(|&n| positions[n as usize][2] == 12.0)
        .collect();
    let lame = Lame::from_young(3000.0, 0.49).unwrap();
    let elastic = LinearElastic::new(&mesh(&positions, &tets), &held, &top, lame, 1).unwrap();
    let nodes = [top[16], top[17], top[23], top[24]];
    let vectors = [
        [0.3, 0.0, -4.0],
        [0.0, 0.1, -4.0],
        [0.0, 0.0, -4.2],
        [0.1, 0.0, -3.9],
    ];
    let (field, ignored) = elastic.response(&nodes, &vectors).unwrap();
    assert!(ignored.is_empty());
    for (&node, vector) in nodes.iter().zip(&vectors) {
        for axis in 0..3 {
            assert!((field[node as usize][axis] - vector[axis]).abs() < 1e-5);
        }
    }
    assert!(held.iter().all(|&n| field[n as usize] == [0.0; 3]));
    let largest = field.iter().flatten().fold(0.0f32, |m, u| m.max(u.abs()));
    assert!(
        largest < 4.3,
        "nothing moves further than the instrument: {largest}"
    );
    let (_, ignored) = elastic.response(&[held[0]], &[[1.0; 3]]).unwrap();
    assert_eq!(ignored, vec![held[0]]);
}

#[test]
fn a_bar_of_two_layers_stretches_by_their_compliances() {
    // nu = 0: no lateral contraction, so the layers are springs in series, 1/10 and 1 of the extension.
    let mut bar = regular_box([4.0, 4.0, 12.0], [2, 2, 6]).unwrap();
    bar.stiffness = (bar.tets.iter())
        .map(|tet| {
            let height: f32 = tet.iter().map(|n| bar.positions[*n as usize][2]).sum();
            if height < 4.0 * 6.0 { 10.0 } else { 1.0 }
        })
        .collect();
    let at = |z: f32| -> Vec<u32> {
        (0..bar.node_count() as u32)
            .filter(|n| (bar.positions[*n as usize][2] - z).abs() < 1e-4)
            .collect()
    };
    let (held, top) = (at(0.0), at(12.0));
    let lame = Lame::from_young(3000.0, 0.0).unwrap();
    let elastic = LinearElastic::new(&bar, &held, &top, lame, 1).unwrap();
    let (field, _) = elastic
        .response(&top, &vec![[0.0, 0.0, 1.1]; top.len()])
        .unwrap();
    for (position, u) in bar.positions.iter().zip(&field) {
        let z = position[2];
        let wanted = if z <= 6.0 {
            0.1 * z / 6.0
        } else {
            0.1 + (z - 6.0) / 6.0
        };
        assert!((u[2] - wanted).abs() < 1e-5, "z = {z}: {u:?}");
        assert!(u[0].abs() + u[1].abs() < 1e-5, "z = {z}: {u:?}");
    }
}

#[test]
fn threads_do_not_change_the_answer_beyond_round_off() {
    let (positions, tets) = block([6, 5, 5], 3.0);
    let held = base(&positions);
    let lame = Lame::from_young(3000.0, 0.45).unwrap();
    let stiffness = Stiffness::assemble(&mesh(&positions, &tets), &held, lame).unwrap();
    let solve = |threads| {
        let factor = Factor::new(&stiffness, &positions, threads).unwrap();
        let mut column = vec![0.0; stiffness.dofs()];
        column[17] = 1.0;
        factor.solve(&mut column);
        column
    };
    for (a, b) in solve(1).iter().zip(solve(2)) {
        assert!((a - b).abs() < 1e-9);
    }
}

#[test]
fn a_factor_in_float32_solves_as_one_in_float64() {
    let (positions, tets) = block([7, 6, 5], 3.0);
    let held = base(&positions);
    let lame = Lame::from_young(3000.0, 0.495).unwrap();
    let stiffness = Stiffness::assemble(&mesh(&positions, &tets), &held, lame).unwrap();
    let n = stiffness.dofs();
    // More than go through the factor together, of very different sizes, and one of zeros.
    let mut random = crate::schemes::SplitMix(3);
    let right: Vec<f64> = (0..21 * n)
        .map(|at| 10f64.powi((at / n) as i32 - 12) * (random.unit() - 0.5))
        .map(|value| if value.abs() < 1e-13 { 0.0 } else { value })
        .collect();
    let solve = |limit| {
        let factor = Factor::within(&stiffness, &positions, 1, limit).unwrap();
        let mut columns = right.clone();
        columns[..n].fill(0.0);
        factor.solve(&mut columns);
        (factor.stats(&stiffness), columns)
    };
    let ((double, exact), (single, found)) = (solve(usize::MAX), solve(0));
    assert_eq!(2 * single.factor_bytes, double.factor_bytes);
    for (exact, found) in exact.chunks_exact(n).zip(found.chunks_exact(n)) {
        let largest = exact.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        for (a, b) in exact.iter().zip(found) {
            assert!((a - b).abs() <= 1e-7 * largest, "{a} and {b} of {largest}");
        }
    }
}

#[test]
fn what_cannot_be_solved_is_named() {
    let (positions, mut tets) = block([2, 2, 2], 1.0);
    let lame = Lame::from_young(3000.0, 0.49).unwrap();
    assert!(matches!(
        Stiffness::assemble(&mesh(&positions, &tets), &[], lame),
        Err(LinearError::NothingHeld)
    ));
    let mut extra = positions.clone();
    extra.push([9.0; 3]);
    assert!(matches!(
        Stiffness::assemble(&mesh(&extra, &tets), &[0], lame),
        Err(LinearError::Loose { node: 27 })
    ));
    tets[3].swap(0, 1);
    assert!(matches!(
        Stiffness::assemble(&mesh(&positions, &tets), &[0], lame),
        Err(LinearError::Volume { tet: 3, .. })
    ));
    tets[3][0] = 99;
    assert!(matches!(
        Stiffness::assemble(&mesh(&positions, &tets), &[0], lame),
        Err(LinearError::Node {
            tet: 3,
            node: 99,
            ..
        })
    ));
}

#[test]
fn natural_modes_are_the_lowest_of_the_dense_problem() {
    let (positions, tets) = block([2, 2, 4], 3.0);
    let (mut mesh, held) = (mesh(&positions, &tets), base(&positions));
    // Every third tetrahedron is of a region that is nearly twice as heavy.
    mesh.region = (0..tets.len()).map(|at| u8::from(at % 3 == 0)).collect();
    mesh.regions = vec![elements::Region {
        name: "heavy".into(),
        law: elements::Law::default(),
        source: String::new(),
        density_kg_m3: Some(1850.0),
        relaxation: None,
    }];
    let lame = Lame::from_young(3000.0, 0.45).unwrap();
    let stiffness = Stiffness::assemble(&mesh, &held, lame).unwrap();
    let factor = Factor::new(&stiffness, &positions, 1).unwrap();
    let found = natural_modes(&mesh, &stiffness, &factor, 1000.0, 6, &|| true).unwrap();

    // Density 1000 kg/m³ is 1e-6 kg/mm³.
    let mut mass = vec![0.0; mesh.node_count()];
    for (at, tet) in tets.iter().enumerate() {
        let density = if at % 3 == 0 { 1.85e-6 } else { 1e-6 };
        for &node in tet {
            mass[node as usize] += 0.25 * density * crate::mesh::tet_volume(&positions, *tet);
        }
    }
    let n = stiffness.dofs();
    let root: Vec<f64> = (stiffness.free.nodes.iter())
        .flat_map(|&node| [mass[node as usize].sqrt(); 3])
        .collect();
    let mut dense = vec![0.0; n * n];
    for (column, values) in dense.chunks_exact_mut(n).enumerate() {
        values[column] = root[column];
        factor.solve(values);
    }
    let flexibility = faer::Mat::from_fn(n, n, |i, j| root[i] * dense[j * n + i]);
    let values = flexibility
        .self_adjoint_eigenvalues(faer::Side::Lower)
        .unwrap();
    for (mode, frequency) in found.frequency.iter().enumerate() {
        let wanted = values[n - 1 - mode].powf(-0.5);
        assert!(
            (frequency / wanted - 1.0).abs() < 1e-6,
            "mode {mode}: {frequency} rad/s, {wanted} by the dense solution"
        );
    }
    let width = 3 * mesh.node_count();
    for (a, first) in found.modes.chunks_exact(width).enumerate() {
        assert!(held.iter().all(|&node| first[3 * node as usize] == 0.0));
        for (b, second) in found.modes.chunks_exact(width).enumerate() {
            let product: f64 = (0..width).map(|i| first[i] * mass[i / 3] * second[i]).sum();
            let wanted = if a == b { 1.0 } else { 0.0 };
            assert!((product - wanted).abs() < 1e-6, "{a}, {b}: {product}");
        }
    }
    assert!(matches!(
        natural_modes(&mesh, &stiffness, &factor, 1000.0, n, &|| true),
        Err(LinearError::Modes { .. })
    ));
    // Stopped before the fourth solve, without a word on standard error.
    let solves = std::sync::atomic::AtomicUsize::new(0);
    let three = || solves.fetch_add(1, std::sync::atomic::Ordering::Relaxed) < 3;
    assert!(matches!(
        natural_modes(&mesh, &stiffness, &factor, 1000.0, 6, &three),
        Err(LinearError::Stopped)
    ));
    assert_eq!(solves.into_inner(), 4);
}
