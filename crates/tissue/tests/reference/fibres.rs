//! Blocks with fibres: pulled and pressed along and across them against the closed form, cut along them, and their file.

use elements::{Deformation, Law, Material, Moduli, Region, stress};
use tissue::mesh::{Boundary, Mesh, regular_box};
use tissue::solver::{ContactNode, Solver, SolverOptions};
use tissue::statics;
use topology::Sweep;

const SIDE: f32 = 8.0;
const HEIGHT: f32 = 24.0;

fn material(law: &str) -> Material {
    Material {
        poisson: 0.45,
        damping_per_s: 200.0,
        ..Material::default()
    }
    .with_law(law.parse().unwrap())
}

fn block(fibre: [f32; 3]) -> Mesh {
    let mut mesh = regular_box([SIDE, SIDE, HEIGHT], [2, 2, 6]).unwrap();
    mesh.fibre = vec![fibre; mesh.tets.len()];
    mesh.domain = (0..mesh.surface.len() as u32).collect();
    mesh
}

fn nodes(mesh: &Mesh, z: f32) -> impl Iterator<Item = u32> + '_ {
    (0..mesh.node_count() as u32).filter(move |n| (mesh.positions[*n as usize][2] - z).abs() < 1e-3)
}

/// Of a free bar along z: nominal stress, Pa, and its stretches across.
fn closed_form(moduli: Moduli, fibre: [f64; 3], along: f64) -> (f64, [f64; 2]) {
    let at = |x: f64, y: f64| {
        let f = [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, along]];
        stress(&Deformation::of(f).along(fibre), moduli)
    };
    let root = |of: &dyn Fn(f64) -> f64| {
        let (mut low, mut high) = (0.6, 1.6);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            match of(middle) > 0.0 {
                true => high = middle,
                false => low = middle,
            }
        }
        low
    };
    let side = |x: f64| root(&|y| at(x, y)[1][1]);
    let x = root(&|x| at(x, side(x))[0][0]);
    let y = side(x);
    (at(x, y)[2][2], [x, y])
}

/// The displacement of the closed form at every node, mm.
fn homogeneous(mesh: &Mesh, along: f64, across: [f64; 2]) -> Vec<[f32; 3]> {
    let part = [across[0] - 1.0, across[1] - 1.0, along - 1.0].map(|x| x as f32);
    let half = SIDE / 2.0;
    let rows = mesh.positions.iter();
    rows.map(|[x, y, z]| [part[0] * (x - half), part[1] * (y - half), part[2] * z])
        .collect()
}

/// Force on the top in the solver, mN, and its field.
fn settled(mesh: &Mesh, material: Material, ends: &[[f32; 3]]) -> (f64, Vec<[f32; 3]>) {
    let led: Vec<u32> = nodes(mesh, 0.0).chain(nodes(mesh, HEIGHT)).collect();
    let mut contact: Vec<ContactNode> = (led.iter())
        .map(|&node| ContactNode {
            node,
            displacement: ends[node as usize],
        })
        .collect();
    contact.sort_by_key(|own| own.node);
    let options = SolverOptions {
        material,
        ..SolverOptions::default()
    };
    let mut solver = Solver::new(mesh, Boundary::Fixed, options).unwrap();
    let mut force = 0.0;
    for _ in 0..10 {
        let report = solver.step_frame(&contact, 0.05).unwrap();
        assert!(report.critical_step_s.is_finite() && report.critical_step_s > 0.0);
        let top = contact.iter().zip(&report.reaction);
        let top = top.filter(|(own, _)| mesh.positions[own.node as usize][2] > 1.0);
        force = top.map(|(_, f)| f64::from(f[2])).sum();
    }
    let mut field = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut field);
    (force, field)
}

/// Statics in f64 and the explicit solver in lanes against the closed form, of fibres in laws of both kinds.
#[test]
fn a_block_is_pulled_and_pressed_as_the_closed_form() {
    for (law, z) in [
        ("fibres:5,2", 1.0),
        ("fibres:5,2", 0.0),
        ("ogden:-163,-18+fibres:5,2", 1.0),
    ] {
        let fibre = [1.0 - z, 0.0, z];
        let mesh = block(fibre.map(|x| x as f32));
        let material = material(law);
        for along in [1.1, 0.93] {
            let (pa, across) = closed_form(material.moduli(), fibre, along);
            let (plain, _) = closed_form(material.moduli().without_fibres(), fibre, along);
            match (z > 0.0, along > 1.0) {
                // Fibres that are pulled, and fibres across that a press stretches.
                (true, true) => assert!(pa > 2.0 * plain),
                (false, false) => assert!(pa < 1.2 * plain),
                // Slack: the body is its matrix.
                _ => assert!((pa / plain - 1.0).abs() < 1e-9),
            }
            let start = homogeneous(&mesh, along, across);
            let ends: Vec<u32> = nodes(&mesh, 0.0).chain(nodes(&mesh, HEIGHT)).collect();
            // From elsewhere, so that it has something to do.
            let mut off = start.clone();
            for (at, row) in off.iter_mut().enumerate() {
                if !ends.contains(&(at as u32)) {
                    row[at % 3] += 0.1 * (at as f32).sin();
                }
            }
            let found = statics::relax(&mesh, &ends, &material, &off).unwrap();
            let most = |found: &dyn Fn(usize, usize) -> f64| {
                (0..3 * start.len())
                    .map(|at| (found(at / 3, at % 3) - f64::from(start[at / 3][at % 3])).abs())
                    .fold(0.0, f64::max)
            };
            let error = most(&|node, axis| found[node][axis]);
            assert!(error < 2e-4, "{law}, {z}, {along}: {error} mm");

            let (force, field) = settled(&mesh, material, &start);
            let wanted = -1e-3 * pa * f64::from(SIDE * SIDE);
            assert!(
                (force - wanted).abs() < 0.005 * wanted.abs(),
                "{law}, {z}, {along}: {force} mN for {wanted}"
            );
            let error = most(&|node, axis| f64::from(field[node][axis]));
            assert!(error < 2e-3, "{law}, {z}, {along}: {error} mm");
        }
    }
}

/// Cells have the direction of the element that they were cut from: parted along its fibres a block is pulled with the force of the whole one.
#[test]
fn a_block_that_is_cut_along_its_fibres_pulls_as_before() {
    let mesh = block([0.0, 0.0, 1.0]);
    let material = material("fibres:20,2");
    let options = SolverOptions {
        material,
        ..SolverOptions::default()
    };
    let pulled = |cut: bool| {
        let mut solver = Solver::new(&mesh, Boundary::Fixed, options.clone()).unwrap();
        if cut {
            let edge = |y: f64| vec![[3.1, y, 5.0], [3.1, y, f64::from(HEIGHT) - 5.0]];
            let sweep = Sweep::new(&[edge(-2.0), edge(f64::from(SIDE) + 2.0)]).unwrap();
            solver.cut(&sweep, 0).unwrap();
        }
        let mut contact: Vec<ContactNode> = nodes(&mesh, 0.0)
            .map(|node| (node, 0.0))
            .chain(nodes(&mesh, HEIGHT).map(|node| (node, 2.0)))
            .map(|(node, up)| ContactNode {
                node,
                displacement: [0.0, 0.0, up],
            })
            .collect();
        contact.sort_by_key(|own| own.node);
        let mut force = 0.0;
        for _ in 0..10 {
            let report = solver.step_frame(&contact, 0.05).unwrap();
            let top = contact.iter().zip(&report.reaction);
            let top = top.filter(|(own, _)| own.displacement[2] > 0.0);
            force = top.map(|(_, f)| f64::from(f[2])).sum();
        }
        force
    };
    let (whole, parted) = (pulled(false), pulled(true));
    assert!(
        (parted / whole - 1.0).abs() < 0.03,
        "{parted} mN for {whole}"
    );
}

#[test]
fn directions_are_kept_by_the_file_and_change_the_hash() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("block");
    let mut mesh = block([0.6, 0.0, 0.8]);
    mesh.fibre[3] = [0.0; 3];
    mesh.region = vec![1; mesh.tets.len()];
    mesh.regions = vec![Region {
        name: "muscle".into(),
        law: "fibres:5,2".parse::<Law>().unwrap(),
        source: String::new(),
        density_kg_m3: None,
        relaxation: None,
    }];
    mesh.write(&path).unwrap();
    let read = Mesh::read(&path).unwrap();
    assert_eq!(read, mesh);
    let mut other = mesh.clone();
    other.fibre[7] = [0.0, 1.0, 0.0];
    assert_ne!(other.hash(), mesh.hash());
    // Each fault says what it is, and where.
    let told = |change: &dyn Fn(&mut Mesh)| {
        let mut bad = mesh.clone();
        change(&mut bad);
        bad.validate().unwrap_err().to_string()
    };
    assert!(told(&|mesh| mesh.fibre[5] = [0.5, 0.0, 0.0]).contains("tetrahedron 5` is 0.5"));
    assert!(told(&|mesh| mesh.fibre[5][1] = f32::NAN).contains("tetrahedron 5` is NaN"));
    assert!(told(&|mesh| mesh.fibre.truncate(9)).contains("length of `fibre`` is 9"));
    assert!(told(&|mesh| mesh.fibre.clear()).contains("region `muscle`: number of directions"));
    let whole = SolverOptions {
        material: material("fibres:5,2"),
        ..SolverOptions::default()
    };
    let plain = regular_box([SIDE, SIDE, HEIGHT], [2, 2, 6]).unwrap();
    let error = Solver::new(&plain, Boundary::Fixed, whole).err().unwrap();
    assert!(
        error.to_string().contains("material: number of directions"),
        "{error}"
    );
}

/// The inner step is bounded by taut fibres, though they are slack or at rest at first.
#[test]
fn stiff_fibres_shorten_the_step() {
    let step = |law: &str| {
        let options = SolverOptions {
            material: material(law),
            ..SolverOptions::default()
        };
        let solver = Solver::new(&block([0.0, 0.0, 1.0]), Boundary::Fixed, options).unwrap();
        solver.critical_step_at_rest_s()
    };
    let (plain, weak, stiff) = (
        step("neo-hookean"),
        step("fibres:0.001,1"),
        step("fibres:500,1"),
    );
    assert!((weak / plain - 1.0).abs() < 0.01, "{weak} {plain}");
    assert!(stiff < 0.4 * plain, "{stiff} {plain}");
}
