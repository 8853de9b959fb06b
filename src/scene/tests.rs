//! What only the library can see of a step: the floating-point exceptions that it meets, and which nodes bear a force.

use super::node_forces::NodeForces;
use super::*;
use crate::kernels::flush::RAISED;
use crate::options::{GuardPolicy, ModelOptions};

/// MXCSR: an invalid operation.
const INVALID: u64 = 1;

#[test]
fn a_step_makes_no_invalid_operation() {
    for name in ["tiny-reduced", "tiny-upt", "tiny-upt-prior"] {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/");
        let path = std::path::PathBuf::from(path).join(name);
        let model = Model::open(&path, &ModelOptions::default()).unwrap();
        let options = SceneOptions {
            guard_policy: GuardPolicy::Report,
            sleep: false,
            ..SceneOptions::default()
        };
        let scene = Scene::new(Arc::clone(&model), &options).unwrap();
        let nodes = &model.indices(crate::IndexSet::DomainNodes)[..4];
        RAISED.with(|raised| raised.set(0));
        for t in 0..20 {
            let vectors = [0.1, 0.0, -0.3 * t as f32].repeat(4);
            let contact = match t {
                0..12 => Contact::Sparse {
                    nodes,
                    vectors: &vectors,
                },
                _ => Contact::None,
            };
            scene.step(contact, None).unwrap();
        }
        let raised = RAISED.with(std::cell::Cell::get);
        assert_ne!(raised, 0, "{name}: results are inexact");
        assert_eq!(raised & INVALID, 0, "{name}: met exceptions {raised:#x}");
    }
}

/// In an element that a blade has parted all of a force at a point is borne by the piece in which the point lies, and by nothing once that is gone.
#[test]
fn the_piece_in_which_a_point_lies_bears_its_force() {
    let path = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/onnx/liver-coarse"));
    let model = Model::open(path, &ModelOptions::default()).unwrap();
    let options = SceneOptions {
        corrections: crate::Corrections::Fixed(1),
        ..SceneOptions::default()
    };
    let scene = Scene::new(Arc::clone(&model), &options).unwrap();
    let node = model.indices(crate::IndexSet::DomainNodes)[40];
    let [x, y, z] = scene.mesh().position(node);
    let edge = |z: f32| [-20.0, 20.0].map(|off| [x + 0.7, y + off, z]);
    let blade = [edge(z - 20.0), edge(z + 20.0)];
    scene.cut(0, 2, blade.as_flattened()).unwrap();
    let looked_at = scene.core().unwrap().call(|core, _| {
        let body = &core.maker.body;
        let cut = &body.cut.as_ref().unwrap().body;
        let mut forces = NodeForces::new(&body.mesh, Some(cut))?;
        let mut looked_at = 0;
        for element in cut.changed_elements() {
            let cells = cut.cells(element).into_owned();
            let [one, other] = &cells[..] else {
                continue;
            };
            // At the blade's end two pieces of an element hang together by a node.
            if one.nodes.iter().any(|node| other.nodes.contains(node)) {
                continue;
            }
            looked_at += 1;
            for (at, [own, other]) in [[one, other], [other, one]].into_iter().enumerate() {
                let force = PointForce {
                    nodes: cut.mesh().tet(element),
                    weights: own.material().middle().map(|weight| weight as f32),
                    force: [1.0, -2.0, 30.0],
                };
                forces.take(&[force], Some(cut))?;
                let mut sum = [0.0; 3];
                for node in 0..body.mesh.node_count() {
                    let borne = forces.on(node, None);
                    sum = [0, 1, 2].map(|axis| sum[axis] + borne[axis]);
                    let bears = borne != [0.0; 3];
                    assert!(!bears || own.nodes.contains(&(node as u32)), "{element}");
                    assert!(!bears || !other.nodes.contains(&(node as u32)), "{element}");
                }
                let off = (sum.iter().zip(force.force)).map(|(sum, wanted)| (sum - wanted).abs());
                assert!(off.fold(0.0, f32::max) < 1e-4, "{element}: {sum:?}");
                let mut rest = cut.clone();
                rest.drop_cells(&[(element, at as u32)]).unwrap();
                let Err(Error::Argument(text)) = forces.take(&[force], Some(&rest)) else {
                    panic!("{element} is gone");
                };
                assert!(text.starts_with("point_forces[0]"), "{text}");
            }
        }
        Ok(looked_at)
    });
    let looked_at = looked_at.unwrap();
    assert!(looked_at > 5, "{looked_at}");
}
