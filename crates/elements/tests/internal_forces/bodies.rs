//! Bodies of one law and of several, and their forces in f64 and in lanes.

use elements::{ElementForces, Isa, Law, Material, MooneyRivlin, Ogden, Region, Tetrahedron};
use tissue::mesh::{Mesh, box_phantom};

pub fn body() -> Mesh {
    let mut mesh = box_phantom([30.0, 40.0, 50.0], [7, 9, 12]).unwrap();
    mesh.stiffness = (0..mesh.tets.len())
        .map(|tet| 1.0 + (tet % 5) as f32 * 0.3)
        .collect();
    mesh
}

/// A body with fibres in several matrices, in all directions; one element in nine has none.
pub fn fibred() -> Mesh {
    let law = |text: &str| text.parse().unwrap();
    let mut mesh = blocks(&[
        law("fibres:20,3"),
        law("mooney-rivlin:0.7+fibres:4,0"),
        law(&format!("{}+fibres:2,10", ogden_laws()[1].law)),
    ]);
    mesh.fibre = (0..mesh.tets.len())
        .map(|tet| {
            let (turn, up) = (0.37 * tet as f32, (0.11 * tet as f32).sin());
            let flat = (1.0 - up * up).sqrt();
            match tet % 9 {
                0 => [0.0; 3],
                _ => [flat * turn.cos(), flat * turn.sin(), up],
            }
        })
        .collect();
    mesh
}

/// The same with blocks of each of some laws; the rest has the material's.
pub fn blocks(laws: &[Law]) -> Mesh {
    let mut mesh = body();
    let number = |tet: &[u32; 4]| {
        let [x, _, z] = mesh.positions[tet[0] as usize];
        (x > 15.0) as u8 + 2 * (z > 20.0) as u8
    };
    mesh.region = mesh.tets.iter().map(number).collect();
    mesh.regions = (laws.iter().enumerate())
        .map(|(at, &law)| Region {
            name: at.to_string(),
            law,
            source: String::new(),
            density_kg_m3: None,
            relaxation: None,
        })
        .collect();
    mesh
}

pub fn mixed() -> Mesh {
    let law = Law::MooneyRivlin(MooneyRivlin { c01_share: 0.7 });
    blocks(&[law, ogden_laws()[0].law, ogden_laws()[1].law])
}

pub fn wave(mesh: &Mesh, size: f32) -> Vec<f32> {
    let rows = mesh.positions.iter().enumerate();
    rows.flat_map(|(i, p)| {
        [0, 1, 2].map(|k| size * (0.21 * p[k] + 0.13 * p[(k + 1) % 3] + i as f32 * 0.01).sin())
    })
    .collect()
}

pub fn exact(mesh: &Mesh, material: &Material, u: &[f32]) -> (Vec<f64>, f64) {
    let mut out = vec![0.0; u.len()];
    let mut least = f64::INFINITY;
    for (at, &corners) in mesh.tets.iter().enumerate() {
        let rest = corners.map(|node| mesh.positions[node as usize].map(f64::from));
        let tet = Tetrahedron::new(corners, rest, f64::from(mesh.stiffness_of(at)))
            .along(mesh.laws().fibre_of(at));
        let state =
            tet.deformation(corners.map(|n| [0, 1, 2].map(|k| f64::from(u[3 * n as usize + k]))));
        least = least.min(state.det);
        let moduli = mesh.laws().moduli_of(at, material.moduli());
        for (node, force) in corners.iter().zip(tet.forces(&state, moduli)) {
            for k in 0..3 {
                out[3 * *node as usize + k] += force[k];
            }
        }
    }
    (out, least)
}

/// Even exponents, broken ones, several terms.
pub fn ogden_laws() -> [Material; 4] {
    [
        vec![[-163.0, -18.0]],
        vec![[-157.0, -18.7]],
        vec![[500.0, 2.0], [-20.0, -12.0]],
        vec![[630.0, 1.3], [-10.0, -24.0]],
    ]
    .map(|terms| Material::default().with_law(Law::Ogden(Ogden::new(&terms).unwrap())))
}

pub fn forces_on(isa: Isa, mesh: &Mesh, material: &Material, u: &[f32]) -> Vec<f32> {
    let forces = ElementForces::new(mesh.tetrahedra(), material, isa).unwrap();
    let mut scratch = forces.scratch(1).unwrap();
    let mut out = vec![f32::NAN; u.len()];
    forces.evaluate(u, &mut scratch, &mut out, &serial);
    out
}

pub fn serial(count: usize, task: &(dyn Fn(usize, usize) + Sync)) {
    (0..count).for_each(|chunk| task(chunk, 0));
}
