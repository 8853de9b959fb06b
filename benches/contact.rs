//! Instrument poses to contacts, and contact forces, on a slab as large as the surface and the
//! contact patches of K = 21,670: about 16,000 surface nodes, 60 nodes in contact.

mod measure;

use contact::Shape;
use measure::{Row, medians};
use upt::contact::Tool;
use upt::forces::ReactionForces;
use upt::instrument::{Instrument, InstrumentContacts};

/// A slab of `n x n x layers` cells of 4 mm: positions, tetrahedra (six a cell), top and bottom faces.
fn slab(n: u32, layers: u32) -> (Vec<f32>, Vec<u32>, Vec<u32>) {
    let node = |x: u32, y: u32, z: u32| x + (n + 1) * (y + (n + 1) * z);
    let (mut positions, mut tets, mut faces) = (Vec::new(), Vec::new(), Vec::new());
    for z in 0..=layers {
        for y in 0..=n {
            for x in 0..=n {
                positions.extend([4.0 * x as f32, 4.0 * y as f32, 4.0 * z as f32]);
            }
        }
    }
    for y in 0..n {
        for x in 0..n {
            for z in 0..layers {
                let corner = |i: u32| node(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2));
                for path in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                    tets.extend([0, path[0], path[1], 7].map(corner));
                }
            }
            let top = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| node(x + i, y + j, layers));
            let bottom = [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(i, j)| node(x + i, y + j, 0));
            for [a, b, c, d] in [top, bottom] {
                faces.extend([a, b, c, a, c, d]);
            }
        }
    }
    (positions, tets, faces)
}

fn main() {
    let (positions, tets, faces) = slab(89, 3);
    let displacement = vec![0.0; positions.len()];
    instruments(&positions, &faces, &displacement);
    forces(&positions, &tets, &displacement);
}

fn instruments(positions: &[f32], faces: &[u32], displacement: &[f32]) {
    let mut contacts = InstrumentContacts::new(positions, faces, &[]).expect("memory for contacts");
    let half_extents = [16.0, 14.0, 3.0];
    let shapes = [
        (
            "capsule",
            Shape::Capsule {
                half_length: 20.0,
                radius: 9.0,
            },
        ),
        ("box", Shape::Box { half_extents }),
        (
            "spatula",
            Shape::Spatula {
                half_extents,
                radius: 1.5,
            },
        ),
    ];
    for (name, shape) in shapes {
        let (at, turn) = ([170.0, 170.0, 14.0], [0.0, 0.0, 0.0, 1.0]);
        let instrument = [Instrument {
            tool: Tool::new(&shape, at, turn).expect("a tool"),
            sticking: false,
        }];
        let mut touched = 0;
        let seconds = medians(&mut [Box::new(|| {
            contacts.reset();
            let found = contacts.find(&instrument, displacement);
            touched = found.expect("finite values").0.len();
        })]);
        let name = format!("{name} on 16,200 surface nodes, {touched} touched");
        Row::new(name, 1e6 * seconds[0], "us")
            .limits(Some(50.0), None)
            .print();
    }
}

fn forces(positions: &[f32], tets: &[u32], displacement: &[f32]) {
    for side in [8, 11] {
        let nodes: Vec<u32> = (0..side * side)
            .map(|i| 40 + i % side + 90 * (40 + i / side) + 3 * 90 * 90)
            .collect();
        let moduli = elements::Material::default().moduli();
        let body = elements::Tetrahedra {
            positions: positions.as_chunks().0,
            tets: tets.as_chunks().0,
            stiffness: &[],
            laws: elements::Laws::default(),
        };
        let mut forces =
            ReactionForces::new(body, &nodes, moduli).expect("memory for the elements");
        let mut out = vec![0.0; 3 * nodes.len()];
        let seconds = medians(&mut [Box::new(|| {
            forces
                .reaction(displacement, &nodes, &mut out)
                .expect("nodes of the slab");
        })]);
        let name = format!("reaction at {} contact nodes", nodes.len());
        Row::new(name, 1e6 * seconds[0], "us")
            .limits(Some(100.0), None)
            .print();
    }
}
