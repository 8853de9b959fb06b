//! Points attached to the tissue: interpolated between nodes, or decoded by the network.

use std::sync::Arc;

use fixture::{BUNDLES, bits, largest_difference, model, plain, push, rollout, scene, sparse};
use upt::{IndexSet, Model, ModelOptions, SceneOptions};

fn interpolated() -> SceneOptions {
    SceneOptions {
        interpolate_points: true,
        ..plain()
    }
}

/// Corners of a tetrahedron and its centre.
fn centre(model: &Arc<Model>) -> (Vec<u32>, Vec<f32>) {
    let tet: Vec<u32> = model.indices(IndexSet::Tets)[400..404].to_vec();
    let p = |node: u32| &model.positions()[3 * node as usize..3 * node as usize + 3];
    let centre = (0..3).map(|axis| tet.iter().map(|&n| p(n)[axis]).sum::<f32>() / 4.0);
    (tet.clone(), centre.collect())
}

fn mean(corners: &[f32]) -> Vec<f32> {
    (0..3)
        .map(|axis| (0..4).map(|k| corners[3 * k + axis]).sum::<f32>() / 4.0)
        .collect()
}

#[test]
fn attached_points_follow_the_tetrahedra_around_them() {
    for name in BUNDLES {
        let model = model(name);
        for options in [plain(), interpolated()] {
            let scene = scene(&model, &options);
            let (tet, middle) = centre(&model);
            let p = |node: u32| &model.positions()[3 * node as usize..3 * node as usize + 3];
            let mut points: Vec<f32> = [7u32, 150, 33]
                .iter()
                .flat_map(|&n| p(n).to_vec())
                .collect();
            points.extend(&middle);
            // A little outside of the mesh: follows its surface.
            let outside = model.positions()[..3].iter().map(|x| x - 2.0);
            points.extend(outside);
            let region: Vec<u32> = vec![3, 5];
            scene.set_region(Some(&region)).unwrap();
            scene.attach_points(Some(&points)).unwrap();
            assert_eq!(scene.point_count(), 5);
            rollout(&scene, 5);
            let mut at_points = vec![0.0; 15];
            scene.read_view(upt::View::Points, &mut at_points).unwrap();
            let mut nodes = vec![0.0; 9];
            scene.decode(&[7, 150, 33], &mut nodes).unwrap();
            let at_nodes = largest_difference(&at_points[..9], &nodes);
            // The nodes of `tiny-upt-prior` are interpolated between its anchors, its points are decoded.
            if options.interpolate_points || name != "tiny-upt-prior" {
                assert!(at_nodes < 1e-4, "{name}: {at_nodes}");
            }
            let mut corners = vec![0.0; 12];
            scene.decode(&tet, &mut corners).unwrap();
            let from_mean = largest_difference(&at_points[9..12], &mean(&corners));
            // Modes have no course of their own between nodes.
            if options.interpolate_points || !name.contains("upt") {
                assert!(from_mean < 1e-4, "{name}: {from_mean}");
            } else {
                assert!(
                    from_mean > 1e-4,
                    "{name}: the network has a course of its own"
                );
            }
            assert!(at_points.iter().all(|u| u.is_finite()));
            scene
                .sample_view(upt::View::Points, 0.5, &mut at_points)
                .unwrap();
            assert_eq!(
                scene
                    .attach_points(Some(&[f32::NAN; 3]))
                    .unwrap_err()
                    .status(),
                -6
            );
            let far = scene.attach_points(Some(&[1e4, 0.0, 0.0])).unwrap_err();
            assert_eq!(far.status(), -2);
            assert!(far.to_string().contains("point 0"), "{far}");
            assert_eq!(scene.point_count(), 5, "a failed call changes nothing");
            scene.attach_points(None).unwrap();
            assert_eq!(scene.point_count(), 0);
        }
    }
}

/// With anchors too a point has the network's own output at its place: what a bundle without them gives a node there.
#[test]
fn anchors_do_not_change_what_a_point_is_decoded_to() {
    let anchored = model("tiny-upt-prior");
    let folder = fixture::copy_of("tiny-upt-prior");
    let path = folder.path().join("bundle.json");
    let mut manifest: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&path).unwrap()).unwrap();
    let upt = manifest["upt"].as_object_mut().unwrap();
    assert!(upt.remove("anchors").is_some());
    fixture::write_manifest(folder.path(), &mut manifest);
    let plain_model = Model::open(folder.path(), &ModelOptions::default()).unwrap();

    let contact = push(&anchored, 2);
    let held = anchored.indices(IndexSet::HeldNodes);
    let nodes: Vec<u32> = (0..anchored.positions().len() as u32 / 3)
        .filter(|node| !held.contains(node) && !contact.0.contains(node))
        .collect();
    let places: Vec<f32> = nodes
        .iter()
        .flat_map(|&n| anchored.positions()[3 * n as usize..3 * n as usize + 3].to_vec())
        .collect();
    let with = scene(&anchored, &plain());
    with.attach_points(Some(&places)).unwrap();
    let without = scene(&plain_model, &plain());
    // The first step only: later ones start from states that differ by the interpolation.
    for scene in [&with, &without] {
        scene.step(sparse(&contact), None).unwrap();
    }
    let mut at_points = vec![0.0; places.len()];
    with.read_view(upt::View::Points, &mut at_points).unwrap();
    let [mut interpolated, mut decoded] = [at_points.clone(), at_points.clone()];
    with.decode(&nodes, &mut interpolated).unwrap();
    without.decode(&nodes, &mut decoded).unwrap();
    let error = largest_difference(&at_points, &decoded);
    assert!(error < 1e-4, "{error} mm from the network");
    let apart = largest_difference(&at_points, &interpolated);
    assert!(apart > 1e-3, "{apart} mm from the anchors' interpolation");
}

/// Attached before the steps or after them, in one thread or two, with either decoder: the same displacement.
#[test]
fn points_attached_late_are_where_they_would_have_been() {
    for name in BUNDLES {
        let model = model(name);
        let (_, middle) = centre(&model);
        let early = scene(&model, &plain());
        early.attach_points(Some(&middle)).unwrap();
        rollout(&early, 5);
        let late = scene(
            &model,
            &SceneOptions {
                threads: 2,
                ..plain()
            },
        );
        rollout(&late, 5);
        late.attach_points(Some(&middle)).unwrap();
        let (mut a, mut b) = (vec![0.0; 3], vec![0.0; 3]);
        for alpha in [0.0, 1.0] {
            early.sample_view(upt::View::Points, alpha, &mut a).unwrap();
            late.sample_view(upt::View::Points, alpha, &mut b).unwrap();
            assert_eq!(bits(&a), bits(&b), "{name} at {alpha}");
        }
        let portable = scene(
            &model,
            &SceneOptions {
                kernel: upt::DecoderKernel::Onnx,
                ..plain()
            },
        );
        portable.attach_points(Some(&middle)).unwrap();
        rollout(&portable, 5);
        portable.read_view(upt::View::Points, &mut b).unwrap();
        assert!(largest_difference(&a, &b) < 1e-3, "{name}");
    }
}

/// A contact node is moved to `c`, whatever the network says, and a point next to it goes along.
#[test]
fn points_near_a_contact_follow_what_is_imposed() {
    for name in BUNDLES {
        let model = model(name);
        let scene = scene(&model, &plain());
        let contact = push(&model, 4);
        let node = 3 * contact.0[0] as usize;
        let place = &model.positions()[node..node + 3];
        scene.attach_points(Some(place)).unwrap();
        scene.step(sparse(&contact), None).unwrap();
        let mut at = vec![0.0; 3];
        scene.read_view(upt::View::Points, &mut at).unwrap();
        assert!(
            largest_difference(&at, &contact.1[..3]) < 1e-4,
            "{name}: {at:?}"
        );
    }
}
