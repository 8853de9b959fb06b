//! Forces at points of the tissue.
#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "a host in a test: every call keeps to the header, or breaks it on purpose"
)]

use upt::ffi::*;
use upt::{IndexSet, Loads, PointForce, StepInput};

use crate::{BUNDLE, awake, rust, step};
use fixture::host::Host;
use fixture::{model, plain, scene};

/// At points of the surface and inside, found by the model: the bits of the same forces shared among the nodes by hand, through both interfaces.
#[test]
fn forces_at_points_are_those_of_their_nodes() {
    let host = Host::new(BUNDLE, awake);
    let model = model(BUNDLE);
    let own = [(); 2].map(|()| scene(&model, &plain()));
    let rows = model.positions().as_chunks::<3>().0;
    let tet: &[u32] = &model.indices(IndexSet::Tets)[..4];
    let face = &model.indices(IndexSet::DomainFaces)[..3];
    let mean = |nodes: &[u32]| {
        [0, 1, 2].map(|axis| {
            let sum: f32 = nodes.iter().map(|node| rows[*node as usize][axis]).sum();
            sum / nodes.len() as f32
        })
    };
    let places = [mean(tet), mean(face)];
    let mut points = PointForce::at(&model, &places).unwrap();
    let (mut nodes, mut weights) = ([0u32; 8], [0.0f32; 8]);
    let status = unsafe {
        upt_model_locate_points(
            host.model,
            places.as_ptr().cast(),
            2,
            nodes.as_mut_ptr(),
            weights.as_mut_ptr(),
        )
    };
    assert_eq!(status, UPT_OK);
    for ((point, place), at) in points.iter().zip(places).zip(0..) {
        assert_eq!(point.nodes, nodes[4 * at..][..4]);
        assert_eq!(point.weights, weights[4 * at..][..4]);
        for axis in 0..3 {
            let corners = point.nodes.iter().zip(point.weights);
            let found: f32 = corners
                .map(|(node, w)| w * rows[*node as usize][axis])
                .sum();
            assert!(
                (found - place[axis]).abs() < 1e-3,
                "{found} for {}",
                place[axis]
            );
        }
    }
    let mut last = Vec::new();
    for t in 0..6 {
        let mut forces = vec![0.0f32; 3 * host.nodes];
        for (point, force) in points.iter_mut().zip([[0.0, 2.0, 1.0], [-3.0, 0.0, 0.5]]) {
            point.force = force.map(|force| 0.2 * t as f32 * force);
            for (node, weight) in point.nodes.iter().zip(point.weights) {
                for axis in 0..3 {
                    forces[3 * *node as usize + axis] += weight * point.force[axis];
                }
            }
        }
        let by = |forces, point_forces| StepInput {
            loads: Loads {
                forces,
                point_forces,
                ..Loads::NONE
            },
            ..StepInput::default()
        };
        let wanted = rust(&own[0], by(Some(&forces), &[]));
        assert_eq!(rust(&own[1], by(None, &points)), wanted, "step {t}");
        let raw = points.iter().map(|point| upt_point_force {
            struct_size: size_of::<upt_point_force>() as u32,
            nodes: point.nodes,
            weights: point.weights,
            force: point.force,
        });
        let raw: Vec<_> = raw.collect();
        let input = upt_input {
            point_forces: raw.as_ptr(),
            point_force_count: 2,
            ..upt_input::NOTHING
        };
        assert_eq!(step(&host, &input), wanted, "step {t}");
        assert_ne!(wanted, last, "step {t} moves");
        last = wanted;
    }
    let far = PointForce::at(&model, &[[1e3, 0.0, 0.0]]).unwrap_err();
    assert!(far.to_string().contains("outside the mesh"), "{far}");
}
