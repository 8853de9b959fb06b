//! Regions with laws of their own: springs in series of two laws, the file, cuts.

use elements::{Deformation, Law, Material, Moduli, Region, Relaxation, stress};
use tissue::mesh::{Boundary, Mesh, MeshError, regular_box};
use tissue::solver::{ContactNode, Solver, SolverOptions};
use tissue::statics;

// Thick enough not to buckle: that would take a compression of 13 %.
const SIDE: f32 = 8.0;
const HEIGHT: f32 = 40.0;

fn named(name: &str, law: &str) -> Region {
    Region {
        name: name.into(),
        law: law.parse().unwrap(),
        source: "a test".into(),
        density_kg_m3: None,
        relaxation: None,
    }
}

/// A bar of which the upper half is cortex and the lower one what the material says.
fn bar() -> Mesh {
    let mut mesh = regular_box([SIDE, SIDE, HEIGHT], [2, 2, 10]).unwrap();
    let height =
        |tet: &[u32; 4]| -> f32 { tet.iter().map(|n| mesh.positions[*n as usize][2]).sum() };
    mesh.region = (mesh.tets.iter())
        .map(|tet| u8::from(height(tet) > 2.0 * HEIGHT))
        .collect();
    mesh.regions = vec![named("cortex", "ogden:-101.8,-22,27.88,16")];
    let factor = mesh.regions[0].law.young_pa(0.45).unwrap() / material().young_pa;
    mesh.stiffness = (mesh.region.iter())
        .map(|number| if *number == 1 { factor as f32 } else { 1.0 })
        .collect();
    mesh.fixed = nodes(&mesh, 0.0);
    mesh
}

fn material() -> Material {
    Material {
        poisson: 0.45,
        young_pa: 2600.0,
        damping_per_s: 200.0,
        ..Material::default()
    }
}

fn nodes(mesh: &Mesh, z: f32) -> Vec<u32> {
    (0..mesh.node_count() as u32)
        .filter(|n| (mesh.positions[*n as usize][2] - z).abs() < 1e-3)
        .collect()
}

/// Nominal stress of a free bar, Pa, and its stretch across.
fn pulled(moduli: Moduli, along: f64) -> [f64; 2] {
    let at = |across: f64| {
        let side = across * along;
        stress(
            &Deformation {
                f: [[across, 0.0, 0.0], [0.0, across, 0.0], [0.0, 0.0, along]],
                cofactor: [
                    [side, 0.0, 0.0],
                    [0.0, side, 0.0],
                    [0.0, 0.0, across * across],
                ],
                det: across * across * along,
                invariant: 2.0 * across * across + along * along,
                fibre: [0.0; 3],
            },
            moduli,
        )
    };
    let (mut low, mut high) = (0.5, 2.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match at(middle)[0][0] > 0.0 {
            true => high = middle,
            false => low = middle,
        }
    }
    [at(low)[2][2], low]
}

#[test]
fn two_laws_in_series_share_a_compression() {
    let (mesh, material) = (bar(), material());
    let own = material.moduli();
    let factor = f64::from(mesh.stiffness[mesh.tets.len() - 1]);
    let upper = Moduli {
        law: mesh.regions[0].law,
        shear_pa: factor * own.shear_pa,
        bulk_pa: factor * own.bulk_pa,
    };
    let whole = 0.94;
    // The same nominal stress in both halves.
    let (mut low, mut high) = (whole - 0.06, 1.0);
    for _ in 0..60 {
        let lower = 0.5 * (low + high);
        match pulled(own, lower)[0] > pulled(upper, 2.0 * whole - lower)[0] {
            true => high = lower,
            false => low = lower,
        }
    }
    let (below, above) = (low, 2.0 * whole - low);
    let [pa, _] = pulled(own, below);
    // What a neo-Hookean cortex of this modulus would do is far from it.
    let plain = Moduli {
        law: Law::default(),
        ..upper
    };
    assert!((pulled(plain, above)[0] / pulled(upper, above)[0] - 1.0).abs() > 0.1);

    // Ends that are led as the closed form has them, so that they do not bulge.
    let half = HEIGHT / 2.0;
    let mut start: Vec<[f32; 3]> = Vec::new();
    let across = [pulled(own, below)[1], pulled(upper, above)[1]].map(|x| x as f32);
    for [x, y, z] in &mesh.positions {
        let side = if *z > half { across[1] } else { across[0] } - 1.0;
        let up = z.min(half) * (below as f32 - 1.0) + (z - half).max(0.0) * (above as f32 - 1.0);
        start.push([side * (x - SIDE / 2.0), side * (y - SIDE / 2.0), up]);
    }
    let ends = [nodes(&mesh, 0.0), nodes(&mesh, HEIGHT)].concat();
    let found = statics::relax(&mesh, &ends, &material, &start).unwrap();
    let mean = |field: &[[f64; 3]], z: f32| {
        let at = nodes(&mesh, z);
        at.iter().map(|n| field[*n as usize][2]).sum::<f64>() / at.len() as f64
    };
    for (from, to, wanted) in [(8.0, 16.0, below), (24.0, 32.0, above)] {
        let stretch = 1.0 + (mean(&found, to) - mean(&found, from)) / 8.0;
        assert!(
            (stretch - wanted).abs() < 0.02 * (1.0 - wanted).abs(),
            "{stretch} for {wanted}"
        );
    }

    // The same with inertia, in float32, and the force on the top.
    let mut led = mesh.clone();
    led.fixed.clear();
    let contact: Vec<ContactNode> = (ends.iter())
        .map(|&node| ContactNode {
            node,
            displacement: start[node as usize],
        })
        .collect();
    let options = SolverOptions {
        material,
        ..SolverOptions::default()
    };
    let mut solver = Solver::new(&led, Boundary::Fixed, options).unwrap();
    let mut force = 0.0;
    for _ in 0..12 {
        let report = solver.step_frame(&contact, 0.05).unwrap();
        let top = contact.iter().zip(&report.reaction);
        let top = top.filter(|(own, _)| mesh.positions[own.node as usize][2] > half);
        force = top.map(|(_, f)| f64::from(f[2])).sum();
    }
    let wanted = -1e-3 * pa * f64::from(SIDE * SIDE);
    assert!(
        (force - wanted).abs() < 0.02 * wanted.abs(),
        "{force} mN for {wanted}"
    );
    let mut field = vec![[0.0; 3]; mesh.node_count()];
    solver.displacement(&mut field);
    let off = field
        .iter()
        .zip(&found)
        .flat_map(|(a, b)| (0..3).map(|k| f64::from(a[k]) - b[k]));
    let off = off.fold(0.0f64, |most, x| most.max(x.abs()));
    assert!(off < 0.02, "{off} mm from the equilibrium");
}

/// A region of the whole bar that relaxes has the bits of a material that does; the stress of a hold falls by what the series loses.
#[test]
fn a_region_relaxes_as_its_own_series() {
    let branches = Relaxation::parse("0.4,0.1,0.3,1000").unwrap();
    let mut mesh = regular_box([SIDE, SIDE, HEIGHT], [2, 2, 10]).unwrap();
    let top = nodes(&mesh, HEIGHT);
    mesh.fixed = nodes(&mesh, 0.0);
    let held = |mesh: &Mesh, relaxation: Relaxation| {
        let options = SolverOptions {
            material: Material {
                relaxation,
                ..material()
            },
            ..SolverOptions::default()
        };
        let mut solver = Solver::new(mesh, Boundary::Fixed, options).unwrap();
        let mut forces = Vec::new();
        for frame in 1..=20 {
            let part = (frame as f32 / 4.0).min(1.0);
            let contact: Vec<ContactNode> = (top.iter())
                .map(|&node| ContactNode {
                    node,
                    displacement: [0.0, 0.0, -1.6 * part],
                })
                .collect();
            let report = solver.step_frame(&contact, 0.05).unwrap();
            forces.push(report.reaction.iter().map(|f| f[2]).sum::<f32>());
        }
        forces
    };
    let elastic = held(&mesh, Relaxation::default());
    let wanted = held(&mesh, branches);
    mesh.region = vec![1; mesh.tets.len()];
    mesh.regions = vec![Region {
        relaxation: Some(branches),
        ..named("muscle", "neo-hookean")
    }];
    let own = held(&mesh, Relaxation::default());
    assert_eq!(own, wanted);
    // 0.8 s after the rise the first branch has gone.
    let left = own[19] / elastic[19];
    assert!((left - 0.6).abs() < 0.03, "{left}");
    // Half of the bar relaxes: in series the whole does by less.
    for number in &mut mesh.region[..mesh.tets.len() / 2] {
        *number = 0;
    }
    mesh.validate().unwrap();
    let half = held(&mesh, Relaxation::default())[19] / elastic[19];
    assert!((0.65..0.95).contains(&half), "{half}");
    // The file keeps it, and the hash knows of it.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bar");
    mesh.write(&path).unwrap();
    let read = Mesh::read(&path).unwrap();
    assert_eq!(read, mesh);
    mesh.regions[0].relaxation = None;
    assert_ne!(read.hash(), mesh.hash());
}

#[test]
fn laws_are_kept_by_the_file_and_change_the_hash() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bar");
    let mesh = bar();
    mesh.write(&path).unwrap();
    let read = Mesh::read(&path).unwrap();
    assert_eq!(read, mesh);
    assert_eq!(read.hash(), mesh.hash());
    let mut other = mesh.clone();
    other.regions[0].law = "ogden:-163,-18".parse().unwrap();
    assert_ne!(other.hash(), mesh.hash());
    other.regions.clear();
    assert!(matches!(other.validate(), Err(MeshError::Laws(_))));
    // Another material has other moduli than the factors say.
    let error = Solver::new(&mesh, Boundary::Fixed, SolverOptions::default())
        .err()
        .unwrap();
    assert!(error.to_string().contains("region `cortex`"), "{error}");
}
